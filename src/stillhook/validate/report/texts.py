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
from stillhook.validate.criteria.notes import Note
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
