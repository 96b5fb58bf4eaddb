"""A number of step 5 over all load cases, with the scatter between the cases in its interval."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.statistics.between_cases import extremes, half_of_mean
from stillhook.statistics.block_bootstrap import Statistic, interval
from stillhook.statistics.estimate import Estimate

Scale = tuple[Callable[[float], float], Callable[[float], float]]
AS_IT_IS: Scale = (float, float)
FISHER: Scale = (math.atanh, math.tanh)
"""Scale on which correlations scatter evenly. Source: Fisher 1915."""
ENOUGH = 4
"""Least number of load cases to estimate their scatter: Student's t is 12.7 with two, 4.3 with three, 3.2 with
four, as in paper F."""
ONE = 1.0 - 1e-9
"""Largest correlation that has a place on it."""


@dataclass(frozen=True)
class OverCases:
    """pooled: the number over all samples, with an interval that holds the scatter between the load cases; cases: the
    same of each case alone, from its own samples."""

    pooled: Estimate
    cases: Mapping[str, Estimate]

    def extremes(self, words: Callable[[float], str]) -> str:
        """The smallest and the largest case in words, "0.37 cm (4) to 1.48 cm (3) by load case"; a remark where there
        is only one."""
        values = {name: case.value for name, case in self.cases.items() if math.isfinite(case.value)}
        if len(values) < 2:
            return "one load case: its interval does not include the scatter between load cases"
        few = f"; {len(values)} cases determine the scatter between cases poorly, test {ENOUGH} or more"
        return f"{extremes(values, words)} by load case{few if len(values) < ENOUGH else ''}"


def over_cases(
    statistic: Statistic,
    parts: Mapping[str, Sequence[FloatArray]],
    *,
    at_least: int,
    bounds: tuple[float, float] = (-math.inf, math.inf),
    scale: Scale = AS_IT_IS,
) -> OverCases:
    """A statistic of all parts together, by load case.

    Parameters: parts of each load case, as of `block_bootstrap.interval`; scale: a function of the statistic on which
    cases scatter evenly, and its inverse. The interval is that of the blocks, widened to that of a mean of the cases,
    each with the weight of its samples and each with a true value of its own.
    """
    filled = {name: [p for p in rows if len(p)] for name, rows in parts.items()}
    filled = {name: rows for name, rows in filled.items() if rows}
    cases = {name: interval(statistic, rows, at_least=at_least, bounds=bounds) for name, rows in filled.items()}
    total = interval(statistic, [p for rows in filled.values() for p in rows], at_least=at_least, bounds=bounds)
    known = [name for name, case in cases.items() if math.isfinite(case.value)]
    if len(known) < 2 or not math.isfinite(total.value):
        return OverCases(total, cases)
    to, back = scale
    centre = _on(to, total.value)
    weights = [sum(map(len, filled[name])) for name in known]
    half = half_of_mean(
        [_on(to, cases[name].value) for name in known], [_half(cases[name], to) for name in known], weights
    )
    low, high = (min(max(back(centre + sign * half), bounds[0]), bounds[1]) for sign in (-1.0, 1.0))
    low, high = np.fmin(low, total.low), np.fmax(high, total.high)
    return OverCases(Estimate(total.value, float(low), float(high), total.n), cases)


def _half(case: Estimate, to: Callable[[float], float]) -> float:
    """The longer side of an interval on its scale: the other may end at a bound. NaN where it has no interval."""
    centre = _on(to, case.value)
    return float(np.fmax(_on(to, case.high) - centre, centre - _on(to, case.low)))


def _on(to: Callable[[float], float], x: float) -> float:
    if not math.isfinite(x):
        return math.nan
    return to(min(max(x, -ONE), ONE)) if to is math.atanh else to(x)
