"""The search of the twin's tier: which limits may govern, and in which seas runs are made to determine them.

Heights of a column are placed about the height at which the level of a rule crosses its limit, by the curves of all
columns together (`stillhook.plan.tiers.time_domain.curves`); runs are added where the interval of a limit is wide and
much weather is about it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress, Relay
from stillhook.plan.definition.capacities import calm as _calm
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Limited
from stillhook.plan.limits import Limits, limited
from stillhook.plan.result import NUMERICAL, in_words
from stillhook.plan.tiers.time_domain.cells import CellRequest, Cells, Runs, merged
from stillhook.plan.tiers.time_domain.crossing_search import CrossingSearch
from stillhook.plan.tiers.time_domain.crossings import HEIGHT, Feature, binned, crosses, crossing_limits, of_height
from stillhook.plan.tiers.time_domain.curves import (
    ColumnRuns,
    Curve,
    CurveLimits,
    chance_of,
    curve_of,
    limits_in_bands,
    wind_sea,
    wind_sea_limits,
    x_limit_of,
)
from stillhook.plan.tiers.time_domain.levels import (
    beyond_from,
    cell_levels,
    inside_up_to,
    may_govern,
    near_limit,
    seldom,
    share_used,
    surely_inside,
    used_of,
)
from stillhook.plan.tiers.time_domain.lowering import KINDS, Winch, winch_of
from stillhook.plan.tiers.time_domain.measures import AT_DECK, Measure, Statistic, measures
from stillhook.plan.tiers.time_domain.placing import (
    BEHIND,
    FEW_CELLS,
    FEW_OF,
    GOVERNING_MARGIN,
    LEAST_PART,
    WIDTHS,
    Column,
    Judged,
    LimitSearch,
    Search,
    cell_above,
    least_predicted,
    next_height,
    pilots_of,
    predicted_by_rule,
    prediction_factors,
    runs_for,
    usual_runs,
)
from stillhook.spec.lift.phase import APART, Phase
from stillhook.statistics.smooth_field import DRAWS


class Work:
    """The state of a search over all lines."""

    def __init__(
        self,
        plan: LiftPlan,
        search: Search,
        cells: Cells,
        progress: Progress | None,
        occurrence: Callable[[Column, float], float] | None = None,
        judges: Container[str] | None = None,
    ) -> None:
        """occurrence: weather about a limit of a column, over the usual; None: all alike. judges: quantities whose
        rules are judged; None: all."""
        self.judges = judges
        self.plan, self.search, self.cells, self.progress = plan, search, cells, progress
        self.occurrence = occurrence or (lambda column, limit: 1.0)
        self.lines: list[LimitSearch] = []
        self.groups: dict[tuple[Alternative, Column], list[LimitSearch]] = {}
        self.phases: dict[tuple[str, Alternative], list[LimitSearch]] = {}
        self.others: dict[tuple[Alternative, Column], float] = {}
        self.predicted: dict[tuple[str, Alternative, str], dict[Column, float]] = {}
        self.judged: dict[tuple[str, Winch, tuple[Limited, ...], bool], tuple[Any, Judged]] = {}
        self.judged_at: dict[tuple[str, Winch, tuple[Limited, ...], bool], int] = {}
        self.kept: dict[tuple[Any, ...], tuple[int, tuple[tuple[float, Runs], ...]]] = {}
        self.swell = float(plan.environment.H_m0(np.zeros(1))[0])
        self.crossings = CrossingSearch(self)
        self.share = 0.0
        self.waiting: set[tuple[str, Alternative]] = set()  # phases whose pilots are still looked for

    def prepare(self, predicted: Sequence[Limits]) -> None:
        """Lines of all phases that can be run, and the lowest limit of those that cannot."""
        columns = [(T, beta) for T, beta, _ in self.plan.environment.table().columns]
        pilots = pilots_of(columns)
        predictions = least_predicted(predicted)
        self.predicted = predicted_by_rule(predicted)
        for alternative in self.plan.alternatives:
            for column in columns:
                group = self.groups.setdefault((alternative, column), [])
                for phase in self.plan.phases:
                    guess, tier = predictions.get((phase.name, alternative, column), (math.nan, None))
                    if phase.kind not in KINDS:
                        old = self.others.get((alternative, column), math.inf)
                        self.others[alternative, column] = old if math.isnan(guess) else min(old, guess)
                        continue
                    if phase.kind in APART:
                        self._closed_alone(phase, alternative, column)
                    under, factor = prediction_factors(phase, tier)
                    floor, first_guess = (0.0 if tier is None else guess / under), guess * factor
                    line = LimitSearch(
                        phase,
                        alternative,
                        winch_of(phase, alternative),
                        column,
                        first_guess,
                        floor,
                        pilot=column in pilots,
                        provisional=math.inf if math.isnan(first_guess) else first_guess,
                    )
                    group.append(line)
                    self.phases.setdefault((phase.name, alternative), []).append(line)
                self.lines += group

    def _closed_alone(self, phase: Phase, alternative: Alternative, column: Column) -> None:
        """Limits at a deck that the closed form alone determines bound a column, as those of phases that are not
        run."""
        known = [
            self.predicted.get((phase.name, alternative, each.rule.key), {}).get(column, math.inf)
            for each in limited(self.plan, phase, alternative)
            if each.rule.quantity not in AT_DECK
        ]
        self.others[alternative, column] = min([self.others.get((alternative, column), math.inf), *known])

    def round(self) -> bool:
        """Start what may govern, run what is wanted, and say whether anything is left to do."""
        for lines in self.phases.values():
            self._correct(lines)
        self.waiting = {(line.phase.name, line.alternative) for line in self.lines if line.pilot and self._open(line)}
        for key, group in self.groups.items():
            self._start(key, group)
        looking = [line for line in self.lines if line.started and not line.resolved]
        before = self._reached()

        wanted = [ask for line in looking for ask in self._next_cells(line, self._provisional(line), patient=True)]
        few = max(min(FEW_CELLS, len(looking) // FEW_OF), 1)
        for patient in (True, False):  # where most wait for others: for pilots alone, at last for nothing
            if len(wanted) < few and (wanted or before == self._reached()):
                wanted = [ask for line in looking for ask in self._next_cells(line, patient=patient)]
        if not wanted:
            return bool(looking)
        asks = merged(wanted)
        self.cells.request(asks, self._progress(asks))
        return True

    def _reached(self) -> tuple[int, int]:
        """How many lines are resolved, and how many placed."""
        return sum(line.resolved for line in self.lines), sum(line.placed for line in self.lines)

    def _start(self, key: tuple[Alternative, Column], group: Sequence[LimitSearch]) -> None:
        """Of the lines that are not started, those that may lie below everything that is known, or that seems to be."""
        under_way = [line.provisional for line in group if line.started and not line.resolved]
        open_lines = [line for line in group if not line.started and line.floor < min([self.least(*key), *under_way])]
        first = min(open_lines, key=lambda line: line.floor, default=None)
        if first is None or first.floor == math.inf:
            return
        bar = first.first_guess if first.first_guess > 0.0 else first.floor
        for line in open_lines:
            line.started = line is first or line.floor <= bar

    def _correct(self, lines: Sequence[LimitSearch]) -> None:
        """Where the search begins in the columns of a phase under an alternative that have no runs: the prediction, by
        as much higher or lower as it was too low or too high in columns of about this period."""
        of = [line for line in lines if 0.0 < line.predicted < math.inf]
        result = [line for line in of if line.pilot and (line.placed or line.resolved) and line.provisional > 0.0]
        known = [(math.log(line.column[0]), math.log(line.provisional / line.predicted)) for line in result]
        if not known:
            return
        ln_T, off = np.array(sorted(known)).T
        for line in of:
            if not line.pilot and not line.resolved and not self.heights(line):
                ratio = math.exp(float(np.interp(math.log(line.column[0]), ln_T, off)))
                line.first_guess = line.provisional = BEHIND * ratio * line.predicted

    @staticmethod
    def _open(line: LimitSearch) -> bool:
        """Whether a line was started and its cells are not about its limit yet."""
        return line.started and not line.placed and not line.resolved

    def _provisional(self, line: LimitSearch) -> float:
        """Lowest limit that other phases of a line's column seem to have, of those that are not found yet [m]."""
        others = [o for o in self.groups[line.alternative, line.column] if o is not line and not o.resolved]
        return min((o.provisional for o in others), default=math.inf)

    def _next_cells(
        self, line: LimitSearch, provisional: float = math.inf, *, patient: bool = False
    ) -> list[CellRequest]:
        """The next cell of a line, or more runs about its limit; none where the limit is found, or where the line waits
        for other phases: it is inside up to what their limits seem to be, `provisional` [m], and may not matter.
        patient: it waits for pilots, and for other columns whose runs narrow its interval, as well."""
        still = self.plan.environment.calm(0.0)
        calm = CellRequest(line.phase.name, line.winch, line.spot(0.0), 1 if still else self.search.seeds)
        if calm.cell not in self.cells.runs:
            return [calm]
        Hs = self.heights(line)
        if patient and not Hs and not line.pilot and (line.phase.name, line.alternative) in self.waiting:
            return []
        limit, half = self.estimate(line) if Hs else self._of_calm(line)
        if self.crosses(line) and limit != 0.0:
            return self.crossings.next_runs(line, Hs, limit, half, provisional)
        if limit == 0.0:
            line.limit = 0.0
            return []
        line.provisional = limit if limit < math.inf else max(line.provisional, max(Hs, default=0.0))
        bound = GOVERNING_MARGIN * self.least(line.alternative, line.column)
        highest = min(max(self.plan.environment.Hs), bound)
        waits = line.first_guess > GOVERNING_MARGIN * provisional if not Hs else limit > Hs[-1]
        if GOVERNING_MARGIN * provisional < highest and waits:
            return []
        seen = min(limit, self._so_far(line).direct(line.column)) if Hs else math.inf
        wanted = next_height(Hs, seen, line.first_guess, highest, self.search)
        unbounded = half == math.inf
        if wanted is None and unbounded and len(Hs) > 1:
            wanted = cell_above(Hs, limit, min(highest, GOVERNING_MARGIN * provisional))
        line.placed = wanted is None
        if wanted is not None:
            return [CellRequest(line.phase.name, line.winch, line.spot(wanted), self.search.seeds)]
        width = self.width(line.column, limit)
        if 0.0 < limit <= bound and limit < math.inf and half > width:
            if patient and any(self._open(other) for other in self.phases[line.phase.name, line.alternative]):
                return []  # their runs narrow this interval as well
            more = self._more_runs(line, Hs, limit, half / width)
            if more is not None:
                return [more]
        line.limit = limit
        return []

    def crosses(self, line: LimitSearch) -> bool:
        """Whether crossings find a line's limits: not with a swell, where features do not grow with the height."""
        return self.swell == 0.0 and crosses(line.phase)

    def _of_calm(self, line: LimitSearch) -> tuple[float, float]:
        """0 where a rule is beyond in a calm, else no limit."""
        beyond = any(self.beyond_in_calm(line, each) for each in self.rules(line))
        return (0.0, 0.0) if beyond else (math.inf, math.nan)

    def beyond_in_calm(self, line: LimitSearch, rule: Limited) -> bool:
        """Whether still water is beyond a rule; of a swell the curve says so."""
        calm, measure = self.runs(line, 0.0), self.measures(line).get(rule.rule.quantity)
        if self.swell > 0.0 or measure is None or measure.x not in calm or measure.statistic is Statistic.CHANCE:
            return False
        return float(measure.values(calm)[0]) > measure.to_x(rule.limit) * (1.0 + 1e-9)

    def _more_runs(self, line: LimitSearch, Hs: Sequence[float], limit: float, wide: float) -> CellRequest | None:
        """More runs for the cell next to the limit while the column may have more; wide: half of its interval over that
        which is narrow enough."""
        sizes = {h: len(self.runs(line, h)["duration"]) for h in Hs}
        more = runs_for(sum(sizes.values()), wide, self.search)
        h = min(Hs, key=lambda h: abs(h - limit))
        return CellRequest(line.phase.name, line.winch, line.spot(h), sizes[h] + more) if more else None

    def width(self, column: Column, limit: float) -> float:
        """Half of the 95 % interval that is narrow enough about a limit [m]: an error of it costs as many days as there
        is weather about it."""
        often = max(self.occurrence(column, limit), 1e-6)
        return self.search.width * min(max(1.0 / math.sqrt(often), WIDTHS[0]), WIDTHS[1])

    def heights(self, line: LimitSearch) -> list[float]:
        """Heights above 0 that were run in a line's column, rising."""
        return [float(h) for h in self.cells.heights(line.phase.name, line.winch, *line.column) if h > 0.0]

    def runs(self, line: LimitSearch, Hs: float) -> dict[str, FloatArray]:
        """Runs of a cell."""
        return self.cells.runs[line.phase.name, line.winch, line.spot(Hs)]

    def measures(self, line: LimitSearch) -> dict[str, Measure]:
        """Measures of a line's quantities."""
        course = self.cells.course(line.phase, line.winch, line.spot(0.0))
        return self.plan.once(measures, line.phase, line.alternative, line.winch, course)

    def rules(self, line: LimitSearch) -> tuple[Limited, ...]:
        """Limits that hold in a line's phase under its alternative."""
        rules = limited(self.plan, line.phase, line.alternative)
        return tuple(each for each in rules if self.judges is None or each.rule.quantity in self.judges)

    def estimate(self, line: LimitSearch) -> tuple[float, float]:
        """Lowest limit of a line as it is now [m], and half of its interval in ln."""
        return self._so_far(line).least(line.column)

    def judgement(self, line: LimitSearch) -> Judged:
        """Limits of a line's phase under its alternative in all columns that have runs."""
        return self.judge(line.phase.name, line.alternative)

    def _so_far(self, line: LimitSearch) -> Judged:
        """The same of those rules that runs came near to."""
        return self.judge(line.phase.name, line.alternative, near=True)

    def judge(self, phase: str, alternative: Alternative, *, near: bool = False) -> Judged:
        """Limits of a phase under an alternative in all columns that have runs of its winch; calculated again where
        runs were added, and once for alternatives under which they are the same. near: of rules alone that a run came
        near to."""
        first = self.phases[phase, alternative][0]
        key = (phase, first.winch, self.rules(first), near)
        if self.judged_at.get(key) == self.cells.requests:
            return self.judged[key][1]
        lines = [line for line in self.phases[phase, alternative] if self.heights(line)]
        state = tuple(
            (line.column, *(len(self.runs(line, h)["duration"]) for h in self.heights(line))) for line in lines
        )
        known = self.judged.get(key)
        if known is None or known[0] != state:
            before = known or self.judged.get((*key[:-1], True))
            self.judged[key] = known = state, self._judge(phase, lines, before[1] if before else None, near=near)
        self.judged_at[key] = self.cells.requests
        return known[1]

    def _judge(self, phase: str, lines: Sequence[LimitSearch], before: Judged | None, *, near: bool) -> Judged:
        columns = tuple(line.column for line in lines)
        curves: dict[str, Curve] = {}
        limits: dict[str, CurveLimits] = {}
        failed: dict[str, str] = {}
        features: dict[str, Feature] = {}
        if not lines:
            return Judged(columns, curves, limits)
        about = [self.about(line, before) for line in lines]
        rules = [each for each in self.rules(lines[0]) if all(self.has(line, each.rule.quantity) for line in lines)]
        runs = [
            [self.runs_of(line, each.rule.quantity, a) for line, a in zip(lines, about, strict=True)] for each in rules
        ]
        shares, nearest = (
            np.array([[share_used(self.bands(each), f(c)) for c in of] for each, of in zip(rules, runs, strict=True)])
            for f in (lambda column: column, near_limit)
        )
        guides = may_govern(shares, nearest) if near and rules else np.ones(len(rules), dtype=np.bool_)
        guides |= [bool(each.by_Hs) for each in rules]  # such a rule has an end whatever was run
        for each, of, guide in zip(rules, runs, guides, strict=True):
            if not guide:
                continue
            expected = self.predicted.get((phase, lines[0].alternative, each.rule.key), {})
            guess = np.array([self.height(expected.get(column, math.nan)) for column in columns])
            n_draws = 0 if near else DRAWS
            crossed = self.crosses(lines[0]) and of[0].measure.statistic is Statistic.LARGEST
            try:
                if crossed:
                    result = self.crossings.judge(lines, each, of, about, guess, n_draws)
                    limits[each.rule.key], features[each.rule.key] = result.limits, result.feature
                    continue
                if self.crosses(lines[0]):
                    quantity = each.rule.quantity
                    of = [self.runs_of(line, quantity, a, bins=True) for line, a in zip(lines, about, strict=True)]
                curves[each.rule.key], limits[each.rule.key] = self.limits_of(each, of, guess, n_draws=n_draws)
            except NUMERICAL as problem:
                failed[each.rule.key] = in_words(problem)
        return Judged(columns, curves, limits, failed, features)

    def limits_by_first(self, line: LimitSearch, rule: Limited, judged: Judged, n: int) -> CurveLimits:
        """A rule's limits in all columns by the first runs alone: n of every cell, or by crossings n of every column in
        the order in which they were made."""
        if rule.rule.key not in judged.features:
            return self.limits_of(rule, [_first(of, n) for of in judged.curves[rule.rule.key].columns])[1]
        lines = [x for x in self.phases[line.phase.name, line.alternative] if x.column in judged.columns]
        return self.crossings.by_first(lines, [self.about(x, judged) for x in lines], rule, judged.features, n)

    def limits_of(
        self,
        rule: Limited,
        columns: Sequence[ColumnRuns],
        expected: FloatArray | None = None,
        *,
        n_draws: int = 0,
    ) -> tuple[Curve, CurveLimits]:
        """The curve of a rule's quantity in columns, and the rule's limits of the wind sea; expected (c,): limits of a
        cheaper method, of all waves [m]; n_draws of all limits together: limits and their lower ends are then held
        against what the cells say (`stillhook.plan.tiers.time_domain.levels`)."""
        curve, limits = self._limits_of(rule, columns, expected, n_draws)
        if n_draws == 0 or columns[0].measure.statistic is Statistic.CHANCE:
            return curve, limits
        levels, bands = cell_levels(columns), self.bands(rule)
        used = used_of(rule, columns[0].measure, levels, self.wind_sea(levels.Hs))
        least, most = self.wind_sea(inside_up_to(levels, used)), self.wind_sea(beyond_from(columns, levels, bands))
        Hs = np.fmin(np.maximum(limits.Hs, least), most)
        certain = np.fmin(self.wind_sea(surely_inside(columns, levels, bands, self.all_waves(Hs))), Hs)
        low = np.fmin(np.where(certain > 0.0, np.fmax(limits.low, certain), limits.low), Hs)
        high = np.where(limits.high < Hs, Hs, limits.high)
        draws = np.minimum(np.maximum(limits.draws, np.where(limits.Hs < least, least, certain)), most)
        return curve, replace(limits, Hs=Hs, low=low, high=high, draws=draws)

    def bands(self, rule: Limited) -> list[tuple[float, float]]:
        """Bands of a rule's limit by the height of all waves [m]."""
        return [(self.height(top), limit) for top, limit in rule.bands]

    def _limits_of(
        self, rule: Limited, columns: Sequence[ColumnRuns], expected: FloatArray | None, n_draws: int
    ) -> tuple[Curve, CurveLimits]:
        highest = self.height(max(self.plan.environment.Hs))
        if seldom(columns):  # by whether each run is beyond, and its height alone
            curve = Curve(tuple(columns), np.array([column.still for column in columns]), None)
            limits = crossing_limits(
                columns, of_height(columns), self.bands(rule), highest, expected, n_draws=n_draws, feature=HEIGHT
            ).limits
        else:
            curve = curve_of(columns, chance_of(columns, rule.limit))
            bands = [
                (top, np.array([x_limit_of(column.measure, limit) for column in columns]))
                for top, limit in self.bands(rule)
            ]
            limits = limits_in_bands(curve, bands, highest, expected, n_draws=n_draws)
        return curve, limits if self.swell == 0.0 else wind_sea_limits(limits, self.swell)

    def height(self, Hs: float) -> float:
        """Height of all waves of a wind sea [m], swell included."""
        return math.hypot(Hs, self.swell)

    def all_waves(self, Hs: FloatArray) -> FloatArray:
        """The same of many."""
        return np.hypot(Hs, self.swell)

    def wind_sea(self, Hs: FloatArray) -> FloatArray:
        """Heights of the wind sea in all waves of a height [m]."""
        return wind_sea(Hs, self.swell)

    def has(self, line: LimitSearch, quantity: str) -> bool:
        """Whether runs of a line determine a quantity."""
        measure = self.measures(line).get(quantity)
        return measure is not None and measure.x in self.runs(line, 0.0)

    def about(self, line: LimitSearch, before: Judged | None) -> float:
        """Height about which a column's curve is looked at [m]: that of the limit, as far as it is known."""
        Hs = self.heights(line)
        limit = before.least(line.column)[0] if before is not None and line.column in before.columns else math.inf
        return self.height(min(max(limit, Hs[0]), Hs[-1]))

    def cells_of(self, line: LimitSearch, *, bins: bool = False) -> tuple[tuple[float, Runs], ...]:
        """Heights of the cells of a line's column that were run in waves [m], rising, and their runs; bins: runs of
        about one height as one cell. Made once until more is run."""
        key, state = (line.phase.name, line.winch, line.column, bins), self.cells.requests
        known = self.kept.get(key)
        if known is None or known[0] != state:
            cells = tuple((h, self.runs(line, h)) for h in self.heights(line))
            self.kept[key] = known = state, binned(cells) if bins else cells
        return known[1]

    def runs_of(self, line: LimitSearch, quantity: str, about: float, *, bins: bool = False) -> ColumnRuns:
        """What was run in a line's column of a quantity, by heights of all waves; about [m] as in `ColumnRuns`; bins as
        in `cells_of`."""
        measure, calm = self.measures(line)[quantity], self.runs(line, 0.0)
        cells = self.cells_of(line, bins=bins)
        if self.swell == 0.0:
            still = float(measure.values(calm)[0])
        else:
            known = self.plan.once(_calm, line.phase).get(quantity, math.nan)
            still = measure.to_x(known) if math.isfinite(known) else LEAST_PART * float(measure.values(calm).min())
            cells = ((self.swell, calm), *((self.height(h), runs) for h, runs in cells))
        return ColumnRuns(*line.column, measure, about, still, cells)

    def least(self, alternative: Alternative, column: Column) -> float:
        """Lowest limit that is known of an alternative in a column, by runs or of a phase that is not run [m]."""
        limits = [line.limit for line in self.groups[alternative, column] if line.resolved]
        return min([self.others.get((alternative, column), math.inf), *limits])

    def _progress(self, wanted: Sequence[CellRequest]) -> Progress | None:
        """Progress of a round as part of all, by runs; it never goes back."""
        if self.progress is None:
            return None
        before, tell = self.share, self.progress
        there = (len(self.cells.runs.get(ask.cell, {"duration": ()})["duration"]) for ask in wanted)
        done = self.cells.n_runs + sum(max(ask.seeds - n, 0) for ask, n in zip(wanted, there, strict=True))
        open_lines = sum(1 for line in self.lines if line.started and not line.resolved)
        total = max(usual_runs(self.plan), done + self.search.seeds * open_lines)
        part = max(done / total - before, 0.0)

        def report(share: float) -> None:
            self.share = before + part * share
            tell(self.share)

        return Relay(report, tell, self.cells.n_runs, total)


def _first(of: ColumnRuns, n: int) -> ColumnRuns:
    """The first n runs of every cell of a column."""
    return replace(of, cells=tuple((h, {name: x[:n] for name, x in runs.items()}) for h, runs in of.cells))
