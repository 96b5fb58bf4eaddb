"""Cylinder-compensated winch: a cylinder in the wire's path compensates heave, the drum is held by its brake (thesis
figure 1.7 and section 1.2.2).

The rod carries a sheave that takes `falls` of wire in for its travel. Lines A and B of the cylinder are in closed
circuit with servo-controlled pumps, so that rod speed is flow over area; a third chamber on an accumulator carries the
weight. A servo-pump and not a proportional valve, because a valve throttles away what compensation takes and never
returns what a falling load gives.

The operator's speed is made by the winch, an ideal source of speed up to its own limit; where he asks for none, the
drum stands on its brake. In manual mode the rod is locked, by the PLC's brake signal.
"""

from typing import Annotated, Any, NamedTuple

from stillhook.base.variable import Row
from stillhook.control.interface import Sensed
from stillhook.control.plc import MANUAL, ActuatorCommands, Plc, hold
from stillhook.physics.friction import bristle_update, dry_torque
from stillhook.physics.hydraulics import cylinder as rod
from stillhook.physics.hydraulics.accumulator import accumulator_pressure, accumulator_void, piston_loss, port_pressure
from stillhook.physics.hydraulics.lines import (
    external_leakage,
    internal_leakage,
    line_pressure,
    relief_flow,
    void_energy,
    void_volume,
)
from stillhook.physics.hydraulics.swash import displacement, swash_acceleration, swash_rate
from stillhook.physics.records import replace, zeros_but
from stillhook.physics.scalar import clip, fmax, scalar
from stillhook.winches import shaft
from stillhook.winches.circuits import rows
from stillhook.winches.circuits.active import ActiveFlows, cavitates, out_of_boost, out_of_power, relieves
from stillhook.winches.circuits.cylinder import (
    BLANK,
    FILL_MOST,
    MAKE_UP_RATE,
    CylinderDrive,
    CylinderTable,
    Extremes,
    charge,
    cylinder_drive,
    cylinder_flows,
    cylinder_stiffness,
    fold_extremes,
    full_speed,
    full_wire_speed,
    gas_pressure_set,
    hydraulics,
    lag,
    motors,
    notes,
    part_speeds,
    pump_flows,
    pump_speed,
    pump_units,
    refusal,
    sized,
    stroke,
)
from stillhook.winches.circuits.passive import at_an_end
from stillhook.winches.interface import Cause, Parts, Stiffness
from stillhook.winches.load_path import load
from stillhook.winches.load_path.load import Hoist, drum_geometry
from stillhook.winches.records import Geometry, Sensors, apply_override

NAME = "cylinder"
TITLE = "cylinder-compensated winch: a cylinder in the wire's path compensates heave, the drum is held by its brake"
PATH = load
CONTROL = "speed"
TABLES = {"cylinder": CylinderTable}
SERVOS = {"u_p": ("cylinder.pump.servo", "cylinder.servo")}


class Params(NamedTuple):
    cylinder: CylinderDrive
    hoist: Hoist
    plc: Plc
    sensors: Sensors


class State(NamedTuple):
    """The winch without its load path."""

    alpha_p: float  # setting of the pumps [-]
    alpha_p_dot: float  # its rate [1/s]
    p_a: float  # linear pressure of line A, hoisting [Pa], see `stillhook.physics.hydraulics.lines`
    p_b: float  # that of line B, lowering [Pa]
    V_o: float  # oil in the accumulator [m^3]
    x_rod: float  # how far the rod is out [m]
    v_rod: float  # its speed, out and hoisting positive [m/s]
    v_drum: float  # wire speed of the drum, hoisting positive [m/s]
    z: float  # bristle of rod and sheaves, half a step ahead [m]


class Command(NamedTuple):
    """Held between PLC cycles: u_p pumps [-]; u_raw what was demanded of them [-]; v_drum speed demanded of the winch
    [m/s]; Q_make_up into the accumulator [m^3/s]; f_pump share of the pumps that run; brake how far the rod is
    locked."""

    u_p: float
    u_raw: float
    v_drum: float
    Q_make_up: float
    f_pump: float
    brake: float


