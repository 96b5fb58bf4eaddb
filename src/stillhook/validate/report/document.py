"""The report: one page that a colleague can read without the program, every step with its statements, tables, figures
and verdict."""

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
    found_on_the_way,
    full_cells,
    joined,
    lines_of,
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

SYNTHETIC = "SYNTHETIC: these logs were simulated, measured on no crane. What follows says nothing about a real one."
JUDGED = (
    "Each line is judged by the 95 % interval of its figure alone: shown where the whole interval meets the limit,"
    " refuted where no part of it does, else not shown. What must be shown (the rule) stands in the way while it is not"
    " shown. What must not be refuted, because data can refute its limit but hardly prove it, stands in the way where"
    " it is refuted, or is not shown and the estimate itself misses the limit."
)
METHOD = (
    "Method: the five verification steps and the acceptance criteria of G.-A. Moslåt 2020 (section 2.6, paper F table"
    " 2), with a step of our own for the passive circuit and criteria of our own where paper F gives no number; each"
    " line names its source. The twin under test is the crane file as given. Values that step 4 tunes are proposals:"
    " they become part of the twin, and of a verdict, only by a crane file that holds them, validated again."
)


def report(validation: Validation, figures: Mapping[str, bytes]) -> str:
    """The page as text. figures: PNG by stem, see `stillhook.validate.report.figures.figures`."""
    parts = [
        paragraph(sentence(validation), no=not validation.passed, yes=validation.passed and validation.whole),
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
        *_found_on_the_way(validation),
        *_unjudged(validation),
        heading("Steps"),
        table([joined(h) for h in STEP_HEAD], (step_row(validation, step) for step in validation.steps), words=True),
        heading("Verdict, line by line"),
        *_verdict(validation),
        _legend(validation.lines),
    ]
    for step in validation.steps:
        parts += _step(validation, step, figures)
    parts += [heading("How it is judged"), paragraph(JUDGED), paragraph(METHOD)]
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
    there = {line.verdict for line in lines}
    return bullets(f"{v.value}: {text}." for v, text in MEANING.items() if v in there)


def _covered(validation: Validation) -> list[str]:
    """What the tests cover: the ranges that a certificate names."""
    found = (
        envelope_of(validation.records, validation.campaign.criteria.settings["window"]) if validation.whole else None
    )
    if found is None:
        return []
    says = Envelope.model_construct(None, **{name: tuple(ends) for name, ends in found.items()}).says()
    told = (
        "What the tests with heave compensation cover. A certificate holds inside these ranges, each taken by itself."
    )
    return [paragraph(told), table(("", ""), says.items(), words=True)]


def _found_on_the_way(validation: Validation) -> list[str]:
    """What reading the logs brought up."""
    said = found_on_the_way(validation)
    return [subheading("Found while reading the logs"), bullets(said)] if said else []


def _unjudged(validation: Validation) -> list[str]:
    """Signals that no line rests on."""
    names = unjudged.unjudged_says(validation)
    return [subheading(unjudged.HEADING), paragraph(unjudged.MEANING), bullets(names)] if names else []


def _step(validation: Validation, step: Step, figures: Mapping[str, bytes]) -> Iterable[str]:
    number = int(step.number)
    lines = lines_of(validation, step)
    yield heading(f"Step {number}: {step.title}")
    yield paragraph(SHOWS[step.number])
    failed = any(line.failed for line in lines)
    yield paragraph(f"Step {number} alone: {step_verdict(validation, step)}.", no=failed)
    yield bullets(step.statements) if step.statements else paragraph("Nothing stands out.")
    for found in step.tables:
        yield from _table(found)
    for stem, data in figures.items():
        if stem.startswith(f"step-{number}-"):
            yield picture(data, caption(stem))
    if lines:
        yield subheading(f"Criteria of step {number}")
        yield _lines(validation, lines)


def _table(found: Table) -> Iterable[str]:
    yield subheading(found.title)
    yield table([joined(h) for h in found.header], found.rows, words=bool(columns_of_words(found) - {0}))


def caption(stem: str) -> str:
    """What a figure is, from its file's name: "step-5-error-deviation" is "Step 5: error deviation"."""
    _, number, name = stem.split("-", 2)
    return f"Step {number}: {name.replace('-', ' ')}"
