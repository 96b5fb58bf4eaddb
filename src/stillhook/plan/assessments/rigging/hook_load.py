"""Hook load of every phase in the seas of the limit: static, with the dynamic factor that the model finds there, and
what of the crane's capacity it uses."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import BoolArray
from stillhook.engine.pack.programme import payload_weight
from stillhook.physics.scalar import G
from stillhook.plan.assessments.interface import PlanState
from stillhook.plan.definition.capacities import places
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Demand, Limited, Tier
from stillhook.plan.limits import limited
from stillhook.plan.table import TIERS
from stillhook.spec.lift.joining import IN_AIR
from stillhook.spec.lift.phase import Phase, PhaseKind

REACH = 1.05
"""A number of the highest sea that was run stands for one up to so many times as high."""


class Place(NamedTuple):
    """A cell of the limits: Hs [m] that may be claimed, Tp [s], direction of travel [rad]."""

    Hs: float
    Tp: float
    beta: float


class DemandValue(NamedTuple):
    """A value of a demand in a sea, and what it is from."""

    value: float
    tier: Tier
    alternative: Alternative
    at: Place


def limit_places(state: PlanState) -> tuple[Alternative, list[Place]]:
    """The alternative that leads, and the seas of the limit that may be claimed: of every heading and period, up to the
    highest that was analysed."""
    of = state.answered
    leads = of.shown()
    axes, Hs = of.axes, of.claimed.Hs[of.axes.alternatives.index(leads)]
    most = max(state.plan.environment.Hs)
    cells = np.ndindex(Hs.shape)
    return leads, [
        Place(min(float(Hs[i, j]), most), axes.periods[j], axes.headings[i]) for i, j in cells if not np.isnan(Hs[i, j])
    ]


def largest(state: PlanState, phase: Phase, quantity: str) -> DemandValue | None:
    """Largest value of a quantity of a phase in the seas of the limit, by the highest tier that determines it in each;
    of the alternative that leads, and of the flat cap that it may be credited as. None where no tier determines it."""
    leads, cells = limit_places(state)
    which = dict.fromkeys([leads, *(a for a in state.plan.alternatives if a is Alternative.CAP)])
    values = [
        each
        for alternative in which
        for at in cells
        if (each := _value(_of(state.demands, phase, alternative), quantity, at)) is not None
    ]
    return max(values, key=lambda each: each.value, default=None)


def _of(demands: Sequence[Demand], phase: Phase, alternative: Alternative) -> list[Demand]:
    """Demands of a phase under an alternative, of the highest tier first."""
    of = [d for d in demands if d.phase == phase.name and d.alternative is alternative]
    return sorted(of, key=lambda d: TIERS.index(d.tier), reverse=True)


def _value(demands: Sequence[Demand], quantity: str, at: Place) -> DemandValue | None:
    for demand in demands:
        values = demand.values.get(quantity)
        if values is None:
            continue
        rows = _column(demand, at) & np.isfinite(values)
        Hs, x = demand.seas.Hs[rows], values[rows]
        if len(Hs) and at.Hs <= REACH * float(Hs.max()):
            order = np.argsort(Hs)
            return DemandValue(float(np.interp(at.Hs, Hs[order], x[order])), demand.tier, demand.alternative, at)
    return None


def _column(demand: Demand, at: Place) -> BoolArray:
    return np.asarray(np.isclose(demand.seas.Tp, at.Tp) & np.isclose(demand.seas.beta, at.beta))


def hook_loads(state: PlanState) -> list[dict[str, Any]]:
    """A row for every phase: static hook load at the hook and tension at the tip [N], dynamic factor and hook load,
    capacity and how much of it is used."""
    plan = state.plan
    leads, _ = limit_places(state)
    SHL = plan.payload.mass * G
    rows = []
    for phase in plan.phases:
        DAF, top = (largest(state, phase, quantity) for quantity in ("DAF", "F_top_max"))
        rule = next((r for r in limited(plan, phase, leads) if r.rule.quantity == "F_top_max"), None)
        rows.append(
            {
                "phase": phase.name,
                "medium": _medium(phase),
                "static_low": _static(plan.low or plan, phase, least=True),
                "static_high": _static(plan, phase, least=False),
                "DAF": None if DAF is None else DAF.value,
                "dynamic": None if DAF is None else DAF.value * SHL,
                "from": None if DAF is None else _source(DAF),
                "F_top": None if top is None else top.value,
                "F_top_from": None if top is None else _source(top),
                **_capacity(rule, top),
            }
        )
    return rows


def _medium(phase: Phase) -> str:
    if phase.kind in IN_AIR:
        return "air"
    return "wave zone" if phase.kind is PhaseKind.SPLASH else "water"


def _static(plan: LiftPlan, phase: Phase, *, least: bool) -> float:
    """Static load on the hook over a phase's way [N], the least or the largest."""
    loads = [payload_weight(plan.hanging(z), z) for z in places(phase)]
    return min(loads) if least else max(loads)


def _source(value: DemandValue) -> dict[str, Any]:
    where = {"Hs": value.at.Hs, "Tp": value.at.Tp, "beta": value.at.beta}
    return {"tier": value.tier.value, "alternative": value.alternative.value, **where}


def _capacity(rule: Limited | None, top: DemandValue | None) -> dict[str, Any]:
    if rule is None:
        return {"capacity": None, "capacity_basis": "", "utilisation": None}
    capacity = rule.limit if top is None else float(rule.at(np.array([top.at.Hs]))[0])
    used = None if top is None else top.value / capacity if capacity > 0.0 else math.inf
    return {"capacity": capacity, "capacity_basis": rule.basis, "utilisation": used}
