"""The hydraulic circuits of a crane winch: motors, pumps, lines, valves, accumulator and gas; and the records that
kernels read of them."""

from __future__ import annotations

import math
from enum import StrEnum
from itertools import pairwise
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from stillhook import units as u
from stillhook.physics.hydraulics import lines, swash
from stillhook.physics.hydraulics.motor import Motors
from stillhook.tables.table import Count, Number, Spec, Text
from stillhook.winches.circuits.losses import MJ4, LossAlternatives, LossModel, TorqueLoss, loss_fit


class ServoVariant(StrEnum):
    """How a motor's displacement is controlled (SPEC section 4)."""

    CLOSED_LOOP = "closed-loop"
    OPEN_LOOP_FEEDBACK = "open-loop-feedback"
    OPEN_LOOP = "open-loop"


class GasModel(StrEnum):
    """Gas law of the accumulator."""

    POLYTROPIC = "polytropic"
    NITROGEN = "nitrogen"


class LeakForm(StrEnum):
    """What the leak of a circuit goes with. All are published and laminar: flow over pressure does not change with
    pressure."""

    CONSTANT = "constant"
    STROKE = "stroke"
    SPEED = "speed"
    STROKE_SPEED = "stroke+speed"


class Servo(Spec):
    """Second-order response of a displacement to its command."""

    omega_n: u.Frequency = Field(gt=0, description="natural frequency")
    zeta: Number = Field(gt=0, description="damping ratio")
    rate_max: u.GainPerTime | None = Field(
        default=None, gt=0, description="highest rate, full stroke over time; default no limit"
    )
    rate_down: u.GainPerTime | None = Field(
        default=None, gt=0, description="highest rate as the displacement falls; default rate_max"
    )

    dead_time: u.Time | None = Field(
        default=None, ge=0, le=1, description="time before it answers its command, at most 20 PLC cycles; default 0"
    )

    @property
    def lag(self) -> float:
        """Time by which it lags a ramp of its command, dead time apart [s]."""
        return 2.0 * self.zeta / self.omega_n


class SpeedTable(Spec):
    """Highest speed of a motor by its displacement, as a data sheet has it; linear between the points."""

    alpha: tuple[Annotated[Number, Field(ge=0, le=1)], ...] = Field(
        min_length=2, max_length=50, description="displacements over the full one, rising to 1"
    )
    n: tuple[Annotated[u.Rotation, Field(gt=0)], ...] = Field(description="highest speed at each, not rising")

    @model_validator(mode="after")
    def _is_a_curve(self) -> Self:
        if len(self.n) != len(self.alpha):
            raise ValueError(f"n has {len(self.n)} speeds for {len(self.alpha)} displacements. Give one for each.")
        if any(b <= a for a, b in pairwise(self.alpha)) or self.alpha[-1] != 1.0:
            raise ValueError("alpha must rise from entry to entry and end at 1.")
        if any(b > a for a, b in pairwise(self.n)):
            raise ValueError("n must not rise with the displacement: a motor turns fastest at a small one.")
        return self

    def below(self) -> tuple[float, float]:
        """n_full and n_max of the largest hyperbola n_full / alpha up to n_max that is nowhere above the table
        [rad/s]. Between two points n alpha is least at an end, so that the points alone decide."""
        alpha, n = np.array(self.alpha), np.array(self.n)
        ends = [(float(np.min((n * alpha)[k:])), float(n[k])) for k in range(len(n)) if alpha[k] > 0.0]
        over = np.linspace(0.5, 1.0, 51)  # where winches work
        return max(ends, key=lambda end: float(np.sum(np.minimum(end[1], end[0] / over))))


