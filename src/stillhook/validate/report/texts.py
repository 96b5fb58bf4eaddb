"""A validation in words: the verdict in a sentence, its lines and load cases as table cells, for terminal and
page.

The envelope of a validation: ranges covered by the segments on which the complete twin was compared with the
crane.

Logged signals that no line of the verdict depends on: the certificate lists them as not
checked.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.report import document
from stillhook.report.document import Cell
from stillhook.sea.motion.recorded import wave_periods
from stillhook.units import number
from stillhook.validate.ahc.replay import SETTLE, usable
from stillhook.validate.criteria.criteria import INFORMATION, Criterion, Limit, Requirement
from stillhook.validate.criteria.judge import in_words, interval_words, outcome_of, structural_words
from stillhook.validate.criteria.results import (
    MEASURES,
    OF_SIGNAL,
    RISK,
    CriterionResult,
    Measure,
    Outcome,
    Step,
    StepNumber,
    Verdict,
)
from stillhook.validate.data_set.campaign import MARK
from stillhook.validate.data_set.check import RESTS, tip_ranges
from stillhook.validate.data_set.records.record import Record, Segment
from stillhook.validate.validation import Validation
from stillhook.variables import WINDOW

MEANING = {
    Verdict.SHOWN: "the complete 95 % interval meets the limit; a value without an interval (marked by value) meets it",
    Verdict.NOT_SHOWN: "part of the interval meets the limit and part does not; in capitals it blocks the certificate",
    Verdict.NOT_COVERED: (
        "the tests lack the data for this line, or detect no deviation of the size of the limit; it says nothing about"
        " the crane; in capitals it blocks the certificate"
    ),
    Verdict.REFUTED: "no part of the interval meets the limit; a value without an interval misses it",
    Verdict.NOT_JUDGED: "the winch type lacks what the line rests on; the verdict says nothing about it",
}
WEIGHTS = {
    Requirement.REQUIRED.value: "it blocks the certificate unless its complete 95 % interval is inside the limit",
    Requirement.SUPPORTING.value: (
        "it blocks the certificate if its estimate is outside the limit; its interval may reach beyond the limit"
    ),
    INFORMATION: "it is for comparison and never blocks",
}
"""The three kinds of line, a sentence each."""
OPEN = (Verdict.NOT_SHOWN, Verdict.NOT_COVERED)
"""Verdicts that leave a line open."""
SEGMENT_HEAD = ("test", "from\n[s]", "for\n[s]", "load\n[t]", "wire out\n[m]", "tip p-p\n[m]", "period\n[s]", "mode")
SHORT_HEAD = ("", "criterion", "found", "limit", "verdict")
FULL_HEAD = ("", "criterion", "found (95 %)", "limit", "verdict", "rests on", "source")
TERSE_HEAD = ("", "found", "95 %", "limit", "kind", "verdict")
STEP_HEAD = ("step", "", "shown", "not\nshown", "not\ncovered", "refuted", "info", "verdict")
COUNTED = (Verdict.SHOWN, Verdict.NOT_SHOWN, Verdict.NOT_COVERED, Verdict.REFUTED, Verdict.INFO)
"""Verdicts that STEP_HEAD counts."""
DECISIVE = 3
"""Number of lines directly below the verdict."""


def title(validation: Validation) -> str:
    """The campaign's title, marked where no crane was measured."""
    campaign = validation.campaign
    mark = f"{MARK} " if campaign.synthetic and MARK not in campaign.title else ""
    return f"{mark}{campaign.title}: {campaign.crane.name}"


