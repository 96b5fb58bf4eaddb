"""Secondary control: over-centre units on a rail of nearly constant pressure turn the drum, and an accumulator keeps
the energy (Moslatt 2020 section 1.2.2, figures 1.10 and 1.12; paper E section 1)."""

from typing import Annotated, Any, NamedTuple

from stillhook.control.commands import SMALL, make_up, within_power
from stillhook.control.interface import Sensed
from stillhook.control.plc import MANUAL, Plc, hold
from stillhook.physics.friction import bristle_update, dry_torque, system_friction_dry
from stillhook.physics.hydraulics.accumulator import (
    accumulator_pressure,
    accumulator_vapour,
    accumulator_void,
    port_pressure,
)
from stillhook.physics.hydraulics.cavitation import vapour_drawn
from stillhook.physics.hydraulics.lines import external_leakage, internal_leakage, relief_flow
from stillhook.physics.hydraulics.motor import motor_leakage, motor_torque, torque_loss_dry, torque_loss_moving
from stillhook.physics.hydraulics.pump import pump_flow, pump_leakage
from stillhook.physics.hydraulics.secondary import (
    friction_ahead,
    guarded_setting,
    integral_rate,
    load_ahead,
    setting_for_torque,
    speed_torque,
)
from stillhook.physics.hydraulics.swash import displacement, swash_acceleration, swash_rate
from stillhook.physics.load_path.drum import K_wire
from stillhook.physics.scalar import copysign, fmax, scalar
from stillhook.physics.sensor import quantise
from stillhook.winches import load_path
from stillhook.winches.circuits.active import CavitationLimit, PowerLimit, cavitates, out_of_power, relieves
from stillhook.winches.circuits.passive import PassiveCircuit, passive_stiffness
from stillhook.winches.circuits.rail import (
    BLANK,
    NO_LIMIT,
    DriveSettings,
    Extremes,
    Secondary,
    Signals,
    charge,
    drive_record,
    fold_extremes,
    notes,
    rail_record,
    stroke,
)
from stillhook.winches.interface import Cause, Parts, Stiffness
from stillhook.winches.load_path import Hoist, drum_geometry, shaft_inertia_without_wire
from stillhook.winches.records import Geometry, Sensors, apply_override

NAME = "secondary"
TITLE = "secondary controlled winch: over-centre units on a rail with accumulators turn the drum"
PATH = load_path
CONTROL = "speed"
SHOWN = {
    "p_r_min": "lowest\nrail",
    "p_r_max": "highest\nrail",
    "alpha_s_max": "largest\nsetting",
    "torque_time": "torque\nlimit",
    "stroke_time": "accumulator\nat its end",
}
TUNED = {"secondary.drive.K": (4.0, 25.0), "secondary.drive.T_i": (0.2, 5.0)}
MOVES = 1.0e-3
"""Motor speed at which the breakaway of a steady speed is taken [rad/s]: next to nothing."""
BISECTIONS = 40
"""Halvings of the speed's range: to the last digit of a float."""
TABLES = {"secondary": Secondary}


class Params(NamedTuple):
    """rail: units, pumps, accumulator and relief valve, as a passive circuit has them; p_min lowest allowed pressure
    [Pa]; P_back hydraulic power that the power units take back at most [W]."""

    rail: PassiveCircuit
    drive: DriveSettings
    p_min: float
    P_back: float
    hoist: Hoist
    plc: Plc
    sensors: Sensors


class State(NamedTuple):
    """The winch without its load path."""

    alpha_s: float  # setting of the secondary units, hoisting positive [-]
    alpha_s_dot: float  # its rate [1/s]
    alpha_rp: float  # setting of the rail's pumps, into the rail positive [-]
    alpha_rp_dot: float  # its rate [1/s]
    V_o: float  # oil in the accumulator [m^3]
    T_I: float  # integral part of the speed control [N m]
    omega_m: float  # motor speed, hoisting positive [rad/s]
    z: float  # bristle, half a step ahead [rad]


class Command(NamedTuple):
    """Held between PLC cycles: omega_ref set-point of the speed [rad/s]; T_ahead torque fed forward [N m]; u_rp pumps
    of the rail [-]; f_pump share of them that runs; brake how far the holding brake is closed [-]."""

    omega_ref: float
    T_ahead: float
    u_rp: float
    f_pump: float
    brake: float