class Motor(Spec):
    """One hydraulic motor of the library. Its total leak is ``C_1 + C_2 |n_m|`` (eq. 2.18)."""

    D_max: u.Displacement = Field(gt=0, description="full displacement of one motor")
    n_max_full: u.Rotation = Field(gt=0, description="highest shaft speed at full displacement")
    n_max: u.Rotation = Field(gt=0, description="highest shaft speed at reduced displacement")
    J: u.Inertia = Field(gt=0, description="rotor inertia of one motor")
    loss: TorqueLoss
    loss_model: LossModel | None = Field(default=None, description="model of the torque loss in place of MJ4")
    alternatives: LossAlternatives | None = Field(default=None, description="models that fit as well")
    C_1: u.Leakage = Field(ge=0, description="total leak of one motor at standstill")
    C_2: u.LeakagePerSpeed = Field(ge=0, description="rise of that leak with shaft speed")
    D_loss_min: u.Displacement | None = Field(
        default=None, ge=0, description="least displacement at which the loss was fitted"
    )
    n_loss_max: u.Rotation | None = Field(
        default=None, gt=0, description="highest shaft speed at which the loss was fitted"
    )
    dp_loss_max: u.Pressure | None = Field(
        default=None, gt=0, description="largest pressure difference at which the loss was fitted"
    )

    @property
    def law(self) -> str:
        """Name of the model of its loss."""
        return MJ4 if self.loss_model is None else str(self.loss_model.law)

    @model_validator(mode="after")
    def _speeds_in_order(self) -> Self:
        if self.n_max < self.n_max_full:
            raise ValueError(
                f"n_max {u.show(self.n_max, 'rotation')} is below n_max_full {u.show(self.n_max_full, 'rotation')}: "
                "a motor turns fastest at reduced displacement. Raise n_max."
            )
        return self

    def speed_limit(self, alpha: float) -> float:
        """Highest shaft speed at displacement alpha over its maximum [rad/s]."""
        return self.n_max if self.n_max_full > self.n_max * alpha else self.n_max_full / alpha


class MotorSet(Motor):
    """All motors of one circuit, of one type, moved by one command."""

    type: Text = Field(description="motor type in the library")
    count: Count = Field(description="number of motors")
    n_table: SpeedTable | None = Field(
        default=None,
        description="highest speed by displacement; default n_max_full over the displacement, up to n_max",
    )
    alpha_min: Number = Field(ge=0, le=1, description="smallest relative displacement")
    servo: Servo
    variant: ServoVariant = Field(description="displacement control")
    offset: Number = Field(ge=0, lt=1, description="open loop: displacement above its command, part of D_max")
    hysteresis: Number = Field(ge=0, lt=1, description="open loop: full width of the hysteresis, part of D_max")

    @property
    def D_total(self) -> float:
        """Full displacement of all motors together [m^3/rad]."""
        return self.count * self.D_max

    def speed_limit(self, alpha: float) -> float:
        """Highest shaft speed at displacement alpha over its maximum [rad/s]."""
        if self.n_table is None:
            return super().speed_limit(alpha)
        return float(np.interp(alpha, self.n_table.alpha, self.n_table.n))

    def speed_ends(self, n_gear: float | None) -> tuple[float, float]:
        """Speed limits at full and at reduced displacement [rad/s] by which runs count overspeed, the gears' limit
        among them. Of a table the largest n_full / alpha up to n_max that is nowhere above it: counted early, never
        late."""
        ends = (self.n_max_full, self.n_max) if self.n_table is None else self.n_table.below()
        return ends if n_gear is None else (min(ends[0], n_gear), min(ends[1], n_gear))


class Pumps(Spec):
    """Pumps of one speed; each belongs to one hydraulic power unit."""

    D: tuple[Annotated[u.Displacement, Field(gt=0)], ...] = Field(
        min_length=1, max_length=100, description="full displacement of each pump"
    )
    omega_p: u.Rotation = Field(gt=0, description="shaft speed")

    @property
    def D_total(self) -> float:
        """Full displacement of all pumps together [m^3/rad]."""
        return sum(self.D)

    @property
    def Q_max(self) -> float:
        """Flow of all pumps at full stroke [m^3/s]."""
        return self.D_total * self.omega_p


