"""Limit curves: the level of a quantity over the height of the sea, from the runs of all columns of a table at once,
and the limiting heights that follow, with what is known of neighbouring periods and headings.

See docs/decisions/0022-limit-curves.md.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray, IntArray
from stillhook.engine.lowering.summary import PEAK_INTERVAL as INTERVAL
from stillhook.plan.tiers.time_domain.cells import PEAKS, Runs
from stillhook.plan.tiers.time_domain.measures import Measure, Statistic
from stillhook.statistics.estimate import NORMAL_95
from stillhook.statistics.level_fit import (
    SLOPES,
    Around,
    LevelFit,
    Samples,
    climbed,
    fit_levels,
    fit_means,
    risen,
)
from stillhook.statistics.smooth_field import DRAWS, Field, smooth_field
from stillhook.variables import WINDOW

NEAR = 0.25
"""Standard deviation of the weight of a run, in ln of its height over that of the limit: growth is a power of the
height about the limit, not everywhere."""
ALIKE = 0.15
"""Standard deviation of the weight, in ln of the period, with which runs of other periods show how runs scatter."""
PART = 20.0
"""Part of a run of which the largest value counts [s]: some waves."""
FEWEST = 8
"""Runs in which waves must add something for a curve."""
BEYOND_CELLS = 1.15
"""A limit is read up to this factor above the highest cell, where a search ends: it needs a cell beyond,
for growth may end there, as that of an error which friction makes."""
NOTHING = 0.02
"""Part of the most that waves added in a cell below which they count as adding nothing: a run that reaches hardly
beyond still water says by chance how little, and its ln far below the others' would be taken for scatter."""
FAILED_MOST = 0.1
"""Chance of a failed run in a phase from which a cell is beyond every limit: as many phases as the level of 90 %
leaves. One of 20 runs may fail in a phase that holds one run, none in a phase that holds two or more."""
ROUNDING = 1e-9
LARGEST = 700.0
"""Exponent from which on e to it is called inf."""
LOWEST = -50.0
"""ln of what waves may add where still water is at the limit."""
FAR = 0.4
"""Part of what waves may add below which no run was near to a limit: such a rule guides no search, and has no limit in
the seas that were run."""
MIDDLE = 250
STEPS = np.linspace(-2.5, 2.5, 2 * MIDDLE + 1)
"""Distances from a limit, in ln of the height, at which the ends of its interval are looked for."""


@dataclass(frozen=True, eq=False)
class ColumnRuns:
    """What was run of a phase in one column: cells of heights above 0, with their runs; still: x of the measure in
    still water; about: height of which its limit is thought to be [m]; period [s], angle [rad]. Heights are those of
    all waves, swell included."""

    period: float
    angle: float
    measure: Measure
    about: float
    still: float
    cells: tuple[tuple[float, Runs], ...] = field(repr=False)

    @cached_property
    def by_run(self) -> tuple[FloatArray, FloatArray]:
        """Height [m] and x of every run (n,), cell by cell."""
        x, duration = (np.concatenate([runs[of] for _, runs in self.cells]) for of in (self.measure.x, "duration"))
        Hs = np.repeat([Hs for Hs, _ in self.cells], [len(runs["duration"]) for _, runs in self.cells])
        return Hs, self.measure.values({self.measure.x: x, "duration": duration})

    @property
    def sound_up_to(self) -> float:
        """Highest height below the first at which too many runs fail [m]; inf where none does."""
        below = 0.0
        for Hs, runs in self.cells:
            lost = float(np.mean(~np.isfinite(runs["duration"])))
            if 1.0 - (1.0 - lost) ** max(self.measure.times, 1.0) >= FAILED_MOST - ROUNDING:
                return below
            below = Hs
        return math.inf


@dataclass(frozen=True, eq=False)
class Curve:
    """Level of a measure over the height in columns (c,); fit None where waves add too little to see."""

    columns: tuple[ColumnRuns, ...]
    still: FloatArray = field(repr=False)
    fit: LevelFit | None = field(repr=False)

    @property
    def tops(self) -> FloatArray:
        """Highest cell of each column [m]."""
        return np.array([max((Hs for Hs, _ in column.cells), default=0.0) for column in self.columns])

    @property
    def about(self) -> FloatArray:
        """Height about which each column is looked at [m]."""
        return np.array([column.about for column in self.columns])

    def level(self, column: int, Hs: float) -> tuple[float, float, float]:
        """x at the level in a sea of this height [m], and the ends of its 95 % interval."""
        if self.fit is None or Hs <= 0.0 or math.isnan(self.fit.level[column]):
            return float(self.still[column]), math.nan, math.nan
        ln_x, var = self.fit.at(np.array([column]), np.array([math.log(Hs / self.columns[column].about)]))
        half = NORMAL_95 * math.sqrt(float(var[0]))
        value, low, high = (self.still[column] + _exp(float(ln_x[0]) + d) for d in (0.0, -half, half))
        return float(value), float(low), float(high)


