"""The report of a validation: as a document, in short for a terminal, and as data in SI."""

from __future__ import annotations

import dataclasses
from collections.abc import Container, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.report.document import Bullets, Column, Document, Figure, Part, Section, Table, Text, Verdict, facts
from stillhook.spec.validity import Envelope
from stillhook.validate.criteria import results
from stillhook.validate.criteria.results import CriterionResult, Outcome, Step
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.report import texts
from stillhook.validate.report.texts import (
    FULL_HEAD,
    HEADING,
    MEANING,
    SEGMENT_HEAD,
    SHORT_HEAD,
    STEP_HEAD,
    TERSE_HEAD,
    UNJUDGED,
    WEIGHTS,
    deciding_title,
    decisive,
    decisive_cells,
    envelope_of,
    full_cells,
    line_verdict,
    lines_of,
    reading_notes,
    risks,
    segment_cells,
    segments,
    sentence,
    short_cells,
    step_row,
    step_verdict,
    terse_cells,
    title,
    unjudged,
    unjudged_says,
    without_meaning,
)
from stillhook.validate.validation import Validation

if TYPE_CHECKING:
    import pandas


SYNTHETIC = "SYNTHETIC: these logs are simulated, not measured on a crane. The results say nothing about a real crane."
JUDGED = (
    "Each line is judged by the 95 % interval of its value alone: shown where the complete interval meets the limit,"
    " refuted where no part of it does, else not shown; not covered where the tests lack the data. The column of the"
    " limit marks the supporting checks; other judged lines are required."
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
        Section("How the verdict is reached", [Text(JUDGED), *legend(validation.lines), Text(METHOD)]),
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
    shown = results.Verdict.SHOWN.value
    return facts(
        [(Verdict(word, False if failed else True if word == shown else None), key, text) for word, key, text in rows],
        heading,
    )


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
    if wide := texts.undetectable(validation):
        parts.append(Section(texts.UNDETECTABLE, [Bullets(wide)]))
    if names := texts.unjudged_says(validation):
        parts.append(Section(texts.HEADING, [Text(texts.UNJUDGED), Bullets(names)]))
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
    """Kinds of line and meaning of the verdicts among these lines."""
    return [Bullets(legend_says({line.weight for line in lines}, {line.verdict for line in lines}))]


def legend_says(weights: Container[str], verdicts: Container[str]) -> list[str]:
    """A sentence for each kind of line, and for each verdict."""
    kinds = [f"{weight}: {text}." for weight, text in WEIGHTS.items() if weight in weights]
    return kinds + [f"{v.value}: {text}." for v, text in MEANING.items() if v in verdicts]


def _step(validation: Validation, step: Step[Any], figures: Mapping[str, bytes]) -> Section:
    number = int(step.number)
    lines = lines_of(validation, step)
    outcome, failed = step_verdict(validation, step), any(line.failed for line in lines)
    parts: list[Part] = [
        Text(results.STEPS[step.number].question),
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


def to_dict(validation: Validation) -> dict[str, Any]:
    """All results in SI as plain data for JSON; names as in the nomenclature."""
    campaign = validation.campaign
    return {
        "title": campaign.title,
        "date": campaign.date.isoformat(),
        "synthetic": campaign.synthetic,
        "crane": campaign.crane.name,
        "criteria": campaign.criteria.to_dict(),
        "passed": validation.passed,
        "outcome": validation.outcome.value,
        "complete": validation.complete,
        "verdict": sentence(validation),
        "decisive": [line.key for line in decisive(validation)],
        "risks": risks(validation.lines),
        "lines": [line.to_dict() for line in validation.lines],
        "segments": [dataclasses.asdict(s) | {"mode": s.mode.value} for s in segments(validation)],
        "unjudged": {name: list(tests) for name, tests in unjudged(validation).items()} if validation.complete else {},
        "steps": [step.to_dict() for step in validation.steps],
        "tests": [
            {"name": r.test.name, "log": r.test.log.name, "statements": list(r.statements)} for r in validation.records
        ],
    }


def segments_table(validation: Validation) -> pandas.DataFrame:
    """Every load case in display units, units in the headings."""
    import pandas as pd

    load_cases = segments(validation)
    columns = {
        "test": [s.test for s in load_cases],
        "start [s]": [s.start for s in load_cases],
        "duration [s]": [s.duration for s in load_cases],
        "load [t]": [s.load / 1e3 for s in load_cases],
        "s_w_min [m]": [s.s_w_min for s in load_cases],
        "s_w_max [m]": [s.s_w_max for s in load_cases],
        "s_tip_pp [m]": [s.s_tip_pp for s in load_cases],
        "period [s]": [s.period for s in load_cases],
        "mode": [s.mode.value for s in load_cases],
    }
    return pd.DataFrame(columns)


def deviations_table(validation: Validation) -> pandas.DataFrame | None:
    """Every window of step 5, units in the headings; None where there is none. Source: Moslatt 2020 paper F,
    figures 11 to 13."""
    import pandas as pd

    found = (s.estimates for s in validation.steps if s.number is results.StepNumber.AHC)
    parts = [c.windows for estimates in found if estimates is not None for c in estimates.comparisons]
    if not parts:
        return None
    joined = {
        "test": [w.test for w in parts for _ in w.ends],
        "end of window [s]": np.concatenate([w.ends for w in parts]),
        "s_tip_pp [m]": np.concatenate([w.s_tip_pp for w in parts]),
        "e_c_pp_measured [m]": np.concatenate([w.measured for w in parts]),
        "e_c_pp_simulated [m]": np.concatenate([w.simulated for w in parts]),
        "deviation [m]": np.concatenate([w.x for w in parts]),
        "eta_c_measured": np.concatenate([w.eta_measured for w in parts]),
        "eta_c_simulated": np.concatenate([w.eta_simulated for w in parts]),
    }
    return pd.DataFrame(joined).round(6)


TERSE_COLUMNS = (Column.TEXT, Column.NUMBER, Column.NUMBER, Column.NUMBER, Column.TEXT, Column.TEXT)


def summary(validation: Validation, *, tables: bool = False, everything: bool = False) -> Document:
    """everything: also what agrees, in full; tables: those of the steps."""
    load_cases: list[Part] = [Table(SEGMENT_HEAD, [segment_cells(s) for s in segments(validation)])]
    load_cases += [Bullets(notes)] if (notes := reading_notes(validation)) else []
    sections = [
        Section("load cases", load_cases),
        Section("steps", _steps(validation, tables=tables, everything=everything)),
        Section("lines", _summary_lines(validation, everything=everything)),
    ]
    if left_out := without_meaning(validation):
        keys = [f"{', '.join(line.key for line in lines)}: {reason}." for reason, lines in left_out.items()]
        sections.append(Section("not judged", [Bullets(keys)]))
    if wide := texts.undetectable(validation):
        sections.append(Section(texts.UNDETECTABLE.lower(), [Bullets(wide)]))
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
