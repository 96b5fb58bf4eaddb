r"""A number over years: level, trend, yearly wave and random walks, seen by campaigns whose errors partly go together.

.. math:: y_i = a + s t_i + \sum_k 1(t_i > t_k)(d_k + s_k (t_i - t_k)) + A \cos(\omega t_i - \phi) + W(t_i)
    + \int_0^{t_i} S \, dt + c_{p(i)} + e_i

W and S are random walks of level and trend; c the error of the calibration, the same until a sensor is changed; e the
campaign's own error and the scatter from day to day; t_k steps. This is the model of Kalman's filter and its smoother,
solved at once for all dates instead of date by date (a test holds it against the filter). Deviations of walks, wave and
scatter are not known: the posterior is summed over a grid of them, so that an interval of few campaigns is not that of
the likeliest of them.
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
WALKS, TRENDS, WAVES, SCATTERS = 5, (0.0, 0.3), (0.3, 0.7, 1.3), (0.0, 0.5, 1.0, 2.0)
"""The grid: steps of the walk between its least and most; walk of the trend a year, wave and scatter in parts of those
of the table."""
STEP_GAIN = 6.0
"""Logarithm of the evidence for a step over none from which it is taken for one."""
MOST_STEPS = 6
BISECTIONS = 50
LEAST = 1e-18
"""Least variance."""


class Point(NamedTuple):
    """What a campaign says: t [yr]; y; deviations of its own error and of that of the calibration; period: number of
    the calibration in use."""

    t: float
    y: float
    own: float
    common: float
    period: int = 0


class Target(NamedTuple):
    """A linear function of what is followed: columns (m,) of the regression, weights (k,) of the walks at times (k,),
    or the trend's walk at a time."""

    columns: FloatArray
    weights: FloatArray
    times: FloatArray
    trend: float | None = None


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


def trend_covariance(s: FloatArray, t: FloatArray) -> FloatArray:
    """The same of what a walk of the trend has added to the level."""
    a, b = np.abs(s)[:, None], np.abs(t)[None, :]
    least, most = np.minimum(a, b), np.maximum(a, b)
    return np.where(s[:, None] * t[None, :] > 0.0, least**2 * (3.0 * most - least) / 6.0, 0.0)


class Grid(NamedTuple):
    """The cells of the grid (g,): deviations of the walks of level and trend and of the yearly wave, and weights; K^-1
    (g, n, n) and K^-1 y (g, n)."""

    walk: FloatArray
    trend: FloatArray
    wave: FloatArray
    weight: FloatArray
    inverse: FloatArray
    solved: FloatArray


