"""The wave zone in a failure: where a payload is the worst off that is stopped there, and hoisting it back."""

from __future__ import annotations

from typing import Any

import numpy as np

from stillhook.plan.assessments.failures.depths import time_between
from stillhook.plan.assessments.failures.judging import HALF_HOUR
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Seas
from stillhook.plan.tiers.closed_form import slings_held
from stillhook.plan.tiers.time_domain.lowering import SeaState
from stillhook.spec.lift.phase import Phase

HEIGHTS = 7
"""Heights in the wave zone at which a stop is run."""


def held(phase: Phase) -> Phase:
    """A passage in which the payload is stopped for half an hour."""
    return phase.model_copy(update={"speed": None, "time": HALF_HOUR, "planned": None, "hold": HALF_HOUR})


def worst_in_wave_zone(plan: LiftPlan, phase: Phase, sea: SeaState) -> float:
    """Height of the underside [m] at which a stop leaves the slings the least tension, by the simplified method."""
    seas = Seas(*(np.array([value]) for value in sea))
    z, slings = slings_held(plan, held(phase), seas)
    return round(float(z[int(np.argmin(slings[:, 0]))]), 3)


def heights_in_wave_zone(plan: LiftPlan, phase: Phase) -> list[float]:
    """Heights of the underside from the surface to the end of the passage [m]: to the cover of the payload half of
    them."""
    bottom = min(phase.z_start or 0.0, phase.z_end or 0.0)
    covered = -min(plan.payload.reach(plan.rho), -bottom)
    upper = np.linspace(0.0, covered, HEIGHTS // 2 + 1)
    lower = np.linspace(covered, bottom, HEIGHTS - len(upper) + 1)[1:]
    return [round(float(z), 3) for z in (*upper, *lower)]


def reversal_time(plan: LiftPlan) -> list[dict[str, Any]]:
    """Time to hoist the payload back to where the lift begins, from the end of every phase, at the speeds of the phases
    that are passed."""
    start = plan.phases[0].z_start or 0.0
    return [
        {"phase": p.name, "z": p.z_end, "time": time_between(plan, start, p.z_end)}
        for p in plan.phases
        if p.z_end is not None and not p.held
    ]
