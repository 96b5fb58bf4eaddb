"""Open-circuit winch: a proportional directional valve lets the oil of load-sensing pumps to motors that turn the drum,
and a counterbalance valve holds the load while it is lowered (Moslatt 2020 paper E section 1, family 5)."""

from typing import Annotated, Any, NamedTuple

from stillhook.base.variable import Row
from stillhook.control.interface import Sensed
from stillhook.control.plant import Hydraulics
from stillhook.control.plc import Plc, hold, low_pass
from stillhook.physics.friction import system_friction
from stillhook.physics.hydraulics.lines import capacitance, line_pressure, void_energy, void_volume
from stillhook.physics.hydraulics.motor import motor_leakage, motor_torque
from stillhook.physics.hydraulics.motor_laws import motor_loss, motors_dry, motors_moving
from stillhook.physics.hydraulics.pump import power_limited_setting, pump_setting_rate
from stillhook.physics.hydraulics.swash import swash_acceleration, swash_rate
from stillhook.physics.hydraulics.valves import in_series, orifice_flow, pilot_pressure_rate, spool_for_opening
from stillhook.physics.records import replace, zeros_but
from stillhook.physics.scalar import clip, fmax, scalar
from stillhook.units import show
from stillhook.winches import shaft
from stillhook.winches.circuits import rows
from stillhook.winches.circuits.active import (
    NEAR_LIMIT,
    cavitates,
    dry_bound,
    line_energy,
    line_voids,
    moving_slope,
    relieves,
)
from stillhook.winches.circuits.valve_controlled import (
    BLANK,
    Extremes,
    OpenCircuit,
    ValveCircuit,
    ValveFlows,
    fold_extremes,
    full_flow_speed,
    pilot_pressure,
    valve_circuit,
    valve_flows,
    valve_rates,
)
from stillhook.winches.interface import Cause, Parts, Stiffness
from stillhook.winches.load_path import load
from stillhook.winches.load_path.load import Hoist, shaft_inertia_without_wire
from stillhook.winches.records import Geometry, Sensors, apply_override
from stillhook.winches.shaft import bristle_after, friction, geometry, wire_speed

NAME = "open-circuit"
TITLE = "open-circuit winch: a proportional directional valve moves the drum, a counterbalance valve holds the load"
PATH = load
CONTROL = "speed"
TABLES = {"open": OpenCircuit}
SERVOS = {"x_v": ("open.valve.servo", "A.spool")}
TUNED = {
    "open.drive.share": (0.0, 1.0),
    "open.drive.jump": (0.002, 0.05),
    "open.drive.dp_nominal": (5.0e5, 100.0e5),
}
SHOWN = {"p_max": "peak\npressure", "P_hpu_max": "peak\npower", "flow_time": "pump\nat limit"}

FILL_RATE = 15.0
"""Rate at which the hoisting line is brought to the load's pressure behind the closed brake [1/s], as on closed
circuits. Assumed."""


class Params(NamedTuple):
    A: ValveCircuit
    hoist: Hoist
    plc: Plc
    sensors: Sensors


class State(NamedTuple):
    """The winch without its load path."""

    x_v: float  # spool position, hoisting positive [-]
    x_v_dot: float  # its rate [1/s]
    alpha_p: float  # setting of the pumps [-]
    p_a: float  # linear pressure of line A, hoisting, at the motors [Pa], see `stillhook.physics.hydraulics.lines`
    p_b: float  # that of line B, lowering [Pa]
    p_s: float  # that of the supply [Pa]
    p_pilot: float  # pressure in the pilot line of the counterbalance valve [Pa]
    omega_m: float  # motor speed, hoisting positive [rad/s]
    z: float  # bristle, half a step ahead [rad]


class Command(NamedTuple):
    """Held between PLC cycles: x_v spool [-]; f_pump share of the pumps that run; brake how far the holding brake is
    closed [-]."""

    x_v: float
    f_pump: float
    brake: float


class Circuit(NamedTuple):
    """The winch at an instant; pressures [Pa], vapour in all lines [m^3], torques at the motor shaft [N m]. g level of
    dry friction, with that of the brake; held how far the brake is closed."""

    f: ValveFlows
    p_a: float
    p_b: float
    p_s: float
    V_void: float
    g: float
    held: float
    T_moving: float


class Signals(NamedTuple):
    """Signals of its own."""

    x_v: Annotated[float, Row("1", "", "hoisting positive", "spool position over its stroke")]
    y_cb: Annotated[float, Row("1", "", "", "opening of the counterbalance valve")]
    alpha_p: Annotated[float, Row("1", "", "hoisting positive", "pump displacement over its maximum", "paper E eq. 8")]
    p_a: rows.PressureA
    p_b: rows.PressureB
    p_s: Annotated[float, Row("Pa", "pressure", "gauge", "supply pressure of the directional valve")]
    V_void: rows.VoidVolume
    omega_m: rows.OmegaM
    Q_relief: rows.ReliefFlow
    T_f: rows.FrictionTorque
    P_hpu: rows.HydraulicPower


