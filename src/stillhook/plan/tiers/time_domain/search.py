"""The search of the twin's tier: which limits may govern, and which cells determine them.

Where a limiting wave height is looked for: cells of a column placed about the height at which a rule is just met.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.phases import Phase
from stillhook.plan.definition.rules import Alternative, Limited, Tier
from stillhook.plan.limits import Limits, limited, utilisation
from stillhook.plan.tiers.time_domain.cells import CellRequest, Cells, quantities
from stillhook.plan.tiers.time_domain.lowering import KINDS, SeaState, Winch, winch_of
from stillhook.statistics.estimate import Estimate


@dataclass(frozen=True)
class Search:
    """How closely a limit is looked for.

    seeds first given to a cell, and the step and most of them; width: half of the 95 % interval of what waves add to a
    utilisation, over it, at which the seeds of the cell next to the limit are enough; near: distance of a cell from the
    limit, over it, at which it is found; cells a column may have; growth exponents between which a utilisation's growth
    with height is believed.
    """

    seeds: int = 20
    more: int = 16
    most_seeds: int = 64
    width: float = 0.12
    near: float = 0.06
    cells: int = 6
    growth: tuple[float, float] = (0.7, 2.5)


LEAST_STEP, MOST_STEP = 1.08, 2.0
"""Factors between which the height grows where no sea was beyond yet."""
BEHIND = 1.04
"""Where the next height is placed behind a crossing that is foreseen, over it: a cell that is beyond ends a search, one
inside does not."""
STEEP, LEAST_PART = 1.5, 0.5
"""A cell that is so far beyond says little about the crossing: it is then not looked for below this part of the way to
that cell."""
USUAL_GROWTH = 1.3
"""Exponent of growth before two seas determine it: motions grow with the height, drag with its square."""
FINE, COARSE, TURN = 0.025, 0.05, 1.0
"""Heights are whole multiples of 2.5 cm below 1 m and of 5 cm above, so that alternatives meet in the same seas [m]."""


def snapped(Hs: float) -> float:
    """The nearest height that is run [m]."""
    step = FINE if Hs < TURN else COARSE
    return round(max(round(Hs / step), 1) * step, 6)


def next_height(Hs: FloatArray, u: FloatArray, guess: float, highest: float, search: Search) -> float | None:
    """Height that is run next in a column [m], or None where its limit is found.

    Parameters: Hs (k,) rising heights that were run, the calm (0) first; u (k,) their largest utilisation, 1 at the
    limit, NaN where no rule is determined; guess: limit that another tier predicts (NaN: none), tried first; highest
    sea to analyse. The limit is the first crossing. Found is: a calm that is beyond, the highest sea inside, a cell
    within `near` of the crossing, or no room for another one.
    """
    if not u[0] < 1.0:
        return None
    if len(Hs) == 1:
        first = guess if guess > 0.0 and math.isfinite(guess) else highest if guess == math.inf else 0.5 * highest
        return snapped(min(first, highest))
    if np.isnan(u[1:]).any() or len(Hs) > search.cells:
        return None
    beyond = np.flatnonzero(u > 1.0)
    wanted = _higher(Hs, u, highest, search) if not len(beyond) else _between(Hs, u, int(beyond[0]), search)
    if wanted is None:
        return None
    wanted = snapped(min(wanted, highest))
    return None if bool(np.any(np.abs(Hs - wanted) < 1e-9)) else wanted


def crossing(Hs: FloatArray, u: FloatArray, search: Search) -> float:
    """Height at which the utilisation first passes 1 [m], by a power of the height between the neighbouring cells; inf
    where none does, 0 where a calm is beyond."""
    beyond = np.flatnonzero(u > 1.0)
    if not len(beyond):
        return math.inf
    k = int(beyond[0])
    if k == 0:
        return 0.0
    p = _growth(Hs, u, k, search)
    low, high = u[k - 1], u[k]
    if not math.isfinite(high):
        return 0.5 * float(Hs[k - 1] + Hs[k])
    part = (1.0 - low) / (high - low)
    return float((Hs[k - 1] ** p + part * (Hs[k] ** p - Hs[k - 1] ** p)) ** (1.0 / p))


def _growth(Hs: FloatArray, u: FloatArray, k: int, search: Search) -> float:
    """Exponent with which the utilisation grows over the calm's up to cell k."""
    i = max(k - 1, 1)
    if i == k or not (u[i] > u[0] and u[k] > u[i] and math.isfinite(u[k])):
        return USUAL_GROWTH
    return float(np.clip(math.log((u[k] - u[0]) / (u[i] - u[0])) / math.log(Hs[k] / Hs[i]), *search.growth))


