"""A number with its 95 % interval, however it was obtained, and the scatter between load cases in it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import FloatArray
from stillhook.statistics.time_lag import dot

CONFIDENCE = 0.95
"""Confidence of every interval that Stillhook states."""
ENDS = (0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE)
"""Quantiles at the ends of such an interval."""
NORMAL_95 = 1.959963984540054
"""Half width of such an interval of a normal distribution, in standard deviations."""
HALVINGS = 60
"""Steps by which the variance between cases is bracketed: to a part in 1e18 of the widest."""
LEAST = 1e-12
"""Least deviation within a case, so that one without any does not weigh without end."""
GRID = 400
"""Values of tau that are summed over."""
REACH = 5.0
"""Largest tau of the sum, in scales of its prior: beyond are 6e-7 of it."""
BEYOND = 12.0
"""Reach of the bracket of an end of the interval, in standard deviations."""


def t_factor(dof: float) -> float:
    """Half width of a 95 % interval in standard uncertainties: two-sided quantile of Student's distribution."""
    from scipy.special import stdtrit  # heavy: only where something is fitted

    return float(stdtrit(max(dof, 1.0), ENDS[1]))


@dataclass(frozen=True)
class Estimate:
    """A number and the ends of its 95 % interval, sampling and structural errors together, all in one unit.

    low, high: infinite where the interval is open, NaN where the samples are too few for one. n: independent samples
    that it is from (blocks, runs, draws). structural: half width due to the form of a law. half: the longer side of the
    interval.
    """

    value: float
    low: float = math.nan
    high: float = math.nan
    n: float = 0
    structural: float = 0.0
    half: float = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        self._set_half(max(self.high - self.value, self.value - self.low))

    def _set_half(self, half: float) -> None:
        object.__setattr__(self, "half", half)

    @classmethod
    def around(cls, value: float, half: float, n: float = 0, structural: float = 0.0) -> Estimate:
        """Of a symmetric interval of this half width."""
        estimate = cls(value, value - half, value + half, n, structural)
        estimate._set_half(half)  # to the last bit, which the ends do not keep
        return estimate

    @classmethod
    def of_mean(cls, values: FloatArray, factor: float = NORMAL_95) -> Estimate:
        """Mean of independent values (n,), with `factor` times its standard error; no interval for fewer than
        two."""
        n = len(values)
        mean = float(values.mean()) if n else math.nan
        if n < 2 or not math.isfinite(mean):
            return cls(mean, n=n)
        return cls.around(mean, factor * float(values.std(ddof=1)) / math.sqrt(n), n)

    @classmethod
    def of_draws(cls, value: float, draws: FloatArray, n: float = 0) -> Estimate:
        """The ends are quantiles of draws (m,) of the value, such as those of a bootstrap; NaN draws do not count."""
        low, high = np.nanquantile(draws, ENDS)
        return cls(value, float(low), float(high), n)

    @classmethod
    def of_share(cls, hits: int, n: int) -> Estimate:
        """Share hits/n of independent cases; Wilson's interval."""
        p, z2 = hits / n, NORMAL_95**2
        middle = (2.0 * n * p + z2) / (2.0 * (n + z2))
        half = NORMAL_95 / (2.0 * (n + z2)) * math.sqrt(4.0 * n * p * (1.0 - p) + z2)
        return cls(p, middle - half if hits > 0 else 0.0, middle + half if hits < n else 1.0, n)

    def contains(self, value: float) -> bool:
        """Whether the interval holds a value."""
        return self.low <= value <= self.high

    def scaled(self, factor: float = 1.0, offset: float = 0.0) -> Estimate:
        """factor times it plus an offset; the ends stay in order."""
        low, high = sorted((factor * self.low + offset, factor * self.high + offset))
        return Estimate(factor * self.value + offset, low, high, self.n, abs(factor) * self.structural)

    def to_dict(self, name: str = "value") -> dict[str, float]:
        """Plain data: the value under a name, and the ends."""
        return {name: self.value, "low": self.low, "high": self.high}


def between(values: ArrayLike, deviations: ArrayLike) -> float:
    """Standard deviation of the true values of cases about their mean; 0 where their own deviations explain that they
    differ.

    Parameters: values (k,) of the cases; deviations (k,) of their sampling errors, in the same unit. Found where the
    weighted sum of squares about the weighted mean is its expectation k - 1 (Paule and Mandel). Fewer than two cases:
    0.
    """
    y, s = np.asarray(values, dtype=np.float64), np.maximum(np.asarray(deviations, dtype=np.float64), LEAST)
    k = len(y)
    if k < 2 or _excess(y, s, 0.0) <= k - 1:
        return 0.0
    low, high = 0.0, float(np.ptp(y)) ** 2 * k
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _excess(y, s, middle) > k - 1 else (low, middle)
    return math.sqrt(high)


