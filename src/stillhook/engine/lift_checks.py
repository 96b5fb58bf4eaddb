"""What can be said before a lowering: refusals (LiftError, SpecError), each in one line."""


from stillhook.crane import Crane
from stillhook.engine.lift_pack import PackedLift
from stillhook.lift.lowering import Lowering

COUPLING = 0.1
"""Largest mass that the wire may feign in one step, h^2 k / 4, over that of the winch as the wire feels it, J / lever^2."""


def check_lift(crane: Crane, case: Lowering) -> None:
    """Refuse what no crane of this kind can be asked, or what is no lowering. Errors: LiftError, one line."""


def check_lift_step(packed: PackedLift, step: float) -> None:
    """Refuse a step that winch or coupling cannot follow. Errors: SpecError naming the fastest mode and the step to take."""
