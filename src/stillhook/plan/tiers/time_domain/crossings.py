"""Limits of a phase whose runs are judged one by one, beyond a limit or not: no shape of what the winch makes of the
waves is assumed (`stillhook.statistics.crossing_fit`).

How closely a run follows the linear sea differs: friction makes up its own mind. So the feature of a run counts with a
power of 1, of a half, or not at all, whichever the runs make likelier: a power too high takes for scatter what is not,
and puts the limit of runs that lie on one side of it too far to the other.

Runs lie at many heights about the limit, one in each sea. They are put together in bins of height where a level or a
share of time is asked for.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import scipy

from stillhook.base.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.tiers.situations import natural_period
from stillhook.plan.tiers.time_domain.cells import PEAKS, Runs
from stillhook.plan.tiers.time_domain.curves import ROUNDING, ColumnRuns, CurveLimits, bands_at, x_limit_of
from stillhook.plan.tiers.time_domain.lowering import Course, SeaState
from stillhook.response.suspended_load import suspended_load
from stillhook.sea.motion.irregular import synthesis
from stillhook.sea.vessel.boom import TipPoint
from stillhook.sea.vessel.realisation import Amplitudes, Realisation, realise
from stillhook.spec.lift.phase import Phase, PhaseKind
from stillhook.statistics.crossing_fit import CrossingFit, Crossings, fit_crossings
from stillhook.variables import WINDOW

BIN = 0.1
"""Width of a bin of heights, in ln: wide enough for some runs, and narrow against the growth of a number."""
WIDEST = 0.4
"""Half of the 95 % interval of a limit, in ln of the height, beyond which it has no two ends: the runs say how far the
column is inside, and no more."""
SEEDS_OF_SEA = 500
"""Linear seeds of a column that a limit is read from."""


def crosses(phase: Phase) -> bool:
    """Whether the limits of a phase are looked for by crossings: over the seabed, where they are tolerances of the
    payload's motion."""
    return phase.kind in (PhaseKind.STAND_OFF, PhaseKind.LANDING)


class Feature(NamedTuple):
    """A feature of the linear sea by its name, and the power with which it counts in addition to the height."""

    name: str
    power: float = 1.0


NAMES = ("tip speed", "tip speed down", "tip motion", "tip acceleration", "load motion")
"""Features: largest values of the linear sea, which say of two seeds of one sea which asks more of a lift; what the
winch makes of that the runs say."""
HEIGHT = Feature(NAMES[0], 0.0)
"""The height alone."""
CANDIDATES = (*(Feature(name, power) for power in (1.0, 0.5) for name in NAMES), HEIGHT)
"""Features that are tried."""


@dataclass(frozen=True, eq=False)
class ColumnFeatures:
    """Features of a column: of every run, cell by cell by height, and of many seeds for each metre of height."""

    cells: tuple[Features, ...] = field(repr=False)
    many: Features = field(repr=False)


def of_height(columns: Sequence[ColumnRuns]) -> list[ColumnFeatures]:
    """Features that say nothing of columns, for `HEIGHT`."""
    many = {HEIGHT.name: np.ones(SEEDS_OF_SEA)}
    return [
        ColumnFeatures(tuple({HEIGHT.name: np.ones(len(runs["duration"]))} for _, runs in column.cells), many)
        for column in columns
    ]


@dataclass(frozen=True, eq=False)
class CrossingLimits:
    """Limits of one rule by crossings, and the feature that they were read with."""

    limits: CurveLimits
    feature: Feature


