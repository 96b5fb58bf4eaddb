"""Tables that lift files and plan files share, and the lift file itself, as users write them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field, ValidationInfo, field_validator

from stillhook import units as u
from stillhook.control.registry import DEFAULT_MODE
from stillhook.library.payloads import read_payload
from stillhook.library.toml.file import TomlTable
from stillhook.sea.vessel.boom import DESCRIPTIONS, Boom
from stillhook.spec.lift.lowering import DeepWire, Rigging
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.programme import Stage, WinchSettings
from stillhook.spec.scenario import RHO_SEA, FrictionModel, Mode, Sensors
from stillhook.tables.table import Number, Part, Spec, Text

DEEPEST = 12_000.0  # m
LIGHTEST, HEAVIEST = 900.0, 1300.0  # kg/m^3: of fresh water that is warm, and of brine


class WaterTable(Spec):
    """The table [water]."""

    depth: u.Length = Field(gt=0, le=DEEPEST, description="depth of the water")
    rho: u.Density = Field(default=RHO_SEA, ge=LIGHTEST, le=HEAVIEST, description="density of the water")


class TipTable(Spec):
    """The table [tip]."""

    at: Text | None = Field(default=None, description="place from the vessel's reference point, as text")
    height: u.Length | None = Field(default=None, description="height of the crane tip above still water")
    motion: Any = Field(default=None, description="motion in place of vessel and sea")


class BoomTable(Spec):
    """The table [boom]."""

    pedestal: tuple[Any, ...] = Field(description="heel pin forward, to port, and above still water")
    slew: Any = Field(description="direction of the boom, counter-clockwise from the bow")
    main: tuple[Any, ...] = Field(description="length and angle of the main boom")
    knuckle: tuple[Any, ...] | None = Field(default=None, description="length and angle of the knuckle boom")
    offset: Any = Field(default="0 m", description="heel pin ahead of the axis of slewing")

    @field_validator("pedestal", "main", "knuckle", mode="before")
    @classmethod
    def _list(cls, value: Any, info: ValidationInfo) -> Any:
        if not isinstance(value, list):
            raise ValueError(DESCRIPTIONS[str(info.field_name)])
        return value

    @property
    def boom(self) -> Boom:
        """The crane of this table. Errors: SeaError, UnitError."""
        return Boom(pedestal=self.pedestal, slew=self.slew, main=self.main, knuckle=self.knuckle, offset=self.offset)


class SeaTable(Spec):
    """The table [sea]."""

    wave: Text = Field(description="waves as text, or a file of spectra next to this file")
    record: Any = Field(default=None, description="number from 0, or time, of a record of that file")
    heading: Any = Field(default=None, description="direction in which the waves travel, from the bow")
    spread: Number | None = Field(
        default=None, description="exponent n of cos^n, such as 4; left out for long-crested waves"
    )
    seed: Annotated[int, Field(strict=True)] = Field(default=1, ge=0, description="seed of the waves")
    amplitudes: Text = Field(default="fixed", description="how amplitudes are drawn")


class PlaceTables(Spec):
    """Where a lift happens, and what lifts: tables of lift files and plan files."""

    name: Text | None = Field(default=None, description="name; default that of the file")
    crane: Text = Field(description="library name or crane file")
    vessel: Text | None = Field(default=None, description="library name or vessel file")
    payload: Any = Field(description="library name, payload file or a table [payload]")
    tip: TipTable = Field(default_factory=TipTable)
    boom: BoomTable | None = None
    water: WaterTable = Field(description="table [water] with depth")
    rigging: Part[Rigging] = Field(default_factory=Rigging)
    wire: Part[DeepWire] = Field(default_factory=DeepWire)
    winch: Part[WinchSettings] = Field(default_factory=WinchSettings)
    sensors: Part[Sensors] = Field(default_factory=Sensors)


class LiftTables(PlaceTables):
    """A lift file."""

    controller: Mode = DEFAULT_MODE
    start: u.Length = Field(description="height of the payload's underside above still water at the start")
    duration: u.Time | None = Field(default=None, gt=0, description="length of the run")
    ramp: u.Time = Field(default=10.0, ge=0, description="time in which the motion grows to full size")
    friction: FrictionModel = FrictionModel.LUGRE
    step: Text | None = Field(default=None, description="time step of the run, as text")
    every: Text | None = Field(default=None, description="time between stored values, as text")
    sea: SeaTable | None = None
    stage: tuple[Part[Stage], ...] = Field(
        min_length=1, description="one [[stage]] table for each, with mode, lower and what ends it"
    )


def payload_of(file: PlaceTables, table: TomlTable) -> Payload:
    """A payload of the library, a file seen from this one, or a table with name, mass and shape."""
    if isinstance(file.payload, Mapping):
        return Payload(**file.payload)
    if not isinstance(file.payload, str) or not file.payload.strip():
        raise table.wrong("give a name of the library, the path of a file, or a table [payload].", "payload")
    return read_payload(table.relative_toml(file.payload))
