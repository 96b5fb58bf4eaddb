"""The open circuit: pumps with load sensing, a directional valve, a counterbalance valve and motors; its tables, its
records and all its flows."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple, Self

from pydantic import Field, model_validator

from stillhook import units as u
from stillhook.base.variable import Row
from stillhook.physics.hydraulics import valves
from stillhook.physics.hydraulics.lines import (
    Relief,
    capacitance,
    external_leakage,
    internal_leakage,
    line_pressure,
    relief_flow,
    vapour_displaced,
    vapour_share,
)
from stillhook.physics.hydraulics.motor import Motors, motor_leakage
from stillhook.physics.hydraulics.pump import LoadSensing, load_pressure, pump_setting_wanted
from stillhook.physics.hydraulics.swash import Servo, displacement
from stillhook.physics.scalar import clip, fmax, scalar
from stillhook.tables.table import Count, Number, Spec, Text
from stillhook.winches.circuits import rows, tables
from stillhook.winches.circuits.active import servo_rate
from stillhook.winches.records import folded, highest, largest


class ValveMotors(tables.Motor):
    """Motors of fixed displacement, of one type."""

    type: Text = Field(description="motor type")
    count: Count = Field(description="number of motors")

    @property
    def D_total(self) -> float:
        """Displacement of all motors together [m^3/rad]."""
        return self.count * self.D_max


class DirectionalValve(Spec):
    """Proportional directional valve with four equal edges."""

    Q_N: u.Flow = Field(gt=0, description="rated flow of one edge at full opening")
    dp_N: u.Pressure = Field(gt=0, description="pressure drop over that edge at the rated flow")
    deadband: Number = Field(ge=0, le=0.5, description="overlap of the spool, part of its stroke")
    dp_laminar: u.Pressure = Field(gt=0, description="pressure drop about which the flow turns turbulent")
    servo: tables.Servo


class CounterbalanceValve(Spec):
    """Vented counterbalance valve at the motors' hoisting port, with a check valve for free flow."""

    ratio: Number = Field(ge=1, le=20, description="pilot ratio")
    p_crack: u.Pressure = Field(gt=0, description="setting: pressure that opens it without a pilot")
    dp_open: u.Pressure = Field(gt=0, description="rise beyond that opens it fully")
    Q_N: u.Flow = Field(gt=0, description="rated flow when open, either way")
    dp_N: u.Pressure = Field(gt=0, description="pressure drop at the rated flow")
    p_check: u.Pressure = Field(ge=0, description="pressure that opens the check valve")
    tau_pilot: u.Time = Field(gt=0, description="time constant of the pilot line with its damping orifice")


class LoadSensingPumps(tables.Pumps):
    """Pumps with a pressure control."""

    C_leak: u.Leakage = Field(ge=0, description="leak of all pumps")
    tau: u.Time = Field(gt=0, description="time constant of the setting")
    dp_margin: u.Pressure = Field(gt=0, description="pressure kept above that of the load")
    dp_droop: u.Pressure = Field(gt=0, description="pressure by which it falls from no to full flow")
    p_standby: u.Pressure = Field(gt=0, description="lowest pressure; that of p_max makes a constant supply")
    p_max: u.Pressure = Field(gt=0, description="largest pressure that the control requires")


class TankLine(Spec):
    """Preloaded tank line, from which make-up valves feed a line that runs dry."""

    p: u.Pressure = Field(ge=0, description="pressure of the tank line")
    dp_make_up: u.Pressure = Field(ge=0, description="drop that opens a make-up valve")
    conductance: u.Leakage = Field(ge=0, description="make-up flow per pressure beyond it; 0: no make-up valves")


class ValveDrive(Spec):
    """How the PLC works the spool."""

    deadband: Number = Field(ge=0, le=0.5, description="overlap that it compensates, part of the stroke")
    jump: Number = Field(gt=0, le=0.2, description="opening over which it jumps the overlap")
    share: Number = Field(ge=0, le=1, description="share of the measured pressure drop in its flow law")
    dp_nominal: u.Pressure = Field(gt=0, description="pressure drop that the rest of its flow law takes")
    dp_least: u.Pressure = Field(gt=0, description="least pressure drop that it divides by")
    tau_dp: u.Time = Field(ge=0, description="low-pass of the measured pressure drop")


