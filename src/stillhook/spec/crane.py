"""What the machine is: a frozen description of one crane winch, in SI, with the source of every number.

A ``Crane`` is read from a file by ``stillhook.library.load_crane``. Its fields take text with a unit and hold SI
floats. Signs: hoisting is positive; A is the hoisting side of the active circuit. Displacement is m^3/rad everywhere.
Letters follow the thesis (Moslatt 2020); what a number means is in its field's description, which the readable
crane sheet prints.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Mapping
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import Field, create_model, model_validator

from stillhook import units as u
from stillhook.errors import SpecError, UnitError
from stillhook.physics.scalar import G
from stillhook.spec.control import Control, DisplacementLimit
from stillhook.spec.settings import SensorTables, optional_tables
from stillhook.spec.validity import Certified
from stillhook.tables.table import Count, Fraction, Name, Number, Spec, Text
from stillhook.tables.table import Source as Source
from stillhook.tables.table import SourceKind as SourceKind
from stillhook.winches.circuits.tables import ActiveCircuit, PassiveCircuit
from stillhook.winches.registry import WINCH_TYPES, WinchType
from stillhook.winches.registry import Plant as Plant

INERTIA_TOLERANCE = 0.005  # of J_m_eff: the published value has two digits, the split is ours
DIAMETER_TOLERANCE = 0.005  # of d_max: printed 5.1 m against 5.104 m from drum, layers and wire
BRAKE_RESERVE = 1.5  # of the torque of SWL and hook: what a holding brake carries unless the file says so; assumed
RATIO_TOLERANCE = 0.001  # of i_hD: printed 501.6 against 35.4 * 14.17 = 501.618


class Packing(StrEnum):
    """How the layers of wire lie on each other."""

    SQUARE = "square"


class Drum(Spec):
    """Winch drum."""

    d: u.Length = Field(gt=0, description="diameter of the bare drum")
    width: u.Length = Field(gt=0, description="width between the flanges")
    layers: Count = Field(description="layers of wire on the full drum")
    turns: Count = Field(description="turns per layer")
    d_max: u.Length = Field(gt=0, description="outer diameter of the full drum; effective one in published numbers")
    packing: Packing = Field(description="how the layers lie on each other")


class Wire(Spec):
    """Winch wire."""

    d: u.Diameter = Field(gt=0, description="diameter")
    E: u.Modulus = Field(gt=0, description="elastic modulus of the steel")
    fill: Fraction = Field(description="part of the cross section that is steel")
    mass_per_length: u.MassPerLength = Field(gt=0, description="mass per length")
    zeta: Number = Field(
        ge=0, lt=10, description="damping ratio of the load's first swing on the wire, for every command"
    )
    zeta_low: Number | None = Field(
        default=None, ge=0, description="low end of what that ratio may be; default a third of it"
    )
    zeta_high: Number | None = Field(
        default=None, ge=0, description="high end of what that ratio may be; default three times it"
    )
    L_0: u.Length = Field(gt=0, description="length between drum and crane tip")


class PowerUnits(Spec):
    """What the hydraulic power units give to active and passive pumps together, as hydraulic power at the pumps'
    constant speed."""

    P_max: u.Power = Field(gt=0, description="largest power of all units together; the pumps' torque control holds it")
    T_max: u.Torque | None = Field(
        default=None, gt=0, description="largest torque of all pump shafts together; default P_max over speed"
    )
    P_back: u.Power = Field(ge=0, description="power that the units take back while the load drives them")


class HoldingBrake(Spec):
    """Brake that holds the winch while no speed is commanded. Without this table the circuits alone hold it."""

    T: u.Torque | None = Field(
        default=None, gt=0, description="torque that it holds, at the motor shaft; default 1.5 times SWL and hook"
    )
    t_wait: u.Time = Field(ge=0, description="time at zero commanded speed before it closes")
    t_close: u.Time = Field(ge=0, description="time to close")
    t_open: u.Time = Field(ge=0, description="time to open")
    t_prove: u.Time = Field(ge=0, description="longest wait for the motors' torque before it opens")


class Inertia(Spec):
    """Inertia of the winch. Motors, J_gear and (J_drum + full wire)/i_hD^2 add up to J_m_eff."""

    J_m_eff: u.Inertia = Field(gt=0, description="effective inertia at the motor shaft, full drum")
    J_gear: u.Inertia = Field(ge=0, description="gears, brakes and couplings, at the motor shaft")
    J_drum: u.Inertia = Field(gt=0, description="bare drum about its own axis")


class SystemFriction(Spec):
    """Friction of gears, bearings, sheaves and wire, per motor shaft (Moslatt 2020 eq. 2.7)."""

    Y_1: Number = Field(ge=0, description="breakaway part of the drum torque")
    Y_2: u.Torque = Field(ge=0, description="constant friction")
    Y_3: u.Torque = Field(ge=0, description="breakaway friction")
    Y_4: u.Rotation = Field(gt=0, description="motor speed over which breakaway fades")
    Y_5: u.ViscousTorque = Field(ge=0, description="friction per motor speed")
    Y_6: Number = Field(ge=0, description="friction part of the drum torque")


class Friction(Spec):
    """System friction and the stick-slip model's own numbers."""

    library: Text = Field(description="system friction set in the library")
    system: SystemFriction
    T_d_min: u.Torque | None = Field(
        default=None, ge=0, description="least drum torque at which the set was identified"
    )
    T_d_max: u.Torque | None = Field(
        default=None, ge=0, description="largest drum torque at which the set was identified"
    )
    sigma_0: u.StiffnessTorsion = Field(gt=0, description="bristle stiffness at the motor shaft")
    sigma_1_ratio: Number = Field(ge=0, description="bristle damping over sqrt(sigma_0 J)")
    omega_fade: u.Rotation = Field(gt=0, description="motor speed over which bristle damping fades")
    omega_reg: u.Rotation = Field(gt=0, description="regularised option: motor speed of the tanh")


