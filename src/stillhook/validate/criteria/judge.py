"""Judgement of the measures by a set of criteria: one result per criterion, with a verdict."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

from stillhook.units import in_unit, number
from stillhook.validate.criteria.criteria import Criteria, Criterion, Limit, Requirement
from stillhook.validate.criteria.results import MEASURES, CriterionResult, Measure, Note, Outcome, StepNumber, Verdict

DIGITS = 3


def judge(
    criteria: Criteria,
    measures: Iterable[Measure],
    steps: Iterable[StepNumber],
    lacks: Mapping[str, str] | None = None,
) -> tuple[CriterionResult, ...]:
    """The result of every criterion that belongs to one of these steps.

    Of several measures of one name (one a test or load case) the worst is judged: refuted before not shown and not
    covered before shown; one without a figure is not covered, and is left out where the criterion is not needed and
    others have one. lacks: measures that have no meaning for the crane, with the reason; their lines are not judged.
    """
    without = lacks or {}
    everything, completed_steps = tuple(measures), set(steps)
    return tuple(
        _not_judged(c, without[c.measure])
        if c.measure in without
        else _result(c, [m for m in everything if m.name == c.measure])
        for c in criteria.criteria
        if c.step in completed_steps
    )


def outcome_of(results: Iterable[CriterionResult]) -> Outcome:
    """Outcome of all results together."""
    judged = [r for r in results if r.judged]
    if not judged:
        return Outcome.NOT_JUDGED
    if any(r.verdict is Verdict.REFUTED for r in judged):
        return Outcome.REFUTED
    open_ = any(r.failed for r in judged) or all(r.verdict is not Verdict.SHOWN for r in judged)
    return Outcome.NOT_SHOWN if open_ else Outcome.PASSED


def verdict_of(criterion: Criterion, measure: Measure) -> Verdict:
    """Shown where the complete 95 % interval of a measure meets the limit, refuted where no part of it does, else not
    shown; a measure without an interval is judged by its value. Not covered: one without a value, one that the data
    cannot detect, and one that counts what the tests contain and misses its limit."""
    value = _value(measure)
    if value is None or measure.undetectable:
        return Verdict.NOT_COVERED
    low, high = _ends(measure) or (value, value)
    fulfilled = [_within(criterion, x) for x in (low, high, value)]
    if all(fulfilled):
        return Verdict.SHOWN
    if MEASURES[criterion.measure].coverage:
        return Verdict.NOT_COVERED
    crosses_zero = criterion.kind is Limit.WITHIN and low <= 0.0 <= high
    return Verdict.NOT_SHOWN if crosses_zero or any(fulfilled) else Verdict.REFUTED


def _value(m: Measure) -> float | None:
    return None if m.value is None or math.isnan(m.value) else m.value


def _ends(m: Measure) -> tuple[float, float] | None:
    """The 95 % interval of a measure; None where it has none."""
    if m.low is None or m.high is None or math.isnan(m.low) or math.isnan(m.high):
        return None
    return m.low, m.high


def _within(c: Criterion, x: float) -> bool:
    if c.kind is Limit.AT_LEAST:
        return x >= c.limit
    return (abs(x) if c.kind is Limit.WITHIN else x) <= c.limit


def _required(c: Criterion, m: Measure | None) -> bool:
    """Whether "not shown" or "not covered" blocks the certificate: it must be shown, has no value, or its estimate
    misses the limit."""
    value = None if m is None else _value(m)
    if value is None or (m is not None and m.undetectable):
        return c.needed
    return c.ask is Requirement.REQUIRED or not _within(c, value)


def _used(c: Criterion, m: Measure) -> float:
    """The farthest end of the interval as a part of the limit, above 1 beyond; NaN without a figure or where the limit
    is zero."""
    value = _value(m)
    if value is None or c.limit == 0.0:
        return math.nan
    points = (*(_ends(m) or ()), value)
    if c.kind is Limit.AT_LEAST:
        least = min(points)
        return c.limit / least if least > 0.0 else math.inf
    return float(max(abs(x) if c.kind is Limit.WITHIN else x for x in points) / abs(c.limit))


def _badness(c: Criterion, m: Measure) -> tuple[int, float, float]:
    """Rank: refuted, then blocking, then others; within a rank by utilisation of the limit, then by value."""
    open_ = 2 if _required(c, m) else 1
    blocking = {Verdict.REFUTED: 3, Verdict.NOT_SHOWN: open_, Verdict.NOT_COVERED: open_}
    rank = blocking.get(verdict_of(c, m), 0)
    used = _used(c, m)
    beyond = 0.0 if m.value is None else c.limit - m.value if c.kind is Limit.AT_LEAST else abs(m.value)
    return rank, -math.inf if math.isnan(used) else used, beyond


def _result(c: Criterion, same: list[Measure]) -> CriterionResult:
    available = [m for m in same if _value(m) is not None and not m.undetectable]
    pool = same if c.needed or not available else available
    worst = max(pool, key=lambda m: _badness(c, m)) if pool else None
    verdict = verdict_of(c, worst) if worst is not None else Verdict.NOT_COVERED
    has_figure = worst is not None and _value(worst) is not None and not worst.undetectable
    return CriterionResult(
        key=c.key,
        step=c.step,
        title=c.title,
        verdict=verdict if c.judged else Verdict.INFO,
        measure=worst,
        limit=c.limit_text,
        weight=c.weight,
        judged=c.judged and (c.needed or has_figure),
        source=c.source,
        message=_message(c, worst, available),
        required=_required(c, worst),
        used=_used(c, worst) if worst is not None and has_figure else math.nan,
        figures=sum(_ends(m) is not None for m in available),
    )


def _not_judged(c: Criterion, reason: str) -> CriterionResult:
    """A line without a meaning for the crane."""
    return CriterionResult(
        key=c.key,
        step=c.step,
        title=c.title,
        verdict=Verdict.NOT_JUDGED,
        measure=Measure(c.measure, None, c.quantity, notes=(reason,)),
        limit=c.limit_text,
        weight=c.weight,
        judged=False,
        source=c.source,
        message=Note("line-no-meaning", title=c.title, reason=reason),
        required=False,
    )


def in_words(c: Criterion, x: float) -> str:
    """A value of the criterion's measure in the unit of the written limit, to a 200th to a 2000th of the limit."""
    unit = c.written.split(" ", 1)[1] if " " in c.written else ""
    scale = 100.0 if unit == "%" else in_unit(1.0, unit, c.quantity) if unit and c.quantity else 1.0
    shown, limit = scale * x, abs(scale * c.limit)
    if not math.isfinite(shown):
        return f"{shown} {unit}".rstrip()
    text = f"{shown:.{max(0, -math.floor(math.log10(limit / 200.0)))}f}" if limit > 0.0 else number(shown, DIGITS)
    bare = text.rstrip("0").rstrip(".") if "." in text else text
    return f"{bare.replace('-0', '0') if float(bare) == 0.0 else bare} {unit}".rstrip()


