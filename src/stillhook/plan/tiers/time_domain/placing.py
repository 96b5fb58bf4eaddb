"""Where the search of the twin's tier places its cells: its lines, columns that come first, heights, and where a
prediction puts the first of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Tier
from stillhook.plan.limits import Limits
from stillhook.plan.tiers.time_domain.crossings import Feature
from stillhook.plan.tiers.time_domain.curves import BEYOND_CELLS, Curve, CurveLimits
from stillhook.plan.tiers.time_domain.lowering import SeaState, Winch
from stillhook.spec.lift.phase import APART, Phase

Column = tuple[float, float]
"""Tp [s] and direction of travel [rad]."""

UNDERESTIMATE_FACTOR: Mapping[Tier, float] = {Tier.FREQUENCY: 1.25, Tier.CLOSED_FORM: 1.0}
"""A phase may govern down to its predicted limit over this factor: the frequency-domain method may overestimate by so
much; the closed form of the splash zone is conservative."""
FIRST_GUESS_FACTOR: Mapping[Tier, float] = {Tier.FREQUENCY: 1.0, Tier.CLOSED_FORM: 1.7}
"""First height of a search over the predicted limit; the closed form of the splash zone is conservative by about so
much (docs/explanation/limits-by-runs.md)."""
HELD_UNDERESTIMATE_FACTOR, HELD_FIRST_GUESS_FACTOR = 1.5, 0.9
"""The same of a payload that is held in the wave zone: the closed form looks at one wave, and half an hour has more.
Limits by runs were 0.69 to 1.2 times the closed form's (docs/explanation/limits-by-runs.md)."""
DECK_UNDERESTIMATE_FACTOR, DECK_FIRST_GUESS_FACTOR = 1.5, 1.3
"""The same at a deck, of the closed form: it takes the worst instant of half an hour, which a run hardly meets, and a
compensated winch leaves less or more than the fifth that it assumes."""
PILOTS = 4
"""Periods whose limits are looked for first, in the middle direction: by how much the prediction is off there corrects
it elsewhere."""


@dataclass(frozen=True)
class Search:
    """How closely a limit is looked for.

    seeds first given to a cell, and the step by which a column gets more of them, up to most_seeds; width: half of the
    95 % interval of a limit, over it, that is narrow enough in weather of the usual frequency; near: distance of a cell
    from the limit, over it, at which it is found; cells a column may have.
    """

    seeds: int = 8
    more: int = 8
    most_seeds: int = 64
    width: float = 0.1
    near: float = 0.12
    cells: int = 6


@dataclass(eq=False)
class LimitSearch:
    """Search for one limit: a phase under an alternative in a column. predicted height [m]; first_guess: where the
    search begins; floor: lower bound assumed for the limit [m]; limit: result (NaN: not yet); provisional: estimate so
    far; pilot: one of those that are looked for first; placed: cells are about the limit, however many runs they have
    yet."""

    phase: Phase
    alternative: Alternative
    winch: Winch
    column: Column
    predicted: float
    floor: float
    started: bool = False
    pilot: bool = False
    placed: bool = False
    limit: float = math.nan
    provisional: float = math.inf
    first_guess: float = math.nan

    def __post_init__(self) -> None:
        self.first_guess = self.predicted

    @property
    def resolved(self) -> bool:
        return not math.isnan(self.limit)

    def spot(self, Hs: float) -> SeaState:
        return SeaState(Hs, *self.column)


LEAST_STEP, MOST_STEP = 1.12, 2.0
"""Factors between which the height grows where no limit is seen yet."""
BEHIND = 1.05
"""Where the next height is placed behind a limit that is seen from below, over it: a cell beyond shows that the number
grows so far."""
LEAST_PART = 0.5
"""Least part of the lowest height at which a limit below it is looked for next."""
FINE, COARSE, TURN = 0.025, 0.05, 1.0
"""Heights are whole multiples of 2.5 cm below 1 m and of 5 cm above, so that alternatives meet in the same seas [m]."""
USUAL_RUNS = 36
"""Runs that the limits of an alternative take in a column, in the example: for progress."""
UPWARDS = 1.6
"""Where a cell is placed well above a limit, over it."""
GOVERNING_MARGIN = 1.1
"""A phase that stays within its limits up to this factor over a known limit of another one does not govern, and is not
searched any higher."""
HOPELESS = 40
"""Runs that a column may have where the interval of its limit has no end: more of them would hardly give it one."""
WIDTHS = (0.7, 2.0)
"""Factors on `Search.width` in the weather that is most and least frequent."""


FEW_CELLS, FEW_OF = 4, 16
"""Cells of a round that fill two threads with blocks of sixteen runs: where fewer are wanted, and fewer than one of so
many columns that are looked at, those that would wait for others continue as well, for waiting costs as much."""


def snapped(Hs: float) -> float:
    """The nearest height that is run [m]."""
    step = FINE if Hs < TURN else COARSE
    return round(max(round(Hs / step), 1) * step, 6)