def _exp(x: float) -> float:
    """e^x, inf where no number holds it: an interval without an end."""
    return math.exp(x) if x < LARGEST else math.inf


def curve_of(columns: Sequence[ColumnRuns], chance: float | None = None) -> Curve:
    """The curve of one measure in several columns; chance: of a phase, in place of the measure's own."""
    return curves_about(columns, [[column.about for column in columns]], chance)[0]


def curves_about(
    columns: Sequence[ColumnRuns], heights: Sequence[Sequence[float]], chance: float | None = None
) -> list[Curve]:
    """Curves of the same runs, looked at about other heights [m]: of every column one for each curve."""
    still = np.array([column.still for column in columns])
    if chance is not None:
        q = 1.0 - min(max(chance, 0.0), 1.0 - ROUNDING)
        columns = [replace(column, measure=replace(column.measure, q=q)) for column in columns]
    mean = columns[0].measure.statistic is Statistic.MEAN
    fit = _of_means(columns) if mean else _of_largest(columns, still)
    return [
        Curve(
            tuple(replace(column, about=H) for column, H in zip(columns, about, strict=True)),
            still,
            fit(np.array(about, dtype=np.float64)),
        )
        for about in heights
    ]


Fit = Callable[[FloatArray], LevelFit | None]
"""From heights about which columns are looked at (c,) [m] to the fit there."""


def _nothing(about: FloatArray) -> None:
    return None


def _of_largest(columns: Sequence[ColumnRuns], still: FloatArray) -> Fit:
    cells = [(i, Hs, runs) for i, column in enumerate(columns) for Hs, runs in column.cells]
    if not cells:
        return _nothing
    rows, length = _parts([(columns[i].measure, runs) for i, _, runs in cells])
    sizes = [len(x) for x in rows]
    place = np.repeat([i for i, _, _ in cells], sizes)
    ln_H, x = np.repeat([math.log(Hs) for _, Hs, _ in cells], sizes), np.concatenate(rows)
    added, known = x - still[place, None], np.isfinite(x)
    most, cell = np.zeros(len(cells)), np.repeat(np.arange(len(cells)), sizes)
    np.maximum.at(most, cell, np.where(known, added, 0.0).max(axis=1))
    added = np.where(known, added, most[cell, None])  # a run that failed is beyond the others of its cell
    some = added > ROUNDING * np.maximum(np.abs(still), ROUNDING)[place, None]
    if int(some.sum()) < min(FEWEST, len(some)):
        return _nothing
    y = np.log(added, out=np.full(x.shape, -np.inf), where=some & (added > NOTHING * most[cell, None]))
    end = np.array([column.measure.end for column in columns])
    over = ~known | (x >= end[place, None] * (1.0 - ROUNDING))
    seen = np.bincount(place, some.any(axis=1), minlength=len(columns)) > 0  # a column without says nothing of scatter
    of = np.flatnonzero(seen)
    rows_seen, number = seen[place], np.cumsum(seen) - 1
    ln_T = np.log([column.period for column in columns])[of]
    likeness = np.exp(-0.5 * ((ln_T[:, None] - ln_T) / ALIKE) ** 2)
    q = np.array([column.measure.of_part(length) for column in columns])[of]

    def fit(about: FloatArray) -> LevelFit:
        h = (ln_H - np.log(about[place]))[rows_seen]
        weight = np.maximum(np.exp(-0.5 * (h / NEAR) ** 2), 1e-6)
        samples = Samples(number[place[rows_seen]], h, y[rows_seen], over[rows_seen], weight)
        return fit_levels(samples, q, likeness).among(of, len(columns))

    return fit


def _parts(cells: Sequence[tuple[Measure, Runs]]) -> tuple[list[FloatArray], float]:
    """x of the parts of all runs, (n, k) for each cell, and the length of a part [s]: whole runs (k = 1), or in a
    stationary phase as many intervals together as hold some waves, or a window."""
    peaks = [measure.peaks(runs) for measure, runs in cells]
    known = [x for x in peaks if x is not None]
    together = round((WINDOW if cells[0][0].x.endswith("_pp") else PART) / INTERVAL)
    parts = min((x.shape[1] for x in known), default=0) // together
    if len(known) < len(peaks) or parts < 2:
        return [measure.values(runs)[:, None] for measure, runs in cells], math.inf
    rows = [x[:, : parts * together].reshape(len(x), parts, together).max(axis=2) for x in known]
    return rows, together * INTERVAL


