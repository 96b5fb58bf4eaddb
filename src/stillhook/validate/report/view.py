"""A validation in words and as plain data that documents are made of: words next to numbers in SI, without clock,
folders of the machine and hashes of files (a certificate adds those of its inputs); the envelope that its tests cover;
and logged signals that no judged line depends on.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np

from stillhook.logs.campaign import MARK
from stillhook.report.formatting import fmt
from stillhook.sea.motion.recorded import wave_periods
from stillhook.spec.crane import Crane
from stillhook.units import number
from stillhook.validate.ahc.replay import SETTLE, usable
from stillhook.validate.criteria.criteria import Criterion, DetectionLimits, Limit, Requirement, detection_limits
from stillhook.validate.criteria.judge import in_words, interval_words, outcome_of, structural_words
from stillhook.validate.criteria.results import (
    MEASURES,
    OF_SIGNAL,
    RISK,
    CriterionResult,
    Measure,
    Note,
    Outcome,
    Step,
    StepNumber,
    Verdict,
    plain,
)
from stillhook.validate.data_set.check import RESTS, tip_ranges
from stillhook.validate.data_set.record import Record, Segment, filled
from stillhook.validate.validation import Validation
from stillhook.variables import WINDOW
from stillhook.winches.types import active_passive

WORDS: Mapping[str, Mapping[str, Any]] = tomllib.loads(
    (files("stillhook.validate.report") / "words.toml").read_text(encoding="utf-8")
)
"""Paragraphs that depend on no result."""
WEIGHTS: Mapping[str, str] = WORDS["weights"]
"""The three kinds of line, a sentence each."""
OPEN = (Verdict.NOT_SHOWN, Verdict.NOT_COVERED)
"""Verdicts that leave a line open."""
DECISIVE = 3
"""Number of lines directly below the verdict."""


def title(campaign: Any) -> str:
    """The campaign's title, marked where no crane was measured."""
    return f"{MARK} {campaign.title}" if campaign.synthetic and MARK not in campaign.title else str(campaign.title)


def sentence(validation: Validation) -> str:
    """The verdict in one sentence."""
    judged, label = [line for line in validation.lines if line.judged], validation.campaign.criteria.label
    failed, of = [line for line in judged if line.failed], Note("criteria", n=len(judged), criteria=label)
    match validation.outcome:
        case Outcome.NOT_JUDGED:
            text = Note("verdict-none", criteria=label)
        case Outcome.PASSED:
            text = Note("verdict-passed", claim=_claim(validation), of=of, shown=_number(judged, Verdict.SHOWN))
        case Outcome.NOT_SHOWN:
            text = Note("verdict-not-shown", of=of, open=_counts(failed, OPEN) or ["none shown"])
        case Outcome.REFUTED:
            text = Note("verdict-refuted", of=of, counts=_counts(failed, (Verdict.REFUTED, *OPEN)))
    open_ = _counts(judged, OPEN) if validation.outcome is Outcome.PASSED else []
    parts = [Note("verdict-open", open=open_)] if open_ else []
    if left_out := without_meaning(validation):
        parts.append(Note("lines-left-out", n=sum(map(len, left_out.values())), reasons="; ".join(left_out)))
    if not validation.complete:
        parts.append(Note("steps-only", steps=[int(s.number) for s in validation.steps], last=int(max(StepNumber))))
    return " ".join((text, *parts))


def _claim(validation: Validation) -> str:
    """What a validation that is passed says of the twin."""
    if not validation.complete:
        return "no objection"
    crane = validation.campaign.crane.name
    return Note("represents-synthetic" if validation.campaign.synthetic else "represents", crane=crane)


def _number(lines: Sequence[CriterionResult], verdict: Verdict) -> int:
    return sum(line.verdict is verdict for line in lines)


def _counts(lines: Sequence[CriterionResult], verdicts: Sequence[Verdict]) -> list[str]:
    """How many lines have each of these verdicts, with their keys: "2 not covered (1c-low, 1d)"."""
    of = {v: [line for line in lines if line.verdict is v] for v in verdicts}
    return [f"{len(some)} {v.value} ({_keys(some)})" for v, some in of.items() if some]