class Circuit(NamedTuple):
    """Everything that the diagram shows at an instant; settings [-], displacement [m^3/rad], flows [m^3/s], pressures
    [Pa], torques at the motor shaft [N m]. g level of dry friction, with that of the brake where it is held (above
    0.5)."""

    alpha_s: float
    alpha_rp: float
    D_s: float
    Q_rp: float
    Q_lp: float
    Q_lp_ext: float
    Q_relief: float
    Q_o: float
    p_o: float
    p_r: float
    T_P: float
    T_ref: float
    T_most: float
    u_s: float
    g: float
    held: float
    T_moving: float


class Limits(NamedTuple):
    """1 where a limit is passed at an instant, else 0."""

    torque: Annotated[float, Cause("torque", "time with more torque demanded than the units give at their stop")]
    rail: Annotated[float, Cause("rail pressure", "time with the rail below its lowest pressure", symbol="t_rail")]
    relief: Annotated[float, Cause("relief", "time with the rail's relief valve open", symbol="t_relief")]
    stroke: Annotated[float, Cause("accumulator", "time with the accumulator piston at an end", symbol="t_stroke")]
    overspeed: Annotated[float, Cause("overspeed", "time with the units above their speed limit", symbol="t_over")]
    cavitation: CavitationLimit
    power: PowerLimit
    brake: Annotated[float, Cause("brake", "time with the closed holding brake slipping", symbol="t_brake")]


class Powers(NamedTuple):
    """Powers [W]: that of the pumps goes in, and that of the boost, which replaces in the low side what leaves the
    circuit; the rest goes out. gas: into the accumulator, and back."""

    pump: float
    boost: float
    friction: float
    leakage: float
    relief: float
    piston: float
    gas: float


SUPPLIED = ("pump", "boost")


@scalar
def geometry(s_w, p):
    """The drum during one PLC cycle, with s_w of wire out [m]."""
    return drum_geometry(s_w, p.hoist)


@scalar
def wire_speed(x, geo):
    """Wire speed that the winch gives, hoisting positive [m/s]."""
    return x.omega_m * geo.r_eff


@scalar
def dry_level(T_d, alpha_s, dp, omega_m, p):
    """Level of the dry friction of all units and of the transmission at the motor shaft [N m]; T_d drum torque."""
    m, h = p.rail.motors, p.hoist
    units = m.count * torque_loss_dry(abs(alpha_s) * m.D_max, dp, m.fit)
    return units + h.n_motors * system_friction_dry(omega_m, T_d, h.friction)


@scalar
def moving_loss(omega_m, alpha_s, p):
    """Viscous and turbulent losses of all units and of the transmission, against the motion [N m]."""
    m, h = p.rail.motors, p.hoist
    units = m.count * torque_loss_moving(omega_m, abs(alpha_s) * m.D_max, m.fit)
    return copysign(units + h.n_motors * h.friction.Y_5 * abs(omega_m), omega_m)


@scalar
def circuit(x, q, u, geo, p):
    """The whole winch at an instant, read along its diagram: rail, speed control, friction. q point of the load
    path."""
    R, d = p.rail, p.drive
    p_lp = R.settings.p_lp
    alpha_s = displacement(x.alpha_s, R.motor_servo)
    alpha_rp = displacement(x.alpha_rp, R.pump_servo)
    D = R.settings.D_m_max
    D_s = D * alpha_s
    p_o = accumulator_pressure(x.V_o, R.accumulator)
    C_leak = u.f_pump * pump_leakage(alpha_rp, R.pumps.leak) + motor_leakage(x.omega_m, R.motors)
    Q_rp = u.f_pump * pump_flow(alpha_rp, R.pumps)
    Q_lp = internal_leakage(C_leak, p_o - p_lp) + R.accumulator.C_leak * (p_o - p_lp)
    Q_lp = Q_lp - vapour_drawn(D_s * x.omega_m, accumulator_vapour(x.V_o, R.accumulator), 0.0)
    Q_lp_ext = external_leakage(C_leak, p_o)
    Q_relief = relief_flow(p_o, R.relief)
    Q_o = Q_rp - D_s * x.omega_m - Q_lp - Q_lp_ext - Q_relief
    p_r = port_pressure(p_o, Q_o, R.accumulator)

    dp = fmax(p_r - p_lp, R.settings.dp_least)
    T_P = speed_torque(u.omega_ref, x.omega_m, 1.0 / geo.i_J, d.K) * (1.0 - u.brake)
    T_ref = u.T_ahead + T_P + x.T_I
    u_s = guarded_setting(setting_for_torque(T_ref, D, dp), x.omega_m, d.n_full, R.n_full)
    g = dry_level(q.F_w * 0.5 * geo.d, alpha_s, p_r - p_lp, x.omega_m, p) + u.brake * p.hoist.T_brake
    return Circuit(
        alpha_s=alpha_s,
        alpha_rp=alpha_rp,
        D_s=D_s,
        Q_rp=Q_rp,
        Q_lp=Q_lp,
        Q_lp_ext=Q_lp_ext,
        Q_relief=Q_relief,
        Q_o=Q_o,
        p_o=p_o,
        p_r=p_r,
        T_P=T_P,
        T_ref=T_ref,
        T_most=D * dp,
        u_s=u_s,
        g=g,
        held=u.brake,
        T_moving=moving_loss(x.omega_m, alpha_s, p),
    )