class OpenCircuit(Spec):
    """Open circuit with a directional valve."""

    motor: ValveMotors
    valve: DirectionalValve
    counterbalance: CounterbalanceValve
    pump: LoadSensingPumps
    line: tables.Line
    supply: tables.Line
    relief: tables.Relief
    supply_relief: tables.Relief
    tank: TankLine
    drive: ValveDrive

    @model_validator(mode="after")
    def _pressures_in_order(self) -> Self:
        if self.pump.p_standby > self.pump.p_max:
            raise ValueError(
                f"pump.p_standby {u.show(self.pump.p_standby, 'pressure')} is above pump.p_max"
                f" {u.show(self.pump.p_max, 'pressure')}. Lower pump.p_standby."
            )
        if self.pump.p_max >= self.supply_relief.p:
            raise ValueError(
                f"pump.p_max {u.show(self.pump.p_max, 'pressure')} is not below supply_relief.p"
                f" {u.show(self.supply_relief.p, 'pressure')}. Raise supply_relief.p."
            )
        if self.counterbalance.p_crack >= self.relief.p:
            raise ValueError(
                f"counterbalance.p_crack {u.show(self.counterbalance.p_crack, 'pressure')} is not below relief.p"
                f" {u.show(self.relief.p, 'pressure')}. Raise relief.p."
            )
        return self


class FlowLaw(NamedTuple):
    """How the PLC turns a flow into a spool position; as `ValveDrive` in SI."""

    deadband: float
    jump: float
    share: float
    dp_nominal: float
    dp_least: float
    tau_dp: float


class ValveCircuit(NamedTuple):
    """i_C_h, i_C_s inverse capacitance of each motor line and of the supply [Pa/m^3]; i_beta inverse bulk modulus of
    the motor lines' oil [1/Pa]; n_max highest motor speed, n_full motor speed at full command [rad/s]; D_m displacement
    of all motors [m^3/rad]."""

    motors: Motors
    edges: valves.Edges
    spool: Servo
    cb: valves.Counterbalance
    pump: LoadSensing
    tank: valves.Tank
    law: FlowLaw
    relief: Relief
    supply_relief: Relief
    i_C_h: float
    i_C_s: float
    i_beta: float
    D_m: float
    n_max: float
    n_full: float


class ValveFlows(NamedTuple):
    """y opening of the counterbalance valve [-]; dp_v pressure drop over the inlet edge [Pa];
    wanted setting of the pumps [-]; flows [m^3/s]: Q_p pumps, Q_PA ... Q_BT through the edges, Q_int leak A to B, Q_ext
    leak of each motor line and of the pumps, relief and make-up of each line, Q_a, Q_b, Q_s net into the lines;
    P_valve power lost at the spool and the make-up valves, P_cb at the counterbalance valve with its check, P_tank left
    in the oil that goes to the tank line [W]."""

    y: float
    dp_v: float
    wanted: float
    Q_p: float
    Q_int: float
    Q_ext_a: float
    Q_ext_b: float
    Q_ext_s: float
    Q_relief_a: float
    Q_relief_b: float
    Q_relief_s: float
    Q_a: float
    Q_b: float
    Q_s: float
    P_valve: float
    P_cb: float
    P_tank: float


class Extremes(NamedTuple):
    """Extremes over a run."""

    p_a_max: rows.HighestPressureA
    p_b_max: rows.HighestPressureB
    p_max: rows.HighestPressure
    p_min: rows.LowestPressure
    void_max: rows.MostVoid
    p_s_max: Annotated[
        float, Row("Pa", "pressure", "gauge", "highest supply pressure", symbol="max p_s"), highest("p_s")
    ]
    x_v_max: Annotated[float, Row("1", "", "", "largest spool position used", symbol="max|x_v|"), largest("x_v")]
    alpha_p_max: rows.LargestAlphaP
    omega_m_max: rows.HighestSpeed
    P_hpu_max: rows.HighestPower


BLANK, fold_extremes = folded(Extremes)


