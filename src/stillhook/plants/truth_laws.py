"""Laws of the truth plant where it differs from the twin: two-volume lines, wire with mass, friction, oil temperature.

No printed source gives their numbers: all are assumed (see `stillhook.engine.truth`). Signs and units as in the twin.
"""

from typing import NamedTuple

from stillhook.physics.load import drag_force
from stillhook.physics.motor import motor_leakage
from stillhook.physics.pump import pump_leakage
from stillhook.physics.scalar import exp, fmax, scalar, sqrt
from stillhook.physics.valves import boost_flows, external_leakage, flushing_flow, internal_leakage, relief_flow
from stillhook.physics.wire import wire_stiffness

OMEGA_TURN = 1.0
"""Motor speed over which the friction's unevenness changes its side [rad/s]."""


class Lines(NamedTuple):
    """Both lines of the active circuit: i_C_p, i_C_m inverse capacitance of the pump end and of the motor end [Pa/m^3]; i_I inverse
    inertance of the oil between them [m^3/(Pa s^2)]; R its resistance at nominal oil [Pa s/m^3]."""

    i_C_p: float
    i_C_m: float
    i_I: float
    R: float


class Oil(NamedTuple):
    """Slow swing of the oil's temperature about nominal: omega [rad/s]; T_0 [K], T_1 [K/s] at the start of a run; leak rise of leakage,
    thin fall of viscous losses, each per kelvin [1/K]."""

    omega: float
    T_0: float
    T_1: float
    leak: float
    thin: float


class TrueFriction(NamedTuple):
    """Friction of the whole winch at the motor shaft. Coulomb: level [N m], load share of the wire's torque [-], motors share of the
    motors' hydraulic torque [-], uneven part by which hoisting has more and lowering less [-]. Stribeck: start [N m], start_load share of
    the wire's torque [-], i_omega_s inverse of its speed [s/rad]. viscous [N m s/rad], turbulent [N m s^2/rad^2]; i_tau inverse of the
    time by which the dry level lags [1/s]."""

    level: float
    load: float
    motors: float
    uneven: float
    start: float
    start_load: float
    i_omega_s: float
    viscous: float
    turbulent: float
    i_tau: float


class Rope(NamedTuple):
    """Wire in two springs with a mass in the middle: c damping of each half [N s/m]; middle and load: W weight [N], m mass [kg],
    i_m inverse mass [1/kg]."""

    c: float
    W_mid: float
    m_mid: float
    i_m_mid: float
    W_load: float
    m_load: float
    i_m_load: float


class RopeState(NamedTuple):
    """v_w [m/s]; k of each half [N/m]; upper and lower half: x stretch [m], x_dot [m/s], F tension [N] (F_w upper: what winch and load
    cell feel); accelerations of middle and load, up positive [m/s^2]."""

    v_w: float
    k: float
    x_up: float
    x_up_dot: float
    F_w: float
    x_low: float
    x_low_dot: float
    F_low: float
    a_mid: float
    a_load: float


class Flows(NamedTuple):
    """Flows of the active circuit [m^3/s]: Q_p pumps towards A; Q_m motors out of A; leaks of pumps (p) and motors (m), A to B and to the
    housings; boost, relief, flushing of each side; net into pump end and motor end of A and B."""

    Q_p: float
    Q_m: float
    Q_int_p: float
    Q_int_m: float
    Q_ext_pa: float
    Q_ext_pb: float
    Q_ext_ma: float
    Q_ext_mb: float
    Q_boost_a: float
    Q_boost_b: float
    Q_relief_a: float
    Q_relief_b: float
    Q_flush_a: float
    Q_flush_b: float
    Q_pa: float
    Q_pb: float
    Q_ma: float
    Q_mb: float


@scalar
def dry_level_true(omega_m, T_w, T_hyd, f):
    r"""Level of the dry friction of the whole winch, never negative [N m].

    .. math:: g = (\mu_0 + \mu_w T_w + \mu_h T_{hyd})(1 + \kappa\,\mathrm{sgn}\,\omega) + (S_0 + S_w T_w)e^{-(\omega/\omega_s)^2}

    Parameters: omega_m [rad/s]; T_w torque of the wire at the motor shaft [N m]; T_hyd displacement times pressure drop, active and
    passive motors added up without sign [N m]; f TrueFriction. The sign turns smoothly over OMEGA_TURN.
    Source: Gaussian Stribeck curve with load-dependent Coulomb friction, as common in the literature on friction; not printed for a crane.
    """
    side = omega_m / sqrt(omega_m * omega_m + OMEGA_TURN * OMEGA_TURN)
    coulomb = (f.level + f.load * T_w + f.motors * T_hyd) * (1.0 + f.uneven * side)
    r = omega_m * f.i_omega_s
    return coulomb + (f.start + f.start_load * T_w) * exp(-r * r)


@scalar
def moving_loss_true(omega_m, thin, f):
    """Viscous and turbulent friction against the motion [N m]; thin viscosity over nominal [-]."""
    return (thin * f.viscous + f.turbulent * abs(omega_m)) * omega_m