def crossing_limits(
    columns: Sequence[ColumnRuns],
    features: Sequence[ColumnFeatures],
    bands: Sequence[tuple[float, float]],
    highest: float,
    expected: FloatArray | None = None,
    *,
    n_draws: int = 0,
    feature: Feature | None = None,
) -> CrossingLimits:
    """Heights at which the share of runs beyond a limit is what the measure allows, in columns that have runs.

    bands of the limit by height [m]; highest sea to analyse [m]; expected
    (c,): limits of a cheaper method [m], NaN where it has none; feature: the one to use, None for that with the largest
    evidence. In a column whose calm is beyond the limit is 0. An interval without two ends leaves no limit (NaN), and
    its lower end.
    """
    p = np.array([1.0 - column.measure.of_part() for column in columns])
    runs = _Stacked.of(columns, features, bands)
    best = feature
    if best is None:
        tried = {each: _fit(columns, features, runs, each, expected, p, alike=True) for each in CANDIDATES}
        best = max(tried, key=lambda each: tried[each].evidence)
    fit = _fit(columns, features, runs, best, expected, p, coarse=n_draws == 0)
    ln_f = best.power * np.log(np.array([each.many[best.name] for each in features]))
    result = fit.limits(ln_f, p, draws=max(n_draws, 100))
    tops = np.array([max((Hs for Hs, _ in column.cells), default=0.0) for column in columns])
    x_limit = np.array([x_limit_of(column.measure, bands[0][1]) for column in columns])
    calm = np.array([column.still for column in columns]) > x_limit * (1.0 + ROUNDING)
    half = 0.5 * (result.high - result.low)
    Hs, low, high = (np.exp(np.minimum(x, 10.0)) for x in (result.value, result.low, result.high))
    draws = np.exp(np.minimum(result.draws, 10.0)) if n_draws else np.full((0, len(columns)), np.nan)
    ends = bands[-2][0] if len(bands) > 1 else math.inf  # where the limit itself ends
    Hs, low, high, draws = (np.minimum(x, ends) for x in (Hs, low, high, draws))
    inside = np.bincount(runs.column, runs.beyond, minlength=len(columns)) == 0
    direct = np.where(inside, np.inf, Hs)
    open_ = (half > WIDEST) & (low <= highest)
    run = np.where(tops >= highest * (1.0 - ROUNDING), np.inf, np.nan)
    Hs = np.where(open_, np.nan, np.where(Hs > highest, run, Hs))
    high = np.where(open_ | (high > highest), np.inf, high)
    half = np.where(open_, np.inf, half)
    for table in (Hs, low, high):
        table[calm] = 0.0
    return CrossingLimits(CurveLimits(Hs, low, high, half, direct, draws), best)


@dataclass(frozen=True, eq=False)
class _Stacked:
    """Runs of all columns, without those of a calm: number of the column, ln of the height, whether a run is beyond the
    limit there (one that failed is), each (n,); and ln of its features by name."""

    column: IntArray
    ln_H: FloatArray
    beyond: BoolArray
    ln_f: Mapping[str, FloatArray]

    @classmethod
    def of(
        cls,
        columns: Sequence[ColumnRuns],
        features: Sequence[ColumnFeatures],
        bands: Sequence[tuple[float, float]],
    ) -> _Stacked:
        rows = [column.by_run for column in columns]
        Hs, x = (np.concatenate(of) for of in zip(*rows, strict=True))
        place = np.repeat(np.arange(len(columns)), [len(of) for of, _ in rows])
        limits = np.array([[x_limit_of(column.measure, limit) for _, limit in bands] for column in columns])
        x_limit = limits[place, bands_at(bands, Hs)]
        of_waves = [
            cell
            for column, each in zip(columns, features, strict=True)
            for (H, _), cell in zip(column.cells, each.cells, strict=True)
            if H > 0.0
        ]
        ln_f = {name: np.log(np.concatenate([cell[name] for cell in of_waves])) for name in features[0].many}
        waves = Hs > 0.0
        return cls(place[waves], np.log(Hs[waves]), (x > x_limit * (1.0 + ROUNDING))[waves], ln_f)


def _fit(
    columns: Sequence[ColumnRuns],
    features: Sequence[ColumnFeatures],
    runs: _Stacked,
    feature: Feature,
    expected: FloatArray | None,
    p: FloatArray,
    *,
    coarse: bool = False,
    alike: bool = False,
) -> CrossingFit:
    name, power = feature
    ln_F = power * runs.ln_f[name] + (1.0 - power) * runs.ln_H
    usual = np.array(
        [power * float(np.quantile(np.log(each.many[name]), 1.0 - q)) for each, q in zip(features, p, strict=True)]
    )
    base = None
    if expected is not None:
        with np.errstate(divide="ignore", invalid="ignore"):
            base = np.where(expected > 0.0, np.log(expected), np.nan) + usual
    crossings = Crossings(runs.column, ln_F, runs.beyond)
    period, angle = (np.array([getattr(column, of) for column in columns]) for of in ("period", "angle"))
    return fit_crossings(crossings, period, angle, base, coarse=coarse, alike=alike)