def _of_means(columns: Sequence[ColumnRuns]) -> Fit:
    rows = []
    for i, column in enumerate(columns):
        for Hs, runs in column.cells:
            x = column.measure.values(runs)
            x = x[np.isfinite(x)]
            if (x > 0.0).sum() >= 2:
                rows.append((i, math.log(Hs), float(x.mean()), float(x.var(ddof=1)) / len(x)))
    if not rows:
        return _nothing
    place, ln_H, mean, var = (np.array(of) for of in zip(*rows, strict=True))

    def fit(about: FloatArray) -> LevelFit:
        h = ln_H - np.log(about[place])
        return fit_means(place, h, mean, var * np.exp((h / NEAR) ** 2), len(columns))

    return fit


@dataclass(frozen=True, eq=False)
class CurveLimits:
    """Limiting heights of one rule in columns (c,) [m]: inf where the highest sea stays inside, 0 where a calm is
    beyond, NaN where cells end below the limit (low is then the last of them). low, high: ends of the 95 % interval;
    half: half of it in ln of the height; direct: estimate of the column's own runs; draws (m, c)."""

    Hs: FloatArray = field(repr=False)
    low: FloatArray = field(repr=False)
    high: FloatArray = field(repr=False)
    half: FloatArray = field(repr=False)
    direct: FloatArray = field(repr=False)
    draws: FloatArray = field(repr=False)


def limits_of_curve(
    curve: Curve, x_limit: FloatArray, highest: float, expected: FloatArray | None = None, *, n_draws: int = DRAWS
) -> CurveLimits:
    """Heights at which the level of a curve is x_limit (c,).

    highest sea to analyse [m]; expected (c,): limits of a cheaper method [m], NaN where it has none;
    n_draws: how many draws of all limits together.
    """
    n, top = len(curve.columns), curve.tops
    sound = np.array([column.sound_up_to for column in curve.columns])
    at_top = top >= highest * (1.0 - ROUNDING)
    beyond_calm = curve.still > x_limit * (1.0 + ROUNDING)
    Hs, low, high, half = (np.full(n, np.nan) for _ in range(4))
    direct, draws = np.full(n, np.inf), np.full((0, n), np.nan)
    result = known = np.zeros(n, dtype=np.bool_)
    if curve.fit is not None:
        y = np.log(x_limit - curve.still, out=np.full(n, LOWEST), where=x_limit > curve.still)
        crossing, known = curve.fit.crossing(y), ~np.isnan(curve.fit.level)
        direct = np.where(known, curve.about * np.exp(np.minimum(crossing.h, 10.0)), np.inf)
        result = known & (direct <= BEYOND_CELLS * top) & ~beyond_calm
        inside = known & at_top & ~result & ~beyond_calm
        draws, rng = np.full((n_draws, n), np.nan), np.random.default_rng(_stream(curve))
        if inside.any():
            about_top = curve.fit.around(np.log(top / curve.about))[inside]
            of_top = _spread(about_top, np.log(top[inside]), y[inside] - about_top.level, rng, n_draws)
            low[inside], draws[:, inside] = np.where(of_top.low > 0.0, of_top.low, np.nan), of_top.draws
            high[inside] = np.where(of_top.low > 0.0, np.inf, np.nan)
        if result.any():
            smooth, about = _smoothed(curve, crossing, direct, result, expected, n_draws), crossing[result]
            errors = about.slope * (smooth.draws - smooth.value)
            of = _spread(
                replace(about, var=about.slope**2 * smooth.var),
                smooth.value,
                np.zeros(result.sum()),
                rng,
                n_draws,
                errors,
            )
            Hs[result], low[result], high[result], half[result] = np.exp(smooth.value), of.low, of.high, of.half
            draws[:, result] = of.draws
    open_ = ~result & ~beyond_calm
    Hs[open_] = np.where(at_top[open_], np.inf, np.nan)
    low[open_ & ~at_top] = top[open_ & ~at_top]
    past = result & (Hs > highest)
    Hs = np.where(past, np.where(at_top, np.inf, highest), Hs)
    high, draws = (np.where(x > highest, np.inf, x) for x in (high, draws))
    for ends in (Hs, low, high):
        ends[beyond_calm] = 0.0
    limited = np.isfinite(sound)
    Hs[limited] = np.fmin(Hs, sound)[limited]
    low[limited] = np.fmin(low, sound)[limited]
    with np.errstate(divide="ignore", invalid="ignore"):  # a draw is off by twice an interval's half at the most
        least, most = low**2 / Hs, high**2 / Hs
    draws = np.maximum(draws, np.where(np.isfinite(least), least, 0.0))
    draws = np.minimum(draws, np.where(most > 0.0, most, np.inf))
    return CurveLimits(Hs, low, high, half, direct, np.minimum(draws, sound))


