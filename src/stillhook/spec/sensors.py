"""What is between winch and PLC in a scenario: delay of the motion unit, noise and steps of its signals, of encoder and
load cell; and a table for each quantity with all that its sensor may have."""

from collections.abc import Mapping
from enum import StrEnum
from typing import Annotated, Any, Generic, Self, TypeVar

import numpy as np
from pydantic import ConfigDict, Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from stillhook import units as u
from stillhook.control import sensor_errors
from stillhook.control.interface import QUANTITIES, SPEED
from stillhook.control.sensors import error_sensor
from stillhook.errors import ScenarioError
from stillhook.spec.record import Record
from stillhook.tables.plausible import Ranged, marks
from stillhook.tables.table import Number, model_in
from stillhook.units import Quantity
from stillhook.winches.registry import WinchType

Q = TypeVar("Q")
"""Quantity of a signal."""
_NOTHING: Any = 0.0


class FaultKind(StrEnum):
    """What a signal is while its sensor is at fault: what it was last; a value; lost, at zero with a channel that says
    so; too much by a value, by a value more each second, or by a value in one cycle of every second; of the other
    sign."""

    FROZEN = "frozen"
    VALUE = "value"
    LOST = "lost"
    OFFSET = "offset"
    DRIFT = "drift"
    SPIKE = "spike"
    SWAPPED = "swapped"


WITHOUT_VALUE = (FaultKind.FROZEN, FaultKind.LOST, FaultKind.SWAPPED)
SPIKES = 1.0
"""Time from one spike to the next [s]."""


class Part(Ranged):
    """A table within that of the sensors, whose refusal names both: frozen, and closed to unknown fields."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    @classmethod
    def model_parametrized_name(cls, params: tuple[Any, ...]) -> str:
        """Such as LengthFault, by the kind of quantity: the name in `stillhook.tables.plausible`, and in a pickle."""
        kinds = (mark.kind for mark in marks(params[0]) if isinstance(mark, Quantity))
        return f"{next(kinds, 'number').title()}{cls.__name__}"


class Fault(Part, Generic[Q]):
    """One fault of a sensor; where two are at one time the later one of the list counts."""

    time: u.Time = Field(ge=0, description="when it begins")
    until: u.Time | None = Field(default=None, gt=0, description="when it is over; default: it stays")
    kind: FaultKind
    value: Q | None = Field(default=None, description="of value, offset, drift (in a second) and spike")

    @model_validator(mode="after")
    def _is_complete(self) -> Self:
        if self.until is not None and self.until <= self.time:
            raise ValueError(f"until {self.until:g} s is not after time {self.time:g} s. Give a later one.")
        if (self.value is None) is not (self.kind in WITHOUT_VALUE):
            with_value = ", ".join(f'"{kind}"' for kind in FaultKind if kind not in WITHOUT_VALUE)
            raise ValueError(f"value belongs to kind = {with_value}, and to no other. Give both, or leave value out.")
        return self

    def record(self, t_cycle: float) -> sensor_errors.Fault:
        """As the kernels read it; t_cycle of the PLC [s]."""
        kind, value = self.kind, 0.0 if self.value is None else float(self.value)  # type: ignore[arg-type]
        return sensor_errors.Fault(
            time=self.time,
            until=sensor_errors.NEVER if self.until is None else self.until,
            frozen=float(kind is FaultKind.FROZEN),
            value=0.0 if kind is FaultKind.DRIFT else value,
            gain=_GAINS.get(kind, 0.0),
            rate=value if kind is FaultKind.DRIFT else 0.0,
            every=float(max(round(SPIKES / t_cycle), 1)) if kind is FaultKind.SPIKE else 0.0,
            lost=float(kind is FaultKind.LOST),
        )


_GAINS = {FaultKind.OFFSET: 1.0, FaultKind.DRIFT: 1.0, FaultKind.SPIKE: 1.0, FaultKind.SWAPPED: -1.0}


class Errors(Part, Generic[Q]):
    """Errors of one signal: it is late, offset, drift and noise are added, it comes in steps, and faults follow."""

    noise: Q = Field(default=_NOTHING, ge=0, description="standard deviation of white noise, a number each PLC cycle")
    offset: Q = Field(default=_NOTHING, description="what is read too much")
    drift: Q = Field(default=_NOTHING, description="what is read too much after an hour more")
    step: Q = Field(default=_NOTHING, ge=0, description="smallest step")
    delay: u.Time = Field(default=0.0, ge=0, le=10, description="delay of the signal, at most 20 PLC cycles")
    faults: tuple[Fault[Q], ...] = Field(default=(), max_length=sensor_errors.FAULTS)


class Sensors(Record):
    """What is between the winch and the PLC. Default: ideal. Noise is white per PLC cycle, from `seed`.

    A table for a quantity, such as `p_a = {"noise": "0.5 bar"}`, has noise, offset, drift (in an hour), step, delay and
    faults of its signal; see docs/how-to/disturb-the-sensors.md.
    """

    delay: u.Time = Field(default=0.0, ge=0, le=10, description="delay of the tip motion signals")
    noise_s_tip: u.Length = Field(default=0.0, ge=0, description="standard deviation of the tip position signal")
    noise_v_tip: u.Speed = Field(default=0.0, ge=0, description="standard deviation of the tip speed signal")
    noise_a_tip: u.Acceleration = Field(
        default=0.0, ge=0, description="standard deviation of the tip acceleration signal"
    )
    noise_s_w: u.Length = Field(default=0.0, ge=0, description="standard deviation of the wire encoder")
    noise_F: u.Force = Field(default=0.0, ge=0, description="standard deviation of the load cell")
    step_s_tip: u.Length = Field(default=0.0, ge=0, description="smallest step of the tip position signal")
    step_v_tip: u.Speed = Field(default=0.0, ge=0, description="smallest step of the tip speed signal")
    step_s_w: u.Length = Field(default=0.0, ge=0, description="smallest step of the wire encoder")
    step_F: u.Force = Field(default=0.0, ge=0, description="smallest step of the load cell")
    seed: Annotated[int, Field(strict=True, ge=0)] = 0
    s_tip: Errors[u.Length] | None = None
    v_tip: Errors[u.Speed] | None = None
    a_tip: Errors[u.Acceleration] | None = None
    s_w: Errors[u.Length] | None = None
    F: Errors[u.Force] | None = None
    alpha_m: Errors[Number] | None = None
    omega_m: Errors[u.Rotation] | None = None
    p_a: Errors[u.Pressure] | None = None
    p_b: Errors[u.Pressure] | None = None
    dp: Errors[u.Pressure] | None = None
    p_hp: Errors[u.Pressure] | None = None

    @model_validator(mode="after")
    def _in_one_place(self) -> Self:
        for quantity in self.disturbed:
            for name in (f"noise_{quantity}", f"step_{quantity}"):
                if getattr(self, name, 0.0):
                    raise ValueError(f"{name} and the table {quantity} are both given. Give all of it in the table.")
        return self

    @model_serializer(mode="wrap")
    def _plain(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Without the tables that are not given, so that a stored scenario is what it was before there were some."""
        data: dict[str, Any] = handler(self)
        return {name: value for name, value in data.items() if name not in QUANTITIES or value is not None}

    @property
    def disturbed(self) -> tuple[str, ...]:
        """Quantities with a table, in the order of `QUANTITIES`."""
        return tuple(quantity for quantity in QUANTITIES if self.errors(quantity) is not None)

    def errors(self, quantity: str) -> Errors[Any] | None:
        """The table of a quantity, None where it is not given."""
        table: Errors[Any] | None = getattr(self, quantity, None)
        return table

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> "Sensors":
        """What `model_dump(mode="json")` wrote, numbers in SI."""
        with u.stored_numbers():
            return cls(**data)


