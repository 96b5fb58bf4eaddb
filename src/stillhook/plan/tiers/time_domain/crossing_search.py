"""The search of limits by crossings: where the next runs of a column lie, and what all runs say so far. Part of the
search of the twin's tier (`stillhook.plan.tiers.time_domain.search`)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Limited
from stillhook.plan.tiers.time_domain.cells import CellRequest, Cells, Runs, seed_of
from stillhook.plan.tiers.time_domain.crossings import (
    SEEDS_OF_SEA,
    ColumnFeatures,
    CrossingLimits,
    Feature,
    Features,
    Place,
    crossing_limits,
    next_heights,
)
from stillhook.plan.tiers.time_domain.curves import ColumnRuns, CurveLimits
from stillhook.plan.tiers.time_domain.levels import beyond_from, cell_levels, inside_up_to, used_of
from stillhook.plan.tiers.time_domain.lowering import SeaState
from stillhook.plan.tiers.time_domain.placing import GOVERNING_MARGIN, HOPELESS, Column, LimitSearch, Search

FIRST_RUNS, MANY_RUNS = 8, 60
"""Runs of a column from which a limit by crossings may be found; runs of all columns from which its feature is kept."""
ABOUT, LOWEST_ABOUT = 1.3, 0.05
"""Ratio of the heights about which features of many seeds are drawn, and the lowest of them [m]: the spectrum's shape
changes little with the height."""


class Searched(Protocol):
    """What is searched: a plan's lines with their runs (`stillhook.plan.tiers.time_domain.search.Work`)."""

    plan: LiftPlan
    search: Search
    cells: Cells

    def runs(self, line: LimitSearch, Hs: float) -> Runs: ...
    def cells_of(self, line: LimitSearch, *, bins: bool = False) -> tuple[tuple[float, Runs], ...]: ...
    def runs_of(self, line: LimitSearch, quantity: str, about: float, *, bins: bool = False) -> ColumnRuns: ...
    def bands(self, rule: Limited) -> list[tuple[float, float]]: ...
    def least(self, alternative: Alternative, column: Column) -> float: ...
    def width(self, column: Column, limit: float) -> float: ...


