"""Tables of a lift file, and what they name."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, TypeVar

from pydantic import Field, ValidationInfo, field_validator

from stillhook import units as u
from stillhook.control.registry import DEFAULT_MODE
from stillhook.engine.simulate import End
from stillhook.errors import LiftError, MotionError, ScenarioError
from stillhook.formats.case_file import read_tip
from stillhook.formats.lift.flow import with_profiles
from stillhook.formats.lift.forms import today
from stillhook.library import load_crane
from stillhook.library.catalogue import read_compensator, read_payload
from stillhook.library.toml.file import TomlTable
from stillhook.sea.vessel.boom import DESCRIPTIONS, Boom
from stillhook.sea.vessel.motion_unit import HEAVE_DAMPING, MotionUnit
from stillhook.sea.vessel.realisation import Resolution
from stillhook.spec.crane import Crane
from stillhook.spec.lift.deck import Deck
from stillhook.spec.lift.lowering import DeepWire, WinchSettings
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.phase import Phase
from stillhook.spec.lift.rigging import RiggingTable
from stillhook.spec.scenario import RHO_SEA, FrictionModel, Mode, Sensors
from stillhook.tables.table import Flag, Number, Part, Spec, Text, with_place
from stillhook.trust.trust_list import plans_trust
from stillhook.winches.load_path.interface import JointUnit
from stillhook.winches.load_path.registry import unit_of

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
    repeat: u.Time | None = Field(
        default=None, gt=0, description="time after which the waves repeat; default the length of the run"
    )
    water: Flag = Field(default=True, description="whether the waves reach the payload")
    left: Number = Field(default=1.0, gt=0, le=1, description="part of the tip's motion that reaches the wire")
    resolution: Resolution = Field(
        default=Resolution.FINE, description="how closely the tip's motion follows its waves"
    )


class OtherVesselTable(Spec):
    """The table [other_vessel]: the vessel that the payload is lifted from or set down on."""

    vessel: Text = Field(description="library name or vessel file")
    at: Text = Field(description="place on its deck from its own reference point, as text")
    heading: Any = Field(default="0 deg", description="direction of its bow, counter-clockwise from the crane vessel's")
    position: Text | None = Field(
        default=None,
        description="its reference point from the crane vessel's, as text; default: the place on deck below the tip",
    )


Tables = TypeVar("Tables", bound="LiftTables")


class MotionUnitTable(Spec):
    """The table [motion_unit]: its heave filter. Its delay and noise are those of [sensors]."""

    heave_period: Text = Field(description="corner of its second-order high-pass on heave")
    heave_damping: float = Field(default=HEAVE_DAMPING, description="damping of that filter")
    at: tuple[Text, Text, Text] = Field(
        default=("0 m", "0 m", "0 m"), description="from the vessel's reference point, forward, to port, up"
    )


def motion_unit_of(file: LiftTables) -> MotionUnit | None:
    """The motion unit of a lift file. Errors: MotionError, UnitError."""
    of = file.motion_unit
    return None if of is None else MotionUnit(at=of.at, heave_period=of.heave_period, heave_damping=of.heave_damping)


class LiftTables(Spec):
    """A lift file. What a plan alone reads is kept as it is written."""

    MEANT: ClassVar[Mapping[str, str]] = MappingProxyType(
        {
            **dict.fromkeys(
                ("sling", "slings"),
                "Slings are one spring in [rigging]: write height (hook to payload top) and stiffness, that of all legs"
                " together (legs * E A / length * cos^2 of their angle from vertical); a plan assesses its legs, angle"
                " and items.",
            ),
            **dict.fromkeys(
                ("load-chart", "loadchart", "chart"),
                'Write [load_chart] with file and pedestal, such as pedestal = "x=-10 m, y=-6 m".',
            ),
            **dict.fromkeys(("limits", "criteria"), "Limits of a phase belong to it: [[phase]] limits = { ... }."),
        }
    )
    """Words that are not a field, and what to write in their place."""

    name: Text | None = Field(default=None, description="name; default that of the file")
    crane: Text = Field(description="library name or crane file")
    trust: Text | None = Field(default=None, description="list of trusted keys in place of the user's")
    vessel: Text | None = Field(default=None, description="library name or vessel file")
    payload: Any = Field(description="library name, payload file or a table [payload]")
    tip: TipTable = Field(default_factory=TipTable)
    boom: BoomTable | None = None
    water: WaterTable = Field(description="table [water] with depth")
    other_vessel: OtherVesselTable | None = None
    deck: Any = Field(default=None, description="table [deck] of a lift in air from it or onto it")
    rigging: Part[RiggingTable] = Field(default_factory=RiggingTable)
    weight: Any = None
    compensator: Any = Field(default=None, description="library name, compensator file or a table [compensator]")
    wire: Part[DeepWire] = Field(default_factory=DeepWire)
    winch: Part[WinchSettings] = Field(default_factory=WinchSettings)
    sensors: Part[Sensors] = Field(default_factory=Sensors)
    motion_unit: MotionUnitTable | None = None
    controller: Mode = DEFAULT_MODE
    start_depth: u.Length | None = Field(
        default=None, description="depth of the payload's underside as the lift begins; negative above the water"
    )
    duration: u.Time | None = Field(default=None, gt=0, description="length of the run")
    ramp: u.Time = Field(default=10.0, ge=0, description="time in which the motion grows to full size")
    friction: FrictionModel = FrictionModel.LUGRE
    step: Text | None = Field(default=None, description="time step of the run, as text")
    every: Text | None = Field(default=None, description="time between stored values, as text")
    sampling: Text | None = Field(default=None, description="time between values that statistics take, as text")
    end: End = Field(default=End.DURATION, description="whether the run ends with its programme")
    sea: SeaTable | None = None
    rules: Any = None
    alternatives: Any = None
    environment: Any = None
    operation: Any = None
    weather: Any = None
    document: Any = None
    load_chart: Any = None
    capacity: Any = None
    synthetic_certificate: Any = None
    phase: tuple[Part[Phase], ...] = Field(
        min_length=1, description="one [[phase]] table for each, with kind or mode, and what ends it"
    )


def read_lift(table: TomlTable, model: type[Tables]) -> tuple[TomlTable, Tables]:
    """A lift file in the words of today, and as a model. Errors: StillhookError, one line."""
    table = with_profiles(today(table))
    file = table.read(model)
    for i, phase in enumerate(file.phase):
        if phase.start_depth is not None:
            message = "each phase starts where the one before it ends, and the lift at the start_depth of the file."
            raise table.wrong(f"{message} Leave it out.", "phase", i, "start_depth")
    return table, file


def crane_of(file: LiftTables, table: TomlTable) -> Crane:
    """A crane of the library, or a file seen from this one; the signature of its certificate is judged by the list of
    trusted keys that this file names, if it names one."""
    crane = load_crane(table.relative_toml(file.crane))
    trust = None if file.trust is None else plans_trust(table.relative_file(file.trust, "trust"))
    if trust is None or crane.certified is None:
        return crane
    return crane.model_copy(update={"certified": crane.certified.judged(trust, crane.certified.file)})


def payload_of(file: LiftTables, table: TomlTable) -> Payload:
    """A payload of the library, a file seen from this one, or a table with name, mass and shape."""
    if isinstance(file.payload, Mapping):
        return Payload(**file.payload)
    if not isinstance(file.payload, str) or not file.payload.strip():
        raise table.wrong("give a name of the library, the path of a file, or a table [payload].", "payload")
    return read_payload(table.relative_toml(file.payload))


def deck_of(file: LiftTables, table: TomlTable) -> Deck | None:
    """The deck of a table [deck], its motion in words or from a log as that of the tip; without motion that of the
    other vessel, which is still as yet, or none."""
    if file.deck is None:
        return None
    if not isinstance(file.deck, Mapping):
        raise table.wrong('give a table [deck] with height, such as height = "6 m".', "deck")
    own = dict(file.deck)
    try:
        if not isinstance(own.get("motion", ""), str):
            own["motion"] = read_tip(own["motion"], table.path.parent)
        return Deck(**own)
    except (ScenarioError, MotionError) as problem:
        raise LiftError(with_place(str(problem), "deck")) from None


def compensator_of(file: LiftTables, table: TomlTable) -> JointUnit | None:
    """A passive heave compensator of the library, a file seen from this one, or a table [compensator], whose `unit`
    names one of these for what the table leaves out."""
    given = file.compensator
    if given is None:
        return None
    if isinstance(given, str) and given.strip():
        given = {"unit": given}
    if not isinstance(given, Mapping):
        raise table.wrong("give a name of the library, the path of a file, or a table [compensator].", "compensator")
    own = {key: value for key, value in given.items() if key != "unit"}
    name = given.get("unit")
    if name is not None and (not isinstance(name, str) or not name.strip()):
        raise table.wrong("give a name of the library, or the path of a file.", "compensator", "unit")
    try:
        return unit_of(own) if name is None else read_compensator(table.relative_toml(name), own)
    except ScenarioError as problem:  # of this table; a file that is wrong names itself
        raise LiftError(with_place(str(problem), "compensator")) from None
