"""Secondary control: over-centre units on a rail of nearly constant pressure turn the drum, and an accumulator keeps
the energy (Moslatt 2020 section 1.2.2, figures 1.10 and 1.12; paper E section 1)."""

from collections.abc import Callable
from typing import Annotated, Any, NamedTuple

from stillhook.control.commands import SMALL, make_up, within_power
from stillhook.control.interface import Sensed
from stillhook.control.plant import Hydraulics
from stillhook.control.plc import MANUAL, Plc, hold
from stillhook.physics.hydraulics.accumulator import accumulator_pressure, accumulator_void
from stillhook.physics.hydraulics.lines import external_leakage, internal_leakage
from stillhook.physics.hydraulics.motor import motor_leakage, motor_torque
from stillhook.physics.hydraulics.motor_laws import motors_dry, motors_moving
from stillhook.physics.hydraulics.pump import pump_leakage
from stillhook.physics.hydraulics.secondary import (
    friction_ahead,
    guarded_setting,
    integral_rate,
    load_ahead,
    setting_for_torque,
    speed_torque,
)
from stillhook.physics.hydraulics.swash import displacement, swash_acceleration, swash_rate
from stillhook.physics.records import replace, zeros_but
from stillhook.physics.scalar import copysign, fmax, scalar
from stillhook.winches import shaft
from stillhook.winches.circuits import rows
from stillhook.winches.circuits.active import cavitates, out_of_power, relieves
from stillhook.winches.circuits.passive import (
    PassiveCircuit,
    PassiveFlows,
    at_an_end,
    passive_flows,
    passive_stiffness,
)
from stillhook.winches.circuits.rail import (
    BLANK,
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
from stillhook.winches.circuits.tables import power_back
from stillhook.winches.interface import Cause, Parts, Stiffness
from stillhook.winches.load_path import load
from stillhook.winches.load_path.load import Hoist, shaft_inertia_without_wire
from stillhook.winches.records import Geometry, Sensors, apply_override
from stillhook.winches.shaft import bristle_after, friction, geometry, wire_speed

NAME = "secondary"
TITLE = "secondary controlled winch: over-centre units on a rail with accumulators turn the drum"
PATH = load
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
SERVOS = {"u_rp": ("secondary.pump.servo", "rail.pump_servo")}


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
    """Everything that the diagram shows at an instant; o flows of the rail; settings [-], displacement [m^3/rad],
    torques at the motor shaft [N m]. g level of dry friction, with that of the brake where it is held (above 0.5)."""

    o: PassiveFlows
    alpha_s: float
    alpha_rp: float
    D_s: float
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
    cavitation: rows.CavitationLimit
    power: rows.PowerLimit
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
def dry_level(T_d, alpha_s, dp, omega_m, p):
    """Level of the dry friction of all units and of the transmission at the motor shaft [N m]; T_d drum torque."""
    return shaft.dry_level(motors_dry(omega_m, abs(alpha_s), dp, p.rail.motors), omega_m, T_d, p.hoist)


@scalar
def moving_loss(alpha_s, dp, omega_m, p):
    """Viscous and turbulent losses of all units and of the transmission, against the motion [N m]."""
    return shaft.moving_loss(motors_moving(omega_m, abs(alpha_s), dp, p.rail.motors), omega_m, p.hoist)


@scalar
def circuit(x, q, u, geo, p):
    """The whole winch at an instant, read along its diagram: rail, speed control, friction. q point of the load
    path."""
    alpha_s = displacement(x.alpha_s, p.rail.motor_servo)
    return circuit_of(x, q, u, geo, alpha_s, abs(alpha_s), p.rail, p)


@scalar
def circuit_of(x, q, u, geo, alpha_s, swept, R, p):
    """The winch at an instant with units at alpha_s, whose pistons sweep a share of their full stroke [-]; R rail with
    the leak and the friction of the units as they are now."""
    d = p.drive
    alpha_rp = displacement(x.alpha_rp, R.pump_servo)
    D = R.settings.D_m_max
    D_s = D * alpha_s
    o = passive_flows(alpha_rp, D_s, x.omega_m, x.V_o, u.f_pump, R)
    over = o.p_hp - R.settings.p_lp
    dp = fmax(over, R.settings.dp_least)
    T_P = speed_torque(u.omega_ref, x.omega_m, 1.0 / geo.i_J, d.K) * (1.0 - u.brake)
    T_ref = u.T_ahead + T_P + x.T_I
    u_s = guarded_setting(setting_for_torque(T_ref, D, dp), x.omega_m, d.n_full, R.n_full)
    dry = motors_dry(x.omega_m, abs(alpha_s), over, R.motors)
    g = shaft.dry_level(dry, x.omega_m, q.F_w * 0.5 * geo.d, p.hoist) + u.brake * p.hoist.T_brake
    return Circuit(
        o=o,
        alpha_s=alpha_s,
        alpha_rp=alpha_rp,
        D_s=D_s,
        T_P=T_P,
        T_ref=T_ref,
        T_most=D * dp,
        u_s=u_s,
        g=g,
        held=u.brake,
        T_moving=shaft.moving_loss(motors_moving(x.omega_m, swept, over, R.motors), x.omega_m, p.hoist),
    )


@scalar
def rates(c, x, q, u, geo, p):
    """Time derivatives of the state; the bristle z is advanced by `bristle_after` and stands still here."""
    R = p.rail
    T = motor_torque(c.D_s, c.o.p_hp - R.settings.p_lp) - q.F_w * geo.r_eff - friction(c, x, p)
    return State(
        alpha_s=swash_rate(x.alpha_s, x.alpha_s_dot, R.motor_servo),
        alpha_s_dot=swash_acceleration(x.alpha_s, x.alpha_s_dot, c.u_s, R.motor_servo),
        alpha_rp=swash_rate(x.alpha_rp, x.alpha_rp_dot, R.pump_servo),
        alpha_rp_dot=swash_acceleration(x.alpha_rp, x.alpha_rp_dot, u.u_rp, R.pump_servo),
        V_o=c.o.Q_o,
        T_I=integral_rate(c.T_P, c.T_ref, c.T_most, x.T_I, p.drive.T_i, u.brake),
        omega_m=T * geo.i_J,
        z=0.0,
    )


still = zeros_but(State, "alpha_s", "V_o")


@scalar
def start(s_w, tick, p):
    """State before the PLC's first cycle: the accumulator at mid stroke; s_w wire out [m]."""
    return still(0.0, 0.5 * p.rail.accumulator.V_stroke)


@scalar
def settle(x, q, u, tick, geo, p):
    """The state at rest under the PLC's first commands: the units hold the load; x that of `start`."""
    R = p.rail
    dp = accumulator_pressure(x.V_o, R.accumulator) - R.settings.p_lp
    return still(displacement(setting_for_torque(q.F_w * geo.r_eff, R.settings.D_m_max, dp), R.motor_servo), x.V_o)


with_pressures = replace(Sensed, "f_pump", "dp", "dp_load", "p_hp")


@scalar
def sense(x, y, q, m, tick, geo, p):
    """What the PLC reads. dp pressure that would give the units' torque at full displacement, dp_load that for the load
    [Pa]: their difference says whether the units carry it, before the brake opens. Lost pumps do not slow the units,
    so f_pump is 1. There are no lines A and B: p_a and p_b are 0, the rail is p_hp."""
    R, r = p.rail, shaft.sense(x, y, q, m, tick, geo, p)
    p_o = accumulator_pressure(x.V_o, R.accumulator)
    dp = displacement(x.alpha_s, R.motor_servo) * (p_o - R.settings.p_lp)
    return with_pressures(r, 1.0, dp, r.F * geo.r_eff / R.settings.D_m_max, p_o)


@scalar
def torque_ahead(omega_ref, u_p, r, x, m, brake, tick, geo, p):
    """Torque that is fed forward to the drive [N m]: load, friction, and the shaft's acceleration while the tip is
    compensated and the speed is not at its limit; m memory after the cycle."""
    F, dp = load_ahead(m.F, r.F, p.drive.most), r.p_hp - p.rail.settings.p_lp
    T_f = dry_level(F * 0.5 * geo.d, x.alpha_s, dp, omega_ref, p)
    T_f = T_f + abs(moving_loss(x.alpha_s, dp, omega_ref, p))
    return torque_ahead_of(F, T_f, omega_ref, u_p, m, brake, tick, geo, p)


@scalar
def torque_ahead_of(F, T_f, omega_ref, u_p, m, brake, tick, geo, p):
    """Torque that is fed forward with a load F [N] and a friction T_f of the winch [N m]."""
    d = p.drive
    follows = 1.0 if m.mode > MANUAL and abs(u_p) < 1.0 else 0.0
    accelerates = -follows * tick.a_m / (geo.r_eff * geo.i_J)
    return F * geo.r_eff + (1.0 - brake) * (friction_ahead(omega_ref, T_f, d.share, d.i_omega) + accelerates)


@scalar
def actuate(drive, r, x, m_0, m, tick, geo, p):
    """Commands of the plant, the PLC's memory, signals of the drive: the speed's set-point and its feedforward; the
    pumps replace what the mean pressure lacks, and the oil that the operator's own motion takes, within the power
    that the units give and take."""
    drive = apply_override(drive, tick)
    omega_ref = drive.u_p * p.drive.n_full
    T_ahead = torque_ahead(omega_ref, drive.u_p, r, x, m, drive.brake, tick, geo, p)
    return commands(drive, omega_ref, T_ahead, r, x, m, tick, geo, p)


@scalar
def commands(drive, omega_ref, T_ahead, r, x, m, tick, geo, p):
    """Commands of the plant with a set-point of the speed [rad/s] and a torque fed forward [N m]; see `actuate`."""
    R, power, f = p.rail, p.plc.power, tick.f_known
    demand = make_up(m.p_mean, displacement(x.alpha_s, R.motor_servo), tick.v_op / geo.r_eff, R.settings)
    dp = r.p_hp - R.settings.p_lp
    u_supplied = within_power(demand, dp, f * power.Q_pp, f * power.P_max)
    u_rp = -within_power(-u_supplied, dp, f * power.Q_pp, f * p.P_back)
    return Command(omega_ref, T_ahead, u_rp, tick.f_pump, drive.brake), hold(m, 1.0), drive


@scalar
def power_units(c, p):
    """Hydraulic power that the power units give to the rail, negative: take back [W]."""
    return c.o.Q_p * (c.o.p_hp - p.rail.settings.p_lp)


@scalar
def signals(c, x, q, u, geo, p):
    """Its own signals at an instant."""
    return Signals(
        alpha_s=c.alpha_s,
        omega_m=x.omega_m,
        omega_ref=u.omega_ref,
        T_s=motor_torque(c.D_s, c.o.p_hp - p.rail.settings.p_lp),
        T_f=friction(c, x, p),
        p_r=c.o.p_hp,
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
        rail=1.0 if c.o.p_hp < p.p_min else 0.0,
        relief=relieves(c.o.Q_relief),
        stroke=at_an_end(x.V_o, p.rail.accumulator),
        overspeed=1.0 if abs(x.omega_m) > p.rail.n_full else 0.0,
        cavitation=cavitates(c.o.p_hp, c.o.p_hp),
        power=out_of_power(power_units(c, p), u.f_pump, p.plc, p),
        brake=1.0 if u.brake >= 1.0 and abs(x.omega_m) > SMALL * p.drive.n_full else 0.0,
    )


@scalar
def powers(c, x, q, p):
    """Where the power comes from and where it goes [W]; see `Powers`."""
    p_lp = p.rail.settings.p_lp
    dp = c.o.p_hp - p_lp
    return Powers(
        pump=c.o.Q_p * dp,
        boost=p_lp * (c.o.Q_ext + c.o.Q_relief),
        friction=friction(c, x, p) * x.omega_m,
        leakage=c.o.Q_lp * dp + c.o.Q_ext * c.o.p_hp,
        relief=c.o.Q_relief * c.o.p_hp,
        piston=c.o.Q_o * (c.o.p_hp - c.o.p_o),
        gas=c.o.Q_o * (c.o.p_o - p_lp),
    )


@scalar
def stored_energy(c, x, geo, p):
    """Energy stored in the shaft [J]; the accumulator's is counted as power."""
    return shaft.energy(x, geo)


def pack(crane: Any, case: Any, parts: Parts) -> Params:
    """Parameters of a run."""
    rail = crane.secondary
    return Params(
        rail=rail_record(rail, crane.control.K_acc, case.gas_held, parts),
        drive=drive_record(rail.drive),
        p_min=rail.p_min,
        P_back=power_back(crane),
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


def hydraulics(crane: Any) -> Hydraulics:
    """What controllers may know: the units turn the drum, the pumps feed the rail, lines A and B there are none."""
    return Hydraulics(D_m=crane.secondary.unit.D_total, Q_pp=crane.secondary.pump.Q_max)


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


def stiffness(p: Any) -> Stiffness:
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
    T_f = dry_level(F_w * 0.5 * geo.d, alpha, dp, omega_m, p) + abs(moving_loss(alpha, dp, omega_m, p))
    return float(T_w + copysign(T_f, omega_m))


def steady_flow(p: Any, T: float, omega_m: float) -> float:
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
    return speed_limit_of(steady_torque, steady_flow, p, geo, F_w, lowering)


def speed_limit_of(
    torque: Callable[..., float], flow: Callable[..., float], p: Any, geo: Geometry, F_w: float, lowering: bool
) -> tuple[float, str]:
    """`speed_limit` with the torque of all units and the flow of the rail's pumps at a steady speed, see
    `steady_torque` and `steady_flow`."""
    R, way = p.rail, -1.0 if lowering else 1.0
    dp = R.settings.p_set - R.settings.p_lp
    P = p.P_back if lowering else p.plc.power.P_max
    Q, cause = (P / dp, "power") if P < R.settings.Q_p_max * dp else (R.settings.Q_p_max, "stroke")

    def possible(omega: float) -> bool:
        return way * flow(p, torque(p, geo, F_w, way * omega), way * omega) <= Q

    if torque(p, geo, F_w, way * MOVES) > R.settings.D_m_max * dp:
        return 0.0, "torque"
    if possible(p.drive.n_full):
        return p.drive.n_full, "overspeed"
    low, high = 0.0, p.drive.n_full
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if possible(middle) else (low, middle)
    return low, cause