@scalar
def friction(c, x, p):
    """Friction torque at the motor shaft, against hoisting positive [N m]."""
    return c.T_moving + dry_torque(x.omega_m, x.z, c.g, c.held, p.hoist.bristle)


@scalar
def rates(c, x, q, u, geo, p):
    """Time derivatives of the state; the bristle z is advanced by `bristle_after` and stands still here."""
    R = p.rail
    T = motor_torque(c.D_s, c.p_r - R.settings.p_lp) - q.F_w * geo.r_eff - friction(c, x, p)
    return State(
        alpha_s=swash_rate(x.alpha_s, x.alpha_s_dot, R.motor_servo),
        alpha_s_dot=swash_acceleration(x.alpha_s, x.alpha_s_dot, c.u_s, R.motor_servo),
        alpha_rp=swash_rate(x.alpha_rp, x.alpha_rp_dot, R.pump_servo),
        alpha_rp_dot=swash_acceleration(x.alpha_rp, x.alpha_rp_dot, u.u_rp, R.pump_servo),
        V_o=c.Q_o,
        T_I=integral_rate(c.T_P, c.T_ref, c.T_most, x.T_I, p.drive.T_i, u.brake),
        omega_m=T * geo.i_J,
        z=0.0,
    )


@scalar
def bristle_after(c, x, p, tau):
    """The bristle's deflection tau [s] later, at the present speed and friction level [rad]."""
    return bristle_update(x.omega_m, x.z, c.g, c.held, tau, p.hoist.bristle)


@scalar
def start(s_w, tick, p):
    """State before the PLC's first cycle: the accumulator at mid stroke; s_w wire out [m]."""
    V_o = 0.5 * p.rail.accumulator.V_stroke
    return State(alpha_s=0.0, alpha_s_dot=0.0, alpha_rp=0.0, alpha_rp_dot=0.0, V_o=V_o, T_I=0.0, omega_m=0.0, z=0.0)


@scalar
def settle(x, q, u, tick, geo, p):
    """The state at rest under the PLC's first commands: the units hold the load; x that of `start`."""
    R = p.rail
    dp = accumulator_pressure(x.V_o, R.accumulator) - R.settings.p_lp
    alpha_s = displacement(setting_for_torque(q.F_w * geo.r_eff, R.settings.D_m_max, dp), R.motor_servo)
    return State(
        alpha_s=alpha_s, alpha_s_dot=0.0, alpha_rp=0.0, alpha_rp_dot=0.0, V_o=x.V_o, T_I=0.0, omega_m=0.0, z=0.0
    )


@scalar
def sense(x, y, q, m, tick, geo, p):
    """What the PLC reads. dp pressure that would give the units' torque at full displacement, dp_load that for the load
    [Pa]: their difference says whether the units carry it, before the brake opens. Lost pumps do not slow the units,
    so f_pump is 1."""
    R = p.rail
    F = quantise(q.F_w + tick.n_F, p.sensors.q_F)
    p_o = accumulator_pressure(x.V_o, R.accumulator)
    return Sensed(
        s_tip=tick.s_m,
        v_tip=tick.v_m,
        a_tip=tick.a_m,
        v_op=tick.v_op,
        s_op=tick.s_op,
        mode=tick.mode,
        f_pump=1.0,
        s_w=quantise(y.s_w + tick.n_s, p.sensors.q_s),
        F=F,
        alpha_m=1.0,
        K_wire=K_wire(geo.d, p.hoist.drum),
        dp=displacement(x.alpha_s, R.motor_servo) * (p_o - R.settings.p_lp),
        dp_load=F * geo.r_eff / R.settings.D_m_max,
        p_hp=p_o,
    )