class Circuit(NamedTuple):
    """Everything that the diagram shows at an instant; flows [m^3/s], pressures [Pa], volumes of line and chamber and
    vapour in all of them [m^3], forces on the rod [N]. g level of dry friction, with that of the lock where it is held
    (above 0.5); F_brake tension that the drum's brake holds."""

    f: ActiveFlows
    p_a: float
    p_b: float
    V_a: float
    V_b: float
    V_void: float
    alpha_p: float
    Q_leak: float
    Q_relief_p: float
    Q_o: float
    p_o: float
    p_hp: float
    F_end: float
    g: float
    held: float
    F_brake: float


class Signals(NamedTuple):
    """Signals of its own."""

    alpha_p: rows.AlphaP
    p_a: rows.PressureA
    p_b: rows.PressureB
    V_void: rows.VoidVolume
    x_rod: Annotated[float, Row("m", "length", "out and hoisting positive", "travel of the rod from its retracted end")]
    v_rod: Annotated[float, Row("m/s", "speed", "out and hoisting positive", "speed of the rod")]
    F_f: Annotated[
        float, Row("N", "force", "against hoisting positive", "friction of rod, guides and sheaves at the rod")
    ]
    Q_relief: rows.ReliefFlow
    f_pump: rows.PumpShare
    P_hpu: rows.HydraulicPower
    p_hp: Annotated[float, Row("Pa", "pressure", "gauge", "pressure of the chamber on the accumulator")]
    V_acc: Annotated[float, Row("m^3", "volume", "from the oil end", "oil in the accumulator")]
    v_drum: Annotated[float, Row("m/s", "speed", "hoisting positive", "wire speed of the drum")]


class Limits(NamedTuple):
    """1 where a limit is passed at an instant, else 0."""

    stroke: Annotated[float, Cause("cylinder stroke", "time with the rod in the cushion of an end", symbol="t_end")]
    flow: Annotated[float, Cause("pump flow", "time with more asked of the pumps than their full flow")]
    rod_speed: Annotated[float, Cause("rod speed", "time with the rod above the speed of its seals")]
    relief: rows.ReliefLimit
    cavitation: rows.CavitationLimit
    accumulator: Annotated[float, Cause("accumulator", "time with the accumulator piston at an end")]
    power: rows.PowerLimit
    boost: rows.BoostLimit
    slip: Annotated[float, Cause("brake", "time with more tension than the brake of the standing drum holds")]
    drum_speed: Annotated[float, Cause("winch speed", "time with more speed asked of the winch than it has")]


class Powers(NamedTuple):
    """Powers [W]: pumps, boost, make-up and winch go in, the rest goes out."""

    pump: float
    boost: float
    make_up: float
    winch: float
    friction: float
    leakage: float
    relief: float
    flushing: float
    cushion: float
    carried: float  # compression that oil takes along into and out of the chambers
    accumulator: float
    piston: float


SUPPLIED = ("pump", "boost", "make_up", "winch")
SHOWN = {"p_max": "peak\npressure", "x_rod_max": "most\nstroke", "stroke_time": "stroke\nlimit"}


@scalar
def geometry(s_w, p):
    """Layer, diameter and damping of the wire as for every drum; r_eff wire over travel of the rod [-] and i_J inverse
    of its mass [1/kg]: at the port the winch is the rod."""
    g, C = drum_geometry(s_w, p.hoist), p.cylinder
    return Geometry(layers=g.layers, d=g.d, r_eff=C.n_f, i_J=C.i_m, c=g.c)


@scalar
def wire_speed(x, geo):
    """Wire speed that rod and drum give, hoisting positive [m/s]."""
    return x.v_rod * geo.r_eff + x.v_drum


