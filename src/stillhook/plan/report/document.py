"""A plan's report as a document: the first page and the sections after it.

The report of a plan: PDF and self-contained page, from a result in memory or on disk.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from stillhook.base.atomic import atomic_folder, check_folder
from stillhook.errors import PlanError
from stillhook.plan.report import basis, detail
from stillhook.plan.report.figures.limits import pictures
from stillhook.plan.report.summary_page import tables, verdict
from stillhook.plan.report.words import TEXTS
from stillhook.plan.result import PlanResult, missing_facts, odd_fact, odd_numbers, of_two
from stillhook.report.document import Document, Section
from stillhook.report.formatting import groups
from stillhook.report.html import html
from stillhook.report.pdf import Unset, pdf
from stillhook.spec.validity import SHORT
from stillhook.units import quote

MISSING = "NOT ASSESSED"
"""Begins remarks that must be seen first."""


def document(result: PlanResult, figures: Mapping[str, bytes]) -> Document:
    """The report. figures: PNG by stem, of `stillhook.plan.report.figures.limits.pictures`."""
    facts = result.facts
    sections = {  # the answer's basis, then detail, then inputs, then what is not covered
        "Operation and phases": basis.operation(result),
        "Rules": basis.rules(result),
        "Credit for compensation": basis.credit(result),
        "Sea states analysed": basis.seas(result),
        "How the limits were calculated": basis.models(result),
        "Limits, cell by cell": detail.limit_cells(result, figures),
        "Limits, phase by phase": [*detail.by_phase(result), *detail.closed_form_comparison(result)],
        "Weather and waiting": detail.weather(result, figures),
        "Behind the limits": detail.behind(result, figures),
        "Inputs, versions, seeds": basis.inputs(result),
        "What is not covered": basis.not_covered(result),
    }
    return Document(
        title=TEXTS["heading"],
        name=result.name,
        subtitle=_subtitle(result),
        purpose=TEXTS["purpose"],
        marks=marks(result),
        front=[verdict(result), *tables(result)],
        sections=[Section(f"{i}. {title}", parts) for i, (title, parts) in enumerate(sections.items(), 1)],
        signatures=("Prepared by", "Checked by", "Marine warranty surveyor, place and date"),
        number=groups(facts["digest"], SHORT),
        date=facts["date"],
        made_by=f"Stillhook {facts['version']}",
    )


def _subtitle(result: PlanResult) -> str:
    payload = result.facts["payload"]
    return f"{payload.get('title') or payload['name']}, {result.facts['place']['depth']:g} m of water"


def marks(result: PlanResult) -> list[str]:
    """What must be seen on every page: synthetic inputs, a twin that is not validated, cells without a result."""
    lines = []
    if "weather" in result and result["weather"].attrs["synthetic"]:
        lines.append(TEXTS["synthetic"])
    certificate = result.facts["crane"]["certificate"]
    if certificate and certificate.get("synthetic"):
        lines.append(TEXTS["synthetic_certificate"])
    if not certificate and any(a.twin for a in result.alternatives):
        lines.append(TEXTS["unvalidated"].rstrip("."))
    return lines + [line.rstrip(".") for line in result.facts["remarks"] if line.startswith(MISSING)]


PDF, PAGE = "report.pdf", "report.html"
REPORT_FILES = (PDF, PAGE)
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
    if missing := missing_facts(result.facts):
        problem = f"its facts lack {missing}"
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
