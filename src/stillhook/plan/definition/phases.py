"""Phases of a lift as a planner names them: what hangs where, how the winch is driven meanwhile, and for how long.

From phases as a file has them to phases that join: heights, speeds and durations of what was left out, and what
cannot be.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from enum import StrEnum
from types import MappingProxyType
from typing import Any, NamedTuple

from pydantic import Field, ValidationInfo, field_validator

from stillhook import units as u
from stillhook.errors import PlanError
from stillhook.spec.lift.lowering import StageMode
from stillhook.spec.scenario import Record
from stillhook.units import quote, show


class PhaseKind(StrEnum):
    """What happens in a phase."""

    LIFT_OFF = "lift-off"
    IN_AIR = "in-air"
    SPLASH = "splash-zone"
    LOWERING = "lowering"
    DEEP = "deep"
    STAND_OFF = "stand-off"
    LANDING = "landing"
    SEABED_LIFT_OFF = "seabed-lift-off"
    SET_DOWN = "set-down"


MODES: Mapping[PhaseKind, tuple[StageMode, ...]] = MappingProxyType(
    {
        PhaseKind.LIFT_OFF: (StageMode.MANUAL,),
        PhaseKind.IN_AIR: (StageMode.MANUAL,),
        PhaseKind.SPLASH: (StageMode.MANUAL, StageMode.SPLASH),
        PhaseKind.LOWERING: (StageMode.MANUAL, StageMode.AHC),
        PhaseKind.DEEP: (StageMode.AHC, StageMode.MANUAL),
        PhaseKind.STAND_OFF: (StageMode.AHC, StageMode.MANUAL),
        PhaseKind.LANDING: (StageMode.LANDING, StageMode.AHC, StageMode.MANUAL),
        PhaseKind.SEABED_LIFT_OFF: (StageMode.AHC, StageMode.MANUAL),
        PhaseKind.SET_DOWN: (StageMode.MANUAL,),
    }
)
"""Winch modes that a phase may have, the usual one first."""
IN_AIR = (PhaseKind.LIFT_OFF, PhaseKind.IN_AIR, PhaseKind.SET_DOWN)
"""Phases in which the payload is wholly above the water."""
HELD_KINDS = (PhaseKind.SPLASH, PhaseKind.LANDING)
"""Phases in which the payload is also held: at the worst height of a passage, at the stand-off of a landing."""
MOST_HOLD, MOST_STAND_OFF = 24.0 * 3600.0, 50.0
"""Longest hold [s], and highest stand-off [m]: what is given in a wrong unit is more."""


OFF = "off"
"""What a file writes for a limit, or a hold, that a phase does not have."""


class Phase(Record):
    """One phase. Heights are those of the payload's underside above still water (negative: below); speed is a
    magnitude, `end` gives the direction.

    mode None takes the first of `MODES`. duration is what the phase is planned to take, for T_POP and for largest
    values; in motion it is the way over the speed where it is not given. tip: place of the crane tip in this phase, as
    text ("x=-15 m, y=0 m, z=36 m"), None for that of the plan. limits: rule -> limit of this phase in place of the
    rule's own, as text, or "off". hold: how long the payload is also held at its worst height of a splash zone, or at
    the stand-off above the seabed before it is landed [s], 0 ("off" in a file) for none, None for the rule set's time;
    `with_holds` makes a phase of its own of it. stand_off: height of that stop above the seabed [m], None for the rule
    set's; of a joined landing that does not stop None. Errors: ScenarioError, one line, for a phase that cannot be.
    """

    name: str
    kind: PhaseKind
    mode: StageMode | None = None
    start: u.Length | None = None
    end: u.Length | None = None
    speed: u.Speed | None = Field(default=None, gt=0, le=5.0)
    duration: u.Time | None = Field(default=None, gt=0)
    tip: str | None = None
    limits: Mapping[str, str] = Field(default_factory=dict)
    hold: u.Time | None = Field(default=None, ge=0, le=MOST_HOLD)
    stand_off: u.Length | None = Field(default=None, gt=0, le=MOST_STAND_OFF)

    def __hash__(self) -> int:
        return hash(self.name)

    @property
    def winch(self) -> StageMode:
        """Mode of the winch."""
        return MODES[self.kind][0] if self.mode is None else self.mode

    @property
    def compensated(self) -> bool:
        """Whether the winch follows the tip."""
        return self.winch in (StageMode.AHC, StageMode.LANDING)

    @property
    def held(self) -> bool:
        """Whether the payload is held in the wave zone, at whichever height between start and end is the worst."""
        return bool(self.hold)

    @property
    def planned(self) -> float:
        """Time that the operation is planned to spend in the phase [s]: a hold is assessed, not planned."""
        return 0.0 if self.held else self.duration or 0.0

    @field_validator("hold", mode="before")
    @classmethod
    def _hold_fits(cls, hold: object, info: ValidationInfo) -> object:
        kind = info.data.get("kind")
        if hold is not None and kind not in (None, *HELD_KINDS):
            raise ValueError(f"{kind} has no hold of its own; only {' and '.join(HELD_KINDS)} have. Leave hold out.")
        return "0 s" if hold == OFF else hold

    @field_validator("stand_off", mode="before")
    @classmethod
    def _stands_off(cls, height: object, info: ValidationInfo) -> object:
        kind = info.data.get("kind")
        if height is not None and kind not in (None, PhaseKind.LANDING):
            raise ValueError(f"{kind} has no stand-off; only {PhaseKind.LANDING} has. Leave stand_off out.")
        return height

    @field_validator("mode", mode="before")
    @classmethod
    def _mode_fits(cls, mode: object, info: ValidationInfo) -> object:
        kind = info.data.get("kind")
        if mode is not None and kind is not None and mode not in MODES[kind]:
            raise ValueError(
                f"{kind} has one of {', '.join(MODES[kind])}; controllers are set by alternatives, not by mode"
            )
        return mode


K = PhaseKind
SPEED = {
    K.LIFT_OFF: 0.1,
    K.IN_AIR: 0.1,
    K.SPLASH: 0.25,
    K.LOWERING: 0.5,
    K.LANDING: 0.1,
    K.SEABED_LIFT_OFF: 0.1,
    K.SET_DOWN: 0.05,
}
"""Speed of a phase that moves, where its file has none [m/s]: usual of each kind (assumed)."""
TIME = {K.IN_AIR: 600.0, K.DEEP: 1800.0, K.STAND_OFF: 300.0}
"""How long a phase stands, where its file has nothing [s]: slewing over the side, half an hour above the place of
landing, and a stop for the last look of the ROV (assumed)."""
CLEAR_OF_DECK = 3.0
"""How far a payload is lifted off the deck before it goes over the side [m]."""
ABOVE_WATER = 5.0
"""Height to which a payload is brought up out of the water [m]."""
BELOW_WAVES = 10.0
"""Depth below full cover to which the splash zone is taken [m]."""
STANDS = (K.DEEP, K.STAND_OFF)
"""Phases at one height under water."""
STAND_OFF = 3.0
"""Height above the seabed of a stand-off, where its file has none [m]."""
ABOVE_SEABED = 20.0
"""Height above the seabed at which a landing begins, or to which a payload is lifted off it [m]."""
CLOSE = 0.01
"""Gap between two phases that is no gap [m]."""


class Water(NamedTuple):
    """depth of the water, and submergence from which the payload is covered [m]."""

    depth: float
    reach: float


def joined(phases: Sequence[Phase], water: Water) -> tuple[Phase, ...]:
    """The phases with start, end, duration and, where they move, speed: each starts where the one before it ends.

    Errors: PlanError, one line, that names the phase: heights that do not join or that its kind cannot have, durations
    too short for the way, two phases of one name.
    """
    if not phases:
        raise PlanError(
            'phase: none. Write each as a table [[phase]] with name, kind and where it ends, such as end = "-25 m".'
        )
    names = [phase.name for phase in phases]
    for phase in phases:
        if names.count(phase.name) > 1:
            raise PlanError(f"phase {quote(phase.name)}: comes twice. Give every phase its own name.")
    done: list[Phase] = []
    for i, phase in enumerate(phases):
        after = phases[i + 1] if i + 1 < len(phases) else None
        start = _start(phase, done, water)
        end = _end(phase, start, after, done, water)
        _check_heights(phase, start, end, water)
        done.append(_timed(phase, start, end))
    return tuple(done)


class Holds(NamedTuple):
    """Holds of phases that do not name their own: time at the worst height of a splash zone, time of the stop before a
    landing [s], and its height above the seabed [m]."""

    splash: float
    stop: float
    stand_off: float


def with_holds(phases: Sequence[Phase], usual: Holds, depth: float, standing: Container[str] = ()) -> tuple[Phase, ...]:
    """Joined phases with a phase for every hold, in water of this depth [m]; standing: rules that there are of one that
    stands off, whose limits are then those of the landing.

    A passage of the splash zone is followed by one in which the payload is held on its way, with heights, mode, tip
    and limits of the passage, and no speed. A landing comes after one in which it stands off, in the mode of AHC where
    the landing is compensated, and is lowered from there; none where a stand-off of the file's own goes before.
    Errors: PlanError where a name is taken.
    """
    names = {phase.name for phase in phases}
    result: list[Phase] = []
    for before, phase in zip((None, *phases), phases, strict=False):
        if phase.kind is K.LANDING:
            own = before is not None and before.kind is K.STAND_OFF
            parts = _stopped(phase, usual, depth, standing, own=own)
        else:
            parts = _held(phase, usual.splash if phase.kind is K.SPLASH else 0.0)
        taken = next((part.name for part in parts if part.name != phase.name and part.name in names), None)
        if taken is not None:
            raise PlanError(
                f"phase {quote(taken)}: is the name of the hold of {called(phase)}. Give it another name, or"
                f' write hold = "{OFF}" there.'
            )
        result += parts
    return tuple(result)


def _held(phase: Phase, usual: float) -> list[Phase]:
    """A passage, and the hold after it."""
    time = usual if phase.hold is None else phase.hold
    passage = phase.model_copy(update={"hold": None})
    held = {"name": f"{phase.name}, held", "speed": None, "duration": time, "hold": time}
    return [passage, phase.model_copy(update=held)] if time > 0.0 else [passage]


def _stopped(phase: Phase, usual: Holds, depth: float, standing: Container[str], *, own: bool) -> list[Phase]:
    """A landing, and its stand-off before it; own: the file has one of its own there."""
    assert phase.start is not None
    time = (0.0 if own else usual.stop) if phase.hold is None else phase.hold
    begins = phase.start + depth
    height = begins if own and time <= 0.0 else min(phase.stand_off or usual.stand_off, begins)
    lands = phase.model_copy(update={"hold": None, "stand_off": height if own or time > 0.0 else None})
    stands = {
        "name": f"{phase.name}, held",
        "kind": K.STAND_OFF,
        "mode": StageMode.AHC if phase.compensated else StageMode.MANUAL,
        "start": height - depth,
        "end": height - depth,
        "speed": None,
        "duration": time,
        "limits": {key: text for key, text in phase.limits.items() if key in standing},
        "hold": None,
        "stand_off": None,
    }
    return [phase.model_copy(update=stands), lands] if time > 0.0 else [lands]


def called(phase: Phase) -> str:
    """The phase in an error."""
    return f"phase {quote(phase.name)} ({phase.kind})"


def _start(phase: Phase, done: Sequence[Phase], water: Water) -> float:
    if done:
        before = done[-1]
        assert before.end is not None
        if phase.start is not None and abs(phase.start - before.end) > CLOSE:
            raise PlanError(
                f"{called(phase)}: starts at {_at(phase.start)}, and {quote(before.name)} ends at {_at(before.end)}. "
                "Let each phase start where the one before it ends, or leave start out."
            )
        return before.end
    if phase.start is not None:
        return phase.start
    usual = {K.SEABED_LIFT_OFF: -water.depth, K.LANDING: ABOVE_SEABED - water.depth}
    if phase.kind in usual:
        return usual[phase.kind]
    example = (
        '"4 m", the deck above still water' if phase.kind in IN_AIR else '"5 m" above still water, or "-25 m" under it'
    )
    raise PlanError(
        f"{called(phase)}: start: missing, the height of the payload's underside as the lift begins. Give it:"
        f" {example}."
    )


def _end(phase: Phase, start: float, after: Phase | None, done: Sequence[Phase], water: Water) -> float:
    if phase.end is not None:
        return phase.end
    if after is not None and after.start is not None and phase.kind not in STANDS:
        return after.start
    usual = {
        K.LIFT_OFF: start + CLEAR_OF_DECK,
        K.IN_AIR: start,
        K.SPLASH: ABOVE_WATER if start < 0.0 else -(water.reach + BELOW_WAVES),
        K.DEEP: start,
        K.STAND_OFF: start,
        K.LANDING: -water.depth,
        K.SEABED_LIFT_OFF: ABOVE_SEABED - water.depth,
    }
    if phase.kind in usual:
        return usual[phase.kind]
    if phase.kind is K.LOWERING and after is not None:
        if after.kind is K.STAND_OFF:
            return STAND_OFF - water.depth
        if after.kind in (K.DEEP, K.LANDING):
            return ABOVE_SEABED - water.depth
        if after.kind is K.SPLASH:
            return -(water.reach + BELOW_WAVES)
    deck = next((p.start for p in done if p.kind is K.LIFT_OFF), None)
    if phase.kind is K.SET_DOWN and deck is not None:
        return deck
    example = '"4 m", the deck above still water' if phase.kind is K.SET_DOWN else '"-1475 m"'
    raise PlanError(
        f"{called(phase)}: end: missing, the height of the payload's underside as the phase ends. Give it, such as"
        f" {example}."
    )


def _check_heights(phase: Phase, start: float, end: float, water: Water) -> None:
    for name, z in (("start", start), ("end", end)):
        if z < -water.depth - CLOSE:
            raise PlanError(
                f"{called(phase)}: {name} {_at(z)} is below the seabed at {_at(-water.depth)}. Heights count up from"
                " still water."
            )
    covered = -water.reach
    if phase.kind in IN_AIR and min(start, end) < 0.0:
        raise PlanError(
            f"{called(phase)}: from {_at(start)} to {_at(end)}, and its kind is above the water. Use splash-zone"
            " through it."
        )
    if phase.kind is K.SPLASH and not (max(start, end) >= 0.0 and min(start, end) <= covered + CLOSE):
        raise PlanError(
            f"{called(phase)}: from {_at(start)} to {_at(end)}. Let it go between 0 m or more and {_at(covered)} or"
            " deeper, where the payload is covered."
        )
    if phase.kind not in (*IN_AIR, K.SPLASH) and max(start, end) > covered + CLOSE:
        raise PlanError(
            f"{called(phase)}: from {_at(start)} to {_at(end)}, and the payload is not covered above {_at(covered)}. "
            "Let splash-zone end deeper."
        )
    _check_way(phase, start, end, water)


def _check_way(phase: Phase, start: float, end: float, water: Water) -> None:
    up = {K.LIFT_OFF: True, K.SEABED_LIFT_OFF: True, K.LANDING: False, K.SET_DOWN: False}.get(phase.kind)
    if up is not None and (end - start) * (1.0 if up else -1.0) < CLOSE:
        raise PlanError(
            f"{called(phase)}: from {_at(start)} to {_at(end)}, and it goes {'up' if up else 'down'}. Exchange or"
            " correct them."
        )
    if phase.kind in STANDS and abs(end - start) > CLOSE:
        raise PlanError(
            f"{called(phase)}: from {_at(start)} to {_at(end)}, and it stands. Use lowering to move, or leave end out."
        )
    if phase.kind is K.LOWERING and abs(end - start) < CLOSE:
        raise PlanError(f"{called(phase)}: starts and ends at {_at(start)}. Use deep to stand, or give where it goes.")
    bottom = {K.LANDING: end, K.SEABED_LIFT_OFF: start}.get(phase.kind)
    if bottom is not None and abs(bottom + water.depth) > CLOSE:
        verb = "ends" if phase.kind is K.LANDING else "starts"
        raise PlanError(
            f"{called(phase)}: {verb} at {_at(bottom)}, and the seabed is at {_at(-water.depth)}. Leave it out, or"
            " correct one."
        )


def _timed(phase: Phase, start: float, end: float) -> Phase:
    """The phase with its heights, speed and duration."""
    way = abs(end - start)
    if way <= CLOSE:
        if phase.speed is not None:
            raise PlanError(
                f"{called(phase)}: speed is given, and it stands at {_at(start)}. Leave speed out, or give where it"
                " goes."
            )
        return _with(phase, start, start, None, TIME[phase.kind] if phase.duration is None else phase.duration)
    speed = SPEED[phase.kind] if phase.speed is None else phase.speed
    least = way / speed
    if phase.duration is not None and phase.duration < least * (1.0 - 1e-3):
        raise PlanError(
            f"{called(phase)}: duration {show(phase.duration, 'time')}, and {show(way, 'length')} at"
            f" {show(speed, 'speed')} take {show(least, 'time')}. Give more time or more speed."
        )
    return _with(phase, start, end, speed, least if phase.duration is None else phase.duration)


def _with(phase: Phase, start: float, end: float, speed: float | None, duration: float) -> Phase:
    new: dict[str, Any] = {"mode": phase.winch, "start": start, "end": end, "speed": speed, "duration": duration}
    return phase.model_copy(update=new)


def _at(z: float) -> str:
    return show(z, "length")


def described(phase: Phase) -> dict[str, Any]:
    """A phase as plain data."""
    return {
        "name": phase.name,
        "kind": phase.kind.value,
        "mode": phase.winch.value,
        "start": phase.start,
        "end": phase.end,
        "speed": phase.speed,
        "duration": phase.duration,
        "held": phase.held,
        "compensated": phase.compensated,
        "limits": dict(phase.limits),
    }
