"""What the cells of columns say by themselves: the level of a measure in each, how much of a limit that uses, and how
far up a column is inside. A limit that a curve extrapolates from elsewhere is compared with them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.plan.definition.rules import Limited
from stillhook.plan.limits import utilisation
from stillhook.plan.tiers.time_domain.cells import Runs
from stillhook.plan.tiers.time_domain.curves import (
    ALIKE,
    FAR,
    ROUNDING,
    ColumnRuns,
    bands_at,
    curves_about,
    limit_at,
    x_limit_of,
)
from stillhook.plan.tiers.time_domain.measures import Measure, Statistic
from stillhook.statistics.estimate import NORMAL_95, t_factor

WELL_BELOW = 0.85
"""Heights below a limit, over it, at which cells show how far down its interval may reach; and the part of a limit that
a cell may use for a limit to be no lower than it."""


SELDOM = 1.0 / 3.0
"""Share of runs in which waves add something below which they do so seldom."""
BEHIND_OTHERS = 0.5
"""Part of what runs used of another rule's limit below which a rule guides no search: where the other is reached this
one is far away."""


@dataclass(frozen=True, eq=False)
class CellLevels:
    """Level x of a measure in the cells of columns (c, k), rising in height Hs [m], by the curve about each cell: value
    and ends of its 95 % interval. inf where runs fail; Hs NaN beyond the cells of a column."""

    Hs: FloatArray = field(repr=False)
    x: FloatArray = field(repr=False)
    low: FloatArray = field(repr=False)
    high: FloatArray = field(repr=False)

    def at(self, column: int, Hs: float) -> tuple[float, float, float]:
        """Value and ends in a cell of a column."""
        k = int(np.nanargmin(np.abs(self.Hs[column] - Hs)))
        return float(self.x[column, k]), float(self.low[column, k]), float(self.high[column, k])


def cell_levels(columns: Sequence[ColumnRuns]) -> CellLevels:
    """Levels in all cells above a calm; a chance is counted (`stillhook.plan.tiers.time_domain.tier.chance`)."""
    heights = [[Hs for Hs, _ in column.cells if Hs > 0.0] for column in columns]
    most = max((len(each) for each in heights), default=0)
    Hs, x, low, high = (np.full((len(columns), most), np.nan) for _ in range(4))
    about = [
        [each[min(k, len(each) - 1)] if each else column.about for each, column in zip(heights, columns, strict=True)]
        for k in range(most)
    ]
    if most == 0:
        return CellLevels(Hs, x, low, high)
    if seldom(columns):
        for i, column in enumerate(columns):
            for k, (height, runs) in enumerate(cell for cell in column.cells if cell[0] > 0.0):
                Hs[i, k], (x[i, k], low[i, k], high[i, k]) = height, _by_order(column, height, runs)
        return CellLevels(Hs, x, low, high)
    for k, curve in enumerate(curves_about(columns, about)):
        for i, column in enumerate(columns):
            if k < len(heights[i]):
                Hs[i, k] = heights[i][k]
                x[i, k], low[i, k], high[i, k] = _level(column, heights[i][k], *curve.level(i, heights[i][k]))
    return CellLevels(Hs, x, low, high)


def seldom(columns: Sequence[ColumnRuns]) -> bool:
    """Whether waves add something in few runs alone, such as a snap load in slings that hardly ever fall slack: no
    distribution of what they add says at which height they do so often enough."""
    first = next((runs for column in columns for _, runs in column.cells), None)
    measure = columns[0].measure
    if measure.statistic is not Statistic.LARGEST or first is None or measure.peaks(first) is not None:
        return False
    rows = [(column.by_run[1], column.still) for column in columns if column.cells]
    added = [x > still + ROUNDING * max(abs(still), ROUNDING) for x, still in rows]
    return float(np.concatenate(added).mean()) < SELDOM


def _by_order(column: ColumnRuns, Hs: float, runs: Runs) -> tuple[float, float, float]:
    """The level of a cell by the order of its own runs; without an upper end where too few are below it."""
    x, q = np.sort(column.measure.values(runs)), column.measure.of_part()
    if not np.isfinite(x).all() and not column.sound_up_to >= Hs:
        return math.inf, math.inf, math.inf
    n, half = len(x), NORMAL_95 * math.sqrt(q * (1.0 - q) / len(x))
    at = [math.ceil(n * share - 1e-9) - 1 for share in (q, max(q - half, 0.0), q + half)]
    value, low = (float(x[max(k, 0)]) for k in at[:2])
    return value, low, float(x[at[2]]) if at[2] < n else math.inf


def _level(column: ColumnRuns, Hs: float, value: float, low: float, high: float) -> tuple[float, float, float]:
    """The level of a cell: of a mean that of its own runs, their largest where too few are above still water for a
    curve, inf where runs fail."""
    x = column.measure.values(next(runs for height, runs in column.cells if height == Hs))
    failed = not np.isfinite(x).all()
    if failed and not column.sound_up_to >= Hs:
        return math.inf, math.inf, math.inf
    if column.measure.statistic is Statistic.MEAN and not failed:
        half = t_factor(len(x) - 1) * x.std(ddof=1) / math.sqrt(len(x)) if len(x) > 1 else math.inf
        return float(x.mean()), float(x.mean() - half), float(x.mean() + half)
    if math.isnan(low) and not failed:
        value = max(value, float(x.max()))
    return value, value if math.isnan(low) else low, math.inf if failed else value if math.isnan(high) else high


def inside_up_to(levels: CellLevels, used: FloatArray) -> FloatArray:
    """Heights (c,) [m] up to which cells show that a column is inside: of the highest cell that uses less than
    `WELL_BELOW` of a limit, where no lower cell uses more than all of it; 0 where there is none. used (c, k): part of
    the limit at their height that the levels use, NaN where there is no cell."""
    within = np.logical_and.accumulate(~(used > 1.0 + ROUNDING), axis=1)
    counts = within & (used < WELL_BELOW)
    return np.asarray(np.where(counts, levels.Hs, 0.0).max(axis=1, initial=0.0))


def used_of(rule: Limited, measure: Measure, levels: CellLevels, Hs: FloatArray) -> FloatArray:
    """Part of a rule's limit that the levels of cells use (c, k) [-]; Hs (c, k): heights of their wind seas [m]."""
    failed = np.isposinf(levels.x)
    values = measure.of_x(np.where(failed, np.nan, levels.x))
    used = utilisation(rule, values.ravel(), np.nan_to_num(Hs).ravel()).reshape(values.shape)
    return np.where(failed, np.inf, used)


