"""Laws of the reference plant where it differs from the twin: two-volume lines, friction, oil temperature,
passive circuit.

Wire, drum, leakage and gas have modules of their own. No printed source gives their numbers: all are assumed (see
`trials.reference_plant.parameters`). Signs and units as in the twin.

Leakage of the reference plant: gaps by viscosity, edges by the root of the pressure, compressed oil by stroke and
speed.

Written for the reference plant alone: nothing here comes from the twin's leak tables
(`stillhook.physics.hydraulics.pump`, `physics.motor`).
"""

from typing import NamedTuple

from stillhook.physics.hydraulics.lines import boost_flows, flushing_flow, relief_flow
from stillhook.physics.scalar import exp, fmax, scalar, sqrt
from trials.reference_plant.gas import ATMOSPHERE, TrueAccumulator, piston_friction, standing_pressure

P_SOFT = 20e5
"""Pressure below which the flow past edges goes over to a laminar one [Pa] (assumed)."""


class TrueLeak(NamedTuple):
    """Leakage of a set of pumps and a set of motors. Conductances at p_ref and nominal oil [m^3/s/Pa]: pumps c_p at no
    stroke and c_p_stroke
    more at full stroke; motors c_m at rest and c_m_speed [m^3/rad/Pa] more with speed. edges part that follows the root
    of the pressure [-], equal to a laminar one at p_ref [Pa]; across share from port to port, the rest goes to the
    housings [-]; p_case pressure in those [Pa]."""

    c_p: float
    c_p_stroke: float
    c_m: float
    c_m_speed: float
    edges: float
    p_ref: float
    across: float
    p_case: float


@scalar
def gap_pump(alpha_p, leak):
    """Conductance of the pumps [m^3/s/Pa]: gaps, and what is squeezed and lost each turn, which goes with the stroke
    alpha_p."""
    return leak.c_p + leak.c_p_stroke * abs(alpha_p)


@scalar
def gap_motor(omega_m, leak):
    """Conductance of the motors [m^3/s/Pa]; omega_m [rad/s]."""
    return leak.c_m + leak.c_m_speed * abs(omega_m)


@scalar
def leak_flow(C, dp, thin, leak):
    r"""Leak through a conductance C [m^3/s]; dp pressure over it, either sign [Pa]; thin viscosity over nominal [-].

    .. math:: Q = C\,\Delta p\left(\frac{1 - e}{\nu/\nu_0} + e\sqrt{\frac{p_r + p_s}{|\Delta p| + p_s}}\right)

    Source: laminar gaps and turbulent edges side by side, as in Ivantysyn and Ivantysynova, Hydrostatic pumps and
    motors, chapter on losses.
    """
    edges = sqrt((leak.p_ref + P_SOFT) / (abs(dp) + P_SOFT))
    return C * dp * ((1.0 - leak.edges) / thin + leak.edges * edges)


@scalar
def leak_across(C, dp, thin, leak):
    """Leak from port to port [m^3/s], towards the lower pressure."""
    return leak.across * leak_flow(C, dp, thin, leak)


@scalar
def leak_to_case(C, p, thin, leak):
    """Leak from a port to the housing [m^3/s]; p gauge [Pa]."""
    return (1.0 - leak.across) * leak_flow(C, p - leak.p_case, thin, leak)


OMEGA_TURN = 1.0
"""Motor speed over which the friction's unevenness changes its side [rad/s]."""


class Lines(NamedTuple):
    """Both lines of the active circuit: i_C_p, i_C_m inverse capacitance of the pump end and of the motor end [Pa/m^3];
    i_I inverse inertance of the oil between them [m^3/(Pa s^2)]; R its resistance at nominal oil [Pa s/m^3]."""

    i_C_p: float
    i_C_m: float
    i_I: float
    R: float


class Oil(NamedTuple):
    """Slow swing of the oil's temperature about nominal: omega [rad/s]; T_0 [K], T_1 [K/s] at the start of a run; thin
    fall of the viscosity per kelvin, on which gaps and viscous losses depend [1/K]."""

    omega: float
    T_0: float
    T_1: float
    thin: float


class TrueFriction(NamedTuple):
    """Friction of the whole winch at the motor shaft. Coulomb: level [N m], load share of the wire's torque [-], motors
    share of the motors' hydraulic torque [-], uneven part by which hoisting has more and lowering less [-]. Stribeck:
    start [N m], start_load share of the wire's torque [-], i_omega_s inverse of its speed [s/rad]. viscous [N m s/rad],
    turbulent [N m s^2/rad^2]; i_tau inverse of the time by which the dry level lags [1/s]."""

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


