r"""A number over years: level, trend, yearly wave and random walk, seen by campaigns whose errors partly go together.

.. math:: y_i = a + s t_i + \sum_k 1(t_i > t_k)(d_k + s_k (t_i - t_k)) + A \cos(\omega t_i - \phi) + W(t_i) + c_{p(i)}
    + e_i

W is a random walk; c the error of the calibration, the same until a sensor is changed; e the campaign's own error and
the scatter from day to day; t_k steps. This is the local level model of Kalman's filter and its smoother, solved at
once for all dates instead of date by date (a test holds it against the filter). Deviations of walk, wave and scatter
are not known: the posterior is summed over a grid of them, so that an interval of few campaigns is not that of the
likeliest of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from stillhook.base.arrays import FloatArray
from stillhook.live.condition.followed import Followed
from stillhook.statistics.estimate import ENDS, Estimate

YEAR = 365.25
"""Days."""
LEVEL, STEP = 0.5, 0.3
"""Deviation of the level, and of a step, before any data [-]."""
WALKS, WAVES, SCATTERS = 6, (0.3, 0.7, 1.3), (0.0, 0.5, 1.0, 2.0)
"""The grid: steps of the walk between its least and most; wave and scatter in parts of those of the table."""
STEP_GAIN = 6.0
"""Logarithm of the evidence for a step over none from which it is taken for one."""
MOST_STEPS = 6
BISECTIONS = 60


class Point(NamedTuple):
    """What a campaign says: t [yr]; y; deviations of its own error and of that of the calibration; period: number of
    the calibration in use."""

    t: float
    y: float
    own: float
    common: float
    period: int = 0


class Target(NamedTuple):
    """A linear function of what is followed: columns (m,) of the regression, weights (k,) of the walk at times (k,)."""

    columns: FloatArray
    weights: FloatArray
    times: FloatArray


@dataclass(frozen=True)
class Mixture:
    """Posterior of a number: normal distributions with weights."""

    weight: FloatArray
    mean: FloatArray
    deviation: FloatArray

    def above(self, x: float) -> float:
        """Probability that the number is above x."""
        return float(self.weight @ ndtr((self.mean - x) / self.deviation))

    def quantile(self, share: float) -> float:
        """The value below which the number is with this probability."""
        low, high = (float(f(self.mean + k * self.deviation)) for f, k in ((np.min, -12.0), (np.max, 12.0)))
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.above(middle) > 1.0 - share else (low, middle)
        return 0.5 * (low + high)

    def estimate(self, n: int) -> Estimate:
        """Mean and 95 % interval."""
        return Estimate(float(self.weight @ self.mean), self.quantile(ENDS[0]), self.quantile(ENDS[1]), n)


def walk_covariance(s: FloatArray, t: FloatArray) -> FloatArray:
    """Covariance of a random walk of unit deviation a year, zero at t = 0, at times (n,) and (m,) [yr]."""
    a, b = s[:, None], t[None, :]
    return 0.5 * (np.abs(a) + np.abs(b) - np.abs(a - b))


@dataclass(frozen=True)
class Course:
    """The posterior of one number after some campaigns. steps: times [yr] of steps, stated or found."""

    of: Followed
    points: tuple[Point, ...]
    stated: tuple[float, ...] = ()
    found: tuple[float, ...] = field(init=False)
    _grid: list[tuple[float, float, FloatArray, FloatArray, FloatArray]] = field(init=False, repr=False)
    """Of each cell: walk, wave, weight, K^-1, K^-1 y."""

    def __post_init__(self) -> None:
        found: tuple[float, ...] = ()
        while True:
            object.__setattr__(self, "found", found)
            grid, gains = self._solve()
            object.__setattr__(self, "_grid", grid)
            more = self._step(gains)
            if more is None:
                return
            found = tuple(sorted((*found, more)))

    @property
    def t(self) -> FloatArray:
        return np.array([p.t for p in self.points])

    @property
    def steps(self) -> tuple[float, ...]:
        """Times of all steps [yr], in order."""
        return tuple(sorted({*self.stated, *self.found}))

    def columns(self, t: FloatArray, *, season: bool = True) -> FloatArray:
        """Regression (n, m) at times [yr]: level, trend, steps and their changes of the trend, yearly wave."""
        after = [np.maximum(t - k, 0.0) for k in self.steps]
        jumps = [(t > k).astype(float) for k in self.steps]
        on = 1.0 if season else 0.0
        wave = (on * np.cos(2.0 * np.pi * t), on * np.sin(2.0 * np.pi * t))
        return np.column_stack([np.ones_like(t), t, *jumps, *after, *wave])

    def _prior(self, wave: float) -> FloatArray:
        k, rate = len(self.steps), self.of.rate
        return np.array([LEVEL, rate, *[STEP] * k, *[rate] * k, wave, wave]) ** 2

    def _solve(self) -> tuple[list[tuple[float, float, FloatArray, FloatArray, FloatArray]], FloatArray]:
        """The cells of the grid, and the logarithm of the evidence for a step before each campaign (n,)."""
        t, of = self.t, self.of
        y, own, common = (np.array([p[i] for p in self.points]) for i in (1, 2, 3))
        period = np.array([p.period for p in self.points])
        B, W = self.columns(t), walk_covariance(t, t)
        C = np.outer(common, common) * (period[:, None] == period[None, :])
        jump = STEP * (t[:, None] >= t[None, :]).astype(np.float64)
        bend: FloatArray = of.rate * np.maximum(t[:, None] - t[None, :], 0.0)
        cells, evidence, gains = [], [], []
        for q, a, w in product(np.geomspace(*of.walk, WALKS), WAVES, SCATTERS):
            K = (B * self._prior(a * of.season)) @ B.T + q**2 * W + C + np.diag(own**2 + (w * of.scatter) ** 2)
            inverse = np.linalg.inv(K)
            solved = inverse @ y
            evidence.append(-0.5 * (np.linalg.slogdet(K)[1] + y @ solved))
            gains.append(_gain(inverse, solved, jump, bend))
            cells.append((float(q), a * of.season, inverse, solved))
        weight = np.exp(np.array(evidence) - max(evidence))
        weight /= weight.sum()
        top = np.max(gains, axis=0)
        gain = top + np.log(weight @ np.exp(np.array(gains) - top))
        return [(q, a, np.array(p), *rest) for p, (q, a, *rest) in zip(weight, cells, strict=True)], gain

    def _step(self, gains: FloatArray) -> float | None:
        """Time of a step that the data show and that is not known yet: in the middle between two campaigns, with at
        least two campaigns after it."""
        t = self.t
        if len(t) < 4 or len(self.found) >= MOST_STEPS:
            return None
        possible = np.zeros(len(t), dtype=bool)
        possible[1:-1] = np.diff(t)[:-1] > 0.0
        gains = np.where(possible, gains, -np.inf)
        k = int(np.argmax(gains))
        return float(0.5 * (t[k - 1] + t[k])) if gains[k] > STEP_GAIN else None

    def posterior(self, target: Target) -> Mixture:
        """Posterior of a linear function."""
        t = self.t
        B = self.columns(t)
        across = target.weights @ walk_covariance(target.times, t) if len(target.times) else np.zeros_like(t)
        own = (
            target.weights @ walk_covariance(target.times, target.times) @ target.weights if len(target.times) else 0.0
        )
        weight, mean, deviation = [], [], []
        for q, a, p, inverse, solved in self._grid:
            prior = self._prior(a)
            k = (target.columns * prior) @ B.T + q**2 * across
            variance = float((target.columns**2) @ prior + q**2 * own - k @ inverse @ k)
            weight.append(float(p))
            mean.append(float(k @ solved))
            deviation.append(max(variance, 1e-18) ** 0.5)
        return Mixture(np.array(weight), np.array(mean), np.array(deviation))

    def value(self, t: float, *, season: bool = True) -> Mixture:
        """The number at a time [yr]; without the yearly wave its level."""
        at = np.array([t])
        return self.posterior(Target(self.columns(at, season=season)[0], np.ones(1), at))

    def change(self, since: float, until: float) -> Mixture:
        """Change of the level between two times [yr]."""
        at = np.array([until, since])
        late, early = self.columns(at, season=False)
        return self.posterior(Target(late - early, np.array([1.0, -1.0]), at))

    def trend(self, t: float) -> Mixture:
        """Trend at a time [1/yr]: what is not the random walk's."""
        k = len(self.steps)
        columns = np.array([0.0, 1.0, *[0.0] * k, *[float(t > s) for s in self.steps], 0.0, 0.0])
        return self.posterior(Target(columns, np.zeros(0), np.zeros(0)))


def _gain(inverse: FloatArray, solved: FloatArray, jump: FloatArray, bend: FloatArray) -> FloatArray:
    """Logarithm of the evidence for one more step and change of the trend over none, for each column (n,)."""
    Kj, Kb = inverse @ jump, inverse @ bend
    jj, jb, bb = (np.sum(x * y, axis=0) for x, y in ((jump, Kj), (jump, Kb), (bend, Kb)))
    determinant = (1.0 + jj) * (1.0 + bb) - jb**2
    u, v = jump.T @ solved, bend.T @ solved
    fit = ((1.0 + bb) * u**2 - 2.0 * jb * u * v + (1.0 + jj) * v**2) / determinant
    return np.asarray(0.5 * (fit - np.log(determinant)))


def course(of: Followed, points: Sequence[Point], stated: Sequence[float] = ()) -> Course:
    """Follow a number through campaigns in the order of their dates.

    Parameters: points of the campaigns; stated: times of repairs that people have stated [yr].
    """
    return Course(of, tuple(sorted(points)), tuple(s for s in stated if points[0].t <= s))