@scalar
def circuit(x, q, u, geo, p):
    """The whole winch at an instant, read along its diagram: closed circuit, accumulator, rod. q point of the load
    path."""
    C = p.cylinder
    alpha_p = displacement(x.alpha_p, C.servo)
    p_o = accumulator_pressure(x.V_o, C.accumulator)
    Q_leak, Q_relief_p = C.accumulator.C_leak * p_o, relief_flow(p_o, C.passive_relief)
    Q_o = u.Q_make_up - C.chambers.A_p * x.v_rod - Q_leak - Q_relief_p
    p_a, p_b = line_pressure(x.p_a), line_pressure(x.p_b)
    V_a, V_b, beta = rod.chamber_a(x.x_rod, C.chambers), rod.chamber_b(x.x_rod, C.chambers), C.chambers.beta
    voids = void_volume(x.p_a, beta / V_a) + void_volume(x.p_b, beta / V_b)
    return Circuit(
        f=cylinder_flows(alpha_p, x.p_a, x.p_b, u.f_pump, C),
        p_a=p_a,
        p_b=p_b,
        V_a=V_a,
        V_b=V_b,
        V_void=voids + accumulator_void(x.V_o, C.accumulator),
        alpha_p=alpha_p,
        Q_leak=Q_leak,
        Q_relief_p=Q_relief_p,
        Q_o=Q_o,
        p_o=p_o,
        p_hp=port_pressure(p_o, Q_o, C.accumulator),
        F_end=rod.stop_force(x.x_rod, C.ends) + rod.cushion_force(x.x_rod, x.v_rod, C.ends),
        g=rod.rod_friction_dry(x.v_rod, C.n_f * q.F_w, C.friction) + u.brake * C.F_lock,
        held=u.brake,
        F_brake=p.hoist.T_brake / (0.5 * geo.d * p.hoist.i_i),
    )


@scalar
def friction(c, x, p):
    """Friction of rod, guides and sheaves, with the lock, against hoisting positive [N]."""
    C = p.cylinder
    return C.friction.b * x.v_rod + dry_torque(x.v_rod, x.z, c.g, c.held, C.bristle)


@scalar
def rates(c, x, q, u, geo, p):
    """Time derivatives of the state; the bristle z is advanced by `bristle_after` and stands still here."""
    C = p.cylinder
    F = rod.rod_force(c.p_a, c.p_b, c.p_hp, C.chambers) - C.n_f * q.F_w - friction(c, x, p) + c.F_end
    return State(
        alpha_p=swash_rate(x.alpha_p, x.alpha_p_dot, C.servo),
        alpha_p_dot=swash_acceleration(x.alpha_p, x.alpha_p_dot, u.u_p, C.servo),
        p_a=rod.pressure_rate(c.f.Q_a, C.chambers.A_a * x.v_rod, c.V_a, c.p_a - x.p_a, C.chambers.beta),
        p_b=rod.pressure_rate(c.f.Q_b, -C.chambers.A_b * x.v_rod, c.V_b, c.p_b - x.p_b, C.chambers.beta),
        V_o=c.Q_o,
        x_rod=x.v_rod,
        v_rod=F * C.i_m,
        v_drum=(clip(u.v_drum, -C.v_winch, C.v_winch) - x.v_drum) * C.i_tau,
        z=0.0,
    )


@scalar
def bristle_after(c, x, p, tau):
    """The bristle's deflection tau [s] later, at the present speed and friction level [m]."""
    return bristle_update(x.v_rod, x.z, c.g, c.held, tau, p.cylinder.bristle)


still = zeros_but(State, "p_a", "p_b", "V_o", "x_rod")


@scalar
def start(s_w, tick, p):
    """State before the PLC's first cycle: the rod at mid stroke, the accumulator too; s_w wire out [m]."""
    C = p.cylinder
    return still(C.boost.p, C.boost.p, C.V_mid, 0.5 * C.chambers.x_max)


@scalar
def settle(x, q, u, tick, geo, p):
    """The state at rest under the PLC's first commands: what the accumulator does not carry is on line A, or on line B
    where it carries too much."""
    C = p.cylinder
    A, boost = C.chambers, C.boost.p
    F = C.n_f * q.F_w - rod.rod_force(boost, boost, accumulator_pressure(x.V_o, C.accumulator), A)
    return still(boost + fmax(F, 0.0) / A.A_a, boost + fmax(-F, 0.0) / A.A_b, x.V_o, x.x_rod)