class Built(StrEnum):
    """Whether a winch exists."""

    BUILT = "built"
    PAPER = "paper"


class Installation(Spec):
    """What an owner asks of the machine on deck; no result follows from it."""

    built: Built | None = Field(default=None, description="built, or paper: a winch that exists as a calculation alone")
    footprint: u.Area | None = Field(default=None, gt=0, description="deck area of winch and drive")
    mass: u.Mass | None = Field(default=None, gt=0, description="mass of winch and drive, without wire")


class Crane(Spec):
    """One crane winch: what a crane file says, checked, in SI. Frozen.

    >>> import stillhook
    >>> crane = stillhook.load_crane("nov-250t")
    >>> crane.name, str(crane.plant), crane.drum.layers
    ('nov-250t', 'active-passive', 12)
    """

    name: Name = Field(description="name")
    title: Name = Field(description="what it is")
    plant: Plant = Field(description="winch type")
    SWL: u.Mass = Field(gt=0, description="safe working load")
    hook_mass: u.Mass = Field(ge=0, description="hook block")
    active: ActiveCircuit = Field(default=None, description="closed circuit that moves the drum")  # type: ignore[assignment]
    passive: PassiveCircuit | None = None
    drum: Drum
    gear_ratios: tuple[Annotated[u.GearRatio, Field(gt=0, le=1e6)], ...] = Field(
        min_length=1, max_length=10, description="gear stages from motor to drum"
    )
    i_hD: u.GearRatio = Field(ge=1e-3, le=1e6, description="motor turns per drum turn")
    n_gear: u.Rotation | None = Field(
        default=None, gt=0, description="highest motor speed that the gears allow; default no limit"
    )
    wire: Wire
    inertia: Inertia
    friction: Friction
    control: Control
    hpu: PowerUnits | None = None
    brake: HoldingBrake | None = None
    sensors: SensorTables | None = None
    installation: Installation | None = Field(default=None, exclude=True)
    sources: Mapping[str, Source] = Field(default_factory=dict, repr=False, description="field to source")
    certified: Certified | None = Field(
        default=None, repr=False, description="certificate of the twin, in short; none: not validated"
    )

    @property
    def circuits(self) -> dict[str, ActiveCircuit | PassiveCircuit]:
        """Its closed circuits by name, the active one first."""
        tables = {name: self.table(name) for name in ("active", "passive")}
        return {name: table for name, table in tables.items() if table is not None}

    def table(self, name: str) -> Any:
        """A table of the file by its name; None where the file has none."""
        return self.__dict__.get(name)

    def __getattr__(self, name: str) -> Any:
        """Errors: SpecError for a circuit that this winch type does not have."""
        if name == "active" and "plant" in self.__dict__:
            raise SpecError(
                f'"{self.name}": winch type "{self.plant}" has no closed circuit, on which this question rests. Choose'
                " another crane, or another question."
            )
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

    @property
    def paper(self) -> bool:
        """Whether its file says that no such winch is built."""
        return self.installation is not None and self.installation.built is Built.PAPER

    @property
    def motors(self) -> tuple[Any, ...]:
        """Its sets of motors on the shaft, each with `count` and inertia `J` of one."""
        sets: tuple[Any, ...] = self.plant.type.motors(self)
        return sets

    @model_validator(mode="before")
    @classmethod
    def _ratio_from_its_stages(cls, data: Any) -> Any:
        """i_hD is the product of the gear stages unless a (rounded) value is given."""
        if isinstance(data, Mapping) and "i_hD" not in data:
            stages = data.get("gear_ratios")
            if isinstance(stages, (list, tuple)):
                try:
                    return {**data, "i_hD": math.prod(u.parse_ratio(i) for i in stages)}
                except UnitError:
                    return data  # the stage itself is refused, with its place
        return data

    @model_validator(mode="before")
    @classmethod
    def _tables_of_its_type(cls, data: Any) -> Any:
        """A table of another winch type is refused as such, before what it lacks is asked for."""
        plant = WINCH_TYPES.get(str(data.get("plant"))) if isinstance(data, Mapping) else None
        if plant is not None and all(data.get(name) is not None for name in plant.tables):
            for table in dict.fromkeys(name for each in WINCH_TYPES.values() for name in each.tables):
                if table not in plant.tables and data.get(table) is not None:
                    raise ValueError(_misplaced(str(data["plant"]), table))
        return data

    @model_validator(mode="after")
    def _parts_fit_together(self) -> Self:
        if self.table("active") is None:
            self.__dict__.pop("active")
        for problem in _misfits(self):
            raise ValueError(problem)
        return self