@scalar
def rope_state(x, geo, tip, h, rope):
    """Wire and load at an instant; x State, tip s, v up positive. The middle lies where half of the wire out is above it, so that the
    wire paid out goes to the upper half. Each half has twice the stiffness of the whole wire."""
    v_w = x.omega_m * geo.lever
    k = 2.0 * wire_stiffness(x.s_w, h.wire)
    x_up, x_up_dot = tip.s - (x.s_w - h.s_w_0) - x.s_mid, tip.v + v_w - x.v_mid
    x_low, x_low_dot = x.s_mid - x.s_load, x.v_mid - x.v_load
    F_w = fmax(k * x_up + rope.c * x_up_dot, 0.0)
    F_low = fmax(k * x_low + rope.c * x_low_dot, 0.0)
    a_mid = (F_w - F_low - rope.W_mid) * rope.i_m_mid
    a_load = (F_low - rope.W_load + drag_force(x.v_load, h.load)) * rope.i_m_load
    return RopeState(v_w, k, x_up, x_up_dot, F_w, x_low, x_low_dot, F_low, a_mid, a_load)


@scalar
def _half_loss(F, x, x_dot, k, i_L, v_w):
    """Power that stays in one half of the wire [W]: damping, plus the strain that wire carries along as it leaves the drum."""
    taut = 1.0 if F > 0.0 else 0.0
    return (F - taut * k * x) * x_dot - taut * 0.5 * k * x * x * i_L * v_w


@scalar
def rope_loss(q, wire):
    """Power that stays in the wire [W]; q.k / (2 EA) is the inverse of its length."""
    i_L = 0.5 * q.k / wire.EA
    return _half_loss(q.F_w, q.x_up, q.x_up_dot, q.k, i_L, q.v_w) + _half_loss(q.F_low, q.x_low, q.x_low_dot, q.k, i_L, q.v_w)


@scalar
def rope_energy(x, q, rope):
    """Energy in the wire, its mass and the load [J]."""
    x_up = q.x_up if q.F_w > 0.0 else 0.0
    x_low = q.x_low if q.F_low > 0.0 else 0.0
    elastic = 0.5 * q.k * (x_up * x_up + x_low * x_low)
    moving = 0.5 * (rope.m_mid * x.v_mid * x.v_mid + rope.m_load * x.v_load * x.v_load)
    return elastic + moving + rope.W_mid * x.s_mid + rope.W_load * x.s_load


@scalar
def two_volume_flows(Q_p, alpha_p, D_m, x, f_pump, more, A):
    """All flows of the active circuit; Q_p that of the pumps [m^3/s], x State, f_pump share of the pumps that run, more leakage over
    nominal [-], A ActiveCircuit.

    Differs from the twin: pump end and motor end of each line are volumes of their own; pumps, boost, relief and flushing sit at the one,
    motors at the other, and each unit leaks by the pressures at its own ports.
    """
    C_p, C_m = more * f_pump * pump_leakage(alpha_p, A.pumps.leak), more * motor_leakage(x.omega_m, A.motors)
    Q_m = D_m * x.omega_m
    Q_int_p, Q_int_m = internal_leakage(C_p, x.p_ap - x.p_bp), internal_leakage(C_m, x.p_a - x.p_b)
    Q_ext_pa, Q_ext_pb = external_leakage(C_p, x.p_ap), external_leakage(C_p, x.p_bp)
    Q_ext_ma, Q_ext_mb = external_leakage(C_m, x.p_a), external_leakage(C_m, x.p_b)
    Q_boost_a, Q_boost_b = boost_flows(x.p_ap, x.p_bp, A.boost)
    Q_relief_a, Q_relief_b = relief_flow(x.p_ap, A.relief), relief_flow(x.p_bp, A.relief)
    Q_flush_a, Q_flush_b = flushing_flow(x.p_ap, x.p_bp, A.flushing), flushing_flow(x.p_bp, x.p_ap, A.flushing)
    Q_pa = Q_p - Q_int_p - Q_ext_pa + Q_boost_a - Q_relief_a - Q_flush_a - x.Q_a
    Q_pb = x.Q_b - Q_p + Q_int_p - Q_ext_pb + Q_boost_b - Q_relief_b - Q_flush_b
    Q_ma = x.Q_a - Q_m - Q_int_m - Q_ext_ma
    Q_mb = Q_m + Q_int_m - Q_ext_mb - x.Q_b
    return Flows(
        Q_p, Q_m, Q_int_p, Q_int_m, Q_ext_pa, Q_ext_pb, Q_ext_ma, Q_ext_mb,
        Q_boost_a, Q_boost_b, Q_relief_a, Q_relief_b, Q_flush_a, Q_flush_b, Q_pa, Q_pb, Q_ma, Q_mb,
    )  # fmt: skip


@scalar
def line_acceleration(p_from, p_to, Q, thin, lines):
    """Rate of the flow through a line [m^3/s^2]: pressure over its inertance, less its viscous resistance."""
    return (p_from - p_to - thin * lines.R * Q) * lines.i_I


@scalar
def line_energy(x, lines):
    """Energy of the oil in both lines, squeezed and moving [J]."""
    ends = (x.p_ap * x.p_ap + x.p_bp * x.p_bp) / lines.i_C_p + (x.p_a * x.p_a + x.p_b * x.p_b) / lines.i_C_m
    return 0.5 * (ends + (x.Q_a * x.Q_a + x.Q_b * x.Q_b) / lines.i_I)
