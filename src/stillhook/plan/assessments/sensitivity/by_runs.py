r"""Limits of a cell with one number of the plan otherwise, by runs of the twin in the same waves.

Of every rule the level of what waves add to still water is taken from the runs of a few heights about the limit, as it
grows there,

.. math:: \ln L(H) = \ln L(H_0) + s \ln(H/H_0)

and that of a variation from runs of the same seeds at H_0: seed by seed it is so many times as much, and the mean of
ln of that is the change of ln L, whose scatter over the seeds is small against that of L. The limit is where
still water and L reach what the rule allows, all three as the variation has them; it is stated as a factor on the limit
of the plan's own table, so that a variation of nothing is that limit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.kernels.lanes import VL
from stillhook.plan.assessments.sensitivity.factors import Cell
from stillhook.plan.definition.capacities import calm as calm_of
from stillhook.plan.definition.rules import Limited
from stillhook.plan.limits import limited
from stillhook.plan.tiers.time_domain.cells import CellRequest, Cells, Execution, Runs, request_together
from stillhook.plan.tiers.time_domain.curves import x_limit_of
from stillhook.plan.tiers.time_domain.lowering import SeaState
from stillhook.plan.tiers.time_domain.measures import Measure, Statistic, measures
from stillhook.plan.tiers.time_domain.placing import LEAST_PART, snapped
from stillhook.statistics.estimate import t_factor

SEEDS = VL
"""Runs of every height: a block of lanes."""
STEP = 1.25
"""Factor between the heights of the plan as it is."""
SLOPES = (0.3, 4.0)
"""Powers of the height with which a level may grow."""
FEWEST = 6
"""Seeds in which waves have to add something, as planned and otherwise."""
EULER, OF_GUMBEL = 0.5772156649015329, math.sqrt(6.0) / math.pi
"""Mean of a Gumbel distribution over its scale, from its mode, and its scale over its standard deviation."""


@dataclass(frozen=True, eq=False)
class Level:
    """What the runs of a cell say of one rule at one height: x of the measure in still water and in every run (n,)."""

    rule: Limited
    measure: Measure
    still: float
    x: FloatArray = field(repr=False)

    @property
    def added(self) -> FloatArray:
        """What waves added in every run (n,); NaN where they added nothing, inf where the run failed."""
        added = self.x - self.still
        return np.where(added > 1e-9 * max(abs(self.still), 1e-9), added, np.nan)

    def x_limit(self, limit: float) -> float:
        """x at a limit of the rule."""
        return x_limit_of(self.measure, limit)

    @property
    def ln_level(self) -> float:
        """ln of what waves add at the rule's level, NaN where they do so too seldom: the mean of a share of time, else
        the quantile of the Gumbel distribution of ln with these runs' mean and deviation."""
        added = self.added[np.isfinite(self.added)]
        if len(added) < FEWEST:
            return math.nan
        if self.measure.statistic is Statistic.MEAN:
            return math.log(float(added.sum()) / len(self.x))
        q = self.measure.of_part()
        if self.measure.statistic is Statistic.CHANCE:
            q = replace(self.measure, q=1.0 - min(max(self.rule.limit, 1e-9), 1.0 - 1e-9)).of_part()
        ln = np.log(added)
        return float(ln.mean() + ln.std(ddof=1) * OF_GUMBEL * (-math.log(-math.log(q)) - EULER))

    def change(self, other: Level) -> tuple[float, float]:
        """Change of ln of the level from this to another of the same seeds, and its standard error; NaN where too few
        runs say so."""
        n = min(len(self.x), len(other.x))
        a, b = self.added[:n], other.added[:n]
        both = np.isfinite(a) & np.isfinite(b)
        if int(both.sum()) < FEWEST:
            return math.nan, math.nan
        a, b = a[both], b[both]
        if self.measure.statistic is Statistic.MEAN:
            parts = b / b.mean() - a / a.mean()
            return float(np.log(b.sum() / a.sum())), float(parts.std(ddof=1) / math.sqrt(len(parts)))
        ln = np.log(b / a)
        return float(ln.mean()), float(ln.std(ddof=1) / math.sqrt(len(ln)))


