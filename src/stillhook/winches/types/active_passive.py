"""Active/passive winch: a closed circuit moves the drum, a second one with accumulator carries the weight (thesis
figure 2.1)."""

from typing import Annotated, Any, NamedTuple

from stillhook.base.variable import Row
from stillhook.control.commands import displacement_for_weight, make_up, within_power
from stillhook.control.plc import Plc, hold
from stillhook.physics.friction import dry_torque
from stillhook.physics.hydraulics.accumulator import accumulator_pressure, accumulator_void
from stillhook.physics.hydraulics.lines import line_pressure
from stillhook.physics.hydraulics.motor import motor_torque
from stillhook.physics.hydraulics.motor_laws import motors_dry, motors_moving
from stillhook.physics.hydraulics.swash import displacement, pilot, swash_acceleration, swash_rate
from stillhook.physics.records import joined, replace, zeros_but
from stillhook.physics.scalar import fmax, scalar
from stillhook.winches import shaft
from stillhook.winches.circuits import active, rows
from stillhook.winches.circuits.active import BLANK, Extremes, fold_extremes, full_speed, lag, least_displacement
from stillhook.winches.circuits.passive import (
    PassiveCircuit,
    PassiveFlows,
    at_an_end,
    carried_by,
    charge,
    notes,
    other_motors,
    passive_flows,
    passive_stiffness,
    prepared,
    stroke,
)
from stillhook.winches.interface import Carried, Cause, Parts, Stiffness
from stillhook.winches.load_path import load
from stillhook.winches.load_path.load import Hoist, shaft_inertia_without_wire
from stillhook.winches.records import Geometry, Sensors, apply_override
from stillhook.winches.shaft import bristle_after, geometry, wire_speed

NAME = "active-passive"
TITLE = "active/passive winch: a closed circuit moves the drum, a second one with accumulator carries the weight"
PATH = load
SHOWN = {"p_max": "peak\npressure", "alpha_m_min": "least\nmotor", "relief_time": "relief\nopen"}
TABLES = ("active", "passive")
SERVOS = {
    **active.SERVOS,
    "u_pp": ("passive.pump.servo", "passive.pump_servo"),
    "u_pm": ("passive.motor.servo", "passive.motor_servo"),
}


class Params(NamedTuple):
    active: active.ActiveCircuit
    passive: PassiveCircuit
    hoist: Hoist
    plc: Plc
    sensors: Sensors


class State(NamedTuple):
    """The winch without its load path."""

    alpha_p: float  # setting of the active pumps [-]
    alpha_p_dot: float  # its rate [1/s]
    alpha_m: float  # setting of the active motors [-]
    alpha_m_dot: float  # its rate [1/s]
    alpha_pp: float  # setting of the passive pumps [-]
    alpha_pp_dot: float  # its rate [1/s]
    alpha_pm: float  # setting of the passive motors [-]
    alpha_pm_dot: float  # its rate [1/s]
    p_a: float  # linear pressure of line A, hoisting [Pa], see `stillhook.physics.hydraulics.lines`
    p_b: float  # that of line B, lowering [Pa]
    V_o: float  # oil in the accumulator [m^3]
    omega_m: float  # motor speed, hoisting positive [rad/s]
    z: float  # bristle, half a step ahead [rad]


class Command(NamedTuple):
    """Held between PLC cycles: u_p, u_m active, u_pp, u_pm passive pumps and motors [-]; f_pump, f_passive shares of
    the active and of the passive pumps that run; brake how far the holding brake is closed [-]."""

    u_p: float
    u_m: float
    u_pp: float
    u_pm: float
    f_pump: float
    f_passive: float
    brake: float


class Circuit(NamedTuple):
    """Everything that the diagram shows at an instant; flows [m^3/s], pressures [Pa], vapour in all lines [m^3],
    torques at the motor shaft [N m]. g level of dry friction, with that of the brake where it is held (above 0.5)."""

    f: active.ActiveFlows
    ports: active.Ports
    o: PassiveFlows
    p_a: float
    p_b: float
    V_void: float
    alpha_p: float
    alpha_m: float
    alpha_pp: float
    alpha_pm: float
    D_m: float
    D_pm: float
    g: float
    held: float
    T_moving: float


