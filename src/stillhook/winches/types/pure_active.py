"""Pure active winch: one closed circuit moves the drum and carries the weight (thesis sections 2.1 and 2.3)."""

from typing import Any, NamedTuple

from stillhook.control.plc import Plc, hold
from stillhook.physics.friction import dry_torque
from stillhook.physics.hydraulics.lines import line_pressure
from stillhook.physics.hydraulics.motor import motor_torque
from stillhook.physics.hydraulics.motor_laws import motors_dry, motors_moving
from stillhook.physics.hydraulics.swash import displacement, pilot, swash_acceleration, swash_rate
from stillhook.physics.records import zeros_but
from stillhook.physics.scalar import scalar
from stillhook.units import show
from stillhook.winches import shaft
from stillhook.winches.circuits import active, rows
from stillhook.winches.circuits.active import (
    BLANK,
    Extremes,
    Signals,
    fold_extremes,
    full_speed,
    lag,
    least_displacement,
)
from stillhook.winches.interface import Parts, Stiffness
from stillhook.winches.load_path import load
from stillhook.winches.load_path.load import Hoist, shaft_inertia_without_wire
from stillhook.winches.records import Geometry, Sensors, apply_override
from stillhook.winches.shaft import bristle_after, geometry, wire_speed

NAME = "pure-active"
TITLE = "pure active winch: one closed circuit moves the drum and carries the weight"
PATH = load
SHOWN = {"p_max": "peak\npressure", "alpha_m_min": "least\nmotor", "relief_time": "relief\nopen"}
TABLES = ("active",)
SERVOS = active.SERVOS


class Params(NamedTuple):
    active: active.ActiveCircuit
    hoist: Hoist
    plc: Plc
    sensors: Sensors


class State(NamedTuple):
    """The winch without its load path."""

    alpha_p: float  # setting of the pumps [-]
    alpha_p_dot: float  # its rate [1/s]
    alpha_m: float  # setting of the motors [-]
    alpha_m_dot: float  # its rate [1/s]
    p_a: float  # linear pressure of line A, hoisting [Pa], see `stillhook.physics.hydraulics.lines`
    p_b: float  # that of line B, lowering [Pa]
    omega_m: float  # motor speed, hoisting positive [rad/s]
    z: float  # bristle, half a step ahead [rad]


class Command(NamedTuple):
    """Held between PLC cycles: u_p pumps, u_m motors [-]; f_pump share of the pumps that run; brake how far the holding
    brake is closed."""

    u_p: float
    u_m: float
    f_pump: float
    brake: float


class Circuit(NamedTuple):
    """Everything that the diagram shows at an instant; flows [m^3/s], pressures [Pa], vapour in both lines [m^3],
    torques at the motor shaft [N m]. g level of dry friction, with that of the brake where it is held (above 0.5)."""

    f: active.ActiveFlows
    ports: active.Ports
    p_a: float
    p_b: float
    V_void: float
    alpha_p: float
    alpha_m: float
    D_m: float
    g: float
    held: float
    T_moving: float


class Limits(NamedTuple):
    """1 where a limit is passed at an instant, else 0."""

    relief: rows.ReliefLimit
    overspeed: rows.OverspeedLimit
    cavitation: rows.CavitationLimit
    power: rows.PowerLimit
    boost: rows.BoostLimit


class Powers(NamedTuple):
    """Powers [W]: pumps and boost go in, the rest goes out."""

    pump: float
    boost: float
    friction: float
    leakage: float
    relief: float
    flushing: float


SUPPLIED = ("pump", "boost")