class Growth(NamedTuple):
    """Of a rule as planned: the level at H_0 as ln, the power of the height with which it grows, and its standard
    error."""

    ln_level: float
    slope: float
    error: float


@dataclass(frozen=True, eq=False)
class CellRuns:
    """A cell with its runs."""

    cell: Cell
    cells: Cells = field(repr=False)

    @classmethod
    def of(cls, cell: Cell, execution: Execution) -> CellRuns:
        return cls(cell, Cells(cell.plan, execution))

    def wants(self, heights: Sequence[float]) -> list[CellRequest]:
        """A calm, and seeds of every height."""
        of = self.cell
        calm = 1 if of.plan.environment.calm(0.0) else SEEDS
        seas = [SeaState(Hs, *of.column) for Hs in (0.0, *heights)]
        return [CellRequest(of.phase.name, of.winch, s, SEEDS if s.Hs > 0.0 else calm) for s in seas]

    def same_runs(self, other: CellRuns) -> bool:
        """Whether another cell is run just so: it counts them otherwise alone."""
        spot = SeaState(0.0, *self.cell.column)
        a, b = (each.cells.course(each.cell.phase, each.cell.winch, spot) for each in (self, other))
        alike = replace(a, times=b.times, swings=b.swings) == b
        return alike and self.cell.column == other.cell.column and self.cell.winch == other.cell.winch

    def levels(self, Hs: float) -> dict[str, Level]:
        """Of every rule that runs determine: what they say at a height [m]."""
        of = self.cell
        course = self.cells.course(of.phase, of.winch, SeaState(0.0, *of.column))
        known = measures(of.plan, of.phase, of.alternative, of.winch, course)
        calm, runs = (self._runs(h) for h in (0.0, Hs))
        swell = of.plan.once(calm_of, of.phase) if of.plan.environment.swell is not None else None
        result = {}
        for each in limited(of.plan, of.phase, of.alternative):
            measure = known.get(each.rule.quantity)
            if measure is not None and measure.x in runs:
                still = float(measure.values(calm).min())
                if swell is not None:
                    known_still = swell.get(each.rule.quantity, math.nan)
                    still = measure.to_x(known_still) if math.isfinite(known_still) else LEAST_PART * still
                result[each.rule.key] = Level(each, measure, still, measure.values(runs)[:SEEDS])
        return result

    def _runs(self, Hs: float) -> Runs:
        return self.cells.runs[self.cell.phase.name, self.cell.winch, SeaState(Hs, *self.cell.column)]


class Moved(NamedTuple):
    """A limit with one number otherwise: the rule that then limits, Hs [m] with the ends of its 95 % interval, inf
    above the highest sea, NaN where runs do not say; used: of the rule's limit at the height that was run [-]."""

    rule: str
    Hs: float
    low: float
    high: float
    used: float