Leaks = Annotated[tuple[Annotated[u.Leakage, Field(ge=0)], ...], Field(min_length=1, max_length=20)]


class PumpLeakTable(Spec):
    """Total leak conductance of one measured pump, a number for each shaft speed, in the place of a library's table."""

    D_ref: u.Displacement = Field(gt=0, description="full displacement of the measured pump")
    omega: tuple[Annotated[u.Rotation, Field(gt=0)], ...] = Field(
        min_length=1, max_length=20, description="shaft speeds, rising; one: the leak does not change with speed"
    )
    C_20: Leaks = Field(description="leak at a fifth of the displacement, and below")
    C_40: Leaks = Field(description="leak at two fifths of the displacement")
    C_60: Leaks = Field(description="leak at three fifths of the displacement")
    C_80: Leaks = Field(description="leak at four fifths of the displacement")
    C_100: Leaks = Field(description="leak at full displacement")

    @property
    def rows(self) -> tuple[tuple[float, ...], ...]:
        """The leak at each displacement, over the speeds."""
        return self.C_20, self.C_40, self.C_60, self.C_80, self.C_100

    @model_validator(mode="after")
    def _is_a_table(self) -> Self:
        if list(self.omega) != sorted(set(self.omega)):
            raise ValueError("omega must rise from entry to entry. Sort the speeds.")
        if any(len(row) != len(self.omega) for row in self.rows):
            raise ValueError(f"each of C_20 to C_100 needs {len(self.omega)} values, one for each speed of omega.")
        return self


class PumpSet(Pumps):
    """All pumps of one circuit."""

    leak: Text = Field(description="leak table in the library, scaled with D_total; with a table of its own its name")
    table: PumpLeakTable | None = Field(default=None, description="leak table of pumps that are not in the library")
    leak_scale: Number | None = Field(
        default=None, gt=0, description="leak of these pumps over that of the table, as of wear; default 1"
    )
    servo: Servo


class Line(Spec):
    """Oil between pumps and motors on one side."""

    V: u.Volume = Field(gt=0, description="oil volume per side")
    bulk_modulus: u.Pressure = Field(gt=0, description="effective bulk modulus")


class Lines(Spec):
    """Pressure that each line takes between the ports of pumps and motors: R_1 Q + R_2 Q |Q|."""

    R_1: u.FlowResistance = Field(default=0.0, ge=0, description="laminar restriction of each line")
    R_2: u.FlowResistanceSquared = Field(default=0.0, ge=0, description="turbulent restriction of each line")


class Boost(Spec):
    """Feed that holds up the low side."""

    p: u.Pressure = Field(gt=0, description="boost pressure")
    conductance: u.Leakage = Field(gt=0, description="boost flow per pressure below it")
    Q_max: u.Flow | None = Field(default=None, gt=0, description="flow that the boost pumps give; default no limit")


class Relief(Spec):
    """Relief valve of the high side."""

    p: u.Pressure = Field(gt=0, description="relief pressure")
    conductance: u.Leakage = Field(gt=0, description="relief flow per pressure above it")


class Flushing(Spec):
    """Hot-oil shuttle that drains the low side."""

    dp_open: u.Pressure = Field(ge=0, description="opens this far above boost")
    conductance: u.Leakage = Field(ge=0, description="flushing flow per pressure above that")
    dp_shuttle: u.Pressure = Field(ge=0, description="pressure between the sides that throws the shuttle fully")


class LeakPoint(Spec):
    """Where the number of a leak holds."""

    p: u.Pressure | None = Field(
        default=None, gt=0, description="pressure at which the leak was measured; conductances are laminar"
    )
    alpha_p: Number = Field(default=1.0, ge=0, le=1, description="setting of the pumps")
    n_m: u.Rotation = Field(default=1000.0 * math.pi / 30.0, ge=0, description="speed of the motors")


