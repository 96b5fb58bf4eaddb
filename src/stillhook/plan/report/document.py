"""A plan's report: the first page and the sections after it as a document, its files, and the answer in short for a
terminal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from stillhook.base.atomic import check_folder
from stillhook.base.extras import installed
from stillhook.base.gateway.guard import reason_of
from stillhook.errors import PlanError, StillhookError
from stillhook.formats.results import save_json
from stillhook.formats.table.workbook import write_sheets
from stillhook.plan.assessments import ASSESSMENTS
from stillhook.plan.assessments.rigging.section import rigging_sheet
from stillhook.plan.report import basis, detail
from stillhook.plan.report.actions import actions
from stillhook.plan.report.decision.card import card, card_parts
from stillhook.plan.report.decision.data import decision, head
from stillhook.plan.report.decision.page import page, sheet, signatures, subtitle
from stillhook.plan.report.decision.short import short
from stillhook.plan.report.detail import tolerance_sweep
from stillhook.plan.report.figures import CLAIM, pictures
from stillhook.plan.report.limits_summary import basis_rows, tables, verdict
from stillhook.plan.report.words import (
    TEXTS,
    named,
    sentence,
    signature_facts,
    untrusted,
    write,
)
from stillhook.plan.result import (
    FACTS,
    FAILED,
    PLAN_FILES,
    UNSEALED,
    PlanResult,
    cranes_of,
    for_print,
    grouped,
    write_plan,
)
from stillhook.report.document import Bullets, Document, Figure, Part, Section, Text
from stillhook.report.document import facts as document_facts
from stillhook.report.html import html
from stillhook.report.kit import can_set, draw_if_possible
from stillhook.report.pdf import Unset, pdf
from stillhook.trust.results import result_folder
from stillhook.units import quote

MISSING = ("not-assessed", FAILED)
"""Causes of remarks that must be seen first."""


def document(result: PlanResult, figures: Mapping[str, Figure]) -> Document:
    """The report. figures: by stem, of `stillhook.plan.report.figures.pictures`. Errors: PlanError for facts that no
    plan of this version has."""
    with _of_facts(result):
        return _document(result, figures)


@contextmanager
def _of_facts(result: PlanResult) -> Iterator[None]:
    """Whatever facts of another version, or edited with their hash, make of a page is one line. Errors: PlanError."""
    try:
        yield
    except (StillhookError, OSError, MemoryError):
        raise
    except Exception as problem:
        mark = "has no hash, and " if UNSEALED in result.facts else "is of another version or was edited: "
        line = f"{FACTS} {mark}a part of it is missing or odd ({reason_of(problem)}). Run the plan again."
        raise PlanError(f"report of {quote(result.name)}: {line}") from problem


def _document(result: PlanResult, figures: Mapping[str, Figure]) -> Document:
    facts, of = result.facts, decision(result)
    sections: dict[
        str, Sequence[Part]
    ] = {  # what is left to do, the answer's basis, then detail, then inputs, then what is not covered
        "To do before approval": [Bullets(actions(result)), document_facts(basis_rows(result), "It rests on")],
        "Limits card": card_parts(card(result)),
        "Operation and phases": basis.operation(result),
        "Rules": basis.rules(result),
        "Credit for compensation": basis.credit(result),
        "Sea states analysed": basis.seas(result),
        "How the limits were calculated": basis.models(result),
        "Limits, cell by cell": detail.limit_cells(result, figures),
        "Weather and waiting": detail.weather(result, figures),
        "Behind the limits": detail.behind(result, figures),
        **{each.TITLE: each.parts(facts) for each in ASSESSMENTS if each.NAME in facts},
        "Inputs, versions, seeds": basis.inputs(result),
        "What is not covered": basis.not_covered(result),
    }
    return Document(
        title=TEXTS["heading"],
        name=result.name,
        subtitle=subtitle(of["document"]),
        purpose=TEXTS["purpose"],
        marks=marks(result),
        front=page(of, figures.get(CLAIM)),
        sections=[
            *(Section(f"{i}. {title}", parts) for i, (title, parts) in enumerate(sections.items(), 1)),
            Section(TEXTS["annex"], _annex(result, figures)),
        ],
        signatures=signatures(of["document"]),
        number=of["document"]["number"],
        revision=of["document"]["revision"],
        dense=True,
        date=facts["date"],
        made_by=f"Stillhook {facts['version']}",
    )


def _annex(result: PlanResult, figures: Mapping[str, Figure]) -> list[Section]:
    """What is no part of what is approved: alternatives, simulated limits, methods and their convergence."""
    return [
        Section("All alternatives, credited and simulated", detail.alternatives(result, figures)),
        Section("Limits, phase by phase", detail.by_phase(result)),
        Section("Landing tolerance, payload and depth", tolerance_sweep(result, figures)),
        Section("Efficiency and convergence", detail.behind(result, figures, detail.RESEARCH)),
        Section("Theory", [Text(TEXTS[key]) for key in ("credit", "extremes", "persistence")]),
    ]


def marks(result: PlanResult) -> list[str]:
    """What must be seen on every page: synthetic inputs, a twin that is not validated, cells without a result."""
    lines = []
    if "weather" in result and result["weather"].attrs["synthetic"]:
        lines.append(TEXTS["synthetic"])
    certificate = result.facts["crane"]["certificate"]
    if certificate and untrusted(certificate):
        lines.append(write(TEXTS["untrusted_certificate"], how=signature_facts(certificate)["statement"]))
    elif certificate and certificate.get("synthetic"):
        lines.append(TEXTS["assumed_certificate" if certificate.get("assumed") else "synthetic_certificate"])
    if not certificate and any(a.twin for a in result.alternatives):
        lines.append(TEXTS["unvalidated"].rstrip("."))
    if wrong := [row for check in result.facts.get("quality", {}).get("checks", []) for row in check["failed"]]:
        lines.append(write(TEXTS["inconsistent"], n=len(wrong)))
    if UNSEALED in result.facts:
        lines.append(TEXTS["unsealed"])
    return [*lines, *dict.fromkeys(sentence(each) for each in result.caused(*MISSING))]


PDF, PAGE = "report.pdf", "report.html"
CARD, DECISION = "card", "decision"
"""Stems of the limits card and of the decision page, each as PDF and as JSON."""
SHEETS = tuple(f"{stem}.{ending}" for stem in (CARD, DECISION) for ending in ("pdf", "json"))
REPORT_FILES = (PDF, PAGE, *SHEETS)
RIGGING = ("rigging.xlsx", "rigging.csv")
"""Items of the rigging for Excel, else as text."""
OUT_FILES = (*REPORT_FILES, *PLAN_FILES, *RIGGING)
FIGURE = "figure-"
"""Prefix of the names of figures that are written as separate files."""


def write_report(result: PlanResult, folder: Path, *, figures: bool = False) -> tuple[str, ...]:
    """Write the report into a folder that is moved into place later; gives the names of its files.

    figures: also every figure as a separate picture. The same result gives the same bytes. Without the extra `report`
    the page alone, without figures. Errors: PlanError where it cannot be set.
    """
    with _of_facts(result):
        result = for_print(result)
        images = draw_if_possible(lambda: pictures(result))
        report, sheets = document(result, images), {CARD: card(result), DECISION: decision(result)}
        papers = {PDF: report, **_sheets(result, sheets, images, report.made_by)}
    try:
        content = {name: pdf(each) for name, each in papers.items()} if can_set() else {}
    except Unset as problem:
        raise PlanError(f"report of {result.name}: {problem}") from None
    content[PAGE] = html(report).encode()
    if figures:
        content |= {f"{FIGURE}{stem}.png": image.png for stem, image in images.items()}
    for name, data in content.items():
        (folder / name).write_bytes(data)
    return (*content, *(save_json(of, folder / f"{stem}.json").name for stem, of in sheets.items()))


def _sheets(
    result: PlanResult, data: Mapping[str, Mapping[str, Any]], images: Mapping[str, Figure], made_by: str
) -> dict[str, Document]:
    """The limits card and the decision page as documents of one page, by file name."""
    of, about = data[CARD], data[DECISION]
    return {
        f"{CARD}.pdf": sheet(of, card_parts(of), made_by, TEXTS["card"]["title"], marks(result)),
        f"{DECISION}.pdf": sheet(about, page(about, images.get(CLAIM)), made_by, TEXTS["heading"], marks(result)),
    }


def write_answer(result: PlanResult, folder: Path) -> None:
    """Everything that `stillhook plan --out` leaves: numbers, facts and the report, all of them or none."""
    with result_folder(folder, "plan", cranes_of(result)) as part:
        write_plan(result, part)
        write_report(result, part)
        if (sheet := rigging_sheet(result.facts)) is not None:
            write_sheets([sheet], part / RIGGING[0 if installed("openpyxl") else 1], PlanError)


def save_report(result: PlanResult, folder: str | Path, *, figures: bool = False) -> tuple[str, ...]:
    """The report of a plan in a folder of its own: all files of it or none.

    Parameters
    ----------
    result : PlanResult
        What `plan` gave.
    folder : str or Path
        Folder to write.
    figures : bool, default False
        Also the figures as files.

    Returns
    -------
    tuple of str
        Names of the files.

    Raises
    ------
    StillhookError
        Where the folder cannot be written to.
    """
    target = Path(folder)
    check_folder(target, REPORT_FILES)
    with result_folder(target, "report of a plan", cranes_of(result)) as part:
        return write_report(result, part, figures=figures)


def brief(result: PlanResult) -> Document:
    """The claimable limit with its status, all limits, the whole year of weather, and what there is to remark, without
    their basis."""
    result = for_print(result)
    facts = result.facts
    parts: list[Part] = [*map(Text, short(result)), verdict(result), *tables(result)]
    parts += [detail.year_table(result)] if "weather" in result else []
    notes = grouped((sentence(each.get("credit_note") or ""), named(each["name"])) for each in facts["alternatives"])
    lines = [f"{', '.join(labels)}: {note}" for note, labels in notes.items() if note]
    lines += [TEXTS["rules"].format(**facts["rules"], editions=basis.editions(facts["rules"]))]
    remarks = [each for each in facts["remarks"] if each not in facts["notes"]]
    return Document(
        facts["name"], name=subtitle(head(result)), front=[*parts, Bullets([*lines, *map(sentence, remarks)])]
    )
