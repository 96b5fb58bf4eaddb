r"""Limits of a cell with one number of the plan otherwise, by runs of the twin in the same waves.

Of every rule the level L of what waves add to still water is taken from runs at the limit and a step below and above
it, all of the same seeds, and grows between them as powers of the height,

.. math:: L(H) = L(H_0)\,(H/H_0)^{s}

A variation is run with those seeds at H_0: there L is as many times as much as the means of both are apart, and seeds
scatter about that ratio far less than about L. The limit is where still water and L reach what the rule allows, all
three as the variation has them. Where that is far from H_0 the variation is run there as well, and its own growth
between both heights counts. As planned L is that which meets the rule at the limit of the plan's own table, so that a
variation of nothing is that limit.
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
FAR, FURTHEST = 0.1, 2.0
"""Change of a limit, in ln, from which a variation is run there as well, and the factor on the height up to which."""
BEYOND = 1.4
"""Factor beyond the heights that were run up to which a limit is read from their growth."""
MOST_OF = 0.75
"""Part of the seeds in which waves have to add something, as planned and otherwise."""
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
        """What waves added in every run (n,), inf where it failed."""
        return np.maximum(self.x - self.still, 0.0)

    @property
    def known(self) -> bool:
        """Whether waves added something in most runs, and at the rule's level: of what they do seldom these runs are
        too few."""
        least = 1e-9 * max(abs(self.still), 1e-9)
        most = int((np.isfinite(self.x) & (self.added > least)).sum()) >= MOST_OF * len(self.x)
        return most and self.over_mean > 0.0

    @property
    def over_mean(self) -> float:
        """What waves add at the rule's level over their mean [-]: 1 for a share of time, else the quantile of the
        Gumbel distribution with the runs' mean and deviation."""
        if self.measure.statistic is Statistic.MEAN:
            return 1.0
        q = self.measure.of_part()
        if self.measure.statistic is Statistic.CHANCE:
            q = replace(self.measure, q=1.0 - min(max(self.rule.limit, 1e-9), 1.0 - 1e-9)).of_part()
        added = self.added[np.isfinite(self.added)]
        return float(1.0 + added.std(ddof=1) / added.mean() * OF_GUMBEL * (-math.log(-math.log(q)) - EULER))

    @property
    def level(self) -> float:
        """What waves add at the rule's level."""
        return float(self.added[np.isfinite(self.added)].mean() * self.over_mean)

    def change(self, other: Level) -> tuple[float, float]:
        """ln of how many times as much waves add in another of the same seeds, and its standard error."""
        n = min(len(self.x), len(other.x))
        a, b = self.added[:n], other.added[:n]
        both = np.isfinite(a) & np.isfinite(b)
        a, b = a[both], b[both]
        parts = b / b.mean() - a / a.mean()
        change = math.log(float(b.mean() / a.mean()))
        if other.measure.of_part() != self.measure.of_part():  # of a phase that lasts for another time
            change += math.log(other.over_mean / self.over_mean)
        return change, float(parts.std(ddof=1) / math.sqrt(len(parts)))


class Growth(NamedTuple):
    """Of a rule as planned: the level at H_0, the powers of the height with which it grows below and above, and their
    standard error: by the seeds, and half of what both are apart."""

    level: float
    below: float
    above: float
    error: float


