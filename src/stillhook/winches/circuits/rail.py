"""A rail of nearly constant pressure: its tables in a crane file, its records, signals and extremes, and what it says
before a run."""

from typing import Annotated, Any, NamedTuple, Self

from pydantic import Field, model_validator

from stillhook import units as u
from stillhook.base.variable import Row
from stillhook.control.commands import PassiveSettings
from stillhook.physics.hydraulics.lines import INTERNAL_SHARE
from stillhook.physics.hydraulics.pump import PumpLeak, Pumps
from stillhook.physics.hydraulics.secondary import largest_speed_gain, setting_for_torque
from stillhook.tables.table import Count, Number, Spec
from stillhook.units import show
from stillhook.winches.circuits import rows, tables
from stillhook.winches.circuits.passive import PassiveCircuit, stroke_notes, stroke_of
from stillhook.winches.interface import Parts, Stroke
from stillhook.winches.records import folded, highest, largest, lowest

USES_MOST = 0.8
"""Setting that holds the load from which a note warns [-]: less than a fifth is then left for acceleration, friction
and a falling rail. Assumed."""


class SecondaryUnits(tables.Motor):
    """Over-centre units on the drum's gear, moved by one command."""

    count: Count = Field(description="number of units")
    servo: tables.Servo

    @property
    def D_total(self) -> float:
        """Full displacement of all units together [m^3/rad]."""
        return self.count * self.D_max


class RailPumps(tables.Pumps):
    """Pumps that hold up the rail."""

    C_leak: u.Leakage = Field(ge=0, description="total leak of all pumps")
    servo: tables.Servo


class SpeedDrive(Spec):
    """Speed control of the secondary units, and its feedforward."""

    n_full: u.Rotation = Field(gt=0, description="motor speed at full command")
    K: u.GainPerTime = Field(gt=0, description="speed gain: acceleration demanded per missing speed")
    T_i: u.Time = Field(gt=0, description="integral time")
    friction_ahead: Number = Field(ge=0, le=1, description="part of the modelled friction that is fed forward")
    omega_ahead: u.Rotation = Field(gt=0, description="speed set-point over which fed-forward friction changes sign")
    load_ahead: Number = Field(
        ge=1, description="most that is fed forward of the load, over what the load cell reads at the instant"
    )


class Secondary(Spec):
    """Secondary controlled units on a rail with accumulators."""

    unit: SecondaryUnits
    pump: RailPumps
    accumulator: tables.Accumulator
    line: tables.Line
    relief: tables.Relief
    p_lp: u.Pressure = Field(gt=0, description="pressure of the low side, which is held")
    p_min: u.Pressure = Field(gt=0, description="lowest allowed pressure of the rail")
    drive: SpeedDrive

    @model_validator(mode="after")
    def _parts_fit_together(self) -> Self:
        p_0 = self.accumulator.gas.p_0
        if not self.p_lp < self.p_min < p_0 < self.relief.p:
            named = {"p_lp": self.p_lp, "p_min": self.p_min, "accumulator.gas.p_0": p_0, "relief.p": self.relief.p}
            text = ", ".join(f"{name} {show(value, 'pressure')}" for name, value in named.items())
            raise ValueError(f"{text} must rise in this order. Change the one that is out of place.")
        if self.drive.n_full >= self.unit.n_max_full:
            raise ValueError(
                f"drive.n_full {show(self.drive.n_full, 'rotation')} is not below unit.n_max_full"
                f" {show(self.unit.n_max_full, 'rotation')}. Lower drive.n_full."
            )
        servo = self.unit.servo
        if servo.dead_time is not None:
            raise ValueError(
                "unit.servo.dead_time: the drive controls the units' speed without cycles, and no dead time is modelled"
                " in this loop. Leave it out."
            )
        most = largest_speed_gain(servo.omega_n, servo.zeta, self.drive.T_i)
        if most <= 0.0:
            raise ValueError(
                f"drive.T_i {show(self.drive.T_i, 'time')} makes the speed control unstable with every drive.K:"
                " unit.servo is too slow for it. Raise drive.T_i."
            )
        if self.drive.K >= most:
            raise ValueError(
                f"drive.K {self.drive.K:.4g} 1/s makes the speed control unstable: with unit.servo and drive.T_i it"
                f" must be below {most:.4g} 1/s. Lower drive.K or raise drive.T_i."
            )
        return self


class DriveSettings(NamedTuple):
    """n_full speed at full command [rad/s]; K speed gain [1/s]; T_i integral time [s]; what is fed forward: share of
    the friction, i_omega inverse of the speed over which its sign changes [s/rad], most load over what the cell reads
    [-]."""

    n_full: float
    K: float
    T_i: float
    share: float
    i_omega: float
    most: float