class Limits(NamedTuple):
    """1 where a limit is passed at an instant, else 0."""

    valve: Annotated[float, Cause("valve", "time with the spool commanded to its stop")]
    flow: Annotated[float, Cause("flow", "time with the load-sensing pumps at full flow")]
    power: rows.PowerLimit
    relief: rows.ReliefLimit
    overspeed: rows.OverspeedLimit
    cavitation: rows.CavitationLimit
    brake: Annotated[float, Cause("brake", "time with the holding brake slipping")]


class Powers(NamedTuple):
    """Powers [W]: the pumps' goes in, the rest goes out; tank: left in the oil that goes to the tank line."""

    pump: float
    friction: float
    valve: float
    counterbalance: float
    leakage: float
    relief: float
    tank: float


SUPPLIED = ("pump",)


@scalar
def circuit(x, q, u, geo, p):
    """The whole winch at an instant: flows of the circuit, friction. q point of the load path."""
    A, h, M = p.A, p.hoist, p.A.motors
    p_a, p_b, p_s = line_pressure(x.p_a), line_pressure(x.p_b), line_pressure(x.p_s)
    f = valve_flows(x.x_v, x.alpha_p, x.omega_m, x.p_a, x.p_b, x.p_s, x.p_pilot, u.f_pump, A)
    g = shaft.dry_level(motors_dry(x.omega_m, 1.0, p_a - p_b, M), x.omega_m, q.F_w * 0.5 * geo.d, h)
    return Circuit(
        f=f,
        p_a=p_a,
        p_b=p_b,
        p_s=p_s,
        V_void=line_voids(x, A.i_C_h) + void_volume(x.p_s, A.i_C_s),
        g=g + u.brake * h.T_brake,
        held=u.brake,
        T_moving=shaft.moving_loss(motors_moving(x.omega_m, 1.0, p_a - p_b, M), x.omega_m, h),
    )


@scalar
def rates(c, x, q, u, geo, p):
    """Time derivatives of the state; the bristle is advanced by `bristle_after`."""
    A, f = p.A, c.f
    T = motor_torque(A.D_m, c.p_a - c.p_b) - q.F_w * geo.r_eff - friction(c, x, p)
    return State(
        x_v=swash_rate(x.x_v, x.x_v_dot, A.spool),
        x_v_dot=swash_acceleration(x.x_v, x.x_v_dot, u.x_v, A.spool),
        alpha_p=pump_setting_rate(x.alpha_p, f.wanted, A.pump),
        p_a=f.Q_a * A.i_C_h,
        p_b=f.Q_b * A.i_C_h,
        p_s=f.Q_s * A.i_C_s,
        p_pilot=pilot_pressure_rate(x.p_pilot, c.p_b, A.cb),
        omega_m=T * geo.i_J,
        z=0.0,
    )


still = zeros_but(State, "p_a", "p_b", "p_s", "p_pilot")


@scalar
def start(s_w, tick, p):
    """State before the PLC's first cycle, with s_w of wire out [m]."""
    p_T = p.A.tank.p_T
    return still(p_T, p_T, p.A.pump.p_standby, p_T)


@scalar
def settle(x, q, u, tick, geo, p):
    """State at rest under the PLC's first commands: line A holds the load, the pumps are at standby."""
    return still(x.p_b + q.F_w * geo.r_eff / p.A.D_m, x.p_b, p.A.pump.p_standby, x.p_b)


with_pressures = replace(Sensed, "f_pump", "dp", "dp_load", "p_a", "p_b")


@scalar
def sense(x, y, q, m, tick, geo, p):
    """What the PLC reads: motors of fixed displacement, lines A and B at them; every pump counts, as the pumps follow
    the load by themselves."""
    r = shaft.sense(x, y, q, m, tick, geo, p)
    p_a, p_b = line_pressure(x.p_a), line_pressure(x.p_b)
    return with_pressures(r, 1.0, p_a - p_b, r.F * geo.r_eff / p.A.D_m, p_a, p_b)


@scalar
def flow_wanted(u_p, brake, idle, missing, A):
    """Flow that the motors shall take [m^3/s], hoisting positive: D omega_ref, and behind a closed brake that is to
    open what brings line A to the load's pressure; missing pressure of that [Pa]; idle as in
    `stillhook.control.commands.idle_time`."""
    filling = FILL_RATE / A.i_C_h * missing if brake > 0.0 and idle < 0.0 else 0.0
    return A.D_m * A.n_full * u_p + filling