class Flows(NamedTuple):
    """Flows of the active circuit [m^3/s]: Q_p pumps towards A; Q_m motors out of A; leaks of pumps (p) and motors (m),
    A to B and to the housings; boost, relief, flushing of each side; net into pump end and motor end of A and B."""

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

    .. math:: g = (\mu_0 + \mu_w T_w + \mu_h T_{hyd})(1 + \kappa\,\mathrm{sgn}\,\omega) + (S_0 + S_w
    T_w)e^{-(\omega/\omega_s)^2}

    Parameters: omega_m [rad/s]; T_w torque of the wire at the motor shaft [N m]; T_hyd displacement times pressure
    drop, active and passive motors added up without sign [N m]; f TrueFriction. The sign turns smoothly over
    OMEGA_TURN.
    Source: Gaussian Stribeck curve with load-dependent Coulomb friction, as common in the literature on friction; not
    printed for a crane.
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
def two_volume_flows(Q_p, alpha_p, D_m, x, f_pump, thin, leak, A):
    """All flows of the active circuit; Q_p that of the pumps [m^3/s], x State, f_pump share of the pumps that run, thin
    viscosity over nominal [-], leak TrueLeak, A ActiveCircuit.

    Differs from the twin: pump end and motor end of each line are volumes of their own; pumps, boost, relief and
    flushing sit at the one, motors at the other, and each unit leaks by the pressures at its own ports and by a law of
    its own.
    """
    C_p, C_m = f_pump * gap_pump(alpha_p, leak), gap_motor(x.omega_m, leak)
    Q_m = D_m * x.omega_m
    Q_int_p, Q_int_m = leak_across(C_p, x.p_ap - x.p_bp, thin, leak), leak_across(C_m, x.p_a - x.p_b, thin, leak)
    Q_ext_pa, Q_ext_pb = leak_to_case(C_p, x.p_ap, thin, leak), leak_to_case(C_p, x.p_bp, thin, leak)
    Q_ext_ma, Q_ext_mb = leak_to_case(C_m, x.p_a, thin, leak), leak_to_case(C_m, x.p_b, thin, leak)
    Q_boost_a, Q_boost_b = boost_flows(x.p_ap, x.p_bp, A.boost)
    Q_relief_a, Q_relief_b = relief_flow(x.p_ap, A.relief), relief_flow(x.p_bp, A.relief)
    Q_flush_a, Q_flush_b = flushing_flow(x.p_ap, x.p_bp, A.flushing), flushing_flow(x.p_bp, x.p_ap, A.flushing)
    Q_pa = Q_p - Q_int_p - Q_ext_pa + Q_boost_a - Q_relief_a - Q_flush_a - x.Q_a
    Q_pb = x.Q_b - Q_p + Q_int_p - Q_ext_pb + Q_boost_b - Q_relief_b - Q_flush_b
    Q_ma = x.Q_a - Q_m - Q_int_m - Q_ext_ma
    Q_mb = Q_m + Q_int_m - Q_ext_mb - x.Q_b
    return Flows(
        Q_p=Q_p,
        Q_m=Q_m,
        Q_int_p=Q_int_p,
        Q_int_m=Q_int_m,
        Q_ext_pa=Q_ext_pa,
        Q_ext_pb=Q_ext_pb,
        Q_ext_ma=Q_ext_ma,
        Q_ext_mb=Q_ext_mb,
        Q_boost_a=Q_boost_a,
        Q_boost_b=Q_boost_b,
        Q_relief_a=Q_relief_a,
        Q_relief_b=Q_relief_b,
        Q_flush_a=Q_flush_a,
        Q_flush_b=Q_flush_b,
        Q_pa=Q_pa,
        Q_pb=Q_pb,
        Q_ma=Q_ma,
        Q_mb=Q_mb,
    )


@scalar
def line_acceleration(p_from, p_to, Q, thin, lines):
    """Rate of the flow through a line [m^3/s^2]: pressure over its inertance, less its viscous resistance."""
    return (p_from - p_to - thin * lines.R * Q) * lines.i_I


@scalar
def line_energy(x, lines):
    """Energy of the oil in both lines, squeezed and moving [J]."""
    ends = (x.p_ap * x.p_ap + x.p_bp * x.p_bp) / lines.i_C_p + (x.p_a * x.p_a + x.p_b * x.p_b) / lines.i_C_m
    return 0.5 * (ends + (x.Q_a * x.Q_a + x.Q_b * x.Q_b) / lines.i_I)


class TruePassive(NamedTuple):
    """Passive circuit: acc TrueAccumulator; leak TrueLeak of its pumps and motors; D_m all motors that work [m^3/rad];
    p_lp low side at rest [Pa], R_lp its rise with the flow into it [Pa s/m^3]."""

    acc: TrueAccumulator
    leak: TrueLeak
    D_m: float
    p_lp: float
    R_lp: float


class PassiveFlows(NamedTuple):
    """Flows [m^3/s]: Q_m motors out of the high side; Q_lp leak to the low side, Q_ext to the housings; Q_relief; Q_o
    into the accumulator. Pressures [Pa]: p_o behind the standing piston, p_hp behind the moving one, where the
    transmitter sits, p_lp low side.
    """

    Q_m: float
    Q_lp: float
    Q_ext: float
    Q_relief: float
    Q_o: float
    p_o: float
    p_hp: float
    p_lp: float


@scalar
def passive_flows(Q_pp, alpha_pp, D_pm, x, f_passive, thin, relief, P):
    """The passive circuit at an instant; Q_pp flow of its pumps [m^3/s], alpha_pp their stroke [-], D_pm displacement
    of the motors that work [m^3/rad], f_passive share of the pumps that run [-], thin viscosity over nominal [-],
    relief Relief, P TruePassive.
    """
    Q_m = D_pm * x.omega_m
    p_o = standing_pressure(x.V_o, x.T_gas, P.acc)
    p_lp = P.p_lp + P.R_lp * (Q_m - Q_pp)
    C = f_passive * gap_pump(alpha_pp, P.leak) + gap_motor(x.omega_m, P.leak)
    Q_lp = leak_across(C, p_o - p_lp, thin, P.leak) + P.acc.C_leak * (p_o - p_lp)
    Q_ext = leak_to_case(C, p_o, thin, P.leak)
    Q_relief = relief_flow(p_o, relief)
    Q_o = Q_pp - Q_m - Q_lp - Q_ext - Q_relief
    return PassiveFlows(
        Q_m=Q_m,
        Q_lp=Q_lp,
        Q_ext=Q_ext,
        Q_relief=Q_relief,
        Q_o=Q_o,
        p_o=p_o,
        p_hp=fmax(p_o + piston_friction(Q_o, P.acc), -ATMOSPHERE),
        p_lp=p_lp,
    )