def _table_and_fault(quantity: str) -> tuple[type[Errors[Any]], type[Fault[Any]]]:
    table = model_in(Sensors.model_fields[quantity].annotation)
    assert table is not None
    return table, model_in(table.model_fields["faults"].annotation)  # type: ignore[return-value]


TABLES = {quantity: _table_and_fault(quantity) for quantity in QUANTITIES}
"""Table and fault of every quantity."""
globals().update({each.__name__: each for both in TABLES.values() for each in both})  # pickle looks for them here


def error_sensors(sensors: Sensors) -> tuple[str, ...]:
    """Names of the sensors that a scenario puts between winch and PLC, see `stillhook.control.sensors.error_sensor`."""
    return tuple(error_sensor(quantity).name for quantity in sensors.disturbed)


def error_settings(sensors: Sensors, winch: WinchType, t_cycle: float) -> dict[str, Any]:
    """Settings of each of these sensors on a winch type, by its name; t_cycle of the PLC [s].

    Errors: ScenarioError for a quantity that this winch does not have, or a delay of more cycles than are kept.
    """
    spawned = np.random.SeedSequence(sensors.seed).spawn(NOISES + len(QUANTITIES))
    streams = dict(zip(QUANTITIES, spawned[NOISES:], strict=True))
    return {
        error_sensor(quantity).name: _settings(quantity, sensors.errors(quantity), streams[quantity], winch, t_cycle)
        for quantity in sensors.disturbed
    }


NOISES = 5
"""Streams of the seed that the noise of motion unit, encoder and load cell has without tables."""


def _settings(
    quantity: str, table: Any, stream: np.random.SeedSequence, winch: WinchType, t_cycle: float
) -> sensor_errors.Settings:
    if lacking := _lacking(quantity, winch):
        raise ScenarioError(f'sensors.{quantity}: winch type "{winch.name}" {lacking}. Leave the table out.')
    longest = sensor_errors.RING * t_cycle
    if table.delay > longest * (1.0 + 1e-12):
        raise ScenarioError(
            f"sensors.{quantity}.delay {table.delay:g} s is more than {sensor_errors.RING} PLC cycles, {longest:g} s."
            " Give a shorter one; sensors.delay, of the tip's motion, may be longer."
        )
    faults = [fault.record(t_cycle) for fault in table.faults]
    faults += [sensor_errors.NO_FAULT] * (sensor_errors.FAULTS - len(faults))
    seed = 1.0 + int(stream.generate_state(1)[0]) % (int(sensor_errors.MODULUS) - 1)
    return sensor_errors.Settings(table.offset, table.drift, table.noise, table.step, table.delay, seed, *faults)


def _lacking(quantity: str, winch: WinchType) -> str:
    """Why a winch type has no such signal, "" where it has."""
    signals = {row.name for row in winch.rows}
    if quantity in ("p_a", "p_b") and quantity not in signals:
        return "has no lines A and B"
    if quantity == "alpha_m" and winch.control == SPEED:
        return "sets no displacement of motors"
    return ""