class Leak(Spec):
    """Form of a circuit's leak. What pumps (table times leak_scale) and motors (C_1 + C_2 |n_m|) leak `at` a point
    holds everywhere ("constant": Moslatt 2020 paper E eq. 11), or goes with the pumps' setting alone ("stroke": tables
    2.5 and 2.6), with the motors' speed alone ("speed": eq. 2.18), or with both ("stroke+speed": section 2.5.2.4)."""

    form: LeakForm = Field(description="what the leakage varies with")
    at: LeakPoint = Field(default_factory=LeakPoint)


InternalShare = Field(
    default=None, ge=0, le=1, description="part of the leak that goes from port to port; default two thirds"
)


class ActiveCircuit(Spec):
    """Closed circuit that moves the winch."""

    motor: MotorSet
    pump: PumpSet
    line: Line
    lines: Lines | None = Field(default=None, description="restrictions between pumps and motors; default none")
    boost: Boost
    relief: Relief
    flushing: Flushing
    C_leak: u.Leakage = Field(
        ge=0, description="total leak of pumps and motors at leak.at; constant in the linear analysis"
    )
    leak: Leak | None = Field(default=None, description='form of the leak; default "stroke+speed"')
    internal_share: Number | None = InternalShare

    @model_validator(mode="after")
    def _pressures_in_order(self) -> Self:
        if self.relief.p <= self.boost.p + self.flushing.dp_open:
            raise ValueError(
                f"relief.p {u.show(self.relief.p, 'pressure')} is not above boost.p + flushing.dp_open "
                f"{u.show(self.boost.p + self.flushing.dp_open, 'pressure')}. Raise relief.p."
            )
        if self.motor.alpha_min <= 0:
            raise ValueError("motor.alpha_min = 0 leaves the winch without torque; give a value above 0, up to 1.")
        return self


class Gas(Spec):
    """Gas charge of the accumulator, with the piston at mid stroke."""

    model: GasModel = Field(description="gas law")
    p_0: u.Pressure = Field(gt=0, description="pressure at mid stroke")
    V_0: u.Volume = Field(gt=0, description="gas volume at mid stroke")
    n: Number = Field(ge=1, le=2, description="polytropic exponent")
    T_0: u.Temperature = Field(gt=0, description="gas temperature at mid stroke")


class Accumulator(Spec):
    """Double-piston accumulator between the high and the low side of the passive circuit."""

    gas: Gas
    V_stroke: u.Volume = Field(gt=0, description="oil volume of the whole stroke, from mid stroke at the start")
    R_piston: u.FlowResistance = Field(ge=0, description="viscous friction of the piston as pressure per flow")
    C_leak: u.Leakage = Field(ge=0, description="leak from the high to the low side")

    @model_validator(mode="after")
    def _gas_outlasts_the_stroke(self) -> Self:
        if self.V_stroke / 2 >= self.gas.V_0:
            raise ValueError(
                f"gas.V_0 {u.show(self.gas.V_0, 'volume')} is not above half of V_stroke "
                f"{u.show(self.V_stroke, 'volume')}: the gas would vanish at the end of the stroke. Raise gas.V_0."
            )
        return self


P_ATM = 101325.0
"""Pressure of the air that a compressor draws [Pa]: standard atmosphere."""


class GasBank(Spec):
    """Bank whose gas pressure is set for the load, with motors of fixed displacement: passive control of the first
    generation. Its highest pressure is accumulator.gas.p_0."""

    p_min: u.Pressure = Field(gt=0, description="lowest gas pressure that is set")
    Q_free: u.Flow = Field(gt=0, description="gas that the compressor delivers, at atmospheric pressure")


