"""The cell of every phase that a sensitivity is of: the column in which the phase's limit is lowest under the
alternative that leads, by the most detailed method that has one."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from stillhook.plan.assessments.interface import PlanState
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Tier
from stillhook.plan.limits import limited, utilisation
from stillhook.plan.table import BY_RUNS, TIERS, Axes
from stillhook.plan.tiers.time_domain.placing import Column
from stillhook.spec.lift.phase import Phase


class Governing(NamedTuple):
    """A phase with its column and tier; Hs: limit of every rule there [m], inf above the highest sea, NaN where there
    is none; ends: of its 95 % interval; counts: what the plan's table has there, and of which tier; plan: of the weight
    case whose limit it is."""

    phase: Phase
    column: Column
    tier: Tier
    Hs: Mapping[str, float]
    ends: Mapping[str, tuple[float, float]]
    counts: tuple[float, str]
    plan: LiftPlan

    @property
    def lowest(self) -> tuple[float, str]:
        """Lowest limit [m] and its rule."""
        known = {key: Hs for key, Hs in self.Hs.items() if not math.isnan(Hs)}
        rule = min(known, key=lambda key: known[key], default="")
        return known.get(rule, math.nan), rule

    @property
    def interval(self) -> tuple[float, float]:
        """Ends of the 95 % interval of the lowest limit [m], NaN where there is none."""
        return self.ends.get(self.lowest[1], (math.nan, math.nan))


def governing(state: PlanState, phase: Phase, alternative: Alternative) -> Governing | None:
    """The cell of a phase; None where no method has a limit of it. Where its limit in the table is by the
    frequency-domain method, and the twin has one as well, it is that of the twin."""
    axes, modelled = state.answered.axes, state.answered.modelled
    at = axes.alternatives.index(alternative), axes.phases.index(phase.name)
    Hs = np.where(np.isnan(modelled.Hs[at]), np.inf, modelled.Hs[at])  # (rule, heading, period)
    rule, least = Hs.argmin(axis=0), Hs.min(axis=0)
    known = ~np.isnan(modelled.Hs[at]).all(axis=0) & (least > 0.0)
    if not known.any():
        return None
    places = [(int(i), int(j)) for i, j in np.argwhere(known)]
    heading, period = min(places, key=lambda place: float(least[place]))
    if math.isinf(least[heading, period]):
        heading, period = max(places, key=lambda place: _used(state, phase, alternative, _column(axes, place)))
    column = _column(axes, (heading, period))
    tiers = modelled.tier[at][:, heading, period]
    tier = int(tiers[rule[heading, period]] if math.isfinite(least[heading, period]) else tiers.max())
    of_twin = state.answered.limits.Hs[(BY_RUNS, *at)][:, heading, period]
    finite = of_twin[np.isfinite(of_twin) & (of_twin > 0.0)]
    used = BY_RUNS if len(finite) else tier
    limits = state.answered.limits
    values, low, high = (x[(used, *at)][:, heading, period] for x in (limits.Hs, limits.low, limits.high))
    rows = dict(zip(axes.rules, zip(values, low, high, strict=True), strict=True))
    known_of = {key: row for key, row in rows.items() if not np.isnan(row).all()}
    return Governing(
        phase,
        column,
        TIERS[used],
        {key: float(row[0]) for key, row in known_of.items()},
        {key: (float(row[1]), float(row[2])) for key, row in known_of.items()},
        (float(least[heading, period]), TIERS[tier].value),
        _case(state, phase.name, alternative, TIERS[used], column, {key: row[0] for key, row in known_of.items()}),
    )


def _case(
    state: PlanState, phase: str, alternative: Alternative, tier: Tier, column: Column, Hs: Mapping[str, float]
) -> LiftPlan:
    """The plan with the weight case whose limit is the lowest of a column."""
    who = (phase, alternative, tier)
    of = next((x for x in state.limits if (x.phase, x.alternative, x.tier) == who), None)
    known = {key: value for key, value in Hs.items() if not math.isnan(value)}
    if of is None or state.plan.low is None or not known:
        return state.plan
    rule = min(known, key=lambda key: known[key])
    at = np.flatnonzero(np.isclose(of.Tp, column[0]) & np.isclose(of.beta, column[1]))
    low = of.low_weight.get(rule)
    return state.plan.low if low is not None and len(at) and bool(low[at[0]]) else state.plan


def _column(axes: Axes, place: Sequence[int]) -> Column:
    return axes.periods[place[1]], axes.headings[place[0]]


def _used(state: PlanState, phase: Phase, alternative: Alternative, column: Column) -> float:
    """The most that the highest sea of a column uses of any rule's limit, by any method [-]."""
    parts = [0.0]
    for demand in state.demands:
        if (demand.phase, demand.alternative) != (phase.name, alternative):
            continue
        rows = next((rows for T, beta, rows in demand.seas.columns if (T, beta) == column), None)
        if rows is None:
            continue
        top, Hs = rows[-1:], demand.seas.Hs[rows[-1:]]
        parts += [
            float(utilisation(each, demand.values[each.rule.quantity][top], Hs)[0])
            for each in limited(state.plan, phase, alternative)
            if each.rule.quantity in demand.values
        ]
    return float(np.nan_to_num(np.array(parts), nan=0.0, posinf=0.0).max())