def binned(cells: Sequence[tuple[float, Runs]]) -> tuple[tuple[float, Runs], ...]:
    """Cells of rising heights, those of about one height as one, at their middle height by runs."""
    groups: list[list[tuple[float, Runs]]] = []
    for Hs, runs in cells:
        if groups and Hs > 0.0 and groups[-1][0][0] > 0.0 and math.log(Hs / groups[-1][0][0]) < BIN:
            groups[-1].append((Hs, runs))
        else:
            groups.append([(Hs, runs)])
    return tuple(_together(group) for group in groups)


def _together(group: Sequence[tuple[float, Runs]]) -> tuple[float, Runs]:
    if len(group) == 1:
        return group[0]
    sizes = np.array([len(runs["duration"]) for _, runs in group])
    Hs = float(np.exp(np.average(np.log([Hs for Hs, _ in group]), weights=sizes)))
    first: Mapping[str, FloatArray] = group[0][1]
    names = [name for name in first if not name.startswith(PEAKS)]
    return Hs, {name: np.concatenate([runs[name] for _, runs in group]) for name in names}


FIRST, EACH = (0.6, 0.85, 1.2, 1.7), (-1.0, -0.35, 0.35, 1.0)
"""Heights of the first runs of a column, over that where its limit is thought to be; and of the following ones about
it, in parts of its uncertainty."""
LEAST_SPREAD, MOST_SPREAD = 0.08, 0.5
"""Ends of that uncertainty, in ln of the height."""
CLIMB = 1.5
"""Factor to the next height where no run was beyond."""
GRID = 0.0025
"""Heights are whole multiples of it [m]: each is a sea of its own, so that a column has as many seeds as runs."""


NEAR = 0.01
"""Part of the highest sea within which a run is one in it."""


def next_heights(Hs: Sequence[float], limit: float, half: float, guess: float, highest: float) -> list[float]:
    """Heights of the next runs of a column [m], of heights that were run; none where the highest sea was run and no run
    was beyond. limit as the runs say it [m] (inf: none was beyond), half of its interval in ln; guess: where it is
    thought to be before any run [m]."""
    if not Hs:
        middle = guess if 0.0 < guess < math.inf else highest if guess == math.inf else 0.5 * highest
        wanted = [middle * f for f in FIRST]
    elif limit < math.inf:
        spread = min(max(half, LEAST_SPREAD), MOST_SPREAD)
        wanted = [limit * math.exp(spread * z) for z in EACH]
    elif max(Hs) >= highest * (1.0 - NEAR):
        return []
    else:
        wanted = [max(Hs) * CLIMB ** (0.5 * (k + 1)) for k in range(2)]
    result: list[float] = []
    for h in wanted:
        at = on_grid(min(h, highest))
        free = (on_grid(at + k * GRID) for n in range(math.ceil(highest / GRID) + 1) for k in (n, -n))
        inside = (z for z in free if 0.0 < z <= highest * (1.0 + ROUNDING) and z not in Hs and z not in result)
        result += [z for z in (next(inside, None),) if z is not None]
    return result


def on_grid(Hs: float) -> float:
    """The nearest height that is run [m]."""
    return round(max(round(Hs / GRID), 0) * GRID, 6)


SAMPLES = 4.0
"""Samples for each second of a series [1/s], at the least: peaks of waves of 4 s and longer are right to 0.3 %."""
DAMPING = 0.1
"""Damping ratio of the load on its wire in the linear motion, some of the drag at limiting motions."""


@dataclass(frozen=True, eq=False)
class Waves:
    """Harmonics of a sea: omega (h,) [rad/s], their numbers (h,), and the standard deviation of each of the two parts
    of the tip's height in them for each metre of the sea's (h,) [-]."""

    omega: FloatArray = field(repr=False)
    harmonic: IntArray = field(repr=False)
    tip: FloatArray = field(repr=False)


