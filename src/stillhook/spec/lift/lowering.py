"""One lowering: what hangs, from where, into which water, and the winch programme, phase by phase."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, SerializeAsAny, field_validator

from stillhook import units as u
from stillhook.control.registry import DEFAULT_MODE
from stillhook.errors import LiftError
from stillhook.sea.motion.motion import Motion, Still
from stillhook.sea.spectra.spectrum import Sea
from stillhook.sea.steady_flow import Current
from stillhook.sea.vessel.heave_filter import moved_by
from stillhook.sea.vessel.motion_unit import MotionUnit
from stillhook.sea.vessel.rao import Rao
from stillhook.sea.vessel.realisation import (
    Amplitudes,
    Resolution,
    WaveField,
    band,
    realise,
    samples,
    tip_motion,
)
from stillhook.sea.vessel.relative import DeckMotion, OtherVessel, RelativeMotion
from stillhook.spec.lift.deck import Deck
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.phase import Move, Phase, moves
from stillhook.spec.scenario import LONGEST, RHO_SEA, FrictionModel, Mode, Number, Record, Sensors
from stillhook.tables.table import Line
from stillhook.winches.load_path.interface import JointUnit
from stillhook.winches.load_path.registry import UNITS, unit_of


class WinchSettings(Record):
    """How the winch modes are set. None of it is published; every default is assumed, for the reason next to it."""

    ramp: u.Acceleration = Field(default=0.1, gt=0, description="ramp of the joystick: half a metre per second in 5 s")
    v_max: u.Speed = Field(
        default=0.5, gt=0, description="highest speed that tension control adds; under half of what a 250 t winch does"
    )
    v_enter: u.Speed = Field(
        default=0.1, gt=0, description="tip speed below which compensation starts: near crest or trough, without a bump"
    )
    omega_T: u.Frequency = Field(
        default=0.5,
        gt=0,
        le=2.0,
        description="bandwidth of tension control on a load at rest; a quarter of K_p v_max at marginal stability",
    )
    v_soft: u.Speed = Field(
        default=2.0,
        ge=0,
        le=5.0,
        description="speed of splash mode per deviation of the tension by (m + A33) g; calm up to 3 m/s",
    )
    omega_soft: u.Frequency = Field(
        default=5.0,
        gt=0,
        description="lightest load that splash mode assumes, as its frequency on the wire; above it the winch lags",
    )
    omega_s: u.Frequency = Field(
        default=0.1,
        ge=0,
        le=1.0,
        description="return of splash and manual mode to the joystick's path, in a minute: below all waves",
    )
    tau_slow: u.Time = Field(
        default=20.0, gt=0, description="time constant of the mean tension: longer than any wave period"
    )
    tau_suspended: u.Time = Field(
        default=200.0, gt=0, description="mean tension that a landing is seen against: a slow one takes minutes"
    )
    landed: Number = Field(
        default=0.5,
        gt=0,
        lt=1,
        description="touch-down is a fall of the tension by this part of the payload's weight in water",
    )
    F_least: u.Force | None = Field(
        default=None, ge=0, description="tension that compensation needs; default half of the empty hook's weight"
    )


class Rigging(Record):
    """Slings between hook and payload: they pull and cannot push."""

    height: u.Length = Field(default=10.0, ge=0, description="from the hook down to the payload's top")
    stiffness: u.Stiffness = Field(default=50e6, gt=0, description="of all slings together (assumed)")
    zeta: Number = Field(default=0.05, ge=0, description="damping ratio of payload on slings (assumed)")


class DeepWire(Record):
    """The wire as a rod of many nodes. Damping is that of the material: the crane's `wire.zeta` is the damping ratio at
    the load's first natural frequency on the wire that is out."""

    nodes: Annotated[int, Field(strict=True, ge=1, le=100)] = 20


def _unit(value: Any) -> Any:
    """A table of a unit as the unit that it describes."""
    return unit_of(value) if isinstance(value, Mapping) else value


AnyUnit = SerializeAsAny[Annotated[JointUnit, BeforeValidator(_unit)]]
"""A unit between hook and slings of any type, or its table."""


