"""What a set of criteria makes of the measures of the steps: one verdict line a criterion."""

from __future__ import annotations

import math
from collections.abc import Iterable

from stillhook.units import in_unit, number
from stillhook.validate.criteria import By, Criteria, Criterion, Limit
from stillhook.validate.lines import Line, Measure, StepNumber, Verdict

DIGITS = 3


def judge(criteria: Criteria, measures: Iterable[Measure], steps: Iterable[StepNumber]) -> tuple[Line, ...]:
    """The verdict line of every criterion that belongs to one of these steps.

    Of several measures of one name (one a test or load case) the worst is judged; one that the data cannot tell comes before those that
    pass, after those that fail, and is left out where the criterion is not needed and others can tell.
    """
    found, taken = tuple(measures), set(steps)
    return tuple(_line(c, [m for m in found if m.name == c.measure]) for c in criteria.criteria if c.step in taken)


def meets(criterion: Criterion, measure: Measure) -> bool | None:
    """Whether a measure meets a criterion; None where the data cannot tell: no value, or by "any" an interval wider than the limits are
    apart that does not miss them. Without an interval its value stands for one."""
    if measure.value is None or math.isnan(measure.value):
        return None
    ends = [x for x in (measure.low, measure.high) if x is not None and not math.isnan(x)]
    if criterion.by is By.VALUE or len(ends) < 2:
        return _within(criterion, measure.value)
    if criterion.by is By.WHOLE:
        return all(_within(criterion, x) for x in (*ends, measure.value))
    crosses_zero = criterion.kind is Limit.WITHIN and ends[0] <= 0.0 <= ends[1]
    if not (crosses_zero or any(_within(criterion, x) for x in (*ends, measure.value))):
        return False
    return None if _too_wide(criterion, measure) else True


def _too_wide(c: Criterion, m: Measure) -> bool:
    """Whether the interval of a measure, any part of which counts, is wider than what is allowed: then no value would have failed."""
    if c.by is not By.ANY or c.kind is not Limit.WITHIN or m.low is None or m.high is None:
        return False
    return m.high - m.low > 2.0 * c.limit


def _within(c: Criterion, x: float) -> bool:
    if c.kind is Limit.AT_LEAST:
        return x >= c.limit
    return (abs(x) if c.kind is Limit.WITHIN else x) <= c.limit


def _badness(c: Criterion, m: Measure) -> tuple[int, float]:
    met = meets(c, m)
    if met is None or m.value is None:
        return 1, 0.0
    beyond = c.limit - m.value if c.kind is Limit.AT_LEAST else (abs(m.value) if c.kind is Limit.WITHIN else m.value) - c.limit
    return (0 if met else 2), beyond


def _line(c: Criterion, found: list[Measure]) -> Line:
    telling = [m for m in found if meets(c, m) is not None]
    pool = found if c.needed or not telling else telling
    worst = max(pool, key=lambda m: _badness(c, m)) if pool else None
    met = meets(c, worst) if worst is not None else None
    counts = c.judged and (c.needed or met is not None)
    if met is None:
        verdict = Verdict.NOT_SHOWN
    elif not c.judged:
        verdict = Verdict.TOLD
    else:
        verdict = Verdict.PASS if met else Verdict.FAIL
    why = "" if c.needed else ", and need not be"
    nothing = f"{c.what}: nothing of the kind is in these data{why} ({c.asked} is asked)."
    said = _said(c, worst, len(telling)) if worst is not None else nothing
    return Line(c.key, c.step, c.what, verdict, worst, c.asked, counts, c.source, said)


def in_words(c: Criterion, x: float) -> str:
    """A value of the criterion's measure in the unit that the limit is written in, to between a 200th and a 2000th of the limit."""
    unit = c.written.split(" ", 1)[1] if " " in c.written else ""
    scale = 100.0 if unit == "%" else in_unit(1.0, unit, c.quantity) if unit and c.quantity else 1.0
    shown, limit = scale * x, abs(scale * c.limit)
    text = f"{shown:.{max(0, -math.floor(math.log10(limit / 200.0)))}f}" if limit > 0.0 else number(shown, DIGITS)
    bare = text.rstrip("0").rstrip(".") if "." in text else text
    return f"{bare.replace('-0', '0') if float(bare) == 0.0 else bare} {unit}".rstrip()


def _said(c: Criterion, m: Measure, of: int) -> str:
    """One sentence: figure, interval, limit and the data behind it."""
    rest = "".join(f"; {part}" for part in (m.data, m.note) if part)
    where = f" in {m.test}" if m.test and of <= 1 else f" in {m.test}, the worst of {of}" if m.test else ""
    if m.value is None or math.isnan(m.value):
        return f"{c.what}{where}: the data cannot tell ({c.asked} is asked){rest}."
    interval = ""
    if m.low is not None and m.high is not None:
        interval = f" (95 % interval {_bare(in_words(c, m.low), in_words(c, m.high))} to {in_words(c, m.high)}{_BY[c.by]})"
    if meets(c, m) is None:
        return f"{c.what}{where}: {in_words(c, m.value)}{interval}, too wide to tell ({c.asked} is asked){rest}."
    asked = f"{c.asked} is asked" if c.judged else f"{c.asked}, not judged"
    return f"{c.what}{where}: {in_words(c, m.value)}{interval}, {asked}{rest}."


_BY = {By.VALUE: "", By.WHOLE: ", all of which counts", By.ANY: ", any part of which counts"}


def _bare(low: str, high: str) -> str:
    """The lower end without its unit where the upper one has the same."""
    unit = high.split(" ", 1)[1] if " " in high else ""
    return low.removesuffix(f" {unit}") if unit else low