def beyond_from(columns: Sequence[ColumnRuns], levels: CellLevels, bands: Sequence[tuple[float, float]]) -> FloatArray:
    """Heights (c,) [m] of the lowest cell that is beyond a limit, to 95 %; inf where there is none. bands of the limit
    by the height of all waves [m]."""
    beyond = levels.low > _x_limits(columns, levels, bands)
    return np.asarray(np.where(beyond, levels.Hs, np.inf).min(axis=1, initial=np.inf))


def surely_inside(
    columns: Sequence[ColumnRuns], levels: CellLevels, bands: Sequence[tuple[float, float]], limits: FloatArray
) -> FloatArray:
    """Heights (c,) [m] up to which cells well below a limit show that a column is inside, to 95 %: the highest such
    cell; 0 where there is none. A column without lower cells takes the least of columns of about its period, or of all.

    bands of the limit by the height of all waves [m]; limits (c,): heights of the limits, inf or NaN where there is
    none [m].
    """
    most = WELL_BELOW * np.where(np.isnan(limits), np.inf, limits)
    counts = (levels.Hs < most[:, None]) & (levels.high < _x_limits(columns, levels, bands))
    floor = np.where(counts, levels.Hs, 0.0).max(axis=1, initial=0.0)
    ln_T = np.log([column.period for column in columns])
    alike = np.abs(ln_T[:, None] - ln_T) < ALIKE
    any_ = np.ones_like(alike)
    least, of_any = (np.where(near & (floor > 0.0), floor, np.inf).min(axis=1) for near in (alike, any_))
    least = np.where(np.isfinite(least), least, of_any)
    return np.asarray(np.minimum(np.where((floor == 0.0) & np.isfinite(least), least, floor), most))


def _x_limits(columns: Sequence[ColumnRuns], levels: CellLevels, bands: Sequence[tuple[float, float]]) -> FloatArray:
    """x at a limit in every cell (c, k)."""
    rows = [
        [x_limit_of(column.measure, limit_at(bands, float(H))) for H in row]
        for column, row in zip(columns, levels.Hs, strict=True)
    ]
    return np.reshape(np.array(rows), levels.Hs.shape)


def share_used(bands: Sequence[tuple[float, float]], column: ColumnRuns) -> float:
    """The most that waves added in a run of a column, over what they may by the limit at its height; inf where a run
    failed, or a calm or a cell is beyond; NaN where this says nothing: of a chance, or without runs."""
    if column.measure.statistic is Statistic.CHANCE or not column.cells:
        return math.nan
    Hs, x = column.by_run
    x_limits = np.array([x_limit_of(column.measure, limit) for _, limit in bands])
    room = x_limits[bands_at(bands, Hs)] - column.still
    return float(((x - column.still) / room).max()) if (room > 0.0).all() else math.inf


def near_limit(column: ColumnRuns) -> ColumnRuns:
    """A column with the one cell that is next to the height about which it is looked at."""
    nearest = min(column.cells, key=lambda cell: abs(cell[0] - column.about), default=None)
    return replace(column, cells=() if nearest is None else (nearest,))


def may_govern(used: FloatArray, near: FloatArray) -> BoolArray:
    """Rules whose limit may be the lowest of a column, of shares (rules, columns) of `share_used`, of all cells and of
    those near to the lowest limit: not where all runs stayed below `FAR`, or those near to it far below what they used
    of another rule's."""
    seen = np.where(np.isnan(near), -np.inf, near)
    behind = seen < BEHIND_OTHERS * seen.max(axis=0, initial=0.0)
    return np.asarray((np.isnan(near) | ((used >= FAR) & ~behind)).any(axis=1))
