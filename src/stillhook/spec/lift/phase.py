"""A phase of a lift: what happens in it, how the winch is driven meanwhile, and what ends it.

Phases are what a lift file lists, what a plan assesses and what a winch programme is made of. Depths are those of the
payload's underside below still water (negative: above it).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from enum import StrEnum
from types import MappingProxyType
from typing import Any, NamedTuple, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from stillhook import units as u
from stillhook.errors import LiftError
from stillhook.spec.scenario import Record
from stillhook.tables.table import Line
from stillhook.units import quote, show


class WinchMode(StrEnum):
    """Winch modes of a lift; docs/explanation/winch-modes.md states what each does, waits for and ends with."""

    MANUAL = "manual"
    AHC = "ahc"
    TENSION = "constant-tension"
    SPLASH = "splash"
    LANDING = "landing"
    STOP = "emergency-stop"
    BLACKOUT = "blackout"


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
    LIFT_OFF_BARGE = "lift-off-barge"
    SET_DOWN_PLATFORM = "set-down-platform"


class SetDownDeck(StrEnum):
    """What a payload is set down on that is not the crane vessel: a fixed platform, or the file's other vessel."""

    FIXED = "fixed"
    OTHER = "other-vessel"


class Reference(StrEnum):
    """What a compensating winch holds the hook still against: the earth, or the deck, by a motion unit on it."""

    EARTH = "earth"
    DECK = "deck"


MODES: Mapping[PhaseKind, tuple[WinchMode, ...]] = MappingProxyType(
    {
        PhaseKind.LIFT_OFF: (WinchMode.MANUAL,),
        PhaseKind.IN_AIR: (WinchMode.MANUAL,),
        PhaseKind.SPLASH: (WinchMode.MANUAL, WinchMode.SPLASH),
        PhaseKind.LOWERING: (WinchMode.MANUAL, WinchMode.AHC),
        PhaseKind.DEEP: (WinchMode.AHC, WinchMode.MANUAL),
        PhaseKind.STAND_OFF: (WinchMode.AHC, WinchMode.MANUAL),
        PhaseKind.LANDING: (WinchMode.LANDING, WinchMode.AHC, WinchMode.MANUAL),
        PhaseKind.SEABED_LIFT_OFF: (WinchMode.AHC, WinchMode.MANUAL),
        PhaseKind.SET_DOWN: (WinchMode.MANUAL,),
        PhaseKind.LIFT_OFF_BARGE: (WinchMode.MANUAL, WinchMode.AHC),
        PhaseKind.SET_DOWN_PLATFORM: (WinchMode.MANUAL, WinchMode.AHC),
    }
)
"""Winch modes that a phase of a kind may have, the usual one first."""
OFF_DECK = (PhaseKind.LIFT_OFF, PhaseKind.LIFT_OFF_BARGE)
"""Phases that lift the payload off a deck: the crane vessel's, or another vessel's."""
ON_DECK = (PhaseKind.SET_DOWN, PhaseKind.SET_DOWN_PLATFORM)
"""Phases that set it down on one."""
APART = (PhaseKind.LIFT_OFF_BARGE, PhaseKind.SET_DOWN_PLATFORM)
"""Phases at a deck that moves otherwise than the crane vessel."""
HELD_KINDS = (PhaseKind.SPLASH, PhaseKind.LANDING)
"""Phases in which the payload is also held: at the worst depth of a passage, at the stand-off of a landing."""
MOST_HOLD, MOST_STAND_OFF = 24.0 * 3600.0, 50.0
"""Longest hold [s], and highest stand-off [m]: what is given in a wrong unit is more."""
FASTEST = 5.0
"""Fastest phase of a kind [m/s]: what is given in a wrong unit is more."""
LATER = ("hold", "stand_off", "deck", "reference")
"""Fields of a phase that digests have only where they are given."""
OFF = "off"
"""What a file writes for a limit, or a hold, that a phase does not have."""
STOPS = (WinchMode.STOP, WinchMode.BLACKOUT)
"""Modes that stop the winch at once: a failure, not a way to lift, so that no kind of phase has one."""
ENDS = ("time", "depth", "wire", "landed", "end_tension")
"""What may end a phase of a programme: exactly one of these fields."""
RUN_ENDS = ("wire", "landed", "end_tension")
"""Those that only a run can tell the depth of."""