@scalar
def torque_ahead(omega_ref, u_p, r, x, m, brake, tick, geo, p):
    """Torque that the drive is told ahead [N m]: load, friction, and the shaft's acceleration while the tip is
    compensated and the speed is not at its limit; m memory after the cycle."""
    R, d = p.rail, p.drive
    F = load_ahead(m.F, r.F, d.most)
    T_f = dry_level(F * 0.5 * geo.d, x.alpha_s, r.p_hp - R.settings.p_lp, omega_ref, p)
    T_f = T_f + abs(moving_loss(omega_ref, x.alpha_s, p))
    follows = 1.0 if m.mode > MANUAL and abs(u_p) < 1.0 else 0.0
    accelerates = -follows * tick.a_m / (geo.r_eff * geo.i_J)
    return F * geo.r_eff + (1.0 - brake) * (friction_ahead(omega_ref, T_f, d.share, d.i_omega) + accelerates)


@scalar
def actuate(drive, r, x, m_0, m, tick, geo, p):
    """Commands of the plant, the PLC's memory, signals of the drive: the speed's set-point and what is told ahead; the
    pumps replace what the mean pressure lacks, and the oil that the operator's own motion takes, within the power
    that the units give and take."""
    R, power, f = p.rail, p.plc.power, tick.f_known
    drive = apply_override(drive, tick)
    omega_ref = drive.u_p * p.drive.n_full
    T_ahead = torque_ahead(omega_ref, drive.u_p, r, x, m, drive.brake, tick, geo, p)
    demand = make_up(m.p_mean, displacement(x.alpha_s, R.motor_servo), tick.v_op / geo.r_eff, R.settings)
    dp = r.p_hp - R.settings.p_lp
    given = within_power(demand, dp, f * power.Q_pp, f * power.P_max)
    u_rp = -within_power(-given, dp, f * power.Q_pp, f * p.P_back)
    return Command(omega_ref, T_ahead, u_rp, tick.f_pump, drive.brake), hold(m, 1.0), drive


@scalar
def power_units(c, p):
    """Hydraulic power that the power units give to the rail, negative: take back [W]."""
    return c.Q_rp * (c.p_r - p.rail.settings.p_lp)


@scalar
def signals(c, x, q, u, geo, p):
    """Its own signals at an instant."""
    return Signals(
        alpha_s=c.alpha_s,
        omega_m=x.omega_m,
        omega_ref=u.omega_ref,
        T_s=motor_torque(c.D_s, c.p_r - p.rail.settings.p_lp),
        T_f=friction(c, x, p),
        p_r=c.p_r,
        V_void=accumulator_void(x.V_o, p.rail.accumulator),
        V_acc=x.V_o,
        alpha_rp=c.alpha_rp,
        f_pump=u.f_pump,
        P_hpu=power_units(c, p),
    )


@scalar
def limits(c, x, q, u, p):
    """Which limits are passed now; see `Limits`. A brake that has closed may find the winch at the speed that counts as
    standing; beyond it it slips."""
    return Limits(
        torque=1.0 if abs(c.T_ref) >= c.T_most else 0.0,
        rail=1.0 if c.p_r < p.p_min else 0.0,
        relief=relieves(c.Q_relief),
        stroke=1.0 if x.V_o <= 0.0 or x.V_o >= p.rail.accumulator.V_stroke else 0.0,
        overspeed=1.0 if abs(x.omega_m) > p.rail.n_full else 0.0,
        cavitation=cavitates(c.p_r, c.p_r),
        power=out_of_power(power_units(c, p), u.f_pump, p.plc, p),
        brake=1.0 if u.brake >= 1.0 and abs(x.omega_m) > SMALL * p.drive.n_full else 0.0,
    )


@scalar
def powers(c, x, q, p):
    """Where the power comes from and where it goes [W]; see `Powers`."""
    p_lp = p.rail.settings.p_lp
    dp = c.p_r - p_lp
    return Powers(
        pump=c.Q_rp * dp,
        boost=p_lp * (c.Q_lp_ext + c.Q_relief),
        friction=friction(c, x, p) * x.omega_m,
        leakage=c.Q_lp * dp + c.Q_lp_ext * c.p_r,
        relief=c.Q_relief * c.p_r,
        piston=c.Q_o * (c.p_r - c.p_o),
        gas=c.Q_o * (c.p_o - p_lp),
    )