class Lowering(Record):
    """A payload on a deep wire under a moving crane tip, through the surface, to the seabed. Frozen.

    At the start everything hangs at rest with the payload's underside at start_depth below still water (negative:
    above), static stretch included. `waves` is the water at the payload, coherent with `tip`; both grow from nothing
    over `ramp`.
    Raises LiftError, one line, for anything else.

    >>> import stillhook
    >>> lift = stillhook.Lowering(
    ...     payload=stillhook.read_payload("template-120t"), h_tip="36 m", depth="1500 m", start_depth="20 m",
    ...     programme=[{"mode": "ahc", "time": "2 min"}], duration="130 s",
    ... )
    >>> lift.depth, lift.programme[0].time
    (1500.0, 120.0)
    """

    name: Line = ""
    payload: Payload
    rigging: Rigging = Field(default_factory=Rigging)
    compensator: AnyUnit | None = Field(default=None, description="passive heave compensator above the slings")
    wire: DeepWire = Field(default_factory=DeepWire)
    deck: Deck | None = Field(default=None, description="that a payload in air is lifted from or set down on")
    tip: SerializeAsAny[Motion] = Field(default_factory=Still)
    waves: WaveField | None = None
    h_tip: u.Length = Field(gt=0, description="mean height of the crane tip above still water")
    depth: u.Length = Field(gt=0, description="water depth")
    start_depth: u.Length = Field(description="depth of the payload's underside below still water at the start")
    programme: tuple[Phase, ...]
    winch: WinchSettings = Field(default_factory=WinchSettings)
    controller: Mode = DEFAULT_MODE
    duration: u.Time = Field(gt=0)
    ramp: u.Time = Field(default=10.0, ge=0)
    rho: u.Density = Field(default=RHO_SEA, gt=0)
    current: Current | None = Field(default=None, description="past the payload, in its drag")
    sensors: Sensors = Field(default_factory=Sensors)
    friction: FrictionModel = FrictionModel.LUGRE

    @field_validator("programme")
    @classmethod
    def _runs(cls, programme: tuple[Phase, ...]) -> tuple[Phase, ...]:
        for phase in programme:
            phase.check_run()
        return programme

    @property
    def z_0(self) -> float:
        """Height of the payload's underside above still water at the start [m]."""
        return 0.0 - self.start_depth

    @property
    def on_deck(self) -> bool:
        """Whether the payload starts on a deck."""
        return self.deck is not None and self.deck.slack is not None

    @property
    def body(self) -> str:
        """Element of the load path that the payload is."""
        if self.deck is not None:
            return "deck"
        return "payload" if self.current is None or max(self.current.speed) == 0.0 else "current"

    @property
    def moves(self) -> tuple[Move, ...]:
        """What the phases do as planned (`stillhook.spec.lift.phase.moves`)."""
        return moves(self.programme, self.start_depth, self.depth)

    @property
    def extension_signal(self) -> str:
        """Column of a series that says how much longer than its shortest the unit between hook and slings is; "" where
        there is none."""
        return "" if self.compensator is None else str(UNITS[self.compensator.type].EXTENSION)

    @property
    def link_mass(self) -> float:
        """Mass between hook and slings, that of a compensator [kg]."""
        return 0.0 if self.compensator is None else self.compensator.mass


def check_length(duration: float) -> None:
    """Refuse a run [s] that is longer than any, before waves are made for it. Errors: LiftError."""
    if not (math.isfinite(duration) and 0.0 < duration <= LONGEST):
        raise LiftError(f"duration = {duration:g} s: a run lasts up to {LONGEST:g} s. Lower in parts.")


