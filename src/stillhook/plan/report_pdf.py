"""A plan's report as PDF, set by typst with the plan's date."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files

from stillhook.errors import PlanError
from stillhook.io.typeset import Unset, set_pages, set_pdf
from stillhook.plan.report_sheet import sheet_of
from stillhook.plan.result import PlanResult

TEMPLATE = files("stillhook.plan") / "template" / "plan.typ"


def pdf(result: PlanResult, figures: Mapping[str, bytes]) -> bytes:
    """The document. figures: PNG by stem, of `stillhook.plan.figures.pictures`. Errors: PlanError where it cannot be set."""
    sheet = sheet_of(result, tuple(figures))
    try:
        return set_pdf(TEMPLATE, sheet, figures, sheet["date"])
    except Unset as problem:
        raise PlanError(f"report of {result.name}: {problem}") from None


def pages(result: PlanResult, figures: Mapping[str, bytes], ppi: float = 100.0) -> list[bytes]:
    """The pages of the document as PNG, to look at."""
    sheet = sheet_of(result, tuple(figures))
    return set_pages(TEMPLATE, sheet, figures, sheet["date"], ppi)