class CrossingSearch:
    """Runs one by one about a limit, for a search over all lines; features that it has drawn."""

    def __init__(self, work: Searched) -> None:
        self.work = work
        self.known: dict[Any, Any] = {}
        self.of_column: dict[Any, tuple[Any, ColumnFeatures]] = {}

    def next_runs(
        self, line: LimitSearch, Hs: Sequence[float], limit: float, half: float, provisional: float
    ) -> list[CellRequest]:
        """The next runs of a line, each in a sea of its own about its limit; none where the limit is found, or is
        above the known one of another phase, or where the line waits for that."""
        n = sum(len(self.work.runs(line, h)["duration"]) for h in Hs)
        if n >= FIRST_RUNS or limit == math.inf:
            line.provisional = limit if limit < math.inf else max(line.provisional, max(Hs, default=0.0))
        bound = GOVERNING_MARGIN * self.work.least(line.alternative, line.column)
        highest = min(max(self.work.plan.environment.Hs), bound)
        waits = line.first_guess > GOVERNING_MARGIN * provisional if not Hs else limit > Hs[-1]
        if GOVERNING_MARGIN * provisional < highest and waits:
            return []
        wanted = next_heights(Hs, limit, half, line.first_guess, highest)
        line.placed = n >= FIRST_RUNS or not wanted
        enough = half <= self.work.width(line.column, limit) or limit > bound
        most = self.work.search.most_seeds if half < math.inf else HOPELESS
        if not wanted or (n >= FIRST_RUNS and enough) or n >= most:
            line.limit = limit
            return []
        return [CellRequest(line.phase.name, line.winch, line.spot(h), 1) for h in wanted]

    def features(self, line: LimitSearch, about: float) -> ColumnFeatures:
        """Features of all runs of a line's column, and of many seeds of its sea about a height [m]."""
        near = line.spot(ABOUT ** round(math.log(max(about, LOWEST_ABOUT)) / math.log(ABOUT)))
        key, state = (line.phase.name, line.winch, line.column), (self.work.cells.requests, near)
        if key not in self.of_column or self.of_column[key][0] != state:
            self.of_column[key] = state, self._features(line, near)
        return self.of_column[key][1]

    def _features(self, line: LimitSearch, near: SeaState) -> ColumnFeatures:
        course = self.work.cells.course(line.phase, line.winch, line.spot(0.0))
        place = self._once(("place", line.phase.name, line.winch), lambda: Place.of(self.work.plan, line.phase, course))
        cells = [self._of_cell(place, line.spot(h), len(runs["duration"])) for h, runs in self.work.cells_of(line)]
        waves = self._once(("waves", place.key, near), lambda: place.each_metre(near))
        first = seed_of(line.spot(1.0), 0)
        many = self._once(
            ("many", place.key, line.column, waves.tip.round(6).tobytes()),
            lambda: place.of_many(waves, SEEDS_OF_SEA, first),
        )
        return ColumnFeatures(tuple(cells), many)

    def _of_cell(self, place: Place, spot: SeaState, n: int) -> Features:
        """Features of the first n runs of a cell."""
        key = ("cell", place.key, spot)
        rows = self.known.setdefault(key, [])
        seed = self.work.cells.execution.seed
        rows += [place.of_seed(spot, seed_of(spot, k, seed)) for k in range(len(rows) + 1, n + 1)]
        return {name: np.array([one[name] for one in rows[:n]]) for name in rows[0]}

    def _once(self, key: Any, make: Callable[[], Any]) -> Any:
        if key not in self.known:
            self.known[key] = make()
        return self.known[key]

    def judge(
        self,
        lines: Sequence[LimitSearch],
        rule: Limited,
        columns: Sequence[ColumnRuns],
        about: Sequence[float],
        expected: FloatArray,
        n_draws: int,
    ) -> CrossingLimits:
        """A rule's limits in columns by their runs one by one; the feature is chosen by all of them while they are
        few, and kept once they are many, until the answer."""
        key = ("feature", lines[0].phase.name, lines[0].winch, rule.rule.key)
        features = [self.features(line, a) for line, a in zip(lines, about, strict=True)]
        result = crossing_limits(
            columns,
            features,
            self.work.bands(rule),
            max(self.work.plan.environment.Hs),
            expected,
            n_draws=n_draws,
            feature=None if n_draws else self.known.get(key),
        )
        if sum(len(runs["duration"]) for column in columns for _, runs in column.cells) >= MANY_RUNS:
            self.known[key] = result.feature
        if n_draws == 0:
            return result
        quantity = rule.rule.quantity
        bins = [self.work.runs_of(line, quantity, a, bins=True) for line, a in zip(lines, about, strict=True)]
        limits = self._held_to_cells(rule, bins, result.limits)
        return replace(result, limits=limits)

    def _held_to_cells(self, rule: Limited, columns: Sequence[ColumnRuns], limits: CurveLimits) -> CurveLimits:
        """Limits none of which is below a bin of runs that is well inside, nor above one that is beyond to 95 %."""
        levels = cell_levels(columns)
        least = inside_up_to(levels, used_of(rule, columns[0].measure, levels, levels.Hs))
        most = beyond_from(columns, levels, self.work.bands(rule))
        Hs = np.minimum(np.maximum(limits.Hs, least), most)
        low = np.where(np.isnan(Hs), np.fmax(limits.low, least), np.fmin(limits.low, Hs))
        draws = np.minimum(np.maximum(limits.draws, np.where(limits.Hs < least, least, 0.0)), most)
        return replace(limits, Hs=Hs, low=low, high=np.fmax(limits.high, Hs), draws=draws)

    def by_first(
        self,
        lines: Sequence[LimitSearch],
        about: Sequence[float],
        rule: Limited,
        used: Mapping[str, Feature],
        n: int,
    ) -> CurveLimits:
        """A rule's limits by the first n runs of every column, in the order in which they were made; used: the feature
        of every rule."""
        work, order = self.work, {cell: i for i, cell in enumerate(self.work.cells.runs)}
        columns, features = [], []
        for x, a in zip(lines, about, strict=True):
            of, each = work.runs_of(x, rule.rule.quantity, a), self.features(x, a)
            made = sorted(range(len(of.cells)), key=lambda i: order[x.phase.name, x.winch, x.spot(of.cells[i][0])])
            sizes = np.cumsum([len(of.cells[i][1]["duration"]) for i in made])
            kept = sorted(made[: max(int(np.searchsorted(sizes, n, side="right")), 1)])
            columns.append(replace(of, cells=tuple(of.cells[i] for i in kept)))
            features.append(replace(each, cells=tuple(each.cells[i] for i in kept)))
        highest = max(work.plan.environment.Hs)
        return crossing_limits(columns, features, work.bands(rule), highest, feature=used[rule.rule.key]).limits