@scalar
def circuit(x, q, u, geo, p):
    """The whole winch at an instant, read along its diagram: active circuit, friction. q point of the load path."""
    A, h = p.active, p.hoist
    alpha_p = displacement(x.alpha_p, A.pump_servo)
    alpha_m = displacement(x.alpha_m, A.motor_servo)
    D_m = A.motors.count * A.motors.D_max * alpha_m
    p_a, p_b = line_pressure(x.p_a), line_pressure(x.p_b)
    f = active.active_flows(alpha_p, D_m, x.omega_m, x.p_a, x.p_b, u.f_pump, A)
    ports = active.port_pressures(f, p_a, p_b, A)
    dp = ports.p_a_motor - ports.p_b_motor
    g = shaft.dry_level(motors_dry(x.omega_m, alpha_m, dp, A.motors), x.omega_m, q.F_w * 0.5 * geo.d, h)
    return Circuit(
        f=f,
        ports=ports,
        p_a=p_a,
        p_b=p_b,
        V_void=active.line_voids(x, A.i_C_h),
        alpha_p=alpha_p,
        alpha_m=alpha_m,
        D_m=D_m,
        g=g + u.brake * h.T_brake,
        held=u.brake,
        T_moving=shaft.moving_loss(motors_moving(x.omega_m, alpha_m, p_a - p_b, A.motors), x.omega_m, h),
    )


@scalar
def rates(c, x, q, u, geo, p):
    """Time derivatives of the state; the bristle z is advanced by `bristle_after` and stands still here."""
    A = p.active
    T = (
        motor_torque(c.D_m, c.ports.p_a_motor - c.ports.p_b_motor)
        - q.F_w * geo.r_eff
        - c.T_moving
        - dry_torque(x.omega_m, x.z, c.g, c.held, p.hoist.bristle)
    )
    return State(
        alpha_p=swash_rate(x.alpha_p, x.alpha_p_dot, A.pump_servo),
        alpha_p_dot=swash_acceleration(x.alpha_p, x.alpha_p_dot, u.u_p, A.pump_servo),
        alpha_m=swash_rate(x.alpha_m, x.alpha_m_dot, A.motor_servo),
        alpha_m_dot=swash_acceleration(x.alpha_m, x.alpha_m_dot, u.u_m, A.motor_servo),
        p_a=c.f.Q_a * A.i_C_h,
        p_b=c.f.Q_b * A.i_C_h,
        omega_m=T * geo.i_J,
        z=0.0,
    )


still = zeros_but(State, "alpha_m", "p_a", "p_b")


@scalar
def start(s_w, tick, p):
    """State before the PLC's first cycle: the load hangs still; s_w wire out [m]."""
    return still(1.0, p.active.boost.p, p.active.boost.p)


@scalar
def settle(x, q, u, tick, geo, p):
    """The state at rest under the PLC's first commands: line A holds the load at the displacement that it wants."""
    A = p.active
    p_a = A.boost.p + q.F_w * geo.r_eff / (A.motors.count * A.motors.D_max * u.u_m)
    return still(u.u_m, p_a, x.p_b)


@scalar
def sense(x, y, q, m, tick, geo, p):
    """What the PLC reads; y state and q point of the load path."""
    return active.readings(x, y, q, m, tick, geo, 0.0, 0.0, p)


@scalar
def actuate(drive, r, x, m_0, m, tick, geo, p):
    """Plant commands, the PLC's memory and the active drive's signals; r what was read, m_0 memory before the cycle."""
    drive = apply_override(drive, tick)
    u_m, held = pilot(drive.u_m, m.held, p.active.control)
    return Command(drive.u_p, u_m, tick.f_pump, drive.brake), hold(m, held), drive


@scalar
def power_units(c, x, p):
    """Hydraulic power that the power units give to the pumps, negative: take back [W]."""
    return c.f.Q_p * (c.ports.p_a_pump - c.ports.p_b_pump)


@scalar
def signals(c, x, q, u, geo, p):
    """Its own signals at an instant."""
    return active.signals_of(c, x, u, power_units(c, x, p), p)