class PassiveSignals(NamedTuple):
    """Signals of the passive circuit."""

    p_hp: Annotated[float, Row("Pa", "pressure", "gauge", "pressure of the passive circuit's high side", "paper F")]
    alpha_pp: Annotated[float, Row("1", "", "into the accumulator", "passive pump displacement over its maximum")]
    alpha_pm: Annotated[float, Row("1", "", "", "passive motor displacement over its maximum")]
    V_acc: Annotated[float, Row("m^3", "volume", "from the oil end", "oil in the accumulator", "paper C")]


Signals, join_signals = joined("Signals", active.Signals, PassiveSignals)


class Limits(NamedTuple):
    """1 where a limit is passed at an instant, else 0."""

    relief: rows.ReliefLimit
    overspeed: rows.OverspeedLimit
    stroke: Annotated[float, Cause("accumulator", "time with the accumulator piston at an end", symbol="t_stroke")]
    cavitation: rows.CavitationLimit
    power: rows.PowerLimit
    boost: rows.BoostLimit


class Powers(NamedTuple):
    """Powers [W]: pumps and boost go in, the rest goes out."""

    pump: float
    boost: float
    passive_pump: float
    friction: float
    leakage: float
    relief: float
    flushing: float
    passive: float


SUPPLIED = ("pump", "boost", "passive_pump")


@scalar
def circuit(x, q, u, geo, p):
    """The whole winch at an instant, read along its diagram: active circuit, passive circuit, friction. q point of the
    load path."""
    A, P = p.active, p.passive
    alpha_p = displacement(x.alpha_p, A.pump_servo)
    alpha_m = displacement(x.alpha_m, A.motor_servo)
    alpha_pp = displacement(x.alpha_pp, P.pump_servo)
    alpha_pm = displacement(x.alpha_pm, P.motor_servo)

    D_m = A.motors.count * A.motors.D_max * alpha_m
    p_a, p_b = line_pressure(x.p_a), line_pressure(x.p_b)
    f = active.active_flows(alpha_p, D_m, x.omega_m, x.p_a, x.p_b, u.f_pump, A)
    ports = active.port_pressures(f, p_a, p_b, A)

    D_pm = P.motors.count * P.motors.D_max * alpha_pm
    o = passive_flows(alpha_pp, D_pm, x.omega_m, x.V_o, u.f_passive, P)

    omega_m, dp, dp_p = x.omega_m, ports.p_a_motor - ports.p_b_motor, o.p_hp - P.settings.p_lp
    dry = motors_dry(omega_m, alpha_m, dp, A.motors) + motors_dry(omega_m, alpha_pm, dp_p, P.motors)
    moving = motors_moving(omega_m, alpha_m, dp, A.motors) + motors_moving(omega_m, alpha_pm, dp_p, P.motors)
    g = shaft.dry_level(dry, x.omega_m, q.F_w * 0.5 * geo.d, p.hoist)
    return Circuit(
        f=f,
        ports=ports,
        o=o,
        p_a=p_a,
        p_b=p_b,
        V_void=active.line_voids(x, A.i_C_h) + accumulator_void(x.V_o, P.accumulator),
        alpha_p=alpha_p,
        alpha_m=alpha_m,
        alpha_pp=alpha_pp,
        alpha_pm=alpha_pm,
        D_m=D_m,
        D_pm=D_pm,
        g=g + u.brake * p.hoist.T_brake,
        held=u.brake,
        T_moving=shaft.moving_loss(moving, x.omega_m, p.hoist),
    )


@scalar
def rates(c, x, q, u, geo, p):
    """Time derivatives of the state; the bristle z is advanced by `bristle_after` and stands still here."""
    A, P = p.active, p.passive
    T = (
        motor_torque(c.D_m, c.ports.p_a_motor - c.ports.p_b_motor)
        + motor_torque(c.D_pm, c.o.p_hp - P.settings.p_lp)
        - q.F_w * geo.r_eff
        - c.T_moving
        - dry_torque(x.omega_m, x.z, c.g, c.held, p.hoist.bristle)
    )
    return State(
        alpha_p=swash_rate(x.alpha_p, x.alpha_p_dot, A.pump_servo),
        alpha_p_dot=swash_acceleration(x.alpha_p, x.alpha_p_dot, u.u_p, A.pump_servo),
        alpha_m=swash_rate(x.alpha_m, x.alpha_m_dot, A.motor_servo),
        alpha_m_dot=swash_acceleration(x.alpha_m, x.alpha_m_dot, u.u_m, A.motor_servo),
        alpha_pp=swash_rate(x.alpha_pp, x.alpha_pp_dot, P.pump_servo),
        alpha_pp_dot=swash_acceleration(x.alpha_pp, x.alpha_pp_dot, u.u_pp, P.pump_servo),
        alpha_pm=swash_rate(x.alpha_pm, x.alpha_pm_dot, P.motor_servo),
        alpha_pm_dot=swash_acceleration(x.alpha_pm, x.alpha_pm_dot, u.u_pm, P.motor_servo),
        p_a=c.f.Q_a * A.i_C_h,
        p_b=c.f.Q_b * A.i_C_h,
        V_o=c.o.Q_o,
        omega_m=T * geo.i_J,
        z=0.0,
    )


