"""Correlation of simulated and measured control error over the load cases, with its interval.

Of each case Fisher's z = atanh(r), on which correlations scatter evenly, with the deviation of its own blocks of time;
over the cases the mean of z, with the scatter between cases.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.statistics.estimate import LEAST, NORMAL_95, Estimate, mean_of_few, t_factor
from stillhook.statistics.time_lag import dot

SCATTER = 0.6
"""Scale of the prior of the scatter of z between load cases of one crane: half of its weight is below 0.4, 5 % above
1.2. About r = 0.95 a scatter of 0.5 is 0.87 to 0.98. Independent cranes have 0.3 to 0.6 (docs/validation,
error-correlation)."""
HIGHEST = 1.0 - 1e-9
"""Largest correlation that has a z."""


@dataclass(frozen=True)
class CaseCorrelation:
    """One load case. r: correlation [-]; deviation of its z by sampling; effective: number of independent samples that
    it is from."""

    r: float
    deviation: float
    effective: float

    @property
    def z(self) -> float:
        """Fisher's z [-]."""
        return _z(self.r)

    @property
    def estimate(self) -> Estimate:
        """The correlation with the interval of the case alone."""
        low, high = (math.tanh(self.z + sign * NORMAL_95 * self.deviation) for sign in (-1.0, 1.0))
        return Estimate(self.r, low, high, self.effective)


def _z(r: float) -> float:
    return math.atanh(min(max(r, -HIGHEST), HIGHEST))


def case_correlation(parts: Sequence[FloatArray], block: int) -> CaseCorrelation | None:
    """Correlation of the two columns over the unbroken parts (n, 2) of one load case, each about its own mean; None
    where one column does not move.

    The sampling variance of z is that of the mean of its influence function, in u and v, the columns over their
    standard deviations,

    .. math:: psi = (u v - r (u^2 + v^2) / 2) / (1 - r^2)

    from its sums over blocks of time [samples], some waves long: errors and what they differ by may be autocorrelated
    in any way within a block. Student's factor of the number of blocks less one is in the deviation. (The memory of psi
    read off its autocovariance is too short in 200 s of narrow-banded waves: it passes zero within each wave.)
    Source: Devlin, Gnanadesikan and Kettenring 1975, Biometrika 62, 531-545 (influence function of z).
    """
    centred = [np.asarray(p, dtype=np.float64) - np.mean(p, axis=0) for p in parts if len(p) > 1]
    if not centred:
        return None
    rows = np.concatenate(centred)
    size = np.sqrt(np.mean(rows**2, axis=0))
    if not (size > 0.0).all():
        return None
    r = float(np.mean((rows[:, 0] / size[0]) * (rows[:, 1] / size[1])))
    bounded = min(max(r, -HIGHEST), HIGHEST)
    influence = [_influence(p / size, bounded) for p in centred]
    least = 1 if len(influence) > 1 else 2
    pieces = [x for p in influence for x in np.array_split(p, max(least, round(len(p) / block)))]
    sums, count = np.array([float(x.sum()) for x in pieces]), len(pieces)
    variance = count / (count - 1) * dot(sums, sums) / len(rows) ** 2
    effective = float(np.mean(np.concatenate(influence) ** 2)) / max(variance, LEAST**2)
    return CaseCorrelation(r, math.sqrt(variance) * t_factor(count - 1) / NORMAL_95, min(effective, len(rows)))


def _influence(x: FloatArray, r: float) -> FloatArray:
    u, v = x[:, 0], x[:, 1]
    return np.asarray((u * v - 0.5 * r * (u**2 + v**2)) / (1.0 - r**2))


def over_cases(cases: Mapping[str, CaseCorrelation]) -> Estimate:
    """Correlation that the load cases have in the mean of their z, with the scatter between them in its interval; one
    case alone: its own interval, for it shows no scatter."""
    if len(cases) == 1:
        return next(iter(cases.values())).estimate
    e = mean_of_few([c.z for c in cases.values()], [c.deviation for c in cases.values()], SCATTER)
    return Estimate(math.tanh(e.value), math.tanh(e.low), math.tanh(e.high), sum(c.effective for c in cases.values()))