def rounded(data: Any, digits: int) -> Any:
    """Plain data with so many digits of every float."""
    if isinstance(data, dict):
        return {name: rounded(value, digits) for name, value in data.items()}
    if isinstance(data, list):
        return [rounded(value, digits) for value in data]
    return float(f"{data:.{digits}g}") if isinstance(data, float) else data


def content(crane: Crane, *, digits: int = 17) -> dict[str, str]:
    """Hash of every part of a crane that results follow from, by its field; names, titles, sources and the certificate
    are none. digits: how many of a number count; 17 are all."""
    loss: Any = {"loss_model": {"map"}, "alternatives": True}
    named: Any = {"motor": {"type": True, **loss}}
    bare: Any = dict.fromkeys(("name", "title", "sources", "certified"), True)
    bare |= {"active": named, "passive": named, "friction": {"library"}}
    bare |= {"secondary": {"unit": loss}, "open": {"motor": loss}}
    data = rounded(crane.model_dump(mode="json", exclude=bare, exclude_none=True), digits)
    return {
        name: hashlib.sha256(json.dumps(part, sort_keys=True).encode()).hexdigest()[:16] for name, part in data.items()
    }


def identity(crane: Crane) -> tuple[str, str]:
    """Name of a crane, and one hash of all that results follow from (`content`): what a manifest says of it."""
    text = "\n".join(f"{name} {part}" for name, part in sorted(content(crane).items()))
    return crane.name, hashlib.sha256(text.encode()).hexdigest()


