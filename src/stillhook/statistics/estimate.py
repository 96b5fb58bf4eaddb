"""A number with its 95 % interval, however the interval was obtained: from a standard uncertainty, from samples, from a
count."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from stillhook.base.arrays import FloatArray

CONFIDENCE = 0.95
"""Confidence of every interval that Stillhook states."""
ENDS = (0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE)
"""Quantiles at the ends of such an interval."""
NORMAL_95 = 1.959963984540054
"""Half width of such an interval of a normal distribution, in standard deviations."""


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