def next_height(Hs: Sequence[float], limit: float, guess: float, highest: float, search: Search) -> float | None:
    """Height that is run next in a column [m], or None where there is a cell about its limit.

    Parameters: Hs rising heights above 0 that were run; limit as their runs give it [m] (inf: none is seen); guess:
    limit that another tier predicts (NaN: none), tried first; highest sea to analyse.
    """
    if not len(Hs):
        first = guess if guess > 0.0 and math.isfinite(guess) else highest if guess == math.inf else 0.5 * highest
        return snapped(min(first, highest))
    top = Hs[-1]
    if len(Hs) >= search.cells or (limit > top and top >= highest * (1.0 - 1e-9)):
        return None
    if limit > top:
        wanted = top * min(max(BEHIND * limit / top, LEAST_STEP), MOST_STEP)
    elif min(abs(limit - h) for h in Hs) <= search.near * limit:
        return None
    else:
        wanted = max(limit, LEAST_PART * Hs[0])
    wanted = snapped(min(wanted, highest))
    return None if any(abs(h - wanted) < 1e-9 for h in Hs) else wanted


def pilots_of(columns: Sequence[Column]) -> set[Column]:
    """Columns whose limits are looked for first: periods over all of their range, the middle direction."""
    T, beta = (sorted({column[i] for column in columns}) for i in (0, 1))
    if len(columns) <= 2 * PILOTS:
        return set(columns)
    places = np.unique(np.linspace(0, len(T) - 1, PILOTS).round().astype(int))
    return {(T[i], beta[len(beta) // 2]) for i in places} & set(columns)


def cell_above(Hs: Sequence[float], limit: float, highest: float) -> float | None:
    """A cell well above a limit about which a level hardly grows: runs there show whether it goes beyond at all. None
    where there is one, or none in the seas that count."""
    wanted = min(UPWARDS * limit, highest)
    return snapped(wanted) if wanted > BEYOND_CELLS * Hs[-1] else None


def runs_for(n: int, wide: float, search: Search) -> int:
    """How many runs more a column with n of them gets, half of whose interval is so many times what is narrow enough:
    half of what it would take alone, for others narrow it as well; as many again where it has no end; none where the
    column has as many as it may."""
    most = search.most_seeds if wide < math.inf else HOPELESS
    if n >= most:
        return 0
    wanted = min(0.5 * n * (wide**2 - 1.0), n)
    steps = min(round(wanted / search.more), (most - n) // search.more)
    return search.more * max(steps, 1)


def prediction_factors(phase: Phase, tier: Tier | None) -> tuple[float, float]:
    """Predicted limit over the least that it may be, and first height of a search over the predicted limit."""
    if tier is None:
        return 1.0, 1.0
    if phase.held:
        return HELD_UNDERESTIMATE_FACTOR, HELD_FIRST_GUESS_FACTOR
    if phase.kind in APART:
        return DECK_UNDERESTIMATE_FACTOR, DECK_FIRST_GUESS_FACTOR
    return UNDERESTIMATE_FACTOR[tier], FIRST_GUESS_FACTOR[tier]


def usual_runs(plan: LiftPlan) -> int:
    """Runs that the limits of a plan usually take."""
    return USUAL_RUNS * len(plan.alternatives) * len(plan.environment.Tp) * len(plan.environment.headings)


def predicted_by_rule(predicted: Sequence[Limits]) -> dict[tuple[str, Alternative, str], dict[Column, float]]:
    """(phase, alternative, rule) -> predicted limits [m] by column: frequency-domain method, else closed form."""
    result: dict[tuple[str, Alternative, str], dict[Column, float]] = {}
    for tier in (Tier.CLOSED_FORM, Tier.FREQUENCY):
        for limits in (p for p in predicted if p.tier is tier):
            for rule, Hs in limits.Hs.items():
                rows = zip(limits.Tp, limits.beta, Hs, strict=True)
                known = {(float(T), float(beta)): float(h) for T, beta, h in rows if math.isfinite(h)}
                result.setdefault((limits.phase, limits.alternative, rule), {}).update(known)
    return result


def least_predicted(predicted: Sequence[Limits]) -> dict[tuple[str, Alternative, Column], tuple[float, Tier]]:
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


class Judged(NamedTuple):
    """Limits of the rules of a phase under an alternative: columns, curve of every rule, and its limits; rules that
    could not be judged, with the reason; features of the rules that crossings judge."""

    columns: tuple[Column, ...]
    curves: Mapping[str, Curve]
    limits: Mapping[str, CurveLimits]
    failed: Mapping[str, str] = {}
    features: Mapping[str, Feature] = {}

    def least(self, column: Column) -> tuple[float, float]:
        """Lowest limit of a column [m], inf where no rule has one, and half of its 95 % interval in ln (inf: where the
        limit by crossings is thought to be, which does not count)."""
        i = self.columns.index(column)
        rows = [(or_inf(self._thought(key, i)), float(each.half[i])) for key, each in self.limits.items()]
        return min(rows, key=lambda row: row[0], default=(math.inf, math.nan))

    def _thought(self, key: str, i: int) -> float:
        """Where a rule's limit is thought to be in a column, without two ends too, where crossings look for it."""
        of = self.limits[key]
        return float(of.direct[i] if key in self.features and math.isnan(of.Hs[i]) else of.Hs[i])

    def direct(self, column: Column) -> float:
        """Lowest limit of a column by its own runs, however far above them [m]."""
        i = self.columns.index(column)
        return min((float(each.direct[i]) for each in self.limits.values()), default=math.inf)


def or_inf(Hs: float) -> float:
    """A limit, inf where none is known [m]."""
    return math.inf if math.isnan(Hs) else float(Hs)