class Phase(Record):
    """One phase. A phase without a kind names its mode and ends by exactly one of `time`, `depth`, `wire`, `landed` and
    `end_tension`; one with a kind ends at a depth or stands for a time, and what it leaves out follows from its kind
    (`stillhook.spec.lift.joining.joined`).

    `depth` becomes wire out by the static stretch of the wire, as a planner would calculate it. `speed` is a magnitude
    where the phase ends at a depth, which says the direction; else lowering positive, and negative hoists. `time`
    counts from the phase's entry, in landing mode from touch-down. `wire` and `end_tension` count in the direction in
    which the phase moves them. `tension` and `end_tension` are those at the hook, as the load indicator gives them:
    without the weight of the wire that hangs. `planned` is what a plan counts for a phase that moves to a depth, where
    that is longer than its way over its speed.

    Of a plan: tip, place of the crane tip in this phase, as text ("x=-15 m, y=0 m, z=36 m"), None for that of the lift;
    limits, rule -> limit of this phase in place of the rule's own, as text, or "off"; hold, how long the payload is
    also held at its worst depth of a splash zone, or at the stand-off above the seabed before it is landed [s], 0
    ("off" in a file) for none, None for the rule set's time; stand_off, height of that stop above the seabed [m], None
    for the rule set's; deck that a
    set-down-platform ends on, None for a fixed one; reference of the compensation at a deck, None for the earth.
    `start_depth` is where a joined phase begins; a file gives that of the lift.

    Raises ScenarioError, one line, for a phase that could not do what it says.
    """

    name: Line = ""
    kind: PhaseKind | None = None
    mode: WinchMode = Field(description=f"one of {', '.join(WinchMode)}; a kind has a usual one")
    start_depth: u.Length | None = Field(default=None, description="depth at which a joined phase begins")
    depth: u.Length | None = Field(default=None, description="depth of the underside at which the phase ends")
    speed: u.Speed | None = Field(
        default=None, ge=-10.0, le=10.0, description="wire speed; without a depth negative hoists"
    )
    time: u.Time | None = Field(
        default=None, gt=0, description="duration of a phase that does not move or moves for a time"
    )
    planned: u.Time | None = Field(default=None, gt=0, description="time that a plan counts for a way to a depth")
    wire: u.Length | None = Field(default=None, ge=0, description="wire out at which the phase ends")
    landed: bool = False
    end_tension: u.Force | None = Field(default=None, gt=0, description="tension at which the phase ends")
    tension: u.Force | None = Field(
        default=None, gt=0, description="tension that constant-tension, or landing after touch-down, holds"
    )
    timeout: u.Time | None = Field(
        default=None, gt=0, description="after which the programme is stuck; an hour longer than it should take"
    )
    tip: str | None = None
    limits: Mapping[str, Any] = Field(default_factory=dict)
    hold: u.Time | None = Field(default=None, ge=0, le=MOST_HOLD)
    stand_off: u.Length | None = Field(default=None, gt=0, le=MOST_STAND_OFF)
    deck: SetDownDeck | None = Field(default=None, description="what set-down-platform ends on: fixed, or other-vessel")
    reference: Reference | None = Field(
        default=None, description="what ahc holds the hook still against at a deck: earth, or deck"
    )

    def __hash__(self) -> int:
        return hash(self.name)

    @property
    def ends(self) -> tuple[str, ...]:
        """Which fields end the phase: one in a programme."""
        return tuple(name for name in ENDS if getattr(self, name) not in (None, False))

    @property
    def keeps_tension(self) -> bool:
        """Whether the mode holds a tension."""
        return self.mode in (WinchMode.TENSION, WinchMode.LANDING)

    @property
    def compensated(self) -> bool:
        """Whether the winch follows the tip."""
        return self.mode in (WinchMode.AHC, WinchMode.LANDING)

    @property
    def on_other_vessel(self) -> bool:
        """Whether its deck is the one of the file's other vessel."""
        return self.kind is PhaseKind.LIFT_OFF_BARGE or self.deck is SetDownDeck.OTHER

    @property
    def follows_deck(self) -> bool:
        """Whether the winch holds the hook still against a moving deck."""
        return self.compensated and self.on_other_vessel and self.reference is Reference.DECK

    @property
    def held(self) -> bool:
        """Whether the payload is held in the wave zone, at whichever depth between begin and end is the worst."""
        return bool(self.hold)

    @property
    def duration(self) -> float | None:
        """What a joined phase takes [s]."""
        return self.time if self.planned is None else self.planned

    @property
    def counted(self) -> float:
        """Time that the operation is planned to spend in the phase [s]: a hold is assessed, not planned."""
        return 0.0 if self.held else self.duration or 0.0

    @property
    def z_start(self) -> float | None:
        """Height of the underside above still water as a joined phase begins [m]."""
        return None if self.start_depth is None else 0.0 - self.start_depth

    @property
    def z_end(self) -> float | None:
        """Height of the underside above still water as the phase ends [m]."""
        return None if self.depth is None else 0.0 - self.depth

    @model_validator(mode="before")
    @classmethod
    def _of_its_kind(cls, data: Any) -> Any:
        """Name and mode that the kind gives where they are left out."""
        if not isinstance(data, Mapping) or data.get("kind") not in tuple(PhaseKind):
            return data
        usual = {"name": str(data["kind"]), "mode": MODES[data["kind"]][0]}
        return {**data, **{key: value for key, value in usual.items() if data.get(key) is None}}

    @field_validator("hold", mode="before")
    @classmethod
    def _hold_fits(cls, hold: object, info: ValidationInfo) -> object:
        if hold is not None and (kind := info.data.get("kind")) not in HELD_KINDS:
            raise ValueError(
                f"{kind or 'a phase without a kind'} has no hold of its own; only {' and '.join(HELD_KINDS)} have."
                " Leave hold out; a tension to hold is tension."
            )
        return "0 s" if hold == OFF else hold

    @field_validator("stand_off", mode="before")
    @classmethod
    def _stands_off(cls, height: object, info: ValidationInfo) -> object:
        if height is not None and (kind := info.data.get("kind")) is not PhaseKind.LANDING:
            raise ValueError(
                f"{kind or 'a phase without a kind'} has no stand-off; only {PhaseKind.LANDING} has. Leave"
                " stand_off out."
            )
        return height

    @field_validator("mode", mode="before")
    @classmethod
    def _mode_fits(cls, mode: object, info: ValidationInfo) -> object:
        kind = info.data.get("kind")
        if kind is not None and mode not in MODES[kind]:
            raise ValueError(
                f"{kind} has one of {', '.join(MODES[kind])}; controllers are set by alternatives, not by mode"
            )
        return mode

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.tension is not None and not self.keeps_tension:
            raise ValueError(
                f"{called(self)}: tension belongs to constant-tension and landing, and this is {self.mode}. Leave it"
                " out; a tension that ends a phase is end_tension."
            )
        if self.deck is not None and self.kind is not PhaseKind.SET_DOWN_PLATFORM:
            raise ValueError(
                f"{called(self)}: deck belongs to {PhaseKind.SET_DOWN_PLATFORM} alone. Leave it out; the deck that a"
                " lift begins on is rigging.carrier."
            )
        if self.reference is not None and not (self.kind in APART and self.compensated):
            raise ValueError(
                f'{called(self)}: reference belongs to {" and ".join(APART)} with mode = "{WinchMode.AHC}". Leave it'
                " out, or give that mode."
            )
        if self.kind is None:
            self.check_run()
        elif self.speed is not None and not 0.0 < abs(self.speed) <= FASTEST:
            raise ValueError(
                f"{called(self)}: speed {show(self.speed, 'speed')}: give more than 0, and at most"
                f" {show(FASTEST, 'speed')}."
            )
        return self

    def check_run(self) -> None:
        """Refuse a phase that a winch could not run: nothing or several things end it, a tension is missing, or its
        speed cannot bring about what ends it. Errors: ValueError, one line."""
        if len(self.ends) != 1:
            raise ValueError(
                f"{called(self)}: {' and '.join(self.ends) or 'nothing'} ends it. Give one of {', '.join(ENDS)}, "
                'such as depth = "20 m" or landed = true.'
            )
        if self.keeps_tension and self.tension is None:
            raise ValueError(
                f'{called(self)}: tension is missing, the one that {self.mode} keeps. Give it, such as "300 kN".'
            )
        (end,), speed = self.ends, self.speed or 0.0
        if self.mode in STOPS and (speed != 0.0 or end != "time"):
            raise ValueError(
                f"{called(self)}: the winch stops at once, and speed or {end} does not apply. Give time alone."
            )
        if self.mode is WinchMode.TENSION and speed != 0.0:
            raise ValueError(
                f"{called(self)}: speed is given, and constant-tension moves the wire by itself. Leave speed out."
            )
        if self.mode is WinchMode.LANDING and speed <= 0.0:
            raise ValueError(f'{called(self)}: a load is landed by lowering it. Give speed above 0, such as "6 m/min".')
        if self.landed and (speed <= 0.0 or self.mode is WinchMode.TENSION):
            raise ValueError(
                f"{called(self)}: landed = true needs a phase that lowers. Give speed above 0, in another mode."
            )
        if speed == 0.0 and not self.keeps_tension and end != "time":
            raise ValueError(f"{called(self)}: speed is 0, so {end} never comes. Give speed, or end it by time.")
        if self.time is not None and self.timeout is not None and self.timeout < self.time:
            raise ValueError(
                f"{called(self)}: timeout {self.timeout:g} s comes before its time {self.time:g} s. Give a longer"
                " one, or none."
            )