def without_meaning(validation: Validation) -> dict[str, list[CriterionResult]]:
    """Lines that are not judged because the winch type lacks what they rest on, by reason."""
    out: dict[str, list[CriterionResult]] = {}
    for line in validation.lines:
        if line.verdict is Verdict.NOT_JUDGED and line.measure is not None:
            out.setdefault(line.measure.note, []).append(line)
    return out


def decisive(validation: Validation) -> list[CriterionResult]:
    """The lines that govern the verdict, DECISIVE at most: blocking lines, refuted first and by utilisation of the
    limit; where it passed, the comparisons of twin and crane with the highest utilisation."""
    judged = [line for line in validation.lines if line.judged]
    failed = [line for line in judged if line.failed]
    if failed:
        return sorted(failed, key=lambda line: (line.verdict is not Verdict.REFUTED, -_used(line)))[:DECISIVE]
    compared = [line for line in judged if line.step is not StepNumber.DATA and math.isfinite(line.used)]
    return sorted(compared or judged, key=lambda line: -_used(line))[:DECISIVE]


def _used(line: CriterionResult) -> float:
    return -math.inf if math.isnan(line.used) else line.used


def decisive_text(validation: Validation, line: CriterionResult) -> str:
    """A governing line: value against its limit, and utilisation by the far end of the interval."""
    cells, m = line_cells(validation, line), line.measure
    if m is None or m.value is None or math.isnan(m.value):
        return Note("decisive-none", title=cells.title, why=m.note if m is not None and m.note else NO_DATA)
    interval = f" ({cells.interval})" if line.figures else ""
    end = "the far end of the interval" if line.figures else "that"
    at_least = criterion(validation, line).kind is Limit.AT_LEAST
    if math.isnan(line.used):
        close = f"{end} is {'beyond' if line.failed else 'within'} it"
    elif at_least or line.used >= 2.0:
        times = line.used if not at_least else 1.0 / line.used if line.used > 0.0 else math.inf
        close = f"{end} is {number(times, 3)} times the limit"
    else:
        close = f"{end} is at {number(100.0 * line.used, 3)} % of the limit"
    where = f" in {m.test}" if m.test else ""
    value = {"value": cells.value, "interval": interval, "limit": cells.limit}
    return Note("decisive", title=cells.title, where=where, close=close, **value)


NO_DATA = "no such data are available"


def risks(results: Iterable[CriterionResult]) -> str:
    """Consumer's and producer's risk, and the number of lines they apply to."""
    judged = [line for line in results if line.judged and line.verdict is not Verdict.INFO]
    sampled = [line for line in judged if line.figures]
    bare = [line for line in judged if not line.figures and line.measure is not None and line.measure.value is not None]
    if not sampled:
        return Note("no-risk" if judged else "none-judged")
    most = max(line.figures for line in sampled)
    several = Note("risk-of-several", most=most) if most > 1 else ""
    text = Note("risk", n=len(sampled), risk=RISK, several=several)
    return f"{text} {Note('by-value', n=len(bare))}" if bare else text


def _keys(lines: Iterable[CriterionResult]) -> str:
    return ", ".join(line.key for line in lines)


def criterion(validation: Validation, line: CriterionResult) -> Criterion:
    """The criterion of a verdict line."""
    return next(c for c in validation.campaign.criteria.criteria if c.key == line.key)


class LineCells(NamedTuple):
    """What people read of a verdict line: values in the unit of the limit, verdict in capitals where it blocks the
    certificate."""

    key: str
    title: str
    value: str
    interval: str
    limit: str
    verdict: str
    data: str
    source: str


def line_cells(validation: Validation, line: CriterionResult) -> LineCells:
    """A verdict line as cells."""
    c, m = criterion(validation, line), line.measure
    behind = (m.test, structural_words(c, m), m.data, m.note) if m is not None else ()
    measured = m is not None and m.value is not None
    between = interval_words(c, m) if m is not None and measured else ""
    figure = in_words(c, m.value) if m is not None and m.value is not None else "-"
    limit = line.limit + (f" ({line.weight})" if line.weight == Requirement.SUPPORTING else "")
    between = between or ("by value" if measured else "")
    verdict = line.verdict.value.upper() if line.failed else line.verdict.value
    data = "; ".join(x for x in behind if x)
    return LineCells(line.key, line.title, figure, between, limit, verdict, data, line.source)


