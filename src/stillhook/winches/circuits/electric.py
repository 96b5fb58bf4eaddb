"""The electric drive of a winch: its tables in a crane file, and the records that its equations read."""

from __future__ import annotations

from typing import Annotated, NamedTuple, Self

from pydantic import Field, model_validator

from stillhook import units as u
from stillhook.base.variable import Row
from stillhook.physics.electric.machine import Body, Machines, SpeedLoop, current_loop_rate
from stillhook.physics.electric.supply import Grid, Store, energy
from stillhook.tables.table import Count, Spec
from stillhook.units import show
from stillhook.winches.circuits import rows
from stillhook.winches.records import folded, highest, largest, lowest

BAND = 0.1
"""Part of the store's usable energy over which its limits come in at either end [-]. Assumed."""


class ElectricMotors(Spec):
    """Electric machines of the winch; per machine."""

    count: Count = Field(description="machines on the shaft")
    J: u.Inertia = Field(gt=0, description="inertia of one")
    K_t: u.TorqueConstant = Field(gt=0, description="torque over current of one; its voltage over speed as well")
    T_max: u.Torque = Field(gt=0, description="largest torque of one")
    P_max: u.Power = Field(gt=0, description="largest power of one at the shaft; above T_max it weakens the field")
    n_full: u.Rotation = Field(gt=0, description="speed at full command")
    n_max: u.Rotation = Field(gt=0, description="highest speed")
    R: u.Resistance = Field(gt=0, description="winding of one, warm")
    k_iron: u.ViscousTorque = Field(ge=0, description="iron loss of one over speed squared")
    T_rated: u.Torque = Field(gt=0, description="torque of one that its cooling holds for ever at standstill")
    rise: u.TemperatureRise = Field(gt=0, description="temperature rise of the winding at that torque")
    tau_th: u.Time = Field(gt=0, description="thermal time constant")
    theta_c: u.Temperature = Field(gt=0, description="temperature of the coolant")
    theta_max: u.Temperature = Field(gt=0, description="highest temperature of the winding")
    theta_0: u.Temperature | None = Field(default=None, gt=0, description="temperature at the start; default theta_c")

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.n_max < self.n_full:
            raise ValueError(
                f"n_max {show(self.n_max, 'rotation')} is below n_full {show(self.n_full, 'rotation')}: a full command"
                " would overspeed the machines. Raise n_max, or lower n_full."
            )
        if self.theta_max <= self.theta_c:
            raise ValueError(
                f"theta_max {show(self.theta_max, 'temperature')} is not above theta_c"
                f" {show(self.theta_c, 'temperature')}: nothing would cool the winding. Raise theta_max."
            )
        return self


class Inverters(Spec):
    """Inverter of each machine, and its loops."""

    omega_i: u.Frequency = Field(gt=0, description="bandwidth of the current loop; integrated at 450 1/s at most")
    R: u.Resistance = Field(ge=0, description="resistance that loses what the inverter loses with current")
    P_idle: u.Power = Field(ge=0, description="loss without current")


class SpeedControl(Spec):
    """PI speed loop of the drive."""

    K: u.ViscousTorque = Field(gt=0, description="torque of all machines over missing speed")
    T_i: u.Time = Field(gt=0, description="integral time, and time in which it is released at the torque limit")
    tau_ref: u.Time = Field(gt=0, description="time constant in which the PLC's set-points are smoothed")


class SupplyLimits(Spec):
    """Grid and braking resistor."""

    P_max: u.Power = Field(gt=0, description="largest power from the grid")
    P_back: u.Power = Field(ge=0, description="largest power back to the grid")
    P_resistor: u.Power = Field(ge=0, description="power of the braking resistor for a while")
    P_rated: u.Power = Field(ge=0, description="power that the braking resistor burns for ever")
    tau_th: u.Time = Field(gt=0, description="thermal time constant of the braking resistor")

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.P_rated > self.P_resistor:
            raise ValueError(
                f"P_rated {show(self.P_rated, 'power')} is above P_resistor {show(self.P_resistor, 'power')}: what the"
                " resistor burns for ever is no more than for a while. Lower P_rated."
            )
        if self.P_rated == 0.0 < self.P_resistor:
            raise ValueError(
                f"P_rated is 0 and P_resistor {show(self.P_resistor, 'power')}: a resistor burns some power for ever."
                " Give P_rated, or P_resistor 0 kW for none."
            )
        return self