@scalar
def stored_energy(c, x, geo, p):
    """Energy stored in the shaft [J]; the accumulator's is counted as power."""
    return 0.5 * x.omega_m * x.omega_m / geo.i_J


def pack(crane: Any, case: Any, parts: Parts) -> Params:
    """Parameters of a run."""
    rail, hpu = crane.secondary, crane.hpu
    return Params(
        rail=rail_record(rail, crane.control.K_acc, case.gas_held, parts),
        drive=drive_record(rail.drive),
        p_min=rail.p_min,
        P_back=NO_LIMIT if hpu is None else hpu.P_back,
        hoist=parts.hoist,
        plc=parts.plc,
        sensors=parts.sensors,
    )


def motors(crane: Any) -> tuple[Any, ...]:
    """Sets of motors on the shaft."""
    return (crane.secondary.unit,)


def pump_units(crane: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Size of the pumps of each power unit; there are no passive ones."""
    return crane.secondary.pump.D, ()


def pump_flows(crane: Any) -> tuple[float, float]:
    """Full flow of the pumps that move the drum, of which there are none, and of the rail's [m^3/s]."""
    return 0.0, crane.secondary.pump.Q_max


def pump_speed(crane: Any) -> float:
    """Speed of the pumps [rad/s]."""
    return float(crane.secondary.pump.omega_p)


def full_speed(crane: Any, alpha_m: float) -> float:
    """Motor speed at full command [rad/s], whatever setting."""
    return float(crane.secondary.drive.n_full)


def lag(crane: Any) -> float:
    """Time by which the set-point of the speed is late [s]: the PLC's computing, and half of the cycle for which it is
    held. The drive itself, told the acceleration ahead, follows a ramp without lag."""
    return float(crane.control.computing + 0.5 * crane.control.t_cycle)


def stiffness(p: Params) -> Stiffness:
    """Fast modes of the winch."""
    of_rail = passive_stiffness(p.rail, shaft_inertia_without_wire(p.hoist))
    rates = {
        name.replace("passive motor", "secondary unit").replace("passive ", ""): i for name, i in of_rail.rates.items()
    }
    rates |= {"speed control": p.drive.K, "integral of the speed control": 1.0 / p.drive.T_i}
    return of_rail._replace(rates=rates)


def steady_torque(p: Params, geo: Geometry, F_w: float, omega_m: float) -> float:
    """Torque of all units at a steady speed [N m], hoisting positive; F_w tension at the top [N]."""
    R, T_w = p.rail, F_w * geo.r_eff
    dp = R.settings.p_set - R.settings.p_lp
    alpha = setting_for_torque(T_w, R.settings.D_m_max, dp)
    T_f = dry_level(F_w * 0.5 * geo.d, alpha, dp, omega_m, p) + abs(moving_loss(omega_m, alpha, p))
    return float(T_w + copysign(T_f, omega_m))


def steady_flow(p: Params, T: float, omega_m: float) -> float:
    """Flow that the rail's pumps must give at a steady speed and mid stroke [m^3/s]; negative: take."""
    R = p.rail
    dp = R.settings.p_set - R.settings.p_lp
    C_leak = pump_leakage(1.0, R.pumps.leak) + motor_leakage(omega_m, R.motors)
    leaks = internal_leakage(C_leak, dp) + R.accumulator.C_leak * dp + external_leakage(C_leak, R.settings.p_set)
    return float(T * omega_m / dp + leaks)


def speed_limit(p: Params, geo: Geometry, F_w: float, lowering: bool = False) -> tuple[float, str]:
    """Highest steady motor speed with the tension F_w at the top [rad/s], and the limit that ends it: torque of the
    units, power of the power units (lowering: what they take back), flow of the pumps (the accumulator then runs to an
    end), or the speed at full command."""
    R, way = p.rail, -1.0 if lowering else 1.0
    dp = R.settings.p_set - R.settings.p_lp
    P = p.P_back if lowering else p.plc.power.P_max
    Q, cause = (P / dp, "power") if P < R.settings.Q_p_max * dp else (R.settings.Q_p_max, "stroke")

    def possible(omega: float) -> bool:
        return way * steady_flow(p, steady_torque(p, geo, F_w, way * omega), way * omega) <= Q

    if steady_torque(p, geo, F_w, way * MOVES) > R.settings.D_m_max * dp:
        return 0.0, "torque"
    if possible(p.drive.n_full):
        return p.drive.n_full, "overspeed"
    low, high = 0.0, p.drive.n_full
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if possible(middle) else (low, middle)
    return low, cause