def step_verdict(validation: Validation, step: Step[Any]) -> str:
    """The verdict of a step alone, in a few words."""
    lines = [line for line in validation.lines if line.step == step.number and line.judged]
    if not lines:
        return "not judged"
    if failed := [line for line in lines if line.failed]:
        return f"{outcome_of(lines).value} ({_keys(failed)})"
    return "passed" if outcome_of(lines) is Outcome.PASSED else "nothing shown, nothing refuted"


WAVES = (0.05, 0.95)
"""Shares of all waves that bound the periods of the envelope: one exceptional wave in twenty at either end is not a
tested range."""
BY_TEST = ("test ", "load case ")
"""Prefixes of a test's name where a measure applies to that test alone."""


def envelope_of(records: Sequence[Record], window: float) -> dict[str, Any] | None:
    """Ranges [SI] of load, wire out, 30 s peak-to-peak of the tip and period of its waves, and modes, over the segments
    used by step 5; windows without tip motion do not count. window: sets the least length for step 5 [s]. None where
    the tip moves in no segment."""
    used = [
        (record, _counted(record, segment)) for record, segment in usable(records, window)[0] if segment.s_tip_pp > 0.0
    ]
    periods = [p for r, segment in used for p in wave_periods(filled(r.part(segment, "s_tip")), r.step)]
    spans = np.concatenate([np.zeros(0), *(tip_ranges(*part, WINDOW) for part in used)])
    spans = spans[spans >= RESTS]
    if not periods or not len(spans):
        return None
    segments = [segment for _, segment in used]
    return {
        "load": _ends([s.load for s in segments]),
        "s_w": [float(min(s.s_w_min for s in segments)), float(max(s.s_w_max for s in segments))],
        "s_tip_pp": _ends(spans),
        "period": [float(x) for x in np.quantile(periods, WAVES)],
        "modes": sorted({s.mode.value for s in segments}),
    }


def _counted(record: Record, segment: Segment) -> Segment:
    """The part of a segment that counts in step 5."""
    skipped = round(SETTLE / record.step)
    start, duration = segment.start + skipped * record.step, segment.duration - skipped * record.step
    return replace(segment, first=segment.first + skipped, start=start, duration=duration)


def _ends(values: Any) -> list[float]:
    return [float(np.min(values)), float(np.max(values))]


def unjudged(validation: Validation) -> dict[str, tuple[str, ...]]:
    """Names of signals, each with the tests in which it was logged and no judged line with a value depends on it, by
    `MEASURES`."""
    counted = {line.key for line in validation.lines if line.judged}
    names = {c.measure for c in validation.campaign.criteria.criteria if c.key in counted}
    judged = {
        (r.test.name, signal)
        for step in validation.steps
        for m in step.measures
        if m.name in names and m.value is not None
        for r in _records(validation, m)
        for signal in _signals(m)
    }
    out: dict[str, list[str]] = {}
    for record in validation.records:
        for name in sorted(set(record.signals) - record.derived):
            if (record.test.name, name) not in judged:
                out.setdefault(name, []).append(record.test.name)
    return {name: tuple(tests) for name, tests in out.items()}


def unjudged_says(validation: Validation) -> list[str]:
    """The same in lines, "p_hp in test dynamics"; nothing where only some steps were taken."""
    if not validation.complete:
        return []
    every = len(validation.records)
    return [f"{name} in {_tests(tests, every)}" for name, tests in unjudged(validation).items()]


def _tests(names: tuple[str, ...], every: int) -> str:
    """Tests in words."""
    return "every test" if len(names) == every > 1 else f"test{'s' if len(names) > 1 else ''} {', '.join(names)}"