still = zeros_but(State, "alpha_m", "p_a", "p_b", "V_o")


@scalar
def start(s_w, tick, p):
    """State before the PLC's first cycle: the load hangs still on both circuits; s_w wire out [m]."""
    boost = p.active.boost.p
    return still(1.0, boost, boost, 0.5 * p.passive.accumulator.V_stroke)


with_displacements = replace(State, "alpha_m", "alpha_pm")


@scalar
def settle(x, q, u, tick, geo, p):
    """The state at rest under the PLC's first commands: displacements where it wants them; x that of `start`."""
    return with_displacements(x, u.u_m, u.u_pm)


@scalar
def sense(x, y, q, m, tick, geo, p):
    """What the PLC reads; y state and q point of the load path."""
    P = p.passive
    p_hp = accumulator_pressure(x.V_o, P.accumulator)
    T_passive = motor_torque(P.settings.D_m_max * displacement(x.alpha_pm, P.motor_servo), p_hp - P.settings.p_lp)
    return active.readings(x, y, q, m, tick, geo, T_passive, p_hp, p)


@scalar
def actuate(drive, r, x, m_0, m, tick, geo, p):
    """Plant commands, the PLC's memory and the active drive's signals; r what was read, m_0 memory before the cycle."""
    A, P = p.active, p.passive
    drive = apply_override(drive, tick)
    u_m, held = pilot(drive.u_m, m.held, A.control)
    u_pm = displacement_for_weight(m.F, geo.r_eff, r.p_hp, P.settings)
    power, f = p.plc.power, tick.f_known
    P_left = f * power.P_max - fmax(f * power.Q_p * drive.u_p * r.dp, 0.0)
    demand = make_up(m.p_mean, u_pm, tick.v_op / geo.r_eff, P.settings)
    u_pp = within_power(demand, r.p_hp - P.settings.p_lp, f * power.Q_pp, fmax(P_left, 0.0))
    return (
        Command(
            u_p=drive.u_p,
            u_m=u_m,
            u_pp=u_pp,
            u_pm=u_pm,
            f_pump=tick.f_pump,
            f_passive=tick.f_passive,
            brake=drive.brake,
        ),
        hold(m, held),
        drive,
    )


@scalar
def power_units(c, x, p):
    """Hydraulic power that the power units give to active and passive pumps, negative: take back [W]."""
    return c.f.Q_p * (c.ports.p_a_pump - c.ports.p_b_pump) + c.o.Q_p * (c.o.p_hp - p.passive.settings.p_lp)


@scalar
def signals(c, x, q, u, geo, p):
    """Its own signals at an instant."""
    passive = PassiveSignals(p_hp=c.o.p_hp, alpha_pp=c.alpha_pp, alpha_pm=c.alpha_pm, V_acc=x.V_o)
    return join_signals(active.signals_of(c, x, u, power_units(c, x, p), p), passive)


@scalar
def powers(c, x, q, p):
    """Where the power comes from and where it goes [W]; see `Powers`."""
    P = p.passive
    f, dp = c.f, c.p_a - c.p_b
    dp_p = c.o.p_hp - P.settings.p_lp
    Q_low = c.D_pm * x.omega_m + c.o.Q_lp - c.o.Q_p  # into the low side, whose pressure is held
    return Powers(
        pump=f.Q_p * (c.ports.p_a_pump - c.ports.p_b_pump),
        boost=c.p_a * f.Q_boost_a + c.p_b * f.Q_boost_b,
        passive_pump=c.o.Q_p * dp_p,
        friction=shaft.friction(c, x, p) * x.omega_m,
        leakage=f.Q_int * dp + f.Q_ext_a * c.p_a + f.Q_ext_b * c.p_b + c.o.Q_lp * dp_p + c.o.Q_ext * c.o.p_hp,
        relief=f.Q_relief_a * c.p_a + f.Q_relief_b * c.p_b + c.o.Q_relief * c.o.p_hp,
        flushing=f.Q_flush_a * c.p_a + f.Q_flush_b * c.p_b,
        passive=c.o.Q_o * c.o.p_hp + P.settings.p_lp * Q_low,
    )