def _higher(Hs: FloatArray, u: FloatArray, highest: float, search: Search) -> float | None:
    """Beyond the highest cell, all of them inside."""
    top = float(Hs[-1])
    if top >= highest - 1e-9:
        return None
    rise = u[-1] - u[0]
    if not rise > 0.0:
        return min(MOST_STEP * top, highest)
    factor = ((1.0 - u[0]) / rise) ** (1.0 / _growth(Hs, u, len(Hs) - 1, search))
    return top * float(np.clip(BEHIND * factor, LEAST_STEP, MOST_STEP))


def _between(Hs: FloatArray, u: FloatArray, k: int, search: Search) -> float | None:
    """Between a cell inside and one beyond."""
    at = crossing(Hs, u, search)
    if u[k] > STEEP:
        at = max(at, LEAST_PART * float(Hs[k]) + (1.0 - LEAST_PART) * float(Hs[k - 1]))
    neighbours = [float(h) for h in (Hs[k - 1], Hs[k]) if h > 0.0]
    if min(abs(at - h) for h in neighbours) <= search.near * at:
        return None
    return at


def nearest(Hs: FloatArray, at: float) -> int:
    """Number of the cell next to a height, the calm left out; of the highest one for inf."""
    if not math.isfinite(at):
        return len(Hs) - 1
    return 1 + int(np.argmin(np.abs(Hs[1:] - at))) if len(Hs) > 1 else 0


Column = tuple[float, float]
"""Tp [s] and direction of travel [rad]."""

UNDERESTIMATE_FACTOR: Mapping[Tier, float] = {Tier.FREQUENCY: 1.25, Tier.CLOSED_FORM: 1.0}
"""A phase may govern down to its predicted limit over this factor: the frequency-domain method may overestimate by so
much; the closed form of the splash zone is conservative."""
FIRST_GUESS_FACTOR: Mapping[Tier, float] = {Tier.FREQUENCY: 1.05, Tier.CLOSED_FORM: 1.8}
"""First height of a search over the predicted limit: slightly above it, because a cell beyond the limit ends a
search; the closed form of the splash zone is conservative by about so much (docs/explanation/limits-by-runs.md)."""
GOVERNING_MARGIN = 1.1
"""A phase that stays within its limits up to this factor over a known limit of another one does not govern, and is not
searched any higher."""


@dataclass(eq=False)
class LimitSearch:
    """Search for one limit: a phase under an alternative in a column. first_guess: predicted height, where the search
    begins; floor: lower bound assumed for the limit [m]; limit: result (NaN: not yet); provisional: estimate so far."""

    phase: Phase
    alternative: Alternative
    winch: Winch
    column: Column
    first_guess: float
    floor: float
    started: bool = False
    limit: float = math.nan
    provisional: float = math.inf

    @property
    def resolved(self) -> bool:
        return not math.isnan(self.limit)

    def spot(self, Hs: float) -> SeaState:
        return SeaState(Hs, *self.column)