def wire_capacity(drum: Drum, wire: Wire) -> float:
    """Wire on the full drum, measured along its centre [m]."""
    return math.pi * drum.turns * drum.layers * (drum.d + drum.layers * wire.d)


def wire_inertia(drum: Drum, wire: Wire) -> float:
    """Inertia of the wire of a full drum about the drum axis, as a hollow cylinder [kg m^2]."""
    r_1, r_2 = drum.d / 2, drum.d / 2 + drum.layers * wire.d
    return wire.mass_per_length * wire_capacity(drum, wire) * (r_1**2 + r_2**2) / 2


def effective_inertia(crane: Crane) -> float:
    """Inertia at the motor shaft with a full drum, added up from its parts [kg m^2]."""
    drum = crane.inertia.J_drum + wire_inertia(crane.drum, crane.wire)
    return float(sum(m.count * m.J for m in crane.motors)) + crane.inertia.J_gear + drum / crane.i_hD**2


def holding_torque(crane: Crane) -> float:
    """Torque of SWL and hook at the motor shaft, with a full drum [N m]."""
    return (crane.SWL + crane.hook_mass) * G * crane.drum.d_max / 2.0 / crane.i_hD


def brake_torque(crane: Crane) -> float:
    """Torque that the holding brake carries at the motor shaft [N m]; 0 without a brake."""
    if crane.brake is None:
        return 0.0
    return BRAKE_RESERVE * holding_torque(crane) if crane.brake.T is None else crane.brake.T


def inertia_ratio_without_wire(crane: Crane) -> float:
    """Total inertia over that without the wire [-]. A factor on the total, less 1, times this is the change of the
    inertia without the wire, because the wire's inertia is known from its mass."""
    J, J_wire = effective_inertia(crane), wire_inertia(crane.drum, crane.wire) / crane.i_hD**2
    return J / (J - J_wire)


def _misplaced(plant: str, table: str, needed: bool = False) -> str:
    need, do = ("needs", "add") if needed else ("has no", "remove")
    return f'plant "{plant}" {need} table [{table}]. Change plant, or {do} [{table}].'


def _limit_misfits(crane: Crane) -> Iterator[str]:
    """Why SSC's smallest displacement cannot follow from torque and speeds."""
    control, active = crane.control, crane.table("active")
    if control.p_most is not None and active and not active.boost.p < control.p_most <= active.relief.p:
        low, most, high = (u.show(p, "pressure") for p in (active.boost.p, control.p_most, active.relief.p))
        yield f"control.p_most {most} is not above active.boost.p {low} and up to active.relief.p {high}. Change it."
    if control.displacement_limit is not DisplacementLimit.TORQUE:
        return
    if active is None:
        yield f'control.displacement_limit "torque": plant "{crane.plant}" has no displacement to limit. Remove it.'
        return
    n, limit = active.pump.Q_max / active.motor.D_total, min(active.motor.speed_limit(1.0), crane.n_gear or math.inf)
    if n > limit:
        yield (
            f'control.displacement_limit "torque": full pumps turn the motors at {u.show(n, "rotation")} at full'
            f" displacement, above {u.show(limit, 'rotation')}. Correct n_max_full, n_table or n_gear, or the pumps."
        )


def has_pumps(winch: WinchType) -> bool:
    """Whether power units drive pumps of a winch of this type, which `pump_units` then lists."""
    return hasattr(winch.module, "pump_units")


