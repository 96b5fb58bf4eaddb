"""Holds of a plan's phases: at the worst depth of a splash zone, and at the stand-off of a landing."""

from __future__ import annotations

from collections.abc import Container, Sequence
from typing import NamedTuple

from stillhook.errors import PlanError
from stillhook.spec.lift.phase import OFF, Phase, PhaseKind, WinchMode, called
from stillhook.units import quote

HELD = ", held"
"""What the name of a hold adds to that of its passage or landing."""


class Holds(NamedTuple):
    """Holds of phases that do not name their own: time at the worst depth of a splash zone, time of the stop before a
    landing [s], and its height above the seabed [m]."""

    splash: float
    stop: float
    stand_off: float


def with_holds(phases: Sequence[Phase], usual: Holds, depth: float, standing: Container[str] = ()) -> tuple[Phase, ...]:
    """Joined phases with a phase for every hold, in water of this depth [m]; standing: rules that there are of one that
    stands off, whose limits are then those of the landing.

    A passage of the splash zone is followed by one in which the payload is held on its way, with depths, mode, tip
    and limits of the passage, and no speed. A landing comes after one in which it stands off, in the mode of AHC where
    the landing is compensated, and is lowered from there; none where a stand-off of the file's own goes before.
    Errors: PlanError where a name is taken.
    """
    names = {phase.name for phase in phases}
    result: list[Phase] = []
    for before, phase in zip((None, *phases), phases, strict=False):
        if phase.kind is PhaseKind.LANDING:
            own = before is not None and before.kind is PhaseKind.STAND_OFF
            parts = _stopped(phase, usual, depth, standing, own=own)
        else:
            parts = _held(phase, usual.splash if phase.kind is PhaseKind.SPLASH else 0.0)
        taken = next((part.name for part in parts if part.name != phase.name and part.name in names), None)
        if taken is not None:
            raise PlanError(
                f"phase {quote(taken)}: is the name of the hold of {called(phase)}. Give it another name, or"
                f' write hold = "{OFF}" there.'
            )
        result += parts
    return tuple(result)


def holds_off(phases: Sequence[Phase], usual: Holds, depth: float, standing: Container[str] = ()) -> tuple[Phase, ...]:
    """Holds of joined phases that say "off", with the usual times, as the phases that `with_holds` makes of others."""
    pairs = zip((None, *phases), phases, strict=False)
    off = [
        phase.model_copy(update={"hold": None})
        for before, phase in pairs
        if phase.hold == 0.0 and (before is None or before.kind is not PhaseKind.STAND_OFF)
    ]
    names = {phase.name for phase in phases}
    return tuple(phase for phase in with_holds(off, usual, depth, standing) if phase.name not in names)


def _held(phase: Phase, usual: float) -> list[Phase]:
    """A passage, and the hold after it."""
    time = usual if phase.hold is None else phase.hold
    passage = phase.model_copy(update={"hold": None})
    held = {"name": f"{phase.name}{HELD}", "speed": None, "time": time, "planned": None, "hold": time}
    return [passage, phase.model_copy(update=held)] if time > 0.0 else [passage]


def _stopped(phase: Phase, usual: Holds, depth: float, standing: Container[str], *, own: bool) -> list[Phase]:
    """A landing, and its stand-off before it; own: the file has one of its own there."""
    assert phase.start_depth is not None
    time = (0.0 if own else usual.stop) if phase.hold is None else phase.hold
    begins = depth - phase.start_depth
    height = begins if own and time <= 0.0 else min(phase.stand_off or usual.stand_off, begins)
    lands = phase.model_copy(update={"hold": None, "stand_off": height if own or time > 0.0 else None})
    stands = {
        "name": f"{phase.name}{HELD}",
        "kind": PhaseKind.STAND_OFF,
        "mode": WinchMode.AHC if phase.compensated else WinchMode.MANUAL,
        "start_depth": depth - height,
        "depth": depth - height,
        "speed": None,
        "time": time,
        "planned": None,
        "tension": None,
        "limits": {key: text for key, text in phase.limits.items() if key in standing},
        "hold": None,
        "stand_off": None,
    }
    return [phase.model_copy(update=stands), lands] if time > 0.0 else [lands]