@scalar
def spool_command(Q, dp, A):
    r"""Spool position for a flow Q [m^3/s], within its stops [-]; dp pressure drop over the inlet edge, filtered [Pa].

    .. math:: x = D\,\omega_{ref}/(K_v\sqrt{\Delta p_v})

    `share` of the drop is the measured one, the rest nominal; the overlap is jumped.
    """
    law = A.law
    dp_v = law.share * fmax(dp, law.dp_least) + (1.0 - law.share) * law.dp_nominal
    opening = Q / orifice_flow(A.edges.K_v, dp_v, A.edges.dp_l)
    return clip(spool_for_opening(opening, law.deadband, law.jump), -1.0, 1.0)


@scalar
def actuate(drive, r, x, m_0, m, tick, geo, p):
    """Plant commands, the PLC's memory (it holds the filtered pressure drop), signals of the drive."""
    A = p.A
    drive = apply_override(drive, tick)
    dp = valve_flows(x.x_v, x.alpha_p, x.omega_m, x.p_a, x.p_b, x.p_s, x.p_pilot, tick.f_pump, A).dp_v
    dp = low_pass(m_0.held, dp, A.law.tau_dp, p.plc.t_cycle)
    Q = flow_wanted(drive.u_p, drive.brake, m.idle, r.dp_load - r.dp, A)
    return Command(spool_command(Q, dp, A), tick.f_pump, drive.brake), hold(m, dp), drive


@scalar
def signals(c, x, q, u, geo, p):
    """Its own signals at an instant."""
    f = c.f
    return Signals(
        x_v=x.x_v,
        y_cb=f.y,
        alpha_p=x.alpha_p,
        p_a=c.p_a,
        p_b=c.p_b,
        p_s=c.p_s,
        V_void=c.V_void,
        omega_m=x.omega_m,
        Q_relief=f.Q_relief_a + f.Q_relief_b + f.Q_relief_s,
        T_f=friction(c, x, p),
        P_hpu=f.Q_p * c.p_s,
    )


@scalar
def limits(c, x, q, u, p):
    """Which limits are passed now; see `Limits`."""
    A, f = p.A, c.f
    most = power_limited_setting(c.p_s, u.f_pump, A.pump)
    spent = x.alpha_p >= NEAR_LIMIT * most
    return Limits(
        valve=1.0 if abs(u.x_v) >= 1.0 else 0.0,
        flow=1.0 if spent and most >= 1.0 else 0.0,
        power=1.0 if spent and most < 1.0 else 0.0,
        relief=relieves(f.Q_relief_a + f.Q_relief_b + f.Q_relief_s),
        overspeed=1.0 if abs(x.omega_m) > A.n_max else 0.0,
        cavitation=cavitates(c.p_a, c.p_b),
        brake=1.0 if c.held >= 1.0 and p.hoist.bristle.sigma_0 * abs(x.z) >= c.g else 0.0,
    )


@scalar
def powers(c, x, q, p):
    """Where the power comes from and where it goes [W]; see `Powers`."""
    f = c.f
    return Powers(
        pump=f.Q_p * c.p_s,
        friction=friction(c, x, p) * x.omega_m,
        valve=f.P_valve,
        counterbalance=f.P_cb,
        leakage=f.Q_int * (c.p_a - c.p_b) + f.Q_ext_a * c.p_a + f.Q_ext_b * c.p_b + f.Q_ext_s * c.p_s,
        relief=f.Q_relief_a * c.p_a + f.Q_relief_b * c.p_b + f.Q_relief_s * c.p_s,
        tank=f.P_tank,
    )


@scalar
def stored_energy(c, x, geo, p):
    """Energy stored in shaft, motor lines and supply [J]."""
    A = p.A
    supply = 0.5 * c.p_s * c.p_s / A.i_C_s + void_energy(x.p_s, A.i_C_s)
    return shaft.energy(x, geo) + line_energy(c.p_a, c.p_b, x, A.i_C_h) + supply


def pack(crane: Any, case: Any, parts: Parts) -> Params:
    """Records of a run."""
    return Params(valve_circuit(crane, parts.plc.power.P_max), parts.hoist, parts.plc, parts.sensors)


def motors(crane: Any) -> tuple[Any, ...]:
    """Sets of motors on the shaft."""
    return (crane.open.motor,)


