"""The report of a validation: every step with its statements, tables, figures and verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from stillhook.report.document import Bullets, Document, Figure, Part, Section, Table, Text, Verdict, facts
from stillhook.spec.validity import Envelope
from stillhook.validate.criteria.results import CriterionResult, Outcome, Step
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.report import envelope
from stillhook.validate.report.envelope import envelope_of
from stillhook.validate.report.texts import (
    FULL_HEAD,
    MEANING,
    SEGMENT_HEAD,
    SHORT_HEAD,
    SHOWS,
    STEP_HEAD,
    deciding_title,
    decisive,
    decisive_cells,
    full_cells,
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
    " while it is not shown. A line that must not be refuted, because data can refute its limit but hardly prove it,"
    " blocks where it is refuted, or where it is not shown and the estimate itself misses the limit."
)
METHOD = (
    "Method: the five verification steps and the acceptance criteria of G.-A. Moslåt 2020 (section 2.6, paper F table"
    " 2), with an additional step for the passive circuit and additional criteria where paper F states no number; each"
    " line names its source. The twin under test is the crane file as supplied. Values tuned in step 4 are proposals:"
    " they become part of the twin, and of a verdict, only by a crane file that holds them, validated again."
)
LOAD_CASES = (
    "Unbroken parts of the logs with one load in one mode. Wire out: least to most; tip p-p: its largest over 30 s."
)
COVERED = (
    "Ranges covered by the tests with heave compensation. A certificate is valid inside these ranges, each considered"
    " separately."
)


def report(validation: Validation, figures: Mapping[str, bytes]) -> Document:
    """The report. figures: PNG by stem, see `stillhook.validate.report.figures.figures`."""
    sections = [
        Section("Load cases", _load_cases(validation)),
        Section("Steps", [Table(STEP_HEAD, [step_row(validation, step) for step in validation.steps])]),
        Section("Verdict, line by line", _lines(validation)),
        *(_step(validation, step, figures) for step in validation.steps),
        Section("How the verdict is reached", [Text(JUDGED), Text(METHOD)]),
    ]
    return Document(
        title=f"Validation of {title(validation)}",
        marks=[SYNTHETIC] if validation.campaign.synthetic else [],
        front=[*verdict(validation), _about(validation.campaign)],
        sections=sections,
        date=validation.campaign.date.isoformat(),
    )


def verdict(validation: Validation) -> list[Part]:
    """The sentence, the lines that decide it, and the risks."""
    passed = False if not validation.passed else True if validation.complete else None
    parts: list[Part] = [Verdict(sentence(validation), passed)]
    if lines := decisive(validation):
        failed = any(line.failed for line in lines)
        parts.append(deciding(deciding_title(failed), [decisive_cells(validation, line) for line in lines], failed))
    return [*parts, Text(risks(validation.lines))]


def deciding(heading: str, rows: Sequence[Sequence[str]], failed: bool) -> Table:
    """The lines that decide a verdict: outcome, key, and the value against its limit."""
    return facts([(Verdict(word, not failed), key, text) for word, key, text in rows], heading)


def _about(campaign: Campaign) -> Table:
    criteria = campaign.criteria
    return facts(
        [
            ("twin under test", f"{campaign.crane.title} ({campaign.crane_name})"),
            ("date", campaign.date.isoformat()),
            ("tests", ", ".join(f"{t.name} ({t.kind.value})" for t in campaign.tests)),
            ("criteria", f"{criteria.label}: {criteria.source}"),
            *(("changed", text) for text in criteria.changes),
            *(("remark", text) for text in campaign.remarks),
        ]
    )


def _load_cases(validation: Validation) -> list[Part]:
    parts: list[Part] = [Text(LOAD_CASES), Table(SEGMENT_HEAD, [segment_cells(s) for s in segments(validation)])]
    parts += _covered(validation)
    if notes := reading_notes(validation):
        parts.append(Section("Notes from reading the logs", [Bullets(notes)]))
    if names := envelope.unjudged_says(validation):
        parts.append(Section(envelope.HEADING, [Text(envelope.UNJUDGED), Bullets(names)]))
    return parts


def _covered(validation: Validation) -> list[Part]:
    """What the tests cover: the ranges stated in a certificate."""
    if not validation.complete:
        return []
    ranges = envelope_of(validation.records, validation.campaign.criteria.settings["window"])
    if ranges is None:
        return []
    envelope = Envelope.model_construct(None, **{name: tuple(ends) for name, ends in ranges.items()})
    return [Text(COVERED), facts(list(envelope.says().items()))]


def _lines(validation: Validation) -> list[Part]:
    """Every criterion in short; the steps have them in full."""
    lines = [line for step in validation.steps for line in lines_of(validation, step)]
    if not lines:
        return [Text("No criterion judges these steps."), *legend(validation.lines)]
    return [Table(SHORT_HEAD, [short_cells(validation, line) for line in lines]), *legend(validation.lines)]


def legend(lines: Sequence[CriterionResult]) -> list[Part]:
    """Meaning of the verdicts among these lines."""
    verdicts = {line.verdict for line in lines}
    return [Bullets([f"{v.value}: {text}." for v, text in MEANING.items() if v in verdicts])]


def _step(validation: Validation, step: Step, figures: Mapping[str, bytes]) -> Section:
    number = int(step.number)
    lines = lines_of(validation, step)
    outcome, failed = step_verdict(validation, step), any(line.failed for line in lines)
    parts: list[Part] = [
        Text(SHOWS[step.number]),
        Verdict(f"Step {number} alone: {outcome}.", step_passed(outcome, failed)),
        Bullets(step.statements) if step.statements else Text("No remarks."),
        *step.tables,
        *(Figure(png, caption(stem)) for stem, png in figures.items() if stem.startswith(f"step-{number}-")),
    ]
    if lines:
        rows = [full_cells(validation, line) for line in lines]
        parts.append(Table(FULL_HEAD, rows, f"Criteria of step {number}"))
    return Section(f"Step {number}: {step.title}", parts)


def step_passed(outcome: str, failed: bool) -> bool | None:
    """Whether a step passed, by its outcome in words; None where nothing was judged or shown."""
    return False if failed else True if outcome == Outcome.PASSED else None


def caption(stem: str) -> str:
    """Caption of a figure, from its file name: "step-5-error-deviation" is "Step 5: error deviation"."""
    _, number, name = stem.split("-", 2)
    return f"Step {number}: {name.replace('-', ' ')}"