@dataclass(frozen=True)
class Place:
    """What features follow from: the vessel's tip in a phase, period of the waves and the part of a run that counts
    [s], natural period of the load [s]."""

    plan: LiftPlan
    at: TipPoint
    repeat: float
    begin: float
    counted: float
    T_0: float

    @classmethod
    def of(cls, plan: LiftPlan, phase: Phase, course: Course) -> Place:
        """That of a phase that is run so; the first window of a peak to peak reaches back before what counts."""
        counts = sum(each.time or 0.0 for each in course.programme[: course.counts])
        begin = max(counts - WINDOW, 0.0)
        hangs = suspended_load(plan.crane, plan.hanging(course.z_0), course.z_0)
        lasts = counts + course.counted - begin
        return cls(plan, plan.tip_of(phase), course.duration, begin, lasts, natural_period(hangs))

    @property
    def key(self) -> tuple[object, ...]:
        """What features of one plan follow from: winches that are run alike share them."""
        return self.at, self.repeat, self.begin, self.counted, self.T_0

    def of_seed(self, spot: SeaState, seed: int) -> dict[str, float]:
        """Features of the waves of one run: name -> value [SI]."""
        waves = self._waves(spot, seed, Amplitudes.RAYLEIGH)
        tip = np.sum(self._vertical(waves) * waves.a, axis=0)
        return {name: float(x[0]) for name, x in self._largest(waves, tip[None]).items()}

    def each_metre(self, spot: SeaState) -> Waves:
        """The tip's motion in a sea for each metre of its height; one in all seas of one shape."""
        waves = self._waves(spot, 0, Amplitudes.FIXED)
        tip = np.sqrt(0.5 * np.sum(np.abs(self._vertical(waves) * waves.a) ** 2, axis=0)) / spot.Hs
        return Waves(waves.omega, waves.harmonic, tip)

    def of_many(self, waves: Waves, count: int, seed: int) -> dict[str, FloatArray]:
        """Features of `count` seeds for each metre of height: name -> (count,)."""
        parts = np.random.default_rng(seed).standard_normal((2, count, len(waves.tip)))
        return self._largest(waves, waves.tip * (parts[0] + 1j * parts[1]))

    def _waves(self, spot: SeaState, seed: int, law: Amplitudes) -> Realisation:
        sea = self.plan.environment.sea(*spot)
        return realise(sea, self.repeat, seed, amplitudes=law, depth=self.plan.depth)

    def _vertical(self, waves: Realisation) -> ComplexArray:
        return self.plan.vessel.vertical(waves.omega, waves.beta, self.at.x, self.at.y)

    def _largest(self, waves: Realisation | Waves, tip: ComplexArray) -> dict[str, FloatArray]:
        """Features of complex amplitudes of the tip's height (n, harmonics)."""
        omega, last = waves.omega, int(waves.harmonic[-1])
        n = scipy.fft.next_fast_len(math.ceil(max(SAMPLES * self.repeat, 2 * last + 2)), real=True)
        dt = self.repeat / n
        counts = slice(math.floor(self.begin / dt), min(math.ceil((self.begin + self.counted) / dt) + 1, n))

        def series(c: ComplexArray) -> FloatArray:
            bins = np.zeros((len(c), last + 1), dtype=np.complex128)
            bins[:, waves.harmonic] = c
            return synthesis(bins, n)[:, counts]

        speed, motion = series(1j * omega * tip), series(tip)
        r = omega * self.T_0 / (2.0 * math.pi)
        load = series(tip / (1.0 - r**2 + 2j * DAMPING * r))
        values = (
            np.abs(speed).max(axis=1),
            (-speed).max(axis=1),
            _span(motion, dt),
            np.abs(series(-(omega**2) * tip)).max(axis=1),
            _span(load, dt),
        )
        return dict(zip(NAMES, values, strict=True))


def _span(x: FloatArray, dt: float) -> FloatArray:
    """Largest difference of highest and lowest value of rows (n, k) within a window."""
    size = min(max(round(WINDOW / dt), 1), x.shape[1])
    spread = scipy.ndimage.maximum_filter1d(x, size, axis=1) - scipy.ndimage.minimum_filter1d(x, size, axis=1)
    return np.asarray(spread.max(axis=1))


Features = Mapping[str, FloatArray]
"""Feature -> values of the runs of a cell (n,)."""