def sentence(validation: Validation) -> str:
    """The verdict in one sentence."""
    campaign, lines = validation.campaign, validation.lines
    judged = [line for line in lines if line.judged]
    criteria = campaign.criteria.label
    part = (
        ""
        if validation.complete
        else f" This is {_steps(validation.steps)} only: a certificate needs all steps, 0 to {max(StepNumber)}."
    )
    if left_out := without_meaning(validation):
        part = f" Not judged: {_count(sum(map(len, left_out.values())), 'line', 'lines')}, {'; '.join(left_out)}.{part}"
    count = _count(len(judged), "criterion", "criteria")
    failed = [line for line in judged if line.failed]
    match validation.outcome:
        case Outcome.NOT_JUDGED:
            return f"NOT ASSESSED: {criteria} has no criterion that counts for these steps.{part}"
        case Outcome.PASSED:
            subject = f"the {MARK} crane of these logs" if campaign.synthetic else "this crane"
            represents = f'"{campaign.crane.name}" as described represents {subject}, within the tested ranges'
            claim = represents if validation.complete else "no objection"
            shown = sum(line.verdict is Verdict.SHOWN for line in judged)
            open_ = _counts(judged, OPEN)
            rest = f"; {' and '.join(open_)}, none of which blocks" if open_ else ""
            return f"PASSED: {claim}: of {count} of {criteria}, {shown} shown{rest}.{part}"
        case Outcome.NOT_SHOWN:
            keys = " and ".join(_counts(failed, OPEN)) or "none shown"
            return f"NOT SHOWN: of {count} of {criteria}, none refuted, but {keys}.{part}"
        case Outcome.REFUTED:
            counts = _counts(failed, (Verdict.REFUTED, *OPEN))
            return f"REFUTED: of {count} of {criteria}, {' and '.join(counts)}.{part}"


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


def without_meaning_says(validation: Validation) -> list[str]:
    """The same in lines, one a line of the verdict."""
    return [f"{line.key}: {line.message}" for lines in without_meaning(validation).values() for line in lines]


def undetectable(validation: Validation) -> list[str]:
    """Lines whose deviation the data could not detect at the size of the limit, each with its interval."""
    return [
        f"{line.key}: {line.message}"
        for line in validation.lines
        if line.measure is not None and line.measure.undetectable
    ]


def decisive(validation: Validation) -> list[CriterionResult]:
    """The lines that govern the verdict, DECISIVE at most: blocking lines, refuted first and by utilisation of the
    limit; where it passed, the comparisons of twin and crane with the highest utilisation (coverage of the data has no
    margin).
    """
    judged = [line for line in validation.lines if line.judged]
    failed = [line for line in judged if line.failed]
    if failed:
        return sorted(failed, key=lambda line: (line.verdict is not Verdict.REFUTED, -_used(line)))[:DECISIVE]
    compared = [line for line in judged if line.step is not StepNumber.DATA and math.isfinite(line.used)]
    return sorted(compared or judged, key=lambda line: -_used(line))[:DECISIVE]


def deciding_title(failed: bool) -> str:
    """Heading above the lines that govern the verdict."""
    return "Blocking, highest utilisation of the limit first" if failed else "Closest to their limits"


def _used(line: CriterionResult) -> float:
    return -math.inf if math.isnan(line.used) else line.used


def decisive_cells(validation: Validation, line: CriterionResult) -> tuple[str, str, str]:
    """A governing line: verdict, key, value against its limit, and utilisation."""
    cells, m = line_cells(validation, line), line.measure
    if m is None or m.value is None or math.isnan(m.value):
        text = f"{cells.title}: no value; {m.note if m is not None and m.note else 'no such data are available'}"
    else:
        test = f" in {m.test}" if m.test else ""
        value = f"{cells.value} ({cells.interval})" if line.figures else cells.value
        text = f"{cells.title}{test}: {value}, limit {cells.limit}; {_closeness(validation, line)}"
    return cells.verdict, cells.key, text


def _closeness(validation: Validation, line: CriterionResult) -> str:
    """Utilisation of the limit by the far end of the interval."""
    end = "the far end of the interval" if line.figures else "that"
    if math.isnan(line.used):
        return f"{end} is {'beyond' if line.failed else 'within'} it"
    if criterion(validation, line).kind is Limit.AT_LEAST:
        least = 1.0 / line.used if line.used > 0.0 else math.inf
        return f"{end} is {number(least, 3)} times the limit"
    if line.used >= 2.0:
        return f"{end} is {number(line.used, 3)} times the limit"
    return f"{end} is at {number(100.0 * line.used, 3)} % of the limit"