@scalar
def valve_flows(x_v, alpha_p, omega_m, P_a, P_b, P_s, p_pilot, f_pump, A):
    """All flows of the open circuit. x_v spool position [-], hoisting positive; alpha_p setting of the pumps [-];
    omega_m [rad/s]; linear pressures P_a, P_b of the motor lines and P_s of the supply, p_pilot pilot of the
    counterbalance valve [Pa]; f_pump share of the pumps that run [-].

    Hoisting opens P-A (through the check valve) and B-T, lowering P-B and A-T (through the counterbalance valve). Edge
    and valve that the same oil passes count as one orifice: the oil between them is not a volume of its own.
    """
    e, cb, p_T = A.edges, A.cb, A.tank.p_T
    p_a, p_b, p_s = line_pressure(P_a), line_pressure(P_b), line_pressure(P_s)
    opening = valves.spool_opening(displacement(x_v, A.spool), e)
    K_up, K_down = e.K_v * fmax(opening, 0.0), e.K_v * fmax(-opening, 0.0)
    y = valves.counterbalance_opening(p_a, p_pilot, cb)
    K_cb = cb.K_v * y
    dp_up, dp_down = valves.check_drop(p_s - p_a, cb.p_check), fmax(p_a - p_T, 0.0)
    Q_PA = valves.orifice_flow(valves.in_series(K_up, cb.K_v), dp_up, e.dp_l)
    Q_AT = valves.orifice_flow(valves.in_series(K_down, K_cb), dp_down, e.dp_l)
    Q_PB = valves.orifice_flow(K_down, p_s - p_b, e.dp_l)
    Q_BT = valves.orifice_flow(K_up, p_b - p_T, e.dp_l)
    dp_PA = valves.share_of_drop(K_up, cb.K_v) * dp_up
    dp_AT = valves.share_of_drop(K_down, K_cb) * dp_down
    p_load = load_pressure(opening, p_s - dp_PA, p_b)
    wanted = pump_setting_wanted(p_s, p_load, f_pump, A.pump)
    C_m = motor_leakage(omega_m, A.motors)
    Q_p = f_pump * A.pump.Q_full * clip(alpha_p, 0.0, 1.0)
    Q_m = A.D_m * omega_m
    void_a, void_b = vapour_share(P_a, A.i_beta), vapour_share(P_b, A.i_beta)
    Q_int = internal_leakage(C_m, p_a - p_b) - vapour_displaced(Q_m, void_a, void_b)
    Q_ext_a, Q_ext_b = external_leakage(C_m, p_a), external_leakage(C_m, p_b)
    Q_ext_s = A.pump.C_leak * p_s
    Q_relief_a = relief_flow(p_a, A.relief)
    Q_relief_b = relief_flow(p_b, A.relief)
    Q_relief_s = relief_flow(p_s, A.supply_relief)
    Q_make_up_a, Q_make_up_b = valves.make_up_flow(p_a, A.tank), valves.make_up_flow(p_b, A.tank)
    P_valve = dp_PA * Q_PA + dp_AT * Q_AT + (p_s - p_b) * Q_PB + (p_b - p_T) * Q_BT
    dp_v = dp_PA if x_v >= 0.0 else p_s - p_b
    P_make_up = (p_T - p_a) * Q_make_up_a + (p_T - p_b) * Q_make_up_b
    return ValveFlows(
        y=y,
        dp_v=dp_v,
        wanted=wanted,
        Q_p=Q_p,
        Q_int=Q_int,
        Q_ext_a=Q_ext_a,
        Q_ext_b=Q_ext_b,
        Q_ext_s=Q_ext_s,
        Q_relief_a=Q_relief_a,
        Q_relief_b=Q_relief_b,
        Q_relief_s=Q_relief_s,
        Q_a=Q_PA - Q_AT - Q_m - Q_int - Q_ext_a - Q_relief_a + Q_make_up_a,
        Q_b=Q_PB - Q_BT + Q_m + Q_int - Q_ext_b - Q_relief_b + Q_make_up_b,
        Q_s=Q_p - Q_PA - Q_PB - Q_ext_s - Q_relief_s,
        P_valve=P_valve + P_make_up,
        P_cb=(p_s - p_a - dp_PA) * Q_PA + (dp_down - dp_AT) * Q_AT,
        P_tank=p_T * (Q_AT + Q_BT - Q_make_up_a - Q_make_up_b),
    )


def full_flow_speed(crane: Any) -> float:
    """Motor speed with the pumps full and no leakage [rad/s]."""
    c = crane.open
    return float(c.pump.D_total * c.pump.omega_p / c.motor.D_total)