class Work:
    """The state of a search over all lines."""

    def __init__(self, plan: LiftPlan, search: Search, cells: Cells, progress: Progress | None) -> None:
        self.plan, self.search, self.cells, self.progress = plan, search, cells, progress
        self.lines: list[LimitSearch] = []
        self.groups: dict[tuple[Alternative, Column], list[LimitSearch]] = {}
        self.others: dict[tuple[Alternative, Column], float] = {}
        self.estimates: dict[tuple[str, Alternative, SeaState, int], dict[str, Estimate]] = {}
        self.share = 0.0

    def prepare(self, predicted: Sequence[Limits]) -> None:
        """Lines of all phases that can be run, and the lowest limit of those that cannot."""
        columns = [(T, beta) for T, beta, _ in self.plan.environment.table().columns()]
        predictions = _least_predicted(predicted)
        for alternative in self.plan.alternatives:
            for column in columns:
                group = self.groups.setdefault((alternative, column), [])
                for phase in self.plan.phases:
                    guess, tier = predictions.get((phase.name, alternative, column), (math.nan, None))
                    if phase.kind not in KINDS:
                        old = self.others.get((alternative, column), math.inf)
                        self.others[alternative, column] = old if math.isnan(guess) else min(old, guess)
                        continue
                    floor = 0.0 if tier is None else guess / UNDERESTIMATE_FACTOR[tier]
                    first_guess = guess if tier is None else guess * FIRST_GUESS_FACTOR[tier]
                    group.append(
                        LimitSearch(
                            phase,
                            alternative,
                            winch_of(phase, alternative),
                            column,
                            first_guess,
                            floor,
                            provisional=math.inf if math.isnan(first_guess) else first_guess,
                        )
                    )
                self.lines += group

    def round(self) -> bool:
        """Start what may govern, ask what is wanted, and say whether anything was."""
        for key, group in self.groups.items():
            self._start(key, group)
        looking = [line for line in self.lines if line.started and not line.resolved]
        resolved = sum(line.resolved for line in self.lines)
        wanted = [ask for line in looking for ask in self._next_cells(line, self._provisional(line))]
        if not wanted and resolved == sum(line.resolved for line in self.lines):
            wanted = [ask for line in looking for ask in self._next_cells(line)]
        if not wanted:
            return bool(looking)
        self.cells.request(_merged(wanted), self._progress(len(wanted)))
        return True

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

    def _provisional(self, line: LimitSearch) -> float:
        """Lowest limit that other phases of a line's column seem to have, of those that are not found yet [m]."""
        others = [o for o in self.groups[line.alternative, line.column] if o is not line and not o.resolved]
        return min((o.provisional for o in others), default=math.inf)

    def _next_cells(self, line: LimitSearch, provisional: float = math.inf) -> list[CellRequest]:
        """The next cell of a line, or more seeds for the one next to its limit; none where the limit is found, or where
        the line waits for other phases: it is inside up to what their limits seem to be, `hoped` [m], and may not
        matter."""
        still = self.plan.environment.calm(0.0)
        calm = CellRequest(line.phase.name, line.winch, line.spot(0.0), 1 if still else self.search.seeds)
        if calm.cell not in self.cells.runs:
            return [calm]
        Hs = self.heights(line)
        u = self.used(line, Hs)
        at = crossing(Hs, u, self.search)
        line.provisional = at if 0.0 < at < math.inf else max(line.provisional, float(Hs[-1]))
        bound = GOVERNING_MARGIN * self.least(line.alternative, line.column)
        highest = min(max(self.plan.environment.Hs), bound)
        if (
            GOVERNING_MARGIN * provisional < highest
            and u[0] < 1.0
            and (line.first_guess > GOVERNING_MARGIN * provisional if len(Hs) == 1 else not (u > 1.0).any())
        ):
            return []
        wanted = next_height(Hs, u, line.first_guess, highest, self.search)
        if wanted is not None:
            return [CellRequest(line.phase.name, line.winch, line.spot(wanted), self.search.seeds)]
        k = nearest(Hs, at)
        if k > 0 and 0.0 < at <= bound and at < math.inf:
            more = self._more_seeds(line, float(Hs[k]))
            if more is not None:
                return [more]
        line.limit = at
        return []

    def _more_seeds(self, line: LimitSearch, Hs: float) -> CellRequest | None:
        """More seeds for a cell whose interval is still too wide."""
        n = len(self.cells.runs[line.phase.name, line.winch, line.spot(Hs)]["duration"])
        if n >= self.search.most_seeds or openness(self, line, Hs) <= self.search.width:
            return None
        return CellRequest(
            line.phase.name, line.winch, line.spot(Hs), min(n + self.search.more, self.search.most_seeds)
        )

    def heights(self, line: LimitSearch) -> FloatArray:
        """Heights that were run in a line's column, the calm first."""
        return self.cells.heights(line.phase.name, line.winch, *line.column)

    def numbers(self, line: LimitSearch, Hs: float) -> dict[str, Estimate]:
        """Quantities of one cell."""
        spot = line.spot(Hs)
        runs = self.cells.runs[line.phase.name, line.winch, spot]
        key = (line.phase.name, line.alternative, spot, len(runs["duration"]))
        if key not in self.estimates:
            course = self.cells.course(line.phase, line.winch, spot)
            estimates = quantities(self.plan, line.phase, line.alternative, line.winch, course, runs)
            self.estimates[key] = (
                {name: Estimate(e.value, e.value, e.value) for name, e in estimates.items()}
                if self.plan.environment.calm(Hs)
                else estimates
            )
        return self.estimates[key]

    def rules(self, line: LimitSearch) -> tuple[Limited, ...]:
        """Limits that hold in a line's phase under its alternative."""
        return limited(self.plan, line.phase, line.alternative)

    def least(self, alternative: Alternative, column: Column) -> float:
        """Lowest limit that is known of an alternative in a column, by runs or of a phase that is not run [m]."""
        limits = [line.limit for line in self.groups[alternative, column] if line.resolved]
        return min([self.others.get((alternative, column), math.inf), *limits])

    def governs(self, line: LimitSearch, Hs: float) -> str:
        """The rule that is used most in a cell; "" where none is determined."""
        used = _used(self.rules(line), self.numbers(line, Hs), Hs)
        return max(used, key=lambda key: used[key], default="")

    def used(self, line: LimitSearch, Hs: FloatArray) -> FloatArray:
        """Largest utilisation of each cell; NaN where no rule is determined. In a calm that of the rule that governs
        the highest sea, from which it grows there, unless the calm itself is beyond."""
        rows = [_used(self.rules(line), self.numbers(line, float(h)), float(h)) for h in Hs]
        most = np.array([max(row.values(), default=math.nan) for row in rows])
        if most[0] < 1.0 and len(rows) > 1 and rows[-1]:
            most[0] = rows[0].get(max(rows[-1], key=lambda key: rows[-1][key]), most[0])
        return most

    def _progress(self, asks: int) -> Progress | None:
        """Progress of a round as part of all: as much again is taken to come while lines are open, so that it never
        goes back."""
        if self.progress is None:
            return None
        before, tell = self.share, self.progress
        open_lines = sum(1 for line in self.lines if line.started and not line.resolved)
        part = (1.0 - before) * (asks / (asks + 1.5 * open_lines))

        def report(share: float) -> None:
            self.share = before + part * share
            tell(self.share)

        return report