@dataclass(frozen=True, eq=False)
class _Spread:
    """Ends of the 95 % intervals of limits (c,) [m], half of these in ln, and draws (m, c) [m]."""

    low: FloatArray
    high: FloatArray
    half: FloatArray
    draws: FloatArray


def _spread(
    about: Around,
    ln_H: FloatArray,
    margin: FloatArray,
    rng: np.random.Generator,
    n_draws: int,
    errors: FloatArray | None = None,
) -> _Spread:
    """What errors of the level, of its growth and of the change of growth make of limits where ln of the level is to
    rise by a margin (c,) about heights of ln_H (c,): little where a number grows steeply, and without an end where it
    levels off. errors (m, c): draws of the level's own error (None: independent ones).

    Errors: none; an end is 0 or inf where there is none.
    """
    of_slope, of_bend = np.sqrt(about.var_slope), np.sqrt(about.var_bend)
    rise = risen(about.slope[:, None], about.bend[:, None], STEPS) - margin[:, None]
    var = (about.var + about.common)[:, None] + (STEPS * of_slope[:, None]) ** 2
    sd = np.sqrt(var + (0.5 * STEPS**2 * of_bend[:, None]) ** 2)
    below = -_reached(-STEPS[MIDDLE::-1], -(rise + NORMAL_95 * sd)[:, MIDDLE::-1])
    above = _reached(STEPS[MIDDLE:], (rise - NORMAL_95 * sd)[:, MIDDLE:])
    z = rng.standard_normal((3, n_draws, len(margin)))
    drawn = np.sqrt(about.var) * z[0] if errors is None else errors
    drawn = drawn + math.sqrt(about.common) * rng.standard_normal((n_draws, 1))
    off = climbed(np.clip(about.slope + of_slope * z[1], *SLOPES), about.bend + of_bend * z[2], margin + drawn)
    low, high, draws = (np.exp(ln_H + np.minimum(x, 10.0)) for x in (below, above, off))
    already = (rise + NORMAL_95 * sd)[:, MIDDLE] < 0.0
    return _Spread(np.where(already, 0.0, low), high, 0.5 * (above - below), draws)


def _reached(x: FloatArray, y: FloatArray) -> FloatArray:
    """Where each row of y (c, n) over rising x (n,) first rises above 0; inf where it does not."""
    over = y > 0.0
    i = np.maximum(over.argmax(axis=1), 1)
    rows = np.arange(len(y))
    before, after = y[rows, i - 1], y[rows, i]
    share = np.clip(before / np.where(before == after, -1.0, before - after), 0.0, 1.0)
    return np.where(over.any(axis=1), x[i - 1] + share * (x[i] - x[i - 1]), np.inf)


def _stream(curve: Curve) -> int:
    """Number of the random numbers of a curve: those of the same runs have the same errors, under every rule and
    alternative; those of others have their own."""
    first = (runs for column in curve.columns for _, runs in column.cells[:1])
    data = b"".join(np.asarray(x).tobytes() for runs in first for name, x in runs.items() if not name.startswith(PEAKS))
    return zlib.crc32(data)


def _where_near(
    curve: Curve, x_limit: FloatArray, highest: float, expected: FloatArray | None, n_draws: int
) -> CurveLimits:
    """Limits (c,), none of them in columns whose runs stayed far below: of a number to which waves add hardly anything
    no curve shows how it grows."""
    limits, most = limits_of_curve(curve, x_limit, highest, expected, n_draws=n_draws), _most_added(curve.columns)
    far = (x_limit > curve.still) & (most < FAR * (x_limit - curve.still))
    if not far.any():
        return limits
    at_top = curve.tops >= highest * (1.0 - ROUNDING)
    nothing = np.where(at_top, np.inf, np.nan)
    return replace(
        limits,
        Hs=np.where(far, nothing, limits.Hs),
        low=np.where(far, curve.tops, limits.low),
        high=np.where(far, np.nan, limits.high),
        half=np.where(far, np.nan, limits.half),
        direct=np.where(far, np.inf, limits.direct),
        draws=np.where(far, nothing, limits.draws),
    )