def _excess(y: FloatArray, s: FloatArray, variance: float) -> float:
    w = 1.0 / (s**2 + variance)
    off = y - dot(w, y) / w.sum()
    return dot(w, off**2)


def random_effects(values: ArrayLike, halves: ArrayLike) -> tuple[float, float]:
    """Mean of several cases and half of its 95 % interval, with the scatter between the cases; never narrower than
    fixed effects.

    Parameters: values (k,); halves (k,) of their own 95 % intervals. Cases are weighted by sampling variance and
    scatter together. One case: as it is, for it gives no scatter.
    """
    y, half = np.asarray(values, dtype=np.float64), np.maximum(np.asarray(halves, dtype=np.float64), NORMAL_95 * LEAST)
    s = half / NORMAL_95
    w = 1.0 / (s**2 + between(y, s) ** 2)
    return dot(w, y) / float(w.sum()), max(half_of_mean(y, half, w), NORMAL_95 / math.sqrt(float(np.sum(s**-2.0))))


def half_of_mean(values: ArrayLike, halves: ArrayLike, weights: ArrayLike) -> float:
    """Half of the 95 % interval of a mean of cases with these weights, such as their lengths, with the scatter between
    the cases.

    Parameters: values, halves (k,) of the cases and their own 95 % intervals (NaN: not known; what such a case differs
    by is scatter); weights (k,), of any sum. Student's t of k - 1 degrees of freedom on the deviation of the cases
    about their mean (Hartung, Knapp, Sidik and Jonkman), never less than the sampling errors alone give. One case: its
    own.
    """
    y, a, half = (np.asarray(x, dtype=np.float64) for x in (values, weights, halves))
    s, a, k = np.maximum(np.where(np.isfinite(half), half, 0.0) / NORMAL_95, LEAST), a / a.sum(), len(y)
    sampling = NORMAL_95 * math.sqrt(float(np.sum(a**2 * s**2)))
    if k < 2:
        return sampling
    variance = s**2 + between(y, s) ** 2
    w = 1.0 / variance
    apart = dot(w, (y - dot(w, y) / float(w.sum())) ** 2) / (k - 1)
    return max(t_factor(k - 1) * math.sqrt(min(apart, 1.0) * float(np.sum(a**2 * variance))), sampling)


def extremes(values: Mapping[str, float], words: Callable[[float], str]) -> str:
    """The smallest and the largest of several cases with their names, "1.08 (limits) to 1.16 (3)"; "" for one case."""
    if len(values) < 2:
        return ""
    low, high = min(values, key=lambda name: values[name]), max(values, key=lambda name: values[name])
    return f"{words(values[low])} ({low}) to {words(values[high])} ({high})"


def mean_of_few(values: ArrayLike, deviations: ArrayLike, scatter: float) -> Estimate:
    """Mean mu of a few cases' true values and a 95 % interval that stays usable with two to four of them.

    Parameters: values (k,) of the cases, deviations (k,) of their sampling errors and scatter, the scale of the
    half-normal prior of tau, all in one unit. Ends: quantiles of the posterior of mu. n: the number of cases.
    Random effects, y_i = mu + tau e_i + s_i f_i with e_i, f_i ~ N(0, 1), a flat prior of mu. Two or three cases hardly
    determine tau: `half_of_mean` multiplies its deviation by Student's t of one or two degrees of freedom (12.7, 4.3).
    What is known of tau beforehand takes the place of that factor.
    Source: Friede, Rover, Wandel and Neuenschwander 2017, "Meta-analysis of few small studies in orphan diseases",
    Research Synthesis Methods 8, 79-91.
    """
    y, s = np.asarray(values, dtype=np.float64), np.maximum(np.asarray(deviations, dtype=np.float64), LEAST)
    tau = REACH * scatter * (np.arange(GRID) + 0.5) / GRID
    variance = s**2 + tau[:, None] ** 2
    w = 1.0 / variance
    total = w.sum(axis=1)
    mu = (w * y).sum(axis=1) / total
    misfit = (w * (y - mu[:, None]) ** 2).sum(axis=1) + np.log(variance).sum(axis=1) + np.log(total)
    log_weight = -0.5 * (misfit + (tau / scatter) ** 2)
    weight = np.exp(log_weight - log_weight.max())
    weight /= weight.sum()
    sd = total**-0.5
    low, high = (_quantile(weight, mu, sd, end) for end in ENDS)
    return Estimate(float(np.sum(weight * mu)), low, high, len(y))


def _quantile(weight: FloatArray, mu: FloatArray, sd: FloatArray, share: float) -> float:
    """Quantile of a mixture of normal distributions."""
    from scipy.special import ndtr  # heavy: only where logs are compared

    low, high = float(np.min(mu - BEYOND * sd)), float(np.max(mu + BEYOND * sd))
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        below = float(np.sum(weight * ndtr((middle - mu) / sd)))
        low, high = (middle, high) if below < share else (low, middle)
    return 0.5 * (low + high)