class Signals(NamedTuple):
    """Signals of its own."""

    alpha_s: Annotated[
        float, Row("1", "", "hoisting positive", "setting of the secondary units over its maximum", "figure 1.12")
    ]
    omega_m: rows.OmegaM
    omega_ref: Annotated[float, Row("rad/s", "rotation", "hoisting positive", "set-point of the motor speed")]
    T_s: Annotated[float, Row("N m", "torque", "hoisting positive", "torque of all secondary units, without losses")]
    T_f: rows.FrictionTorque
    p_r: Annotated[float, Row("Pa", "pressure", "gauge", "pressure of the rail", "figure 1.12")]
    V_void: rows.VoidVolume
    V_acc: Annotated[float, Row("m^3", "volume", "from the oil end", "oil in the accumulator", "paper C")]
    alpha_rp: Annotated[float, Row("1", "", "into the rail", "setting of the rail's pumps over its maximum")]
    f_pump: rows.PumpShare
    P_hpu: rows.HydraulicPower


class Extremes(NamedTuple):
    """Extremes of its signals over a run."""

    p_r_max: Annotated[
        float, Row("Pa", "pressure", "gauge", "highest pressure of the rail", symbol="max p_r"), highest("p_r")
    ]
    p_r_min: Annotated[
        float, Row("Pa", "pressure", "gauge", "lowest pressure of the rail", symbol="min p_r"), lowest("p_r")
    ]
    void_max: rows.MostVoid
    V_acc_max: Annotated[
        float, Row("m^3", "volume", "from the oil end", "most oil in the accumulator"), highest("V_acc")
    ]
    V_acc_min: Annotated[
        float, Row("m^3", "volume", "from the oil end", "least oil in the accumulator"), lowest("V_acc")
    ]
    alpha_s_max: Annotated[
        float,
        Row("1", "", "", "largest setting of the secondary units used", symbol="max|alpha_s|"),
        largest("alpha_s"),
    ]
    omega_m_max: rows.HighestSpeed
    P_hpu_max: rows.HighestPower
    P_hpu_min: rows.LowestPower


BLANK, fold_extremes = folded(Extremes)


def rail_record(rail: Secondary, K_acc: float, gas_held: bool, parts: Parts) -> PassiveCircuit:
    """Units, pumps, accumulator and relief valve of the rail as kernels know them; K_acc pump command per missing
    pressure [1/Pa]; gas_held: the accumulator has so large a bank that its pressure stands."""
    unit, pump = rail.unit, rail.pump
    return PassiveCircuit(
        pumps=Pumps(D_max=sum(pump.D), omega_p=pump.omega_p, leak=PumpLeak(*[pump.C_leak] * len(PumpLeak._fields))),
        pump_servo=tables.servo_record(pump.servo),
        motors=tables.motors_record(unit, unit.C_1, unit.C_2),
        motor_servo=tables.servo_record(unit.servo),
        accumulator=parts.accumulator(rail.accumulator, rail.line, gas_held, "secondary"),
        relief=tables.relief_record(rail.relief),
        internal=INTERNAL_SHARE,
        settings=PassiveSettings(
            D_m_max=unit.D_total,
            Q_p_max=pump.Q_max,
            p_lp=rail.p_lp,
            p_set=rail.accumulator.gas.p_0,
            K_acc=K_acc,
            dp_least=tables.DP_LEAST,
            least=0.0,
        ),
        n_full=unit.n_max_full,
        n_max=unit.n_max_full,
    )


def drive_record(drive: SpeedDrive) -> DriveSettings:
    """The speed control as kernels know it."""
    return DriveSettings(
        n_full=drive.n_full,
        K=drive.K,
        T_i=drive.T_i,
        share=drive.friction_ahead,
        i_omega=1.0 / drive.omega_ahead,
        most=drive.load_ahead,
    )


def charge(crane: Any) -> float:
    """Accumulator pressure at rest [Pa]."""
    return float(crane.secondary.accumulator.gas.p_0)


def stroke(crane: Any, F: float) -> Stroke:
    """Motion of the tip that fills the accumulator's stroke at a tension F [N]."""
    return stroke_of(crane.secondary.accumulator, crane.secondary.p_lp, F)


def notes(crane: Any, held: Any, parts: Parts) -> list[str]:
    """Units too small for the load, an accumulator too small for the motion."""
    rail, out = crane.secondary, []
    acc = rail.accumulator
    alpha = setting_for_torque(held.W * 0.5 * held.d / crane.i_hD, rail.unit.D_total, acc.gas.p_0 - rail.p_lp)
    p_0 = show(acc.gas.p_0, "pressure")
    if alpha > 1.0:
        out.append(f"holding the load takes {alpha:.0%} of the secondary units at {p_0}: the load will sink")
    elif alpha > USES_MOST:
        out.append(
            f"holding the load takes {alpha:.0%} of the secondary units at {p_0}: little is left to accelerate, and for"
            " friction"
        )
    return out + stroke_notes(acc, rail.p_lp, held)
