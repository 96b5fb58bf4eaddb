"""Drive-off and drift-off by closed form: when the wire of a load that stays behind reaches its off-lead limit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from stillhook.plan.definition.capacities import CAPACITIES
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.tiers.time_domain.lowering import SeaState
from stillhook.spec.lift.phase import OFF_DECK, ON_DECK

OFF_LEAD = math.radians(3.0)
"""Off-lead that is allowed where no load chart gives one [rad]. Assumed: cranes of this type have 3 to 5 deg."""
DRIVE_OFF = 0.05
"""Acceleration of a vessel whose thrusters push at full power [m/s^2]. Assumed."""
DRIFT_OFF, DRIFT_SPEED = 0.005, 1.0
"""Acceleration of a vessel without power in wind and waves [m/s^2], and its speed in the end [m/s]. Assumed."""
TIMES_ONLY = "no-time-allowed"
"""Reason of a case that has times to compare with those of crew and vessel, and no verdict."""


def time_of_way(x: float, a: float, v: float) -> float:
    """Time in which a vessel goes x from rest with the acceleration a up to the speed v [s].

    .. math:: t = \\sqrt{2 x / a}, \\quad x \\le v^2 / 2 a; \\qquad t = v / a + (x - v^2 / 2 a) / v
    """
    reached = 0.5 * v * v / a
    return math.sqrt(2.0 * x / a) if x <= reached else v / a + (x - reached) / v


def drive_off(plan: LiftPlan, seas: Sequence[SeaState]) -> dict[str, Any]:
    """Time until the wire is at its off-lead limit at the end of every phase over the side, the load as if it stayed
    where it was (safe side: water and inertia hold it back, nothing else does); the twin has no horizontal motion.

    .. math:: x = L \\tan\\theta
    """
    rows = []
    for phase in plan.phases:
        if phase.kind in (*OFF_DECK, *ON_DECK) or phase.held or phase.z_end is None:
            continue
        chart = CAPACITIES["off_lead_chart"].find(plan, phase, Alternative.NONE)
        limit = OFF_LEAD if chart is None else min([chart.value, *(value for _, value in chart.by_Hs)])
        length = (plan.tip_of(phase).z or plan.h_tip) - phase.z_end
        x = length * math.tan(limit)
        rows.append(
            {
                "phase": phase.name,
                "z": phase.z_end,
                "angle": limit,
                "from_chart": chart is not None,
                "way": x,
                "time_drive_off": time_of_way(x, DRIVE_OFF, math.inf),
                "time_drift_off": time_of_way(x, DRIFT_OFF, DRIFT_SPEED),
            }
        )
    return {
        "key": "drive-off",
        "title": "Drive-off and drift-off",
        "basis": "closed-form",
        "verdict": "not-assessed",
        "reason": TIMES_ONLY,
        "rows": [],
        "off_lead": rows,
        "assumed": {"drive_off": DRIVE_OFF, "drift_off": DRIFT_OFF, "drift_speed": DRIFT_SPEED},
    }
