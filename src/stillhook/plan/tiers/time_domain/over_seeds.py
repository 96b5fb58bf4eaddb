"""From runs with different seeds to a number of the phase that they are of, with the interval that so few of them leave
open."""

from __future__ import annotations

import math

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.plan.definition.rules import Level
from stillhook.statistics.estimate import ENDS, Estimate
from stillhook.statistics.extremes import FEWEST_MAXIMA, MPM, P90, gumbel

QUANTILE = {Level.MPM: MPM, Level.P90: P90}
"""Part of all phases that stay below a level."""
ALIKE = 1e-6
"""Range of maxima over their size below which they are one value: a relief valve that held all of them."""

BEYOND = Estimate(math.inf, math.inf, math.inf)
"""What stands for a number of runs that failed."""


def largest(maxima: FloatArray, level: Level, times: float = 1.0) -> Estimate:
    r"""Largest value of a phase that holds `times` such runs, from the largest of each run (n,): Gumbel of maximum
    likelihood.

    .. math:: P(X_{phase} \le x) = P(X_{run} \le x)^{times}, \qquad x_q = \mu - \beta \ln(-\ln q^{1/times}) = \ldots +
    \beta \ln times

    so that the most probable largest of the phase is mu + beta ln(times). The runs are taken as independent, which they
    are. Where all maxima are one value that value; of fewer than five the largest, without an interval.
    """
    x = np.asarray(maxima, dtype=np.float64)
    if np.isinf(x).any():
        return BEYOND
    top = float(x.max())
    if len(x) < FEWEST_MAXIMA:
        return Estimate(top, n=len(x))
    if np.ptp(x) <= ALIKE * np.abs(x).max():
        return Estimate(top, top, top, len(x))
    q = QUANTILE[level] ** (1.0 / max(times, 1.0))
    return gumbel(x).estimate(q)


def passage(maxima: FloatArray, level: Level, times: float = 1.0) -> Estimate:
    """Largest value of something that passes once, a surface or a touch-down, or `times` times, from the largest of
    each run (n,).

    What happens in a few seconds follows no extreme-value law: which wave meets the payload scatters, slam grows with
    the square of the speed, and a Gumbel fit to the bulk tells a 90 % level 7 to 13 % low (480 passages of the
    example). So it is the runs' own quantile, at rank q (n + 1), with the order statistics between which the true one
    lies with 95 %; inf above where even the largest run may lie below it (fewer than 36 runs at 90 %). Where no run
    lies beyond the level, the larger of the largest run and the Gumbel distribution.
    """
    x = np.sort(np.asarray(maxima, dtype=np.float64))
    n, q = len(x), QUANTILE[level] ** (1.0 / max(times, 1.0))
    if np.isinf(x).any() or n < FEWEST_MAXIMA or np.ptp(x) <= ALIKE * np.abs(x).max():
        return largest(x, level, times)
    if q * (n + 1) > n:
        fit = largest(x, level, times)
        return Estimate(max(fit.value, float(x[-1])), fit.low, max(fit.high, float(x[-1])), n)
    below = np.cumsum([math.comb(n, k) * q**k * (1.0 - q) ** (n - k) for k in range(n)])
    first, last = int(np.searchsorted(below, ENDS[0], side="right")), int(np.searchsorted(below, ENDS[1]))
    low, high = float(x[max(first - 1, 0)]), float(x[last]) if last < n else math.inf
    return Estimate(float(np.quantile(x, q, method="weibull")), low, high, n)


def mean(values: FloatArray) -> Estimate:
    """The mean over runs (n,), with the normal interval of a mean."""
    return Estimate.of_mean(np.asarray(values, dtype=np.float64))


def chance(hits: int, n: int, times: float = 1.0) -> Estimate:
    """Chance that a phase of `times` runs sees what `hits` of n runs saw; Wilson's interval."""
    share = Estimate.of_share(hits, n)
    value, low, high = (1.0 - (1.0 - x) ** max(times, 1.0) for x in (share.value, share.low, share.high))
    return Estimate(value, low, high, n)
