"""A lift from the deck of another vessel, which moves on its own: what that adds to the lift-off.

Source: EN 13852-1 as publicly quoted (B.4); the standard itself was not seen. EN 13852-1:2004 excludes subsea lifts:
the formulas are of the lift-off in air. Where the plan has the other vessel's transfer functions, the speed of the hook
against the deck follows from both vessels in the same waves as well, and the larger of the two counts.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import FloatArray
from stillhook.physics.scalar import G
from stillhook.plan.definition.capacities import jerk, places
from stillhook.plan.definition.lift_plan import LiftPlan, remembered
from stillhook.plan.definition.rules import Seas
from stillhook.response.forcing import Forcing, forcing_of_seas
from stillhook.spec.lift.phase import Phase
from stillhook.statistics.extremes import most_probable_maximum, zero_crossing_period


def deck_speed(Hs: ArrayLike) -> FloatArray:
    r"""Vertical speed of another vessel's deck [m/s], :math:`V_D = 6 H_s/(H_s + 8)`. Hs [m]."""
    H = np.asarray(Hs, dtype=np.float64)
    return np.asarray(6.0 * H / (H + 8.0))


def relative_speed(Hs: ArrayLike, V_C: ArrayLike) -> FloatArray:
    r"""Speed of the hook against the deck [m/s], :math:`\sqrt{V_D^2 + V_C^2}`, of which a hoisting speed must be K_H at
    the least. Hs [m]; V_C speed of the crane tip [m/s]."""
    return np.asarray(np.hypot(deck_speed(Hs), np.asarray(V_C)))


def lead(Hs: ArrayLike, L: float, share: float = 1.0) -> FloatArray:
    r"""Angle of the wire [rad], :math:`\arctan((2.5 + 1.5 H_s)/L)` in the plane of the boom: the deck is off by so many
    metres; of share 0.5 across it. Hs [m]; L from the tip to the payload [m]."""
    return np.asarray(np.arctan(share * (2.5 + 1.5 * np.asarray(Hs, dtype=np.float64)) / L))


@remembered
def against_deck(plan: LiftPlan, seas: Seas, x: float, y: float) -> Forcing:
    """What seas (n,) do to the height of a crane tip over (x, y) [m] against the other vessel's deck."""
    assert plan.against is not None
    each = [plan.environment.sea(*(float(v) for v in row)) for row in zip(seas.Hs, seas.Tp, seas.beta, strict=True)]
    return forcing_of_seas(each, plan.against, x, y)


def speed_against_deck(plan: LiftPlan, phase: Phase, seas: Seas, duration: float) -> FloatArray:
    """Most probable largest vertical speed of the crane tip against the deck (n,) [m/s] over a duration [s], by the
    transfer functions of both vessels."""
    at = plan.tip_of(phase)
    v, a = (against_deck(plan.of_high, seas, at.x, at.y).deviation(order) for order in (1, 2))
    return most_probable_maximum(v, zero_crossing_period(v, a), duration)


def from_other_vessel(
    plan: LiftPlan, phase: Phase, seas: Seas, duration: float, values: Mapping[str, FloatArray]
) -> dict[str, FloatArray]:
    """Quantities of a lift-off from the own deck as those of one from another vessel, in seas (n,) over a duration
    [s]: the load is taken up at the hoisting speed and that of the hook against the deck; the deck is off
    by the table's distance.

    The speed of the hook against what carries the payload is then `v_carrier`, of the table or, where it is larger, by
    the transfer functions of both vessels, and `v_lift_off` is not determined: its
    rule is of a hook that only moves with its own vessel.
    """
    tip = plan.tip_of(phase)
    assert tip.z is not None
    Hs = plan.environment.H_m0(seas.Hs)
    v = relative_speed(Hs, values["v_tip_max"])
    if plan.against is not None:
        v = np.maximum(v, speed_against_deck(plan, phase, seas, duration))
    F = jerk(plan, phase, 1.0) * v
    result = {name: each for name, each in values.items() if name != "v_lift_off"} | {"v_carrier": v}
    result["F_top_max"] = values["F_top_max"] + F
    result["DAF"] = values["DAF"] + F / (plan.of_high.payload.mass * G)
    L = min(tip.z - z for z in places(phase)) - plan.payload.height
    for name, share in (("off_lead", 1.0), ("side_lead", 0.5)):
        if name in values:
            result[name] = np.maximum(values[name], lead(Hs, L, share))
    return result