with_pressures = replace(Sensed, "v_op", "K_wire", "dp", "dp_load", "p_hp", "p_a", "p_b")


@scalar
def sense(x, y, q, m, tick, geo, p):
    """What the PLC reads. The operator's speed goes to the winch: the cylinder compensates the tip and, by the drum's
    encoder, what the winch lags. omega_m is the speed of the motors that turn the drum; p_a and p_b are those of the
    cylinder's lines."""
    C = p.cylinder
    behind = clip(tick.v_op, -C.v_winch, C.v_winch) - x.v_drum
    omega_m = x.v_drum / (0.5 * geo.d * p.hoist.i_i)
    p_o, r = accumulator_pressure(x.V_o, C.accumulator), shaft.readings(omega_m, y, q, tick, geo, p)
    v_op = behind if tick.mode > MANUAL else 0.0
    dp_load = (C.n_f * r.F - C.chambers.A_p * p_o) / C.chambers.A_a
    p_a, p_b = line_pressure(x.p_a), line_pressure(x.p_b)
    return with_pressures(r, v_op, 1.0, p_a - p_b, dp_load, p_o, p_a, p_b)


with_command = replace(ActuatorCommands, "u_p")


@scalar
def actuate(drive, r, x, m_0, m, tick, geo, p):
    """Plant commands, the PLC's memory and the signals of the drive. Behind the locked rod the pumps bring the cylinder
    to the load before it opens; what the accumulator has lost of its oil is made up for slowly."""
    C = p.cylinder
    drive = apply_override(drive, tick)
    fill = clip(C.K_fill * (r.dp_load - r.dp), -FILL_MOST, FILL_MOST) if m.idle < 0.0 else 0.0
    u_p = fill if drive.brake > 0.0 else drive.u_p
    lost = C.V_mid - C.chambers.A_p * (x.x_rod - 0.5 * C.chambers.x_max) - x.V_o
    u = Command(
        u_p=u_p,
        u_raw=drive.u_raw,
        v_drum=tick.v_op,
        Q_make_up=clip(MAKE_UP_RATE * lost, 0.0, C.Q_make_up),
        f_pump=tick.f_pump,
        brake=drive.brake,
    )
    return u, hold(m, 1.0), with_command(drive, u_p)


@scalar
def signals(c, x, q, u, geo, p):
    """Its own signals at an instant."""
    return Signals(
        alpha_p=c.alpha_p,
        p_a=c.p_a,
        p_b=c.p_b,
        V_void=c.V_void,
        x_rod=x.x_rod,
        v_rod=x.v_rod,
        F_f=friction(c, x, p),
        Q_relief=c.f.Q_relief_a + c.f.Q_relief_b + c.Q_relief_p,
        f_pump=u.f_pump,
        P_hpu=c.f.Q_p * (c.p_a - c.p_b),
        p_hp=c.p_hp,
        V_acc=x.V_o,
        v_drum=x.v_drum,
    )


@scalar
def powers(c, x, q, p):
    """Where the power comes from and where it goes [W]; see `Powers`. What goes into the accumulator is counted as
    power."""
    f, C, v = c.f, p.cylinder, x.v_rod
    A, dp = C.chambers, c.p_a - c.p_b
    carried = rod.carried_power(c.p_a, A.A_a * v, A.beta) - rod.carried_power(c.p_b, A.A_b * v, A.beta)
    return Powers(
        pump=f.Q_p * dp,
        boost=c.p_a * f.Q_boost_a + c.p_b * f.Q_boost_b,
        make_up=(c.Q_o + A.A_p * v + c.Q_leak + c.Q_relief_p) * c.p_hp,
        winch=q.F_w * x.v_drum,
        friction=friction(c, x, p) * v,
        leakage=f.Q_int * dp + f.Q_ext_a * c.p_a + f.Q_ext_b * c.p_b + c.Q_leak * c.p_hp,
        relief=(f.Q_relief_a - f.Q_relief_b) * dp + c.Q_relief_p * c.p_hp,
        flushing=f.Q_flush_a * c.p_a + f.Q_flush_b * c.p_b,
        cushion=-rod.cushion_force(x.x_rod, v, C.ends) * v,
        carried=-carried,
        accumulator=c.Q_o * c.p_o,
        piston=c.Q_o * (c.p_hp - c.p_o),
    )