def _signals(m: Measure) -> Sequence[str]:
    """Signals that a measure depends on: those declared, or the one that it is of."""
    return (m.test.removeprefix(OF_SIGNAL),) if m.test.startswith(OF_SIGNAL) else MEASURES[m.name].signals


def _records(validation: Validation, m: Measure) -> Iterator[Record]:
    """The tests that a measure covers."""
    names = {r.test.name for r in validation.records}
    test = [m.test.removeprefix(before) for before in BY_TEST if m.test.startswith(before)]
    kinds = MEASURES[m.name].kinds
    for r in validation.records:
        if test and test[0] in names:
            if r.test.name == test[0]:
                yield r
        elif not kinds or r.test.kind.value in kinds:
            yield r


SEGMENT_HEAD = ("test", "from\n[s]", "for\n[s]", "load\n[t]", "wire out\n[m]", "tip p-p\n[m]", "period\n[s]", "mode")
UNDETECTABLE = "Not detectable with these data"
UNJUDGED = "Logged, not judged"
ROUNDING = 1e-9
OF_ORDINARY_SIZE = ("", "time", "length", "speed", "pressure", "force", "mass", "torque", "rotation")
"""Below ROUNDING [SI], a number of these quantities is what rounding leaves of zero, which no two machines do alike."""

TRIED = active_passive.NAME
"""Winch type of the trials with known defects."""


def view_of(validation: Validation) -> dict[str, Any]:
    """What a validation came to. A complete one in which no part with heave compensation could be compared, or of whose
    criteria none counts, certifies nothing, even where all of them are met."""
    campaign, outcome, verdict = validation.campaign, validation.outcome, sentence(validation)
    envelope = envelope_of(validation.records, campaign.criteria.settings["window"])
    if validation.complete and outcome is Outcome.NOT_JUDGED:
        none = f"no criterion of {campaign.criteria.label} counts on these data, so that nothing was shown."
        verdict = f"NOT ASSESSED: {none}"
    elif validation.complete and outcome is Outcome.PASSED and envelope is None:
        none = "no part of the logs with heave compensation could be compared, so the twin is not validated."
        outcome, verdict = Outcome.NOT_SHOWN, f"NOT SHOWN: {none}"
    passed = outcome is Outcome.PASSED
    return {
        "title": campaign.title,
        "date": campaign.date.isoformat(),
        "synthetic": campaign.synthetic,
        "crane": {"name": campaign.crane.name, "title": campaign.crane.title},
        "passed": passed,
        "outcome": outcome.value,
        "verdict": verdict,
        "decisive": [
            {"verdict": line_cells(validation, x).verdict, "key": x.key, "text": decisive_text(validation, x)}
            for x in decisive(validation)
        ],
        "risks": risks(validation.lines),
        "criteria": plain(campaign.criteria.to_dict()),
        "lines": [_line(validation, line) for line in validation.lines],
        "steps": [_step(validation, step) for step in validation.steps],
        "data": [_data(record) for record in validation.records],
        "load_cases": {"header": list(SEGMENT_HEAD), "rows": [_load_case(s) for s in segments(validation)]},
        "unjudged": plain(unjudged(validation)),
        "envelope": plain(envelope),
        "limitations": list(_limitations(validation, passed)),
    }


def _line(validation: Validation, line: CriterionResult) -> dict[str, Any]:
    measure = {"measure": _numbers(line.measure) if line.measure is not None else None}
    return {**plain(line.to_dict()), **measure, "cells": line_cells(validation, line)._asdict()}


def _step(validation: Validation, step: Step[Any]) -> dict[str, Any]:
    return {
        "step": int(step.number),
        "title": step.title,
        "verdict": step_verdict(validation, step),
        "measures": [_measure(m) for m in step.measures],
        "statements": list(step.statements),
        "tables": [
            {"title": t.title, "header": list(t.header), "rows": [list(r) for r in t.rows]} for t in step.tables
        ],
    }


def _numbers(measure: Measure) -> dict[str, Any]:
    """A measure without what is rounding in it."""
    data: dict[str, Any] = plain(measure.to_dict())
    if measure.quantity in OF_ORDINARY_SIZE:
        data |= {
            n: 0.0 for n in ("value", "low", "high", "structural") if data[n] is not None and abs(data[n]) < ROUNDING
        }
    return data


