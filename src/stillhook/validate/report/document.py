"""The report: one page readable without the program, every step with its statements, tables, figures and
verdict."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from stillhook.report.html import bullets, heading, page, paragraph, picture, subheading, table
from stillhook.spec.validity import Envelope
from stillhook.validate.criteria.results import CriterionResult, Step, Table
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.report import unjudged
from stillhook.validate.report.envelope import envelope_of
from stillhook.validate.report.texts import (
    DECISIVE_HEAD,
    FULL_HEAD,
    MEANING,
    SEGMENT_HEAD,
    SHORT_HEAD,
    SHOWS,
    STEP_HEAD,
    columns_of_words,
    deciding_title,
    decisive,
    decisive_cells,
    full_cells,
    joined,
    lines_of,
    reading_notes,
    risks,
    segment_cells,
    segments,
    sentence,
    short_cells,
    step_row,
    step_verdict,
    title,
)
from stillhook.validate.validation import Validation

SYNTHETIC = "SYNTHETIC: these logs are simulated, not measured on a crane. The results say nothing about a real crane."
JUDGED = (
    "Each line is judged by the 95 % interval of its value alone: shown where the complete interval meets the limit,"
    " refuted where no part of it does, else not shown. A line that must be shown (the default) blocks the certificate"
    " while it is"
    " not shown. A line that must not be refuted, because data can refute its limit but hardly prove it, blocks where"
    " it"
    " is refuted, or where it is not shown and the estimate itself misses the limit."
)
METHOD = (
    "Method: the five verification steps and the acceptance criteria of G.-A. Moslåt 2020 (section 2.6, paper F table"
    " 2), with an additional step for the passive circuit and additional criteria where paper F states no number; each"
    " line names its source. The twin under test is the crane file as supplied. Values tuned in step 4 are proposals:"
    " they become part of the twin, and of a verdict, only by a crane file that holds them, validated again."
)


def report(validation: Validation, figures: Mapping[str, bytes]) -> str:
    """The page as text. figures: PNG by stem, see `stillhook.validate.report.figures.figures`."""
    parts = [
        paragraph(sentence(validation), no=not validation.passed, yes=validation.passed and validation.complete),
        *_decisive(validation),
        paragraph(risks(validation.lines)),
        _about(validation.campaign),
        heading("Load cases"),
        paragraph(
            "Unbroken parts of the logs with one load in one mode. Wire out: least to most; tip p-p: its largest over"
            " 30 s."
        ),
        table([joined(h) for h in SEGMENT_HEAD], map(segment_cells, segments(validation))),
        *_covered(validation),
        *_reading_notes(validation),
        *_unjudged(validation),
        heading("Steps"),
        table([joined(h) for h in STEP_HEAD], (step_row(validation, step) for step in validation.steps), words=True),
        heading("Verdict, line by line"),
        *_verdict(validation),
        _legend(validation.lines),
    ]
    for step in validation.steps:
        parts += _step(validation, step, figures)
    parts += [heading("How the verdict is reached"), paragraph(JUDGED), paragraph(METHOD)]
    return page(
        f"Validation of {title(validation)}", parts, synthetic=SYNTHETIC if validation.campaign.synthetic else ""
    )


def _decisive(validation: Validation) -> list[str]:
    """The lines that decide the verdict."""
    lines = decisive(validation)
    if not lines:
        return []
    title = deciding_title(any(line.failed for line in lines))
    rows = (decisive_cells(validation, line) for line in lines)
    return [paragraph(f"{title}:"), table(DECISIVE_HEAD, rows, no=_failed(lines), words=True)]


def _about(campaign: Campaign) -> str:
    criteria = campaign.criteria
    return table(
        ("", ""),
        (
            ("twin under test", f"{campaign.crane.title} ({campaign.crane_name})"),
            ("date", campaign.date.isoformat()),
            ("tests", ", ".join(f"{t.name} ({t.kind.value})" for t in campaign.tests)),
            ("criteria", f"{criteria.label}: {criteria.source}"),
            *(("changed", text) for text in criteria.changes),
            *(("remark", text) for text in campaign.remarks),
        ),
        words=True,
    )


def _verdict(validation: Validation) -> list[str]:
    """Every criterion in short; the steps have them in full."""
    lines = [line for step in validation.steps for line in lines_of(validation, step)]
    if not lines:
        return [paragraph("No criterion judges these steps.")]
    return [table(SHORT_HEAD, (short_cells(validation, line) for line in lines), no=_failed(lines), words=True)]


def _lines(validation: Validation, lines: Sequence[CriterionResult]) -> str:
    """Verdict lines in full."""
    return table(FULL_HEAD, (full_cells(validation, line) for line in lines), no=_failed(lines), words=True)


def _failed(lines: Sequence[CriterionResult]) -> list[int]:
    return [i for i, line in enumerate(lines) if line.failed]


def _legend(lines: Sequence[CriterionResult]) -> str:
    used = {line.verdict for line in lines}
    return bullets(f"{v.value}: {text}." for v, text in MEANING.items() if v in used)


def _covered(validation: Validation) -> list[str]:
    """What the tests cover: the ranges stated in a certificate."""
    ranges = (
        envelope_of(validation.records, validation.campaign.criteria.settings["window"])
        if validation.complete
        else None
    )
    if ranges is None:
        return []
    says = Envelope.model_construct(None, **{name: tuple(ends) for name, ends in ranges.items()}).says()
    text = (
        "Ranges covered by the tests with heave compensation. A certificate is valid inside these ranges, each"
        " considered separately."
    )
    return [paragraph(text), table(("", ""), says.items(), words=True)]


def _reading_notes(validation: Validation) -> list[str]:
    """Notes from reading the logs."""
    notes = reading_notes(validation)
    return [subheading("Notes from reading the logs"), bullets(notes)] if notes else []


def _unjudged(validation: Validation) -> list[str]:
    """Signals that no line depends on."""
    names = unjudged.unjudged_says(validation)
    return [subheading(unjudged.HEADING), paragraph(unjudged.MEANING), bullets(names)] if names else []


def _step(validation: Validation, step: Step, figures: Mapping[str, bytes]) -> Iterable[str]:
    number = int(step.number)
    lines = lines_of(validation, step)
    yield heading(f"Step {number}: {step.title}")
    yield paragraph(SHOWS[step.number])
    failed = any(line.failed for line in lines)
    yield paragraph(f"Step {number} alone: {step_verdict(validation, step)}.", no=failed)
    yield bullets(step.statements) if step.statements else paragraph("No remarks.")
    for step_table in step.tables:
        yield from _table(step_table)
    for stem, data in figures.items():
        if stem.startswith(f"step-{number}-"):
            yield picture(data, caption(stem))
    if lines:
        yield subheading(f"Criteria of step {number}")
        yield _lines(validation, lines)


def _table(step_table: Table) -> Iterable[str]:
    yield subheading(step_table.title)
    yield table([joined(h) for h in step_table.header], step_table.rows, words=bool(columns_of_words(step_table) - {0}))


def caption(stem: str) -> str:
    """Caption of a figure, from its file name: "step-5-error-deviation" is "Step 5: error deviation"."""
    _, number, name = stem.split("-", 2)
    return f"Step {number}: {name.replace('-', ' ')}"
