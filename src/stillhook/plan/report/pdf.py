"""A plan's report as PDF, set by typst with the plan's date."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files

from stillhook.errors import PlanError
from stillhook.plan.report.document import sheet_of
from stillhook.plan.result.result import PlanResult
from stillhook.report.pdf import Unset, set_pages, set_pdf

TEMPLATE = files("stillhook.plan.report") / "plan.typ"


def pdf(result: PlanResult, figures: Mapping[str, bytes]) -> bytes:
    """The document. figures: PNG by stem, of `stillhook.plan.report.figures.limits.pictures`. Errors: PlanError where
    it cannot be set."""
    sheet = sheet_of(result, tuple(figures))
    try:
        return set_pdf(TEMPLATE, sheet, figures, sheet["date"])
    except Unset as problem:
        raise PlanError(f"report of {result.name}: {problem}") from None


def pages(result: PlanResult, figures: Mapping[str, bytes], ppi: float = 100.0) -> list[bytes]:
    """The pages of the document as PNG, to look at."""
    sheet = sheet_of(result, tuple(figures))
    return set_pages(TEMPLATE, sheet, figures, sheet["date"], ppi)