def _measure(exact: Measure) -> dict[str, Any]:
    numbers = _numbers(exact)
    m = replace(exact, **{n: numbers[n] for n in ("value", "low", "high")})
    value, low, high = (fmt(x, m.quantity, 3) for x in (m.value, m.low, m.high))
    interval = f"{low} to {high}" if m.low is not None and m.high is not None else ""
    meaning = MEASURES[m.name].meaning if m.name in MEASURES else m.name
    return {**numbers, "text": {"meaning": meaning, "value": value, "interval": interval}}


def _data(record: Record) -> dict[str, Any]:
    test = record.test
    return {
        "test": test.name,
        "kind": test.kind.value,
        "file": test.log.name,
        "samples": int(record.log.samples),
        "rate": float(record.log.rate),
        "duration": float(record.t[-1] - record.t[0]),
        "load": test.load,
        "water": test.water is not None,
        "signals": sorted(record.signals),
        "statements": list(record.statements),
    }


def segments(validation: Validation) -> list[Segment]:
    """The load cases of all tests."""
    return [s for record in validation.records for s in record.segments]


def _load_case(s: Segment) -> list[str]:
    """A load case as cells, see SEGMENT_HEAD."""
    low, high = (number(x, 4) for x in (s.s_w_min, s.s_w_max))
    moving = s.s_tip_pp > 0.0
    return [
        s.test,
        f"{s.start:.0f}",
        f"{s.duration:.0f}",
        number(s.load / 1e3, 3),
        low if low == high else f"{low}-{high}",
        f"{s.s_tip_pp:.2f}" if moving else "-",
        f"{s.period:.1f}" if moving and math.isfinite(s.period) else "-",
        s.mode.value,
    ]


def _limitations(validation: Validation, passed: bool) -> Iterator[dict[str, Any]]:
    """What was synthetic, not shown, holds always, or is left out of the model: headings with their lines."""
    words, campaign = WORDS["limitations"], validation.campaign
    wide = [line for line in validation.lines if line.measure is not None and line.measure.undetectable]
    no_meaning = [line for lines in without_meaning(validation).values() for line in lines]
    sections = {
        "Synthetic data": [words["synthetic"]] if campaign.synthetic else [],
        "Not shown by these data": list(_open(validation, Verdict.NOT_SHOWN)),
        "Not covered by the tests": list(_open(validation, Verdict.NOT_COVERED)),
        UNDETECTABLE: [f"{line.key}: {line.message}" for line in wide],
        "Remarks of the campaign": [f"Remark: {text}" for text in campaign.remarks],
        "Not judged: no meaning for this winch type": [f"{line.key}: {line.message}" for line in no_meaning],
        UNJUDGED: unjudged_says(validation),
        "Of this certificate" if passed else "Of this validation": words["always"],
        "Left out of the model": words["left_out"],
        "What this method detects (simulated cranes with known defects)": _detects(campaign.crane),
    }
    yield from ({"heading": heading, "lines": list(lines)} for heading, lines in sections.items() if lines)


def _open(validation: Validation, verdict: Verdict) -> Iterator[str]:
    for line in validation.lines:
        undetectable = line.measure is not None and line.measure.undetectable  # they have a heading of their own
        if line.verdict is verdict and not undetectable:
            weight = "blocks the certificate" if line.failed else "does not block it"
            yield f"{line.key} ({weight}): {line.message}"


def limits_of(crane: Crane) -> DetectionLimits:
    """Detection limits of a crane: of the trials with known defects; none for another winch type, whose judged lines
    are others."""
    return detection_limits() if crane.plant == TRIED else DetectionLimits("", "", 0, 0, ())


def _detects(crane: Crane) -> list[str]:
    if crane.plant == TRIED:
        return list(limits_of(crane).sentences())
    return [
        f'The trials with known defects are of winch type "{TRIED}": the detection limits of winch type'
        f' "{crane.plant.value}" are not known. The page "Validate a twin" lists single defects that were tried.'
    ]
