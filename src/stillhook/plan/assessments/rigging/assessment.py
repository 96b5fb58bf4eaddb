"""Weights and rigging of a plan as plain data: build-up, hook load by phase, tension of the legs, utilisation by item,
and which weight case was run by which tier."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from stillhook.base.progress import Progress
from stillhook.physics.scalar import G
from stillhook.plan.assessments.interface import PlanState
from stillhook.plan.assessments.rigging.hook_load import hook_loads
from stillhook.plan.assessments.rigging.legs import Suspension, shares, usual_skew, worst
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Tier
from stillhook.plan.definition.weights import weight_facts
from stillhook.spec.lift.rigging import DAF_in_air

NAME = "rigging"


def assess(state: PlanState, progress: Progress) -> Mapping[str, Any] | None:
    """What a lift weighs and hangs by, in the seas of its limit [SI]."""
    plan = state.plan
    rows = hook_loads(state)
    progress(1.0)
    gear = plan.gear
    return {
        "weight": None if plan.weight is None else weight_facts(plan.weight),
        "SHL": plan.payload.mass,
        "DAF_air": gear.DAF_air or DAF_in_air(plan.payload.mass, gear.carrier),
        "DAF_air_stated": gear.DAF_air is not None,
        "carrier": gear.carrier.value,
        "hook_loads": rows,
        "cases": _cases(state),
        "legs": None if not gear.n_legs else _legs(plan, rows),
    }


def _legs(plan: LiftPlan, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Tension of the legs [N] under the largest dynamic hook load of all phases, and items by utilisation."""
    gear, box = plan.gear, None if plan.weight is None else plan.weight.cog_box
    suspension = Suspension(gear.ends, gear.height, 0.5 * plan.payload.height)
    of = worst(suspension, box, gear.tilt)
    even = float(shares(suspension).max())
    skew = usual_skew(gear.n_legs) if gear.skew is None else gear.skew
    row = max((r for r in rows if r["dynamic"] is not None), key=lambda r: float(r["dynamic"]), default=None)
    DHL = plan.payload.mass * G * gear_DAF(plan) if row is None else float(row["dynamic"])
    T = [skew * DHL * float(share) for share in of.shares]
    items: list[dict[str, Any]] = [
        {
            "name": item.name,
            "kind": item.kind.value,
            "load": (load := max(T) if item.kind.of_leg else DHL),
            "WLL": item.WLL,
            "MBL": item.MBL,
            "factor": item.factor,
            "dynamic": item.dynamic,
            "utilisation": item.utilisation(load),
            "source": item.source,
        }
        for item in gear.item
    ]
    return {
        "n": gear.n_legs,
        "ends": [list(end) for end in gear.ends],
        "height": gear.height,
        "angles": [gear.slope(end) for end in gear.ends],
        "even": gear.points is None,
        "cog_below": suspension.c,
        "skew": skew,
        "skew_stated": gear.skew is not None,
        "tilt": gear.tilt,
        "cog_box": None if box is None else list(box),
        "phase": None if row is None else row["phase"],
        "DHL": DHL,
        "T_even": skew * DHL * even,
        "T": T,
        "T_max": max(T),
        "corner": list(of.corner),
        "slack": of.slack,
        "items": items,
        "worst": max(items, key=lambda item: float(item["utilisation"]), default=None),
        "source": gear.source,
    }


def gear_DAF(plan: LiftPlan) -> float:
    """Design DAF of the rigging in air, where no tier says what it is [-]."""
    return plan.gear.DAF_air or DAF_in_air(plan.payload.mass, plan.gear.carrier)


def _cases(state: PlanState) -> dict[str, Any]:
    """Which weight case each tier looked at, and by how many of its limits the low one is the lower."""
    if state.plan.low is None:
        return {"two": False}
    tiers = [tier for tier in Tier if any(each.tier is tier for each in state.limits)]
    governs = []
    for limits in state.limits:
        for rule, low in limits.low_weight.items():
            known = np.isfinite(limits.Hs[rule])
            if (low & known).any():
                n, of = int((low & known).sum()), int(known.sum())
                where = {"phase": limits.phase, "alternative": limits.alternative.value, "tier": limits.tier.value}
                governs.append({"rule": rule, "n": n, "of": of, **where})
    runs = 0 if state.twin is None else int(state.twin.runs.get("n_low_weight", 0))
    return {"two": True, "tiers": [tier.value for tier in tiers], "runs_low": runs, "low_governs": governs}