class Supercapacitors(Spec):
    """Store on the DC link."""

    C: u.Capacitance = Field(gt=0, description="capacitance of the whole store")
    R: u.Resistance = Field(ge=0, description="internal resistance of the whole store")
    V_min: u.Voltage = Field(gt=0, description="lowest voltage at which the drive works")
    V_set: u.Voltage = Field(gt=0, description="voltage that the grid keeps it at")
    V_max: u.Voltage = Field(gt=0, description="highest voltage")
    P_max: u.Power = Field(ge=0, description="largest power of the store")
    tau: u.Time = Field(gt=0, description="time in which the grid refills it")
    I_max: u.Current = Field(gt=0, description="largest current of the whole store, either way")
    P_loss: u.Power = Field(gt=0, description="loss of the whole store that its cooling takes for ever")
    rise: u.TemperatureRise = Field(gt=0, description="temperature rise of the store at that loss")
    tau_th: u.Time = Field(gt=0, description="thermal time constant of the store")
    theta_c: u.Temperature = Field(gt=0, description="temperature of the air around the store")
    theta_max: u.Temperature = Field(gt=0, description="highest temperature of the store")
    theta_0: u.Temperature | None = Field(default=None, gt=0, description="temperature at the start; default theta_c")

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if not self.V_min < self.V_set < self.V_max:
            volts = ", ".join(show(V, "voltage") for V in (self.V_min, self.V_set, self.V_max))
            raise ValueError(f"V_min, V_set, V_max are {volts}: they must rise. Change the one that is out of place.")
        if self.theta_max <= self.theta_c:
            raise ValueError(
                f"theta_max {show(self.theta_max, 'temperature')} is not above theta_c"
                f" {show(self.theta_c, 'temperature')}: nothing would cool the store. Raise theta_max."
            )
        return self


class Electric(Spec):
    """Electric drive of the winch."""

    motor: ElectricMotors
    inverter: Inverters
    speed: SpeedControl
    supply: SupplyLimits
    store: Supercapacitors


class Drive(NamedTuple):
    """The drive as its equations read it; rate_i of the current loop [1/s], n_full motor speed at full command
    [rad/s], theta_0 and theta_store_0 temperatures of windings and store at the start [K]."""

    machines: Machines
    rate_i: float
    speed: SpeedLoop
    store: Store
    grid: Grid
    winding: Body
    heat_store: Body
    n_full: float
    theta_0: float
    theta_store_0: float


def records(e: Electric) -> Drive:
    """Records of an electric drive."""
    m, s, g = e.motor, e.store, e.supply
    E_low, E_high = energy(s.C, s.V_min), energy(s.C, s.V_max)
    return Drive(
        machines=Machines(
            count=float(m.count),
            K_t=m.K_t,
            R=m.R,
            R_inverter=e.inverter.R,
            k_iron=m.k_iron,
            P_idle=e.inverter.P_idle,
            T_max=m.count * m.T_max,
            P_max=m.count * m.P_max,
            n_max=m.n_max,
        ),
        rate_i=current_loop_rate(e.inverter.omega_i),
        speed=SpeedLoop(e.speed.K, 1.0 / e.speed.T_i, 1.0 / e.speed.tau_ref),
        store=Store(
            i_C=1.0 / s.C,
            R=s.R,
            E_low=E_low,
            E_high=E_high,
            E_set=energy(s.C, s.V_set),
            V_low=s.V_min,
            V_high=s.V_max,
            i_band=1.0 / (BAND * (E_high - E_low)),
            i_tau=1.0 / s.tau,
            P_max=s.P_max,
            I_max=s.I_max,
        ),
        grid=Grid(
            P_max=g.P_max,
            P_back=g.P_back,
            P_resistor=g.P_resistor,
            P_rated=g.P_rated,
            i_rated=1.0 / g.P_rated if g.P_rated > 0.0 else 0.0,
            i_tau=1.0 / g.tau_th,
        ),
        winding=Body(m.theta_c, m.rise / (m.R * (m.T_rated / m.K_t) ** 2), 1.0 / m.tau_th, m.theta_max),
        heat_store=Body(s.theta_c, s.rise / s.P_loss, 1.0 / s.tau_th, s.theta_max),
        n_full=m.n_full,
        theta_0=m.theta_c if m.theta_0 is None else m.theta_0,
        theta_store_0=s.theta_c if s.theta_0 is None else s.theta_0,
    )


class Extremes(NamedTuple):
    """Extremes of its signals over a run."""

    omega_m_max: rows.HighestSpeed
    T_m_max: Annotated[
        float, Row("N m", "torque", "", "largest torque of all machines", symbol="max|T_m|"), largest("T_m")
    ]
    P_el_max: Annotated[
        float, Row("W", "power", "to the winch positive", "highest power from the grid"), highest("P_el")
    ]
    P_el_min: Annotated[
        float, Row("W", "power", "to the winch positive", "lowest power; negative: most fed back"), lowest("P_el")
    ]
    E_store_min: Annotated[
        float, Row("J", "energy", "", "lowest energy of the store", symbol="min E_store"), lowest("E_store")
    ]
    E_store_max: Annotated[
        float, Row("J", "energy", "", "highest energy of the store", symbol="max E_store"), highest("E_store")
    ]
    V_dc_min: Annotated[
        float, Row("V", "voltage", "", "lowest voltage of the DC link", symbol="min V_dc"), lowest("V_dc")
    ]
    V_dc_max: Annotated[
        float, Row("V", "voltage", "", "highest voltage of the DC link", symbol="max V_dc"), highest("V_dc")
    ]
    I_store_max: Annotated[
        float, Row("A", "current", "", "largest current of the store", symbol="max|I_store|"), largest("I_store")
    ]
    theta_max: Annotated[
        float,
        Row("K", "temperature", "", "highest temperature of the windings", symbol="max theta"),
        highest("theta"),
    ]
    theta_store_max: Annotated[
        float,
        Row("K", "temperature", "", "highest temperature of the store", symbol="max theta_store"),
        highest("theta_store"),
    ]


BLANK, fold_extremes = folded(Extremes)