class PassiveCircuit(Spec):
    """Circuit on an accumulator that carries the weight of the load."""

    motor: MotorSet
    pump: PumpSet
    accumulator: Accumulator
    p_lp: u.Pressure = Field(gt=0, description="pressure of the low side")
    relief: Relief
    line: Line
    leak: Leak | None = Field(default=None, description='form of the leak; default "stroke+speed"')
    internal_share: Number | None = InternalShare
    bank: GasBank | None = Field(
        default=None, description="gas pressure set for the load; default variable displacement at one pressure"
    )

    @model_validator(mode="after")
    def _bank_holds_the_load(self) -> Self:
        if self.bank is None:
            return self
        if self.motor.alpha_min < 1.0:
            raise ValueError(
                f"motor.alpha_min = {self.motor.alpha_min:g}: with a bank the motors are of fixed displacement. Set 1,"
                " or leave out bank."
            )
        if not self.p_lp < self.bank.p_min <= self.accumulator.gas.p_0:
            raise ValueError(
                f"p_lp {u.show(self.p_lp, 'pressure')}, bank.p_min {u.show(self.bank.p_min, 'pressure')} and"
                f" accumulator.gas.p_0 {u.show(self.accumulator.gas.p_0, 'pressure')} must rise in this order. Change"
                " the one that is out of place."
            )
        return self

    @model_validator(mode="after")
    def _pressures_in_order(self) -> Self:
        if self.motor.variant is not ServoVariant.CLOSED_LOOP:
            raise ValueError(
                f'motor.variant "{self.motor.variant}" is modelled for active motors only. Set "closed-loop".'
            )
        p_0 = self.accumulator.gas.p_0
        if not self.p_lp < p_0 < self.relief.p:
            raise ValueError(
                f"p_lp {u.show(self.p_lp, 'pressure')}, accumulator.gas.p_0 {u.show(p_0, 'pressure')} and relief.p "
                f"{u.show(self.relief.p, 'pressure')} must rise in this order. Change the one that is out of place."
            )
        return self


NO_LIMIT = 1.0e30
"""Stands for a limit that a crane file does not name [SI]: no winch gets there."""
DP_LEAST = 1.0e6
"""Pressure below which the torque law of units on an accumulator stops dividing by it [Pa]: 10 bar, far below any
charge."""


def limit(value: float | None) -> float:
    """A limit, or what stands for none [SI]."""
    return NO_LIMIT if value is None else value


def power_back(crane: Any) -> float:
    """Hydraulic power that the power units of a crane take back at most [W]."""
    return NO_LIMIT if crane.hpu is None else float(crane.hpu.P_back)


def servo_record(servo: Servo, lo: float = -1.0, hi: float = 1.0) -> swash.Servo:
    """A displacement control between its stops; without a known limit its setting may get as fast as its command
    asks."""
    rate = limit(servo.rate_max)
    down = rate if servo.rate_down is None else servo.rate_down
    return swash.Servo(servo.omega_n, servo.zeta, lo, hi, rate, down, servo.dead_time or 0.0)


def internal_share(circuit: Any) -> float:
    """Part of a circuit's leak that goes from port to port [-]."""
    return lines.INTERNAL_SHARE if circuit.internal_share is None else float(circuit.internal_share)


def restriction(circuit: Any) -> lines.Restriction:
    """What each line of a circuit takes of the pressure."""
    table = Lines() if circuit.lines is None else circuit.lines
    return lines.Restriction(table.R_1, table.R_2)


def relief_record(relief: Relief) -> lines.Relief:
    """A relief valve."""
    return lines.Relief(relief.p, relief.conductance)


def boost_record(boost: Boost) -> lines.Boost:
    """A boost pump with its valves."""
    return lines.Boost(boost.p, boost.conductance, limit(boost.Q_max))


def flushing_record(flushing: Flushing, boost: Boost) -> lines.Flushing:
    """A flushing valve, which opens above the boost pressure."""
    return lines.Flushing(boost.p + flushing.dp_open, flushing.conductance, 1.0 / max(flushing.dp_shuttle, 1.0))


def motors_record(motor: Any, C_1: float, C_2: float) -> Motors:
    """A set of motors whose leak is C_1 + C_2 |n_m| each [m^3/s/Pa]."""
    return Motors(count=float(motor.count), D_max=motor.D_max, C_1=C_1, C_2=C_2, fit=loss_fit(motor))
