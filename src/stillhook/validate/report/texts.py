"""A validation in words: the verdict in a sentence, the lines that decide it, its lines as cells, and the risks."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from typing import Any, NamedTuple

from stillhook.units import number
from stillhook.validate.criteria.criteria import Criterion, Limit, Requirement
from stillhook.validate.criteria.judge import in_words, interval_words, outcome_of, structural_words
from stillhook.validate.criteria.results import RISK, CriterionResult, Outcome, Step, StepNumber, Verdict
from stillhook.validate.data_set.campaign import MARK
from stillhook.validate.validation import Validation

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


def _used(line: CriterionResult) -> float:
    return -math.inf if math.isnan(line.used) else line.used


def decisive_text(validation: Validation, line: CriterionResult) -> str:
    """A governing line: value against its limit, and utilisation."""
    cells, m = line_cells(validation, line), line.measure
    if m is None or m.value is None or math.isnan(m.value):
        return f"{cells.title}: no value; {m.note if m is not None and m.note else 'no such data are available'}"
    test = f" in {m.test}" if m.test else ""
    value = f"{cells.value} ({cells.interval})" if line.figures else cells.value
    return f"{cells.title}{test}: {value}, limit {cells.limit}; {_closeness(validation, line)}"


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
    limit, verdict (in capitals where it blocks the certificate), data and reason, source."""

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
