"""Whether what a plan names can hang at its crane at all: heights under the tip, reach, weight in water and wire."""

from __future__ import annotations

from stillhook.engine.lowering.checks import check_lift
from stillhook.errors import LiftError, PlanError, SeaError, UnitError
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.phase_profile import CLOSE, called
from stillhook.sea.vessel.boom import Boom
from stillhook.spec.lift.payload import Payload
from stillhook.units import quote, show

SINKS = 0.01
"""Share of its weight that a payload must keep under water."""


def check_sinks(payload: Payload, rho: float) -> None:
    """Refuse a payload that floats, or does but for `SINKS` of its weight: no wire would be held taut."""
    displaced = rho * payload.displaced
    if displaced > (1.0 - SINKS) * payload.mass:
        volume, water, mass = show(payload.displaced, "volume"), show(displaced, "mass"), show(payload.mass, "mass")
        reason = f"it weighs {mass} and its {volume} displace {water} of water"
        raise PlanError(f"payload {quote(payload.name)}: it floats, or nearly: {reason}. Check mass and volume.")


def check_tips(plan: LiftPlan, boom: Boom | None) -> None:
    """The crane reaches every place that a phase names, and what hangs fits under it."""
    room = plan.payload.height + plan.rigging.height
    for phase in plan.phases:
        try:
            at = plan.tip_of(phase)
            if phase.tip is not None and boom is not None:
                boom.reaching(at.x, at.y, at.z)
        except (SeaError, UnitError) as e:
            raise PlanError(f"{called(phase)}: {e}") from None
        assert at.z is not None
        highest = max(z for z in (phase.start, phase.end) if z is not None)
        free = at.z - room - highest
        if free <= 0.0:
            raise PlanError(
                f"{called(phase)}: underside at {show(highest, 'length')}, payload and rigging {show(room, 'length')}"
                f" high: they cannot hang under the crane tip at {show(at.z, 'length')}. Raise the tip, or lower the"
                " heights."
            )


def check_wire(plan: LiftPlan) -> None:
    """The crane may carry the payload, and has wire for the deepest phase."""
    deepest = min(plan.phases, key=lambda phase: min(phase.start or 0.0, phase.end or 0.0))
    z = max(min(deepest.start or 0.0, deepest.end or 0.0), -plan.depth + CLOSE)
    try:
        check_lift(plan.crane, plan.hanging(z))
    except LiftError as e:
        raise PlanError(f"{called(deepest)}: {str(e).replace('z_0 = ', 'underside at ')}") from None