def _most_added(columns: Sequence[ColumnRuns]) -> FloatArray:
    """The most that waves added in a run of each column (c,); inf of a chance, where this says nothing, and where a run
    failed or none was made."""
    some = [bool(c.cells) and c.measure.statistic is not Statistic.CHANCE for c in columns]
    return np.array(
        [float(c.by_run[1].max()) - c.still if known else math.inf for c, known in zip(columns, some, strict=True)]
    )


def limits_in_bands(
    curve: Curve,
    bands: Sequence[tuple[float, FloatArray]],
    highest: float,
    expected: FloatArray | None = None,
    *,
    n_draws: int = DRAWS,
) -> CurveLimits:
    """As `limits_of_curve` for a limit that depends on the height: bands of a height up to which [m], rising, and the
    limit x (c,) there. The limit is that of a band within it, or the height of a band where the next one is beyond at
    once."""
    results = [_where_near(curve, x_limit, highest, expected, n_draws) for _, x_limit in bands]
    if len(results) == 1:
        return results[0]
    tops = [top for top, _ in bands]

    def first(tables: Sequence[FloatArray]) -> FloatArray:
        result, bottom = np.full_like(tables[0], np.inf), 0.0
        for table, top in zip(tables, tops, strict=True):
            height = np.maximum(np.where(np.isnan(table), np.inf, table), bottom)
            result = np.where(np.isposinf(result) & (height <= top), height, result)
            bottom = top
        return result

    Hs = first([each.Hs for each in results])
    top = curve.tops
    open_ = np.isposinf(Hs) & (top < highest * (1.0 - ROUNDING))
    draws = [each.draws for each in results]
    same = len({len(each) for each in draws}) == 1
    return CurveLimits(
        np.where(open_, np.nan, Hs),
        np.where(open_, top, first([np.where(np.isnan(each.low), each.Hs, each.low) for each in results])),
        np.where(open_, np.nan, first([np.where(np.isnan(each.high), each.Hs, each.high) for each in results])),
        results[0].half,
        first([each.direct for each in results]),
        np.where(open_, np.nan, first(draws)) if same and len(draws[0]) else np.full((0, len(Hs)), np.nan),
    )


def wind_sea(H: FloatArray, swell: float) -> FloatArray:
    """Heights of the wind sea in all waves of a height, with a swell [m]; 0 where the swell alone is higher."""
    return np.asarray(np.sqrt(np.maximum(H**2 - swell**2, 0.0)))


def wind_sea_limits(limits: CurveLimits, swell: float) -> CurveLimits:
    """Limits of all waves as those of the wind sea with a swell [m]; 0 where the swell alone is beyond."""
    tables = {name: wind_sea(getattr(limits, name), swell) for name in ("Hs", "low", "high", "direct", "draws")}
    return replace(limits, **tables)


def _smoothed(
    curve: Curve, crossing: Around, direct: FloatArray, usable: BoolArray, expected: FloatArray | None, n_draws: int
) -> Field:
    """ln of the heights as a field over periods and headings. It is levels that differ little between neighbours:
    limits of numbers that hardly grow may differ by more."""
    places = [column for column, use in zip(curve.columns, usable, strict=True) if use]
    ln_expected = None
    if expected is not None and np.isfinite(expected[usable]).all() and (expected[usable] > 0.0).all():
        ln_expected = np.log(expected[usable])
    slope = crossing.slope[usable]
    return smooth_field(
        np.array([column.period for column in places]),
        np.array([column.angle for column in places]),
        np.log(np.maximum(direct[usable], 1e-3)),
        np.maximum(crossing.var[usable] / slope**2, 1e-8),
        expected=ln_expected,
        scale=np.maximum(1.0 / slope, 1.0),
        seed=_stream(curve),
        draws=n_draws,
    )


def chance_of(columns: Sequence[ColumnRuns], limit: float) -> float | None:
    """A limit where it is one of a chance, else None."""
    return limit if columns[0].measure.statistic is Statistic.CHANCE else None


def x_limit_of(measure: Measure, limit: float) -> float:
    """x of a measure at a limit; of a chance the end that is reached by chance."""
    return measure.end if measure.statistic is Statistic.CHANCE else measure.to_x(limit)


def limit_at(bands: Sequence[tuple[float, float]], Hs: float) -> float:
    """The limit of a rule in a sea of a height [m], of bands of a height up to which [m], rising, and their limit."""
    return bands[int(bands_at(bands, np.array(Hs)))][1]


def bands_at(bands: Sequence[tuple[float, float]], Hs: FloatArray) -> IntArray:
    """Numbers of the bands that heights [m] lie in; of the last one above all."""
    tops = np.array([top for top, _ in bands[:-1]])
    return np.searchsorted(tops * (1.0 + ROUNDING), Hs)