def valve_circuit(crane: Any, P_max: float) -> ValveCircuit:
    """The open circuit of a crane as the physics reads it; P_max largest power of the power units [W]."""
    c = crane.open
    v, b, w, t, m, d = c.valve, c.counterbalance, c.pump, c.tank, c.motor, c.drive
    return ValveCircuit(
        motors=tables.motors_record(m, m.C_1, m.C_2),
        edges=valves.Edges(valves.flow_coefficient(v.Q_N, v.dp_N), v.deadband, 1.0 / (1.0 - v.deadband), v.dp_laminar),
        spool=tables.servo_record(v.servo),
        cb=valves.Counterbalance(
            psi=b.ratio,
            p_crack=b.p_crack,
            i_dp_open=1.0 / b.dp_open,
            K_v=valves.flow_coefficient(b.Q_N, b.dp_N),
            p_check=b.p_check,
            i_tau=1.0 / b.tau_pilot,
        ),
        pump=LoadSensing(
            Q_full=w.D_total * w.omega_p,
            i_tau=1.0 / w.tau,
            dp_margin=w.dp_margin,
            i_droop=1.0 / w.dp_droop,
            p_standby=w.p_standby,
            p_max=w.p_max,
            C_leak=w.C_leak,
            P_max=P_max,
        ),
        tank=valves.Tank(t.p, t.dp_make_up, t.conductance),
        law=FlowLaw(d.deadband, d.jump, d.share, d.dp_nominal, d.dp_least, d.tau_dp),
        relief=tables.relief_record(c.relief),
        supply_relief=tables.relief_record(c.supply_relief),
        i_C_h=1.0 / capacitance(c.line.V, c.line.bulk_modulus),
        i_C_s=1.0 / capacitance(c.supply.V, c.supply.bulk_modulus),
        i_beta=1.0 / c.line.bulk_modulus,
        D_m=m.D_total,
        n_max=m.n_max_full,
        n_full=full_flow_speed(crane),
    )


def valve_rates(A: ValveCircuit, J: float) -> dict[str, float]:
    """Fast modes of the open circuit [1/s]; J inertia at the motor shaft without the wire [kg m^2]."""
    e, cb, pump = A.edges, A.cb, A.pump
    C_leak = float(motor_leakage(A.n_max, A.motors))
    edge = e.K_v / math.sqrt(e.dp_l)
    spread = A.D_m * math.sqrt(2.0 * A.i_C_h / J)
    opening = valves.in_series(e.K_v, cb.K_v) * math.sqrt(A.relief.p) * cb.i_dp_open
    return {
        "control edges against the oil": edge * (A.i_C_h + A.i_C_s),
        "relief valve against the line's oil": A.relief.G * A.i_C_h,
        "relief valve against the supply's oil": A.supply_relief.G * A.i_C_s,
        "make-up valve against the line's oil": A.tank.G * A.i_C_h,
        "counterbalance valve against the line's oil": opening * A.i_C_h,
        "leakage against the oil": max(2.0 * C_leak * A.i_C_h, pump.C_leak * A.i_C_s),
        "motors against the line's oil": spread,
        "pressure control of the pumps": pump.i_tau + math.sqrt(pump.Q_full * pump.i_droop * pump.i_tau * A.i_C_s),
        "pilot line of the counterbalance valve": cb.i_tau,
        "spool": servo_rate(A.spool),
    }


def pilot_pressure(Q: float, dp: float, A: ValveCircuit) -> float:
    """Pressure of line B that opens the counterbalance valve for a steady lowering [Pa], no less than the tank line's.

    Q flow of the motors [m^3/s]; dp = p_a - p_b [Pa]; the spool fully open.
    """
    p_b = A.tank.p_T
    for _ in range(30):
        drop = max(p_b + dp - A.tank.p_T, 1.0)
        K_2 = Q * Q / drop
        others = 1.0 / max(K_2, 1e-30) - 1.0 / A.edges.K_v**2
        y = min(1.0 / (others**0.5 * A.cb.K_v), 1.0) if others > 0.0 else 1.0
        p_b = max((A.cb.p_crack + y / A.cb.i_dp_open - dp) / (1.0 + A.cb.psi), A.tank.p_T)
    return p_b