@scalar
def powers(c, x, q, p):
    """Where the power comes from and where it goes [W]; see `Powers`."""
    f, dp = c.f, c.p_a - c.p_b
    return Powers(
        pump=f.Q_p * (c.ports.p_a_pump - c.ports.p_b_pump),
        boost=c.p_a * f.Q_boost_a + c.p_b * f.Q_boost_b,
        friction=shaft.friction(c, x, p) * x.omega_m,
        leakage=f.Q_int * dp + f.Q_ext_a * c.p_a + f.Q_ext_b * c.p_b,
        relief=f.Q_relief_a * c.p_a + f.Q_relief_b * c.p_b,
        flushing=f.Q_flush_a * c.p_a + f.Q_flush_b * c.p_b,
    )


@scalar
def stored_energy(c, x, geo, p):
    """Energy stored in shaft and the two lines [J]."""
    return shaft.energy(x, geo) + active.line_energy(c.p_a, c.p_b, x, p.active.i_C_h)


@scalar
def limits(c, x, q, u, p):
    """Which limits are passed now; see `Limits`."""
    return Limits(
        relief=active.relieves(c.f.Q_relief_a + c.f.Q_relief_b),
        overspeed=active.overspeed(c.alpha_m, x.omega_m, p.active),
        cavitation=active.cavitates(c.p_a, c.p_b),
        power=active.out_of_power(power_units(c, x, p), u.f_pump, p.plc, p.active),
        boost=active.out_of_boost(c.f, p.active),
    )


def steady(p: Params, geo: Geometry, F_w: float, omega_m: float, v_op: float, alpha_m: float) -> tuple[State, Command]:
    """State and command of a steady speed, without the active circuit's pressures: omega_m motor speed [rad/s]; alpha_m
    displacement of the motors [-]."""
    return still(alpha_m, 0.0, 0.0)._replace(omega_m=omega_m), Command(0.0, alpha_m, 1.0, 0.0)


def pack(crane: Any, case: Any, parts: Parts) -> Params:
    """Records of a run."""
    return Params(parts.active(crane), parts.hoist, parts.plc, parts.sensors)


def motors(crane: Any) -> tuple[Any, ...]:
    """Sets of motors on the shaft."""
    return (crane.active.motor,)


def pump_units(crane: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Size of the pumps of each power unit, active and passive."""
    return crane.active.pump.D, ()


def pump_flows(crane: Any) -> tuple[float, float]:
    """Full flow of active and passive pumps [m^3/s]."""
    return crane.active.pump.D_total * crane.active.pump.omega_p, 0.0


def stiffness(p: Params) -> Stiffness:
    """Fast modes of the winch."""
    return active.active_stiffness(p.active, shaft_inertia_without_wire(p.hoist))


def notes(crane: Any, held: Any, parts: Parts) -> list[str]:
    """What the winch type means for a weight and a motion."""
    r_eff, D = 0.5 * held.d / crane.i_hD, crane.active.motor.D_total * held.alpha
    dp = held.W * r_eff / D
    A, p_b = parts.active(crane), crane.active.boost.p
    f = active.active_flows(0.0, D, 0.0, p_b + dp, p_b, 1.0, A)
    leak = f.Q_int + f.Q_ext_a
    out = []
    relief = crane.active.relief.p - crane.active.boost.p
    if dp > relief:
        out.append(
            f"holding the load takes {show(dp, 'pressure')} with the motors at {held.alpha:.2f}, more than the"
            f" {show(relief, 'pressure')} up to the relief valves: the load will sink"
        )
    if held.compensates:
        errors = held.standing_errors(crane, leak / (A.pumps.D_max * A.pumps.omega_p))
        out += [
            f"the load is held by the pumps against leakage: under {law} expect a standing offset of about"
            f" {show(e_c, 'length')}"
            for law, e_c in errors.items()
        ]
    if held.manual and crane.brake is None:  # else the brake holds at rest
        sinks = show(leak / D * r_eff, "speed", 2)
        out.append(f"nothing compensates leakage in manual mode: with the joystick at rest the load sinks by {sinks}")
    return out
