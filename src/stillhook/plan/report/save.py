"""The report of a plan: PDF and self-contained page, from a result in memory or on disk."""

from __future__ import annotations

from pathlib import Path

from stillhook.base.atomic import atomic_folder, check_folder
from stillhook.errors import PlanError
from stillhook.plan.report.document import document
from stillhook.plan.report.figures.limits import pictures
from stillhook.plan.result.result import PlanResult
from stillhook.plan.result.schema import odd_fact, odd_numbers, of_two
from stillhook.report.html import html
from stillhook.report.pdf import Unset, pdf
from stillhook.units import quote

PDF, PAGE = "report.pdf", "report.html"
REPORT_FILES = (PDF, PAGE)
NEEDED = (
    "name",
    "date",
    "phases",
    "rules",
    "alternatives",
    "settings",
    "crane",
    "vessel",
    "payload",
    "place",
    "limited",
    "inputs",
    "operation",
    "runs",
    "remarks",
    "not_covered",
    "summary",
    "limits",
)
"""Facts without which there is no report."""
FIGURE = "figure-"
"""Begins the names of figures that are written beside."""


def write_report(result: PlanResult, folder: Path, *, figures: bool = False) -> tuple[str, ...]:
    """Write the report into a folder that is moved into place later; gives the names of its files.

    figures: also every figure as a picture of its own. The same result gives the same bytes. Errors: PlanError where it
    cannot be set.
    """
    check(result)
    images = pictures(result)
    report = document(result, images)
    try:
        content = {PDF: pdf(report), PAGE: html(report).encode()}
    except Unset as problem:
        raise PlanError(f"report of {result.name}: {problem}") from None
    if figures:
        content |= {f"{FIGURE}{stem}.png": data for stem, data in images.items()}
    for name, data in content.items():
        (folder / name).write_bytes(data)
    return tuple(content)


def check(result: PlanResult) -> None:
    """Refuse results that no report can be made of. Errors: PlanError."""
    if missing := [key for key in NEEDED if key not in result.facts]:
        problem = f"its facts lack {', '.join(missing)}"
    else:
        problem = odd_fact(result.facts) or odd_numbers(result.data) or of_two(result.data, result.facts)
    if problem:
        raise PlanError(f"report of {quote(result.facts.get('name'))}: {problem}. Run the plan again.")


def save_report(result: PlanResult, folder: str | Path, *, figures: bool = False) -> tuple[str, ...]:
    """The same in a folder of one's own: all files of it or none. Errors: StillhookError where the folder cannot be
    written to."""
    target = Path(folder)
    check_folder(target, REPORT_FILES)
    with atomic_folder(target) as part:
        return write_report(result, part, figures=figures)