def openness(work: Work, line: LimitSearch, Hs: float) -> float:
    """Half of the 95 % interval of the governing utilisation in a cell, over what the waves add to the calm's [-]; 0
    where none is determined."""
    calm, numbers = work.numbers(line, 0.0), work.numbers(line, Hs)
    used = _used(work.rules(line), numbers, Hs)
    if not used:
        return 0.0
    governs = max(used, key=lambda key: used[key])
    rule = next(r for r in work.rules(line) if r.rule.key == governs)
    estimate = numbers[rule.rule.quantity]
    low, high = utilisation(rule, np.array([estimate.low, estimate.high]), Hs)
    still = calm.get(rule.rule.quantity)
    added = used[governs] - (0.0 if still is None else float(utilisation(rule, np.array([still.value]), Hs)[0]))
    half = 0.5 * abs(float(high - low))
    return half / added if not math.isnan(half) and 0.0 < added < math.inf else 0.0


def _used(rules: Sequence[Limited], numbers: Mapping[str, Estimate], Hs: float) -> dict[str, float]:
    """Rule -> utilisation in a sea of Hs [m], of the rules that are determined."""
    utilisations = {
        r.rule.key: float(utilisation(r, np.array([numbers[r.rule.quantity].value]), Hs)[0])
        for r in rules
        if r.rule.quantity in numbers
    }
    return {key: value for key, value in utilisations.items() if not math.isnan(value)}


def _merged(wanted: Sequence[CellRequest]) -> list[CellRequest]:
    """Each cell once, with the most seeds that any line wants."""
    most: dict[Any, CellRequest] = {}
    for ask in wanted:
        if ask.cell not in most or most[ask.cell].seeds < ask.seeds:
            most[ask.cell] = ask
    return list(most.values())


def _least_predicted(predicted: Sequence[Limits]) -> dict[tuple[str, Alternative, Column], tuple[float, Tier]]:
    """(phase, alternative, column) -> lowest predicted limit [m] and its tier: frequency-domain method, else closed
    form."""
    result: dict[tuple[str, Alternative, Column], tuple[float, Tier]] = {}
    for tier in (Tier.CLOSED_FORM, Tier.FREQUENCY):
        for limits in (p for p in predicted if p.tier is tier):
            table = [np.where(np.isnan(row), np.inf, row) for row in limits.Hs.values() if not np.isnan(row).all()]
            if not table:
                continue
            least = np.min(table, axis=0)
            for T, beta, Hs in zip(limits.Tp, limits.beta, least, strict=True):
                result[limits.phase, limits.alternative, (float(T), float(beta))] = float(Hs), tier
    return result