@dataclass(frozen=True)
class Course:
    """The posterior of one number after some campaigns. steps: times [yr] of steps, stated or found."""

    of: Followed
    points: tuple[Point, ...]
    stated: tuple[float, ...] = ()
    found: tuple[float, ...] = field(init=False)
    _grid: Grid = field(init=False, repr=False)

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

    def _prior(self, wave: FloatArray) -> FloatArray:
        """Variances of the regression before any data (g, m); wave: deviations of the yearly one (g,)."""
        k, rate = len(self.steps), self.of.rate
        alike = np.array([LEVEL, rate, *[STEP] * k, *[rate] * k])
        return np.column_stack([np.tile(alike, (len(wave), 1)), wave, wave]) ** 2

    def _solve(self) -> tuple[Grid, FloatArray]:
        """The grid, and the logarithm of the evidence for a step before each campaign (n,)."""
        t, of = self.t, self.of
        y, own, common = (np.array([p[i] for p in self.points]) for i in (1, 2, 3))
        period = np.array([p.period for p in self.points])
        B, C = self.columns(t), np.outer(common, common) * (period[:, None] == period[None, :])
        axes = product(np.geomspace(*of.walk, WALKS), TRENDS, WAVES, SCATTERS)
        walk, trend, wave, scatter = np.array(list(axes)).T * np.array([[1.0], [of.rate], [of.season], [of.scatter]])
        K = (B * self._prior(wave)[:, None, :]) @ B.T + C
        K += _each(walk**2) * walk_covariance(t, t) + _each(trend**2) * trend_covariance(t, t)
        K[:, np.arange(len(t)), np.arange(len(t))] += own**2 + scatter[:, None] ** 2
        inverse = np.linalg.inv(K)
        solved = inverse @ y
        evidence = -0.5 * (np.linalg.slogdet(K)[1] + solved @ y)
        weight = np.exp(evidence - evidence.max())
        weight /= weight.sum()
        gains = _gain(inverse, solved, t, of.rate)
        top = gains.max(axis=0)
        return Grid(walk, trend, wave, weight, inverse, solved), top + np.log(weight @ np.exp(gains - top))

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
        t, x, w = self.t, target.times, target.weights
        B = self.columns(t)
        level, trend = w @ walk_covariance(x, t), w @ trend_covariance(x, t)
        own, bent = w @ walk_covariance(x, x) @ w, w @ trend_covariance(x, x) @ w
        if (at := target.trend) is not None:  # covariance of the trend's walk with what it has added
            trend, bent = np.where(t < at, 0.5 * t**2, at * (t - 0.5 * at)), np.asarray(at)
        grid, prior = self._grid, self._prior(self._grid.wave)
        k = (target.columns * prior) @ B.T + np.outer(grid.walk**2, level) + np.outer(grid.trend**2, trend)
        total = prior @ target.columns**2 + grid.walk**2 * own + grid.trend**2 * bent
        variance = total - np.einsum("gi,gij,gj->g", k, grid.inverse, k, optimize=True)
        return Mixture(grid.weight, np.sum(k * grid.solved, axis=1), np.sqrt(np.maximum(variance, LEAST)))

    def value(self, t: float, *, season: bool = True) -> Mixture:
        """The number at a time [yr]; without the yearly wave its level."""
        at = np.array([t])
        return self.posterior(Target(self.columns(at, season=season)[0], np.ones(1), at))

    def change(self, since: float, until: float, *, season: bool = False) -> Mixture:
        """Change of the level between two times [yr], or of the number with its yearly wave."""
        at = np.array([until, since])
        late, early = self.columns(at, season=season)
        return self.posterior(Target(late - early, np.array([1.0, -1.0]), at))

    def trend(self, t: float) -> Mixture:
        """Trend at a time [1/yr]: what is not the walk of the level."""
        k = len(self.steps)
        columns = np.array([0.0, 1.0, *[0.0] * k, *[float(t > s) for s in self.steps], 0.0, 0.0])
        return self.posterior(Target(columns, np.zeros(0), np.zeros(0), t))


def _each(x: FloatArray) -> FloatArray:
    """Numbers of the cells (g,), to multiply matrices with."""
    return x[:, None, None]


def _gain(inverse: FloatArray, solved: FloatArray, t: FloatArray, rate: float) -> FloatArray:
    """Logarithm of the evidence for one more step and change of the trend over none, before each campaign (g, n)."""
    jump = STEP * (t[:, None] >= t[None, :]).astype(np.float64)
    bend: FloatArray = rate * np.maximum(t[:, None] - t[None, :], 0.0)
    Kj, Kb = inverse @ jump, inverse @ bend
    jj, jb, bb = (np.sum(x * y, axis=1) for x, y in ((jump, Kj), (jump, Kb), (bend, Kb)))
    determinant = (1.0 + jj) * (1.0 + bb) - jb**2
    u, v = solved @ jump, solved @ bend
    fit = ((1.0 + bb) * u**2 - 2.0 * jb * u * v + (1.0 + jj) * v**2) / determinant
    return np.asarray(0.5 * (fit - np.log(determinant)))


def course(of: Followed, points: Sequence[Point], stated: Sequence[float] = ()) -> Course:
    """Follow a number through campaigns in the order of their dates.

    Parameters: points of the campaigns; stated: times of repairs that people have stated [yr].
    """
    return Course(of, tuple(sorted(points)), tuple(s for s in stated if points[0].t <= s))