@scalar
def stored_energy(c, x, geo, p):
    """Energy stored in shaft and the two lines [J]; the accumulator's is counted as power."""
    return shaft.energy(x, geo) + active.line_energy(c.p_a, c.p_b, x, p.active.i_C_h)


@scalar
def limits(c, x, q, u, p):
    """Which limits are passed now; see `Limits`. All motors sit on one shaft and each set has its own speed limit."""
    A, P = p.active, p.passive
    return Limits(
        relief=fmax(active.relieves(c.f.Q_relief_a + c.f.Q_relief_b), active.relieves(c.o.Q_relief)),
        overspeed=fmax(active.overspeed(c.alpha_m, x.omega_m, A), active.overspeed(c.alpha_pm, x.omega_m, P)),
        stroke=at_an_end(x.V_o, P.accumulator),
        cavitation=fmax(active.cavitates(c.p_a, c.p_b), active.cavitates(c.o.p_hp, c.o.p_hp)),
        power=active.out_of_power(power_units(c, x, p), u.f_pump, p.plc, A),
        boost=active.out_of_boost(c.f, A),
    )


def steady(
    p: Params,
    geo: Geometry,
    F_w: float,
    omega_m: float,
    v_op: float,
    alpha_m: float,
    *,
    V_o: float | None = None,
    alpha_pp: float | None = None,
) -> tuple[State, Command]:
    """State and command of a steady speed with everything but the active circuit's pressures where the PLC puts it.

    F_w tension [N]; omega_m motor speed [rad/s]; v_op wire speed that the operator requests [m/s]; alpha_m displacement
    of the active motors [-]; V_o oil in the accumulator [m^3], default mid stroke; alpha_pp setting of the passive
    pumps [-], default the PLC's command.
    """
    P = p.passive
    V = 0.5 * P.accumulator.V_stroke if V_o is None else V_o
    p_o = accumulator_pressure(V, P.accumulator)
    alpha_pm = displacement_for_weight(F_w, geo.r_eff, p_o, P.settings)
    pp = make_up(p_o, alpha_pm, v_op / geo.r_eff, P.settings) if alpha_pp is None else alpha_pp
    x = still(alpha_m, 0.0, 0.0, V)._replace(alpha_pp=pp, alpha_pm=alpha_pm, omega_m=omega_m)
    return x, Command(u_p=0.0, u_m=alpha_m, u_pp=pp, u_pm=alpha_pm, f_pump=1.0, f_passive=1.0, brake=0.0)


def carried(p: Params, geo: Geometry, F_w: float) -> Carried:
    """What the passive motors hold of a tension F_w [N] at mid stroke."""
    return carried_by(p.passive, geo.r_eff, F_w)


def mean_pressure(x: State, p: Params) -> float:
    """Mean accumulator pressure that the PLC has seen in this state [Pa]: that of the gas, which differs from the
    motors' by the piston's resistance."""
    return float(accumulator_pressure(x.V_o, p.passive.accumulator))


def pack(crane: Any, case: Any, parts: Parts) -> Params:
    """Records of a run."""
    return Params(
        active=parts.active(crane),
        passive=parts.passive(crane, case.gas_held),
        hoist=parts.hoist,
        plc=parts.plc,
        sensors=parts.sensors,
    )


def motors(crane: Any) -> tuple[Any, ...]:
    """Sets of motors on the shaft."""
    return crane.active.motor, crane.passive.motor


def pump_units(crane: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Size of the pumps of each power unit, active and passive."""
    return crane.active.pump.D, crane.passive.pump.D


def pump_flows(crane: Any) -> tuple[float, float]:
    """Full flow of active and passive pumps [m^3/s]."""
    a, p = crane.active.pump, crane.passive.pump
    return a.D_total * a.omega_p, p.D_total * p.omega_p


def stiffness(p: Params) -> Stiffness:
    """Fast modes of the winch."""
    J = shaft_inertia_without_wire(p.hoist)
    a, passive = active.active_stiffness(p.active, J), passive_stiffness(p.passive, J)
    rates = {**a.rates, **passive.rates}
    return Stiffness(rates, a.viscous + passive.viscous, a.dry + passive.dry, a.n_max)
