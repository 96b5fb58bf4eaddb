"""The cell of every phase that a sensitivity is of: the column in which the phase's limit is lowest under the
alternative that leads, by the most detailed method that has one."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from stillhook.plan.answer.dataset import Answered
from stillhook.plan.assessments.interface import PlanState
from stillhook.plan.definition.rules import Alternative, Demand, Tier
from stillhook.plan.limits import Limits, limited, utilisation
from stillhook.plan.table import TIERS
from stillhook.plan.tiers.time_domain.placing import Column
from stillhook.spec.lift.phase import Phase


class Governing(NamedTuple):
    """A phase with its column and tier; Hs: limit of every rule there [m], inf above the highest sea, NaN where there
    is none; ends: of its 95 % interval; counts: what the plan's table has there, and of which tier."""

    phase: Phase
    column: Column
    tier: Tier
    Hs: Mapping[str, float]
    ends: Mapping[str, tuple[float, float]]
    counts: tuple[float, str]

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
    """The cell of a phase; None where no method has a limit of it."""
    for tier in reversed(TIERS):
        of = next(
            (x for x in state.limits if (x.phase, x.alternative, x.tier) == (phase.name, alternative, tier)), None
        )
        if of is None or not len(of.Tp):
            continue
        table = np.array([np.where(np.isnan(row), np.inf, row) for row in of.Hs.values()])
        known = ~np.isnan(np.array(list(of.Hs.values()))).all(axis=0) if len(table) else np.zeros(0, dtype=np.bool_)
        if not known.any():
            continue
        least = np.where(known & (table.min(axis=0) > 0.0), table.min(axis=0), np.nan)
        if np.isnan(least).all():
            continue
        i = int(np.nanargmin(least))
        if math.isinf(least[i]):
            i = _most_used(state, of, phase, np.flatnonzero(np.isposinf(least)).tolist())
        column = float(of.Tp[i]), float(of.beta[i])
        Hs = {key: float(row[i]) for key, row in of.Hs.items()}
        ends = {key: (float(of.low[key][i]), float(of.high[key][i])) for key in Hs if key in of.low}
        return Governing(phase, column, tier, Hs, ends, _counting(state.answered, phase.name, alternative, column))
    return None


def _counting(of: Answered, phase: str, alternative: Alternative, column: Column) -> tuple[float, str]:
    """Limit of a phase in the plan's table as modelled [m], and its tier."""
    axes = of.axes
    heading, period = (int(x[0]) for x in axes.place(np.array(column[:1]), np.array(column[1:])))
    at = (axes.alternatives.index(alternative), axes.phases.index(phase), slice(None), heading, period)
    Hs = np.where(np.isnan(of.modelled.Hs[at]), np.inf, of.modelled.Hs[at])
    rule = int(Hs.argmin())
    tier = int(of.modelled.tier[at][rule])
    return float(Hs[rule]), TIERS[tier].value if tier >= 0 else ""


def _most_used(state: PlanState, of: Limits, phase: Phase, places: Sequence[int]) -> int:
    """Of columns without a limit the one whose highest sea uses most of any rule's."""
    who = (of.phase, of.alternative, of.tier)
    demand = next((d for d in state.demands if (d.phase, d.alternative, d.tier) == who), None)
    if demand is None:
        return places[0]
    return max(places, key=lambda i: _used(state, demand, phase, (float(of.Tp[i]), float(of.beta[i]))))


def _used(state: PlanState, demand: Demand, phase: Phase, column: Column) -> float:
    rows = next((rows for T, beta, rows in demand.seas.columns if (T, beta) == column), None)
    if rows is None:
        return 0.0
    top, Hs = rows[-1:], demand.seas.Hs[rows[-1:]]
    parts = [
        utilisation(each, demand.values[each.rule.quantity][top], Hs)
        for each in limited(state.plan, phase, demand.alternative)
        if each.rule.quantity in demand.values
    ]
    return float(np.nan_to_num(np.array(parts), nan=0.0, posinf=0.0).max(initial=0.0))