def risks(results: Iterable[CriterionResult]) -> str:
    """Consumer's and producer's risk, and the number of lines they apply to."""
    judged = [line for line in results if line.judged and line.verdict is not Verdict.INFO]
    sampled = [line for line in judged if line.figures]
    bare = [line for line in judged if not line.figures and line.measure is not None and line.measure.value is not None]
    if not sampled:
        return "No judged line has an interval, so no sampling risk can be stated." if judged else "No line was judged."
    percent, most = f"{100.0 * RISK:g} %", max(line.figures for line in sampled)
    several = f", n times that at most where the worst of n tests is judged (n up to {most} here)" if most > 1 else ""
    text = (
        f"{_count(len(sampled), 'line was', 'lines were')} judged by the 95 % interval of the value. Consumer's risk:"
        f" such a line is judged shown in at most {percent} of campaigns where its true value is at the limit or"
        f" beyond. Producer's risk: it is judged refuted in at most {percent} of campaigns where its true value is at"
        f" the limit or within{several}. Both apply to one line and are as good as the intervals (coverage is measured"
        " on synthetic campaigns)."
    )
    if bare:
        count = _count(len(bare), "line was", "lines were")
        text += f" {count} judged by value, without an interval (counts, maxima): no risk is stated for them."
    return text


def _steps(steps: Sequence[Step[Any]]) -> str:
    numbers = [str(int(s.number)) for s in steps]
    return f"step {numbers[0]}" if len(numbers) == 1 else f"steps {', '.join(numbers[:-1])} and {numbers[-1]}"


def _keys(lines: Iterable[CriterionResult]) -> str:
    return ", ".join(line.key for line in lines)


def _count(n: int, one: str, many: str) -> str:
    return f"{n} {one if n == 1 else many}"


def criterion(validation: Validation, line: CriterionResult) -> Criterion:
    """The criterion of a verdict line."""
    return next(c for c in validation.campaign.criteria.criteria if c.key == line.key)


class LineCells(NamedTuple):
    """What people read of a verdict line: number, criterion, value and its 95 % interval in the unit of the limit,
    limit, verdict, data and reason, source."""

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
    data = "; ".join(x for x in behind if x)
    return LineCells(line.key, line.title, figure, between, limit, verdict_word(line), data, line.source)


def terse_cells(validation: Validation, line: CriterionResult) -> tuple[Cell, ...]:
    """A verdict line without the text of the criterion, see TERSE_HEAD."""
    cells = line_cells(validation, line)
    unit = cells.value.partition(" ")[2]
    bare = cells.interval.removesuffix(f" {unit}") if unit else cells.interval
    verdict = document.Verdict("-") if line.verdict is Verdict.INFO else line_verdict(line)
    return cells.key, cells.value, bare, line.limit, line.weight, verdict


def short_cells(validation: Validation, line: CriterionResult) -> tuple[Cell, ...]:
    """A verdict line in short, see SHORT_HEAD."""
    cells = line_cells(validation, line)
    return cells.key, cells.title, cells.value, cells.limit, line_verdict(line)


def full_cells(validation: Validation, line: CriterionResult) -> tuple[Cell, ...]:
    """A verdict line in full with few columns, see FULL_HEAD."""
    cells = line_cells(validation, line)
    value = f"{cells.value} ({cells.interval})" if cells.interval else cells.value
    return cells.key, cells.title, value, cells.limit, line_verdict(line), cells.data, cells.source


def verdict_word(line: CriterionResult) -> str:
    """The verdict; in capitals where it blocks the certificate."""
    return line.verdict.value.upper() if line.failed else line.verdict.value


def line_verdict(line: CriterionResult) -> document.Verdict:
    """The verdict as a cell of a table."""
    passed = False if line.failed else True if line.verdict is Verdict.SHOWN else None
    return document.Verdict(verdict_word(line), passed)


def segment_cells(segment: Segment) -> tuple[str, ...]:
    """A load case as cells, see SEGMENT_HEAD."""
    s = segment
    low, high = (number(x, 4) for x in (s.s_w_min, s.s_w_max))
    moving = s.s_tip_pp > 0.0
    return (
        s.test,
        f"{s.start:.0f}",
        f"{s.duration:.0f}",
        number(s.load / 1e3, 3),
        low if low == high else f"{low}-{high}",
        f"{s.s_tip_pp:.2f}" if moving else "-",
        f"{s.period:.1f}" if moving and math.isfinite(s.period) else "-",
        s.mode.value,
    )