@scalar
def stored_energy(c, x, geo, p):
    """Energy stored in the rod, its end stops and the two lines [J]; the accumulator's is counted as power."""
    C = p.cylinder
    A = C.chambers
    oil = rod.oil_energy(c.p_a, c.V_a, A.beta) + rod.oil_energy(c.p_b, c.V_b, A.beta)
    voids = void_energy(x.p_a, A.beta / c.V_a) + void_energy(x.p_b, A.beta / c.V_b)
    return 0.5 * x.v_rod * x.v_rod / C.i_m + rod.stop_energy(x.x_rod, C.ends) + oil + voids


@scalar
def limits(c, x, q, u, p):
    """Which limits are passed now; see `Limits`."""
    C = p.cylinder
    return Limits(
        stroke=rod.in_cushion(x.x_rod, C.ends),
        flow=1.0 if abs(u.u_raw) > 1.0 else 0.0,
        rod_speed=1.0 if abs(x.v_rod) > C.v_rod else 0.0,
        relief=relieves(c.f.Q_relief_a + c.f.Q_relief_b + c.Q_relief_p),
        cavitation=fmax(cavitates(c.p_a, c.p_b), cavitates(c.p_hp, c.p_hp)),
        accumulator=at_an_end(x.V_o, C.accumulator),
        power=out_of_power(c.f.Q_p * (c.p_a - c.p_b), u.f_pump, p.plc, C),
        boost=out_of_boost(c.f, C),
        slip=1.0 if u.v_drum == 0.0 and q.F_w > c.F_brake else 0.0,
        drum_speed=1.0 if abs(u.v_drum) > C.v_winch else 0.0,
    )


def pack(crane: Any, case: Any, parts: Parts) -> Params:
    """Records of a run: the gas is set to the load."""
    t = crane.cylinder.passive
    gas = t.accumulator.gas.model_copy(update={"p_0": gas_pressure_set(crane.cylinder, parts.hoist.load.W)})
    table = t.accumulator.model_copy(update={"gas": gas})
    accumulator = parts.accumulator(table, t.line, False, "cylinder.passive")
    return Params(cylinder_drive(crane, accumulator, parts.hoist), parts.hoist, parts.plc, parts.sensors)


def stiffness(p: Params) -> Stiffness:
    """Fast modes of the winch."""
    return cylinder_stiffness(p.cylinder, p.hoist)


def speed_limit(p: Params, geo: Geometry, F_w: float, lowering: bool = False) -> tuple[float, str]:
    """Highest steady rod speed with tension F_w at the top [N], rod at mid stroke, and the limit's cause."""
    C, boost = p.cylinder, p.cylinder.boost.p
    v = C.Q_p / C.chambers.A_a
    lost = float(rod.rod_friction_dry(v, C.n_f * F_w, C.friction)) + C.friction.b * v
    lost += C.chambers.A_p * float(piston_loss(C.chambers.A_p * v, C.accumulator))
    F = (
        C.n_f * F_w
        - C.chambers.A_p * float(accumulator_pressure(C.V_mid, C.accumulator))
        + (-lost if lowering else lost)
    )
    dp = (-F if lowering else F) / (C.chambers.A_b if lowering else C.chambers.A_a)  # against the pumps
    if boost + dp > C.relief.p:
        return 0.0, "relief"
    leak = float(internal_leakage(C.C_leak, dp) + external_leakage(C.C_leak, boost + fmax(dp, 0.0)))
    speeds = {"pump flow": (C.Q_p - leak) / C.chambers.A_a, "rod speed": C.v_rod}
    if dp > 0.0:
        speeds["power"] = p.plc.power.P_max / (dp * C.chambers.A_a)
    elif dp < 0.0:
        speeds["power"] = C.P_back / (-dp * C.chambers.A_a)
    cause = min(speeds, key=lambda name: speeds[name])
    return speeds[cause], cause
