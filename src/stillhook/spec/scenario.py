"""What is done to a crane: load, wire out, tip motion, operator, mode, sensors, faults. Frozen; text with units in, SI
inside.

Commands to the active circuit as a record, such as a log has them: commands of the pumps and motors, cycle by
cycle.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import pairwise
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, SerializeAsAny, field_validator, model_validator

from stillhook import units as u
from stillhook.base.arrays import ArrayRecord, FloatArray, decode_array, encode_array, fill
from stillhook.control.registry import DEFAULT_MODE
from stillhook.control.registry import Mode as Mode
from stillhook.errors import ScenarioError
from stillhook.physics.scalar import G
from stillhook.sea.motion.motion import Motion, Still
from stillhook.sea.motion.text import motion_from_dict
from stillhook.sea.motion.words import parse_motion
from stillhook.sea.steady_flow import FlowSpeed
from stillhook.spec.record import Record as Record
from stillhook.spec.sensors import Sensors as Sensors
from stillhook.tables.table import Line
from stillhook.tables.table import Number as Number

EDGE = 1e-9  # s: how far a time may lie outside the record by rounding alone


@dataclass(frozen=True, init=False, eq=False)
class Commands(ArrayRecord):
    """Pump and motor commands at given times, each held until the next one, as a PLC's outputs are.

    Parameters: times [s], strictly increasing (the first one becomes t = 0); u_p pump commands in [-1, 1], hoisting
    positive; u_m motor displacement commands in [0, 1]; source, where they are from. A scenario with commands drives
    the winch by them in place of its PLC.
    Errors: ScenarioError, one line.
    """

    times: FloatArray = field(repr=False)
    u_p: FloatArray = field(repr=False)
    u_m: FloatArray = field(repr=False)
    source: str

    def __init__(self, times: ArrayLike, u_p: ArrayLike, u_m: ArrayLike, *, source: str = "") -> None:
        place = source or "Commands"
        t, p, m = (_column(x, name, place) for x, name in ((times, "times"), (u_p, "u_p"), (u_m, "u_m")))
        if not len(t) == len(p) == len(m) or not len(t):
            raise ScenarioError(
                f"{place}: {len(t)} times, {len(p)} u_p and {len(m)} u_m. Give one of each for every time."
            )
        if (np.diff(t) <= 0.0).any():
            raise ScenarioError(f"{place}: times do not increase. Sort them and remove doubles.")
        for name, x, lo in (("u_p", p, -1.0), ("u_m", m, 0.0)):
            bad = ~((x >= lo) & (x <= 1.0))
            if bad.any():
                i = int(np.argmax(bad))
                raise ScenarioError(
                    f"{place}: {name} = {x[i]:g} at {t[i]:g} s: allowed is {lo:g} to 1. Scale it, or hold it in its"
                    " range."
                )
        fill(self, times=t - t[0], u_p=p, u_m=m, source=source)

    def at(self, t: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """u_p and u_m in force at the times t [s]; after the last time the last ones hold."""
        i = np.clip(np.searchsorted(self.times, np.asarray(t) + EDGE, side="right") - 1, 0, len(self.times) - 1)
        return self.u_p[i], self.u_m[i]

    @property
    def duration(self) -> float:
        """Last time of the record [s]."""
        return float(self.times[-1])

    def to_dict(self) -> dict[str, Any]:
        """Plain data that `from_dict` turns into the same record, exact to the bit."""
        return {"source": self.source, **{n: encode_array(getattr(self, n)) for n in ("times", "u_p", "u_m")}}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """The record that `to_dict` stored. Errors: KeyError, TypeError, ValueError where it is not one."""
        return cls(*(decode_array(data[n]) for n in ("times", "u_p", "u_m")), source=str(data["source"]))

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> Any:
        """A model field of this type takes finished commands only."""
        from pydantic_core import core_schema  # here, as in `stillhook.sea.motion.motion`

        as_dict = core_schema.plain_serializer_function_ser_schema(lambda commands: commands.to_dict())
        return core_schema.is_instance_schema(cls, serialization=as_dict)


def _column(values: ArrayLike, name: str, place: str) -> FloatArray:
    try:
        column = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise ScenarioError(f"{place}: {name} are not numbers. Give one number a sample.") from None
    if column.ndim != 1 or not np.isfinite(column).all():
        raise ScenarioError(f"{place}: {name} are not one finite number a sample. Leave the gaps out, or fill them.")
    return column


RHO_SEA = 1025.0
"""Default density of sea water [kg/m^3]."""

SHORTEST = 0.01
LONGEST = 86400.0


def mode_of(text: Mode | str) -> Mode:
    """The mode of this name. Errors: ScenarioError naming the modes there are."""
    try:
        return Mode(text)
    except ValueError:
        raise ScenarioError(f"mode {u.quote(str(text))} is not one of {', '.join(m.value for m in Mode)}.") from None


class FrictionModel(StrEnum):
    """Dry friction: LuGre bristle, or the regularised tanh law (peak pressure up to +-15 bar, error up to 1.5 mm
    off)."""

    LUGRE = "lugre"
    REGULARISED = "regularised"


class Water(Record):
    """Fully submerged payload. Weight is less by buoyancy, moving mass more by added mass; drag
    1/2 rho C_D A v sqrt(v^2 + U^2), U the current."""

    volume: u.Volume = Field(gt=0, description="displaced volume of payload")
    added_mass: u.Mass = Field(default=0.0, ge=0, description="added mass in heave")
    C_D: Number = Field(default=0.0, ge=0, description="drag coefficient on `area`")
    area: u.Area = Field(default=0.0, ge=0, description="projected area")
    rho: u.Density = Field(default=RHO_SEA, gt=0, description="water density")
    current: FlowSpeed = Field(default=0.0, ge=0, description="speed of the current, horizontal, past the payload")


class Operator(Record):
    """Joystick: wire speeds held from a time on, hoisting positive, and set-point steps of the wire reference, hoisting
    positive.

    `profile` joins its points by straight lines; before the first and after the last point the nearest speed holds.
    `alpha_m` is the motors' relative displacement that the operator holds in manual mode, as in friction tests; the
    pump command then follows the joystick alone and is steady within a layer. Without it the PLC chooses the
    displacement.
    """

    profile: tuple[tuple[u.Time, u.Speed], ...] = ()
    steps: tuple[tuple[u.Time, u.Length], ...] = ()
    alpha_m: Number | None = Field(
        default=None, gt=0, le=1, description="relative displacement of the motors, held in manual mode"
    )

    @model_validator(mode="after")
    def _times_rise(self) -> Self:
        for name, rows in (("profile", self.profile), ("steps", self.steps)):
            times = [t for t, _ in rows]
            if any(b < a for a, b in pairwise(times)) or any(t < 0 for t in times):
                raise ValueError(f"{name}: times must not be negative nor fall. Sort the points.")
        return self


class PowerLoss(Record):
    """One hydraulic power unit stops: its pumps run down, the PLC notices, isolates them and reconfigures its gains."""

    time: u.Time = Field(ge=0, description="when the unit stops")
    unit: Annotated[int, Field(strict=True, ge=1)] = Field(default=1, description="which unit, counted from 1")
    run_down: u.Time = Field(default=0.3, ge=0, description="time in which the pump's flow falls to nothing (assumed)")
    detection: u.Time = Field(default=0.1, ge=0, description="time until the PLC detects it (assumed)")


class Scenario(Record):
    """One run. `load` is the hook load without the hook; `s_w` the wire paid out at the start; `tip` the crane tip's
    motion.

    The motion is ramped in over `ramp`; metrics count from `warm_up` on. `modes` changes the mode at given times,
    bumpless. `commands`: a record of pump and motor commands that the active circuit takes in place of the PLC's, as
    measured ones to see how the winch itself answers. `gas_held`: the accumulator's pressure is held, as with a gas
    bank without end, so that a long steady run does not empty it. Texts carry units: `Scenario(load="100 t", s_w="100
    m", tip="sine 2.8 m 12 s", mode="ssc")`. Raises ScenarioError, one line, for anything else.

    >>> import stillhook
    >>> case = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 2.8 m 12 s", mode="ssc")
    >>> case.load, case.with_mode("ns").mode.value
    (100000.0, 'ns')
    """

    name: Line = ""
    load: u.Mass = Field(ge=0, description="payload on the hook")
    s_w: u.Length = Field(ge=0, description="wire paid out at the start")
    tip: SerializeAsAny[Motion] = Field(default_factory=Still, description="crane tip motion")
    mode: Mode = DEFAULT_MODE
    modes: tuple[tuple[u.Time, Mode], ...] = ()
    duration: u.Time = Field(default=120.0, ge=SHORTEST, le=LONGEST, description="length of the run")
    ramp: u.Time = Field(default=10.0, ge=0, description="time in which the motion grows to full size")
    warm_up: u.Time = Field(default=30.0, ge=0, description="start of the run that metrics leave out")
    water: Water | None = None
    operator: Operator = Field(default_factory=Operator)
    sensors: Sensors = Field(default_factory=Sensors)
    power_loss: PowerLoss | None = None
    friction: FrictionModel = FrictionModel.LUGRE
    gas_held: Annotated[bool, Field(strict=True)] = False
    commands: Commands | None = None

    @model_validator(mode="before")
    @classmethod
    def _complete_record(cls, data: Any) -> Any:
        """A recorded motion, or a record of commands, is run to its end unless a duration is given."""
        if not isinstance(data, dict) or "duration" in data:
            return data
        tip, commands = data.get("tip"), data.get("commands")
        ends = [tip.duration] if isinstance(tip, Motion) and tip.duration is not None else []
        ends += [commands.duration] if isinstance(commands, Commands) else []
        return {**data, "duration": f"{min(ends)!r} s"} if ends else data

    @field_validator("tip", mode="before")
    @classmethod
    def _tip_from_text(cls, value: object) -> object:
        return parse_motion(value, "tip") if isinstance(value, str) else value

    @model_validator(mode="after")
    def _times_fit(self) -> Self:
        if self.warm_up >= self.duration:
            raise ValueError(
                f"warm_up {self.warm_up:g} s leaves nothing of the duration {self.duration:g} s. Shorten warm_up or run"
                " longer."
            )
        if any(b <= a for (a, _), (b, _) in pairwise(self.modes)) or any(t < 0.0 for t, _ in self.modes):
            raise ValueError("modes: times must rise and not be negative. Sort the mode changes.")
        if self.tip.duration is not None and self.duration > self.tip.duration + 1e-9:
            raise ValueError(
                f"duration {self.duration:g} s is longer than the recorded motion, {self.tip.duration:g} s. Shorten the"
                " run."
            )
        if self.commands is not None and self.duration > self.commands.duration + 1e-9:
            raise ValueError(
                f"duration {self.duration:g} s is longer than the record of commands, {self.commands.duration:g} s."
                " Shorten the run."
            )
        return self

    @property
    def weight(self) -> float:
        """Weight of the payload, in water less buoyancy [N]."""
        buoyancy = self.water.rho * self.water.volume if self.water else 0.0
        return (self.load - buoyancy) * G

    def with_mode(self, mode: Mode | str) -> Scenario:
        """The same run in another mode. Errors: ScenarioError naming the modes there are."""
        return self.model_copy(update={"mode": mode_of(mode)})

    def to_dict(self) -> dict[str, Any]:
        """Plain data that `from_dict` turns into the same scenario: SI numbers, for storing in a result."""
        data = self.model_dump(mode="json", exclude={"tip"})
        return {**data, "tip": self.tip.to_dict()}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Scenario:
        """The scenario that `to_dict` wrote. Errors: ScenarioError for any other."""
        try:
            tip, commands = motion_from_dict(data["tip"]), data.get("commands")
            made = {name: data[name] for name in STORED} | dict(data) | {"tip": tip}
            if commands is not None:
                made["commands"] = Commands.from_dict(commands)
        except (KeyError, TypeError, ValueError, AttributeError, zlib.error) as problem:
            raise ScenarioError(
                f"stored scenario: {u.quote(str(problem))} is missing or wrong. Simulate again."
            ) from None
        try:
            with u.stored_numbers():
                return cls(**made)
        except ScenarioError as problem:
            raise ScenarioError(f"stored scenario: {problem}") from None


STORED = ("mode", "modes", "duration", "friction", "operator", "sensors", "water", "power_loss")
"""What every version has stored of a scenario, besides load, wire and motion."""