def segments(validation: Validation) -> list[Segment]:
    """The load cases of all tests."""
    return [s for record in validation.records for s in record.segments]


def reading_notes(validation: Validation) -> list[str]:
    """Notes from reading the logs, each with its test; without those repeated by a step."""
    notes = []
    for record in validation.records:
        test = f'Test "{record.test.name}"'
        notes += [text if text.startswith(test) else f"{test}: {text}" for text in record.statements]
    again = {text for step in validation.steps for text in step.statements}
    return [text for text in notes if text not in again]


def step_row(validation: Validation, step: Step[Any]) -> tuple[str, ...]:
    """Results of the criteria of a step, see STEP_HEAD."""
    counts = Counter(line.verdict for line in lines_of(validation, step))
    return (
        str(int(step.number)),
        step.title,
        *(str(counts[v]) if counts[v] else "" for v in COUNTED),
        step_verdict(validation, step),
    )


def lines_of(validation: Validation, step: Step[Any]) -> list[CriterionResult]:
    """The verdict lines of a step."""
    return [line for line in validation.lines if line.step == step.number]


def step_verdict(validation: Validation, step: Step[Any]) -> str:
    """The verdict of a step alone, in a few words."""
    lines = [line for line in lines_of(validation, step) if line.judged]
    if not lines:
        return "not judged"
    failed = [line for line in lines if line.failed]
    outcome = outcome_of(lines)
    return (
        f"{outcome.value} ({_keys(failed)})"
        if failed
        else "passed"
        if outcome is Outcome.PASSED
        else "nothing shown, nothing refuted"
    )


WAVES = (0.05, 0.95)
"""Shares of all waves that bound the periods of the envelope: one exceptional wave in twenty at either end is not a
tested range."""


def envelope_of(records: Sequence[Record], window: float) -> dict[str, Any] | None:
    """Ranges [SI] of load, wire out, 30 s peak-to-peak of the tip and period of its waves, and modes, over the
    segments used by step 5.

    window: that of the criteria [s], which sets the least length for step 5. Windows without tip motion do not count,
    as in step 0. None where the tip moves in no segment.
    """
    used = [
        (record, _counted(record, segment)) for record, segment in usable(records, window)[0] if segment.s_tip_pp > 0.0
    ]
    periods = [p for record, segment in used for p in wave_periods(_tip(record, segment), record.step)]
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


def _tip(record: Record, segment: Segment) -> FloatArray:
    """Height of the tip as logged [m]; single missing samples are bridged."""
    s = record.part(segment, "s_tip")
    finite = np.isfinite(s)
    return np.interp(np.arange(len(s)), np.flatnonzero(finite), s[finite])


def _ends(values: Any) -> list[float]:
    return [float(np.min(values)), float(np.max(values))]


UNDETECTABLE = "Not detectable with these data"
HEADING = "Logged, not judged"
UNJUDGED = (
    "No judged line of the verdict depends on these signals in these tests. Errors in them would not be detected."
)
BY_TEST = ("test ", "load case ")
"""Prefixes of a test's name where a measure applies to that test alone."""


def unjudged(validation: Validation) -> dict[str, tuple[str, ...]]:
    """Names of signals, each with the tests in which it was logged and no judged line with a value depends on it.

    A measure depends on the signals listed in `stillhook.validate.criteria.results`, in its test, or in all tests
    of its kinds.
    """
    judged = _judged(validation)
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
    if len(names) == every > 1:
        return "every test"
    return f"test{'s' if len(names) > 1 else ''} {', '.join(names)}"


def _judged(validation: Validation) -> set[tuple[str, str]]:
    """Tests and signals that a judged line with a value depends on."""
    counted = {line.key for line in validation.lines if line.judged}
    names = {c.measure for c in validation.campaign.criteria.criteria if c.key in counted}
    out = set()
    for m in (m for step in validation.steps for m in step.measures if m.name in names and m.value is not None):
        out |= {(r.test.name, signal) for r in _records(validation, m) for signal in _signals(m)}
    return out


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