def called(phase: Phase) -> str:
    """The phase in an error: its name with its kind, or its mode."""
    what = phase.mode if phase.kind is None else phase.kind
    return f"phase {quote(phase.name)} ({what})" if phase.name else f"a phase in mode {phase.mode}"


def phase_names(programme: Sequence[Phase]) -> tuple[str, ...]:
    """A name for each phase, no two alike: its own, or its number and mode."""
    names = [p.name or f"{i} {p.mode}" for i, p in enumerate(programme, 1)]
    return tuple(f"{n} ({i})" if names.count(n) > 1 else n for i, n in enumerate(names, 1))


class Move(NamedTuple):
    """What a phase of a programme does as planned. v: wire speed, lowering positive [m/s]; start, end: depths of the
    underside [m], NaN where only a run can tell."""

    v: float
    start: float
    end: float


def moves(programme: Sequence[Phase], start_depth: float, bottom: float) -> tuple[Move, ...]:
    """The moves of a programme that begins at a depth, over a seabed at bottom [m].

    Errors: LiftError, one line, where the sign of a speed contradicts the depth that its phase ends at, or where it
    cannot be known on which side of the payload that depth is.
    """
    depth, least, most = start_depth, start_depth, start_depth  # as planned; where the payload is for sure between
    result = []
    for name, phase in zip(phase_names(programme), programme, strict=True):
        v = phase.speed or 0.0
        if phase.depth is not None:
            v, end = _towards(phase.depth, v, least, most, name), phase.depth
            least = most = end
        elif phase.time is not None:
            way = v * phase.time
            end, least, most = depth + way, min(least, least + way), max(most, most + way)
        else:
            end = bottom if phase.landed else math.nan
        if phase.landed or (phase.mode is WinchMode.LANDING and phase.time is not None):
            least = most = bottom
        elif phase.depth is None and (phase.time is None or phase.mode is WinchMode.TENSION):
            least, most = -math.inf, math.inf
        if phase.mode is WinchMode.LANDING and v < 0.0:
            raise LiftError(
                f"phase {quote(name)}: it lands, and its depth is above where it begins. Give a deeper one."
            )
        result.append(Move(v, depth, end))
        depth = end
    return tuple(result)


def _towards(depth: float, speed: float, least: float, most: float, name: str) -> float:
    """The speed towards a depth, lowering positive [m/s], from somewhere between two others; where the payload may be
    anywhere its sign is that of the phase."""
    if speed < 0.0:
        if depth > most:
            raise LiftError(
                f"phase {quote(name)}: speed = {show(speed, 'speed')} hoists, and it ends at {show(depth, 'length')},"
                f" below where it begins, {show(most, 'length')}. Give speed without a sign: the depth says"
                " the direction."
            )
        return speed
    if depth >= most or (math.isinf(least) and math.isinf(most)):
        return speed
    if depth <= least:
        return -speed
    raise LiftError(
        f"phase {quote(name)}: depth = {show(depth, 'length')} is on the way of the phase before it, which ends by"
        f" time, between {show(least, 'length')} and {show(most, 'length')}: the direction is not known. End that one"
        " at a depth, or give this one a negative speed where it hoists."
    )