def _misfits(crane: Crane) -> Iterator[str]:
    """Why the parts of a crane do not fit together, worst first."""
    for table in dict.fromkeys(name for each in WINCH_TYPES.values() for name in each.tables):
        present, needed = crane.table(table) is not None, table in crane.plant.type.tables
        if present != needed:
            yield _misplaced(crane.plant, table, needed)
            return
    if crane.hpu is not None and not has_pumps(crane.plant.type):
        yield f'plant "{crane.plant}" has no pumps that table [hpu] could limit. Remove [hpu].'
    drum, wire, control = crane.drum, crane.wire, crane.control
    alpha_min = crane.plant.type.least_displacement(crane)
    if wire.zeta_low is not None and wire.zeta_high is not None and wire.zeta_low > wire.zeta_high:
        yield (
            f"wire.zeta_low {wire.zeta_low:g} is above wire.zeta_high {wire.zeta_high:g}. Change the one that is out of"
            " place."
        )
    T_hold = holding_torque(crane)
    if crane.brake is not None and crane.brake.T is not None and T_hold > crane.brake.T:
        yield (
            f"brake.T {u.show(crane.brake.T, 'torque')} does not hold SWL and hook on the full drum:"
            f" {u.show(T_hold, 'torque')} at the motor shaft. Raise brake.T."
        )
    if crane.circuits and not alpha_min <= control.alpha_hs <= control.alpha_ns:
        yield (
            f"active.motor.alpha_min {alpha_min}, control.alpha_hs {control.alpha_hs} and control.alpha_ns "
            f"{control.alpha_ns} must not fall in this order. Change the one that is out of place."
        )
    yield from _limit_misfits(crane)
    yield from filter(None, [crane.plant.type.dead_time_refusal(crane)])
    if drum.turns * wire.d > drum.width:
        yield (
            f"drum.turns {drum.turns} x wire.d {u.show(wire.d, 'diameter')} = {drum.turns * wire.d:.4g} m is more than "
            f"drum.width {u.show(drum.width, 'length')}. Lower drum.turns or widen the drum."
        )
    d_max = drum.d + 2 * drum.layers * wire.d
    if abs(d_max - drum.d_max) > DIAMETER_TOLERANCE * drum.d_max:
        yield (
            f"drum.d_max {u.show(drum.d_max, 'length')} is not drum.d + 2 x {drum.layers} layers x wire.d = "
            f'{d_max:.4g} m. Set drum.d_max = "{d_max:.4g} m" or change the layers.'
        )
    i_hD = math.prod(crane.gear_ratios)
    if abs(i_hD - crane.i_hD) > RATIO_TOLERANCE * crane.i_hD:
        yield f"i_hD {crane.i_hD:.6g} is not the product {i_hD:.6g} of gear_ratios. Set i_hD = {i_hD:.6g}."
    J, J_m_eff = effective_inertia(crane), crane.inertia.J_m_eff
    if abs(J - J_m_eff) > INERTIA_TOLERANCE * J_m_eff:
        yield (
            f"inertia.J_m_eff {u.show(J_m_eff, 'inertia')} is not the sum {J:.4g} kg m^2 of motors, J_gear, drum and "
            f'full wire. Set inertia.J_m_eff = "{J:.4g} kg m^2", or change inertia.J_drum or inertia.J_gear.'
        )


def passive_of(crane: Crane) -> PassiveCircuit:
    """Passive circuit of a crane that has one, see `Crane.circuits`."""
    circuit = crane.circuits["passive"]
    assert isinstance(circuit, PassiveCircuit)
    return circuit


def _tables() -> dict[str, type[Spec]]:
    """Errors: SpecError for a table without a model, or a model whose name is taken."""
    models: dict[str, type[Spec]] = {}
    for winch in WINCH_TYPES.values():
        for name, model in winch.tables.items():
            where = f'{winch.file.name}: TABLES: "{name}"'
            if model is None and name not in ("active", "passive", *models):
                raise SpecError(
                    f"{where} is not a table of a winch. Choose {', '.join(('active', 'passive', *models))}."
                )
            if model is not None and (name in Crane.model_fields or models.setdefault(name, model) is not model):
                raise SpecError(f"{where} is a table of crane files already. Choose another name.")
    return models


TABLES = _tables()
"""Tables of winch types with additional tables, by name."""

if not TYPE_CHECKING and TABLES:
    Crane = create_model("Crane", __base__=Crane, __doc__=Crane.__doc__, **optional_tables(TABLES))