@dataclass(frozen=True, eq=False)
class Base:
    """A cell as planned. Hs: limit of every rule by the plan's own table [m], inf above its highest sea, NaN where it
    has none; Hs_0 the height at which variations are run; growth of every rule."""

    runs: CellRuns
    Hs: Mapping[str, float]
    Hs_0: float
    highest: float
    levels: Mapping[str, Level] = field(repr=False)
    growth: Mapping[str, Growth] = field(repr=False)

    def moved(self, other: CellRuns) -> Moved:
        """The lowest limit of another cell over the rules."""
        levels, rows = other.levels(self.Hs_0), []
        for key, level in levels.items():
            row = self._limit(key, level)
            if row is not None:
                rows.append(row)
        return min(rows, key=lambda row: (row.Hs, -row.used), default=Moved("", *[math.nan] * 4))

    def _limit(self, key: str, level: Level) -> Moved | None:
        base, growth, table = self.levels.get(key), self.growth.get(key), self.Hs.get(key, math.nan)
        if base is None or growth is None:
            return None
        lost = ~np.isfinite(level.x)
        if lost.sum() > (~np.isfinite(base.x)).sum() + 1:
            return Moved(key, math.nan, 0.0, self.Hs_0, math.inf)  # runs fail that did not
        change, error = base.change(level)
        if not math.isfinite(change):
            return None
        known = _crossing(base, growth, 0.0, self.Hs_0)
        scale = table / known if 0.0 < table < math.inf and 0.0 < known < math.inf else 1.0
        value = _crossing(level, growth, change, self.Hs_0) * scale
        half = t_factor(len(level.x) - 1) * error / growth.slope
        if 0.0 < value < math.inf:
            half = math.hypot(
                half, t_factor(len(level.x) - 1) * growth.error / growth.slope * math.log(value / self.Hs_0)
            )
        room = level.x_limit(level.rule.limit) - level.still
        used = math.exp(growth.ln_level + change) / room if room > 0.0 else math.inf
        ends = (value * math.exp(-half), value * math.exp(half)) if 0.0 < value < math.inf else (value, value)
        Hs, low, high = (x if x <= self.highest else math.inf for x in (value, *ends))
        return Moved(key, Hs, low, high, used)


def _crossing(level: Level, growth: Growth, change: float, Hs_0: float) -> float:
    """Height at which a level meets its rule, whose limit may fall in steps of the height [m]."""
    bottom = 0.0
    for top, limit in level.rule.bands:
        room = level.x_limit(limit) - level.still
        if room <= 0.0:
            return bottom
        H = Hs_0 * math.exp(min((math.log(room) - growth.ln_level - change) / growth.slope, 50.0))
        if top >= H:
            return max(H, bottom)
        bottom = top
    return math.inf


def base_of(Hs: Mapping[str, float], highest: float) -> tuple[list[float], float]:
    """Heights at which a cell is run as planned, and the one at which variations are: about the lowest limit, or below
    the highest sea where there is none."""
    lowest = min((h for h in Hs.values() if h > 0.0), default=math.inf)
    middle = snapped(min(lowest, highest))
    return sorted({snapped(middle / STEP), middle, *([snapped(middle * STEP)] if lowest < highest else [])}), middle


def grown(runs: CellRuns, heights: Sequence[float], Hs: Mapping[str, float], Hs_0: float, highest: float) -> Base:
    """A cell as planned, its heights run."""
    levels = {h: runs.levels(h) for h in heights}
    growth = {}
    for key in levels[Hs_0]:
        rows = [(math.log(h / Hs_0), levels[h][key]) for h in heights]
        known = [(h, level.ln_level, _error(level)) for h, level in rows if math.isfinite(level.ln_level)]
        at = next((ln for h, ln, _ in known if h == 0.0), math.nan)
        if not math.isfinite(at) or len(known) < 2:
            continue
        h, means, errors = (np.array(column) for column in zip(*known, strict=True))
        off = h - h.mean()
        slope = float((off * means).sum() / (off**2).sum())
        error = float(np.sqrt((off**2 * errors**2).sum()) / (off**2).sum())
        growth[key] = Growth(at, min(max(slope, SLOPES[0]), SLOPES[1]), error)
    return Base(runs, Hs, Hs_0, highest, levels[Hs_0], growth)


def _error(level: Level) -> float:
    """Standard error of the mean of ln of what waves added."""
    added = level.added[np.isfinite(level.added)]
    return float(np.log(added).std(ddof=1) / math.sqrt(len(added)))


def run(wanted: Sequence[tuple[CellRuns, Sequence[float]]], progress: Progress | None) -> None:
    """All runs together, so that blocks of lanes and threads are full."""
    request_together([(runs.cells, runs.wants(heights)) for runs, heights in wanted], progress)
