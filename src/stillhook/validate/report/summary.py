"""A validation in short, for a terminal: verdict, load cases, steps, and lines."""

from __future__ import annotations

from stillhook.report.document import Bullets, Column, Document, Part, Section, Table, Text, Verdict, facts
from stillhook.validate.criteria import results
from stillhook.validate.report.document import legend, verdict
from stillhook.validate.report.envelope import HEADING, UNJUDGED, unjudged_says
from stillhook.validate.report.texts import (
    SEGMENT_HEAD,
    STEP_HEAD,
    TERSE_HEAD,
    line_verdict,
    lines_of,
    reading_notes,
    segment_cells,
    segments,
    step_row,
    step_verdict,
    terse_cells,
    title,
)
from stillhook.validate.validation import Validation

TERSE_COLUMNS = (Column.TEXT, Column.NUMBER, Column.NUMBER, Column.NUMBER, Column.TEXT)


def summary(validation: Validation, *, tables: bool = False, everything: bool = False) -> Document:
    """everything: also what agrees, in full; tables: those of the steps."""
    load_cases: list[Part] = [Table(SEGMENT_HEAD, [segment_cells(s) for s in segments(validation)])]
    load_cases += [Bullets(notes)] if (notes := reading_notes(validation)) else []
    sections = [
        Section("load cases", load_cases),
        Section("steps", _steps(validation, tables=tables, everything=everything)),
        Section("lines", _summary_lines(validation, everything=everything)),
    ]
    if names := unjudged_says(validation):
        sections.append(Section(HEADING, [Text(f"{'; '.join(names)}. {UNJUDGED}")]))
    return Document(title(validation), sections, verdict(validation))


def _steps(validation: Validation, *, tables: bool, everything: bool) -> list[Part]:
    """Result of each step; its statements where lines of it block, or everything is requested."""
    parts: list[Part] = [Table(STEP_HEAD, [step_row(validation, step) for step in validation.steps])]
    for step in validation.steps:
        if everything or any(line.failed for line in lines_of(validation, step)):
            heading = f"step {int(step.number)}, {step.title}: {step_verdict(validation, step)}"
            parts.append(Section(heading, [Bullets(step.statements), *(step.tables if tables else ())]))
    return parts


def _summary_lines(validation: Validation, *, everything: bool) -> list[Part]:
    """Every line in a table; in full only those that are not shown, or all of them."""
    terse = [terse_cells(validation, line) for line in validation.lines]
    parts: list[Part] = [Table(TERSE_HEAD, terse, columns=TERSE_COLUMNS)]
    full = [
        line for line in validation.lines if everything or (line.judged and line.verdict is not results.Verdict.SHOWN)
    ]
    rows: list[tuple[Verdict, str, str]] = [
        (line_verdict(line), line.key, f"{line.message} [{line.source}]") for line in full
    ]
    if rows:
        parts.append(facts(rows, "in full"))
    return [*parts, *legend(validation.lines)]