def interval_words(c: Criterion, m: Measure) -> str:
    """The 95 % interval in the unit of the limit, "1.8 to 2.51 cm"; "" where there is none."""
    ends = _ends(m)
    if ends is None:
        return ""
    low, high = (in_words(c, x) for x in ends)
    _, space, unit = high.partition(" ")
    return f"{low.removesuffix(space + unit)} to {high}"


def structural_words(c: Criterion, m: Measure) -> str:
    """Structural part of the interval in words; "" where it is zero."""
    return f"of which +- {in_words(c, m.structural)} from the form of the law" if m.structural else ""


def _message(c: Criterion, m: Measure | None, known: Sequence[Measure]) -> str:
    """One sentence: figure, interval, limit and the data behind it."""
    if m is None:
        return Note("line-without-data" if c.needed else "line-without-needed-data", title=c.title, limit=c.limit_text)
    rest = "".join(f"; {part}" for part in (m.data, m.note) if part)
    where = f" in {m.test}" if m.test else ""
    where += f", the worst of {len(known)}" if m.test and len(known) > 1 else ""
    value, of = _value(m), {"title": c.title, "where": where, "limit": c.limit_text, "rest": rest}
    if value is None:
        return Note("line-without-value", **of)
    parts = [part for part in (interval_words(c, m), structural_words(c, m)) if part]
    interval = f" (95 % interval {', '.join(parts)})" if parts else ""
    open_ = "not-shown-in" if _within(c, value) else "not-shown-out"
    beyond = {Verdict.NOT_COVERED: "not-covered", Verdict.NOT_SHOWN: open_}.get(verdict_of(c, m), "as-it-is")
    code = "not-detectable" if m.undetectable else beyond if c.judged else "not-judged"
    return Note(f"line-{code}", value=in_words(c, value), interval=interval, **of)