@dataclass(frozen=True, eq=False)
class CellRuns:
    """A cell with its runs."""

    cell: Cell
    cells: Cells = field(repr=False)

    @classmethod
    def of(cls, cell: Cell, execution: Execution, waves: SeaState) -> CellRuns:
        """waves: sea whose random numbers all runs take."""
        return cls(cell, Cells(cell.plan, execution, waves))

    def wants(self, heights: Sequence[float]) -> list[CellRequest]:
        """A calm, and seeds of every height."""
        of = self.cell
        calm = 1 if of.plan.environment.calm(0.0) else SEEDS
        seas = [SeaState(Hs, *of.column) for Hs in (0.0, *heights)]
        return [CellRequest(of.phase.name, of.winch, s, SEEDS if s.Hs > 0.0 else calm) for s in seas]

    def same_course(self, other: CellRuns) -> bool:
        """Whether the phase of another cell is run just so, and counts otherwise alone."""
        spot = SeaState(0.0, *self.cell.column)
        a, b = (each.cells.course(each.cell.phase, each.cell.winch, spot) for each in (self, other))
        return replace(a, times=b.times, swings=b.swings) == b

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

    def moved(self, other: CellRuns, at: float | None = None) -> Moved:
        """The lowest limit of another cell over the rules; at: further height that it was run at [m]."""
        lowest = self._lowest(other, at)
        run = sorted({self.Hs_0, self.Hs_0 if at is None else at})
        return Moved(lowest.rule, *self._as_run(lowest[1:4], run), lowest.used)

    def _lowest(self, other: CellRuns, at: float | None = None) -> Moved:
        """The same, however far from the heights that were run."""
        levels, there = other.levels(self.Hs_0), {} if at is None else other.levels(at)
        rows = [self._limit(key, level, at, there.get(key)) for key, level in levels.items() if key in self.levels]
        known = [row for row in rows if row is not None]
        nothing = Moved("", *[math.nan] * 4)
        lowest = min(known, key=lambda row: (row.Hs, -row.used), default=nothing)
        limit, rule = min(((Hs, key) for key, Hs in self.Hs.items() if math.isfinite(Hs)), default=(math.inf, ""))
        shown = rule in {row.rule for row in known} or lowest.Hs < limit or math.isinf(limit)
        return lowest if shown else nothing  # without the rule that limits as planned the others are no limit

    def further(self, other: CellRuns, limit: float) -> float | None:
        """Height at which a variation is run again [m]: about its limit, where that is far from the first height and
        from the limit as planned [m]; else None."""
        value = self._lowest(other).Hs
        if not value > 0.0:
            return None
        H = snapped(min(max(value, self.Hs_0 / FURTHEST), self.Hs_0 * FURTHEST, self.highest))
        far = min(abs(math.log(H / each)) for each in (min(limit, self.highest), self.Hs_0))
        return H if far > FAR else None

    def _limit(self, key: str, level: Level, at: float | None = None, there: Level | None = None) -> Moved | None:
        base, growth = self.levels[key], self.growth.get(key)
        for each in (level, there):
            if each is not None and (~np.isfinite(each.x)).sum() > (~np.isfinite(base.x)).sum() + 1:
                return Moved(key, math.nan, 0.0, self.Hs_0, math.inf)  # runs fail that did not
        if growth is None or not level.known:
            return None
        (change, error), H = base.change(level), self.Hs_0
        if at is not None and there is not None and there.known:
            first, (change, error) = change, base.change(there)
            power = min(max((change - first) / math.log(at / H), SLOPES[0]), SLOPES[1])
            level, H, growth = there, at, growth._replace(below=power, above=power)
        scale, known = 1.0, self._crossing(base, self.growth[key], 0.0, self.Hs_0)
        if level.rule.by_Hs and 0.0 < self.Hs.get(key, math.nan) < math.inf and 0.0 < known < math.inf:
            scale = self.Hs[key] / known
        value = scale * self._crossing(level, growth, change, H)
        ends = (value, value)
        if 0.0 < value < math.inf:
            off = math.log(value / H)
            power = growth.below if off < 0.0 else growth.above
            half = t_factor(len(level.x) - 1) / power * math.hypot(error, growth.error * off)
            ends = value * math.exp(-half), value * math.exp(half)
        return Moved(key, value, *ends, _used(level, growth, change))

    def _as_run(self, limit: tuple[float, float, float], run: Sequence[float]) -> tuple[float, float, float]:
        """A limit with its ends [m], no further from the lowest and highest height that was run than `BEYOND`: below it
        lies somewhere down to 0, above somewhere up to any height."""
        value, low, high = limit
        if 0.0 < value < run[0] / BEYOND:
            value, low, high = run[0], 0.0, run[0]
        elif run[-1] * BEYOND < value < math.inf and run[-1] < self.highest / BEYOND:
            value, low, high = run[-1], run[-1], math.inf
        Hs, low, high = (math.inf if x > self.highest else x for x in (value, low, high))  # NaN stays
        return Hs, low, high

    @staticmethod
    def _crossing(level: Level, growth: Growth, change: float, H: float) -> float:
        """Height at which a level, changed by so much at H, meets its rule, whose limit may fall in steps of the height
        [m]."""
        bottom = 0.0
        for top, limit in level.rule.bands:
            room = x_limit_of(level.measure, limit) - level.still
            if room <= 0.0:
                return bottom
            rise = math.log(room / growth.level) - change
            crossing = H * math.exp(min(rise / (growth.below if rise < 0.0 else growth.above), 50.0))
            if top >= crossing:
                return max(crossing, bottom)
            bottom = top
        return math.inf


def _used(level: Level, growth: Growth, change: float) -> float:
    """Part of what waves may add that they add at the height that was run [-]."""
    room = x_limit_of(level.measure, level.rule.limit) - level.still
    return growth.level * math.exp(change) / room if room > 0.0 else math.inf


def heights_of(Hs: Mapping[str, float], highest: float) -> tuple[list[float], float]:
    """Heights at which a cell is run as planned, and the one at which variations are: about the lowest limit, or at the
    highest sea where there is none."""
    middle = snapped(min([h for h in Hs.values() if h > 0.0] + [highest]))
    return [snapped(middle / STEP), middle, *([snapped(middle * STEP)] if middle < highest else [])], middle


def base_of(runs: CellRuns, heights: Sequence[float], Hs: Mapping[str, float], Hs_0: float, highest: float) -> Base:
    """A cell as planned, its heights run."""
    levels = {h: runs.levels(h) for h in heights}
    growth = {}
    for key, at in levels[Hs_0].items():
        if not (at.known and all(of[key].known for of in levels.values())):
            continue
        slopes = []
        for h in (h for h in heights if h != Hs_0):
            (change, error), step = at.change(levels[h][key]), math.log(h / Hs_0)
            slopes.append((min(max(change / step, SLOPES[0]), SLOPES[1]), error / abs(step)))
        powers, errors = zip(*slopes, strict=True)
        apart = 0.5 * (max(powers) - min(powers))
        of = Growth(at.level, powers[0], powers[-1], math.hypot(max(errors), apart))
        growth[key] = of._replace(level=_as_in_table(at, of, Hs.get(key, math.nan), Hs_0))
    return Base(runs, Hs, Hs_0, highest, levels[Hs_0], growth)


def _as_in_table(level: Level, growth: Growth, table: float, Hs_0: float) -> float:
    """Level at H_0 that meets the rule at the table's limit [m], or none above that of these runs that is inside where
    the table has none; that of these runs where the limit falls in steps."""
    room = x_limit_of(level.measure, level.rule.limit) - level.still
    if level.rule.by_Hs or room <= 0.0:
        return growth.level
    if not 0.0 < table < math.inf:
        return min(growth.level, room)
    return float(room * (Hs_0 / table) ** (growth.below if table < Hs_0 else growth.above))


def run(wanted: Sequence[tuple[CellRuns, Sequence[float]]], progress: Progress | None) -> None:
    """All runs together, so that blocks of lanes and threads are full."""
    request_together([(runs.cells, runs.wants(heights)) for runs, heights in wanted], progress)