@dataclass(frozen=True, eq=False)
class InSea:
    """What thousands of runs of a table are given as: small, and quick to send to a cluster.

    lift: everything but tip and waves, which it must not have. sea, seed: which waves; rao: what moves in them; x, y:
    crane tip and payload from the vessel's reference point, forward and to port [m]. water: whether the payload feels
    the waves. left: part of the tip's motion that reaches the wire, 1 all of it (a flat cap on compensation of 80 %
    leaves 0.2), and where a deck is followed the part of its motion against that; the water keeps its waves.
    amplitudes: random ones (Rayleigh) where largest values are gathered over seeds. repeat: period of the waves [s],
    None for the lift's duration, and not shorter: lifts of unlike durations meet the same waves where it is equal.
    other: whose deck in these waves is that of the lift. unit: motion unit whose heave filter takes from what the PLC
    is given.
    """

    lift: Lowering
    sea: Sea = field(repr=False)
    seed: int
    rao: Rao = field(repr=False)
    x: float
    y: float
    water: bool = False
    left: float = 1.0
    amplitudes: Amplitudes = Amplitudes.FIXED
    repeat: float | None = None
    other: OtherVessel | None = field(default=None, repr=False)
    unit: MotionUnit | None = None

    def __post_init__(self) -> None:
        if self.lift.waves is not None or not isinstance(self.lift.tip, Still):
            raise LiftError(
                f'lift "{self.lift.name}": it has a tip motion or waves already. Leave them to the sea, or run it as'
                " it is."
            )
        if self.other is not None and not (self.lift.deck is not None and isinstance(self.lift.deck.motion, Still)):
            raise LiftError(f'lift "{self.lift.name}": the vessel `other` moves a deck at rest. Give the lift one.')
        if self.repeat is not None and self.repeat < self.lift.duration:
            raise LiftError(
                f"repeat {self.repeat:g} s is shorter than the lift, {self.lift.duration:g} s. Give its duration or"
                " more."
            )

    @property
    def _follows(self) -> bool:
        """Whether what is left is that of the motion against the deck."""
        return self.left != 1.0 and self.other is not None and self.lift.deck is not None and self.lift.deck.followed

    @property
    def period(self) -> float:
        """Period after which the waves repeat [s]."""
        return self.lift.duration if self.repeat is None else self.repeat

    @cached_property
    def motion(self) -> bytes:
        """Hash of what tip and water follow from: runs in which it is equal are moved alike."""
        trains = [{"spectrum": t.spectrum.to_dict(), "beta": t.beta, "spread": t.spread} for t in self.sea.trains]
        place = [self.period, self.lift.depth, self.seed, self.x, self.y, self.water, self.left, self.amplitudes]
        place += [] if self.other is None else self.other.inputs()
        place += [] if self.unit is None else [self.unit.to_dict()]
        place += ["followed"] if self._follows else []
        return hashlib.sha256(json.dumps([trains, place], sort_keys=True).encode() + self.rao.digest).digest()

    @cached_property
    def spacing(self) -> float:
        """Spacing of the water's samples [s], 0 without water: equal in runs that can go side by side."""
        return self.period / samples(self.period, band(self.sea, self.period)[1]) if self.water else 0.0

    def lowering(self) -> Lowering:
        """The lowering, with `realise`, `tip_motion` and `wave_field` of the seed. Errors: SeaError for a sea without
        waves."""
        waves = realise(self.sea, self.period, self.seed, amplitudes=self.amplitudes, depth=self.lift.depth)
        moves: RelativeMotion | None = None
        if self.other is not None and self._follows:
            moves = RelativeMotion(self.rao, self.other, self.lift.depth, self.left, 1.0 - self.left)
        tip, water = moved_by(
            waves,
            self.rao,
            self.x,
            self.y,
            water=self.water,
            left=self.left,
            resolution=Resolution.COARSE,
            unit=self.unit,
            moves=moves,
        )
        moved = self.lift.model_copy(update={"tip": tip, "waves": water})
        if self.other is None or self.lift.deck is None:
            return moved
        deck = tip_motion(waves, DeckMotion(self.other, self.lift.depth), self.x, self.y, fine=Resolution.COARSE.angle)
        return moved.model_copy(update={"deck": self.lift.deck.model_copy(update={"motion": deck})})

    def moved_as(self, other: Lowering) -> Lowering:
        """The lowering, with the motions of another whose `motion` is equal."""
        deck = self.lift.deck
        if deck is not None and other.deck is not None and self.other is not None:
            deck = deck.model_copy(update={"motion": other.deck.motion})
        return self.lift.model_copy(update={"tip": other.tip, "waves": other.waves, "deck": deck})