def pump_units(crane: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Size of the pump of each power unit; there are no passive ones."""
    return crane.open.pump.D, ()


def hydraulics(crane: Any) -> Hydraulics:
    """What controllers may know of its hydraulics: lines A and B between valve and motors."""
    c = crane.open
    return Hydraulics(
        D_m=c.motor.D_total,
        Q_p=c.pump.D_total * c.pump.omega_p,
        i_C_h=1.0 / capacitance(c.line.V, c.line.bulk_modulus),
    )


def pump_speed(crane: Any) -> float:
    """Speed of the pumps [rad/s]."""
    return float(crane.open.pump.omega_p)


def full_speed(crane: Any, alpha_m: float) -> float:
    """Motor speed at full command [rad/s]: the pumps' full flow, whatever displacement."""
    return full_flow_speed(crane)


def lag(crane: Any) -> float:
    """Time by which the winch lags its command [s]: that of the spool."""
    return float(crane.open.valve.servo.lag)


def stiffness(p: Params) -> Stiffness:
    """Fast modes of the winch."""
    A, M = p.A, p.A.motors
    rates = valve_rates(A, shaft_inertia_without_wire(p.hoist))
    return Stiffness(rates, moving_slope(M, A.n_max, A.relief.p), dry_bound(M, A.relief.p), A.n_max)


def notes(crane: Any, held: Any, parts: Parts) -> list[str]:
    """What the winch type means for a weight and a motion."""
    c, r_eff = crane.open, 0.5 * held.d / crane.i_hD
    dp = held.W * r_eff / c.motor.D_total
    out = []
    if dp > c.counterbalance.p_crack:
        out.append(
            f"holding the load takes {show(dp, 'pressure')}, more than the setting of the counterbalance valve,"
            f" {show(c.counterbalance.p_crack, 'pressure')}: it will not hold the load"
        )
    elif dp + c.pump.dp_margin > c.pump.p_max:
        out.append(
            f"holding the load takes {show(dp, 'pressure')}; the supply of {show(c.pump.p_max, 'pressure')} leaves less"
            f" than the margin of {show(c.pump.dp_margin, 'pressure')} for the valve: it will hoist slowly, or not"
        )
    if held.manual and crane.brake is None:
        leak = c.motor.count * c.motor.C_1 * dp / c.motor.D_total * r_eff
        out.append(f"with the spool in its overlap the load sinks by {show(leak, 'speed', 2)}, as the motors leak")
    return out


def speed_limit(p: Params, geo: Geometry, F_w: float, lowering: bool = False) -> tuple[float, str]:
    """Highest steady motor speed with tension F_w at the top [rad/s, never negative], and the limit that stops it."""
    low, high, cause = 0.0, 4.0 * p.A.n_max, "overspeed"
    while high - low > 1e-6 * p.A.n_max:
        omega = 0.5 * (low + high)
        passed = _passed(omega, p, geo, F_w, lowering)
        low, high, cause = (low, omega, passed) if passed else (omega, high, cause)
    return low, cause


def _passed(omega: float, p: Params, geo: Geometry, F_w: float, lowering: bool) -> str:
    """Which limit a steady speed passes [rad/s], "" where none."""
    A, h, M, p_T = p.A, p.hoist, p.A.motors, p.A.tank.p_T
    T_f = h.n_motors * system_friction(omega, F_w * 0.5 * geo.d, h.friction)
    T = F_w * geo.r_eff + (-T_f if lowering else T_f)
    dp = T / A.D_m
    for _ in range(20):  # the motors' own loss goes with the pressure that carries it
        T_m = M.count * motor_loss(omega, M.D_max, dp, M.fit)
        dp = (T - T_m if lowering else T + T_m) / A.D_m
    Q = A.D_m * omega
    drop = (Q / A.edges.K_v) ** 2
    if lowering:
        p_b = pilot_pressure(Q, dp, A)
        p_a, p_in = p_b + dp, p_b
        K = in_series(A.edges.K_v, A.cb.K_v)
        meter_out = p_a - p_T < (Q / K) ** 2
    else:
        p_b = p_T + drop
        p_a = p_b + dp
        p_in, meter_out = p_a + A.cb.p_check + (Q / A.cb.K_v) ** 2, False
    Q_m = Q + motor_leakage(omega, M) * max(p_in, 0.0)
    Q_p = Q_m + A.pump.C_leak * A.pump.p_max
    droop = min(Q_p / A.pump.Q_full, 1.0) / A.pump.i_droop
    p_s = min(max(p_in + A.pump.dp_margin, A.pump.p_standby), A.pump.p_max) - droop
    Q_p = Q_m + A.pump.C_leak * p_s
    passed = {
        "overspeed": omega > A.n_max,
        "relief": max(p_a, p_b) > A.relief.p,
        "flow": Q_p > A.pump.Q_full,
        "power": p_s * Q_p > A.pump.P_max,
        "valve": drop > p_s - p_in or meter_out,
    }
    return next((name for name, beyond in passed.items() if beyond), "")
