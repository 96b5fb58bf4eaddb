"""What one PLC cycle commands: active heave compensation, displacement of the motors, torque limit of the pumps,
passive circuit, holding brake; and the position loop as a linear model."""

from typing import NamedTuple

from stillhook.physics.scalar import clip, fmax, fmin, scalar, sqrt


class AhcGains(NamedTuple):
    """K_1 [s/m], K_2 [s^2/m], K_p [1/m]."""

    K_1: float
    K_2: float
    K_p: float


@scalar
def feedforward(v_tip, a_tip, K_wire, alpha_m, gains):
    """u_ff = -(K_1 v_tip + K_2 a_tip) K_wire alpha_m [-]; tip up positive, so a rising tip pays wire out.

    Source: Moslatt 2020 C eq. 12, E eq. 4. Differs from print: paper E counts pay-out positive and prints the mirror
    image.
    """
    return -(gains.K_1 * v_tip + gains.K_2 * a_tip) * K_wire * alpha_m


@scalar
def feedback(e_c, gains):
    """-K_p e_c [-]; e_c = s_w_ref - s_w > 0: too little wire is out, so pay out. Source: Moslatt 2020 E eq. 6."""
    return -gains.K_p * e_c


class Loop(NamedTuple):
    """Hydraulics s^2 + a_1 s + a_0, pump servo s^2 + b_1 s + b_0; g their gain from pump setting to wire speed, times
    a_0 [m/s^3]."""

    a_0: float
    a_1: float
    b_0: float
    b_1: float
    g: float


@scalar
def marginal_gain(loop):
    r"""Position gain of marginal stability [1/m], and the frequency at which the winch then swings [rad/s].

    .. math:: s (s^2 + a_1 s + a_0)(s^2 + b_1 s + b_0) + K_p\,b_0\,g = 0

    At the limit s = i omega_c: the odd powers give omega_c, the even ones the gain (Routh and Hurwitz in closed form).
    Source: Moslatt 2020 paper E eqs 14 to 20.
    """
    c_1, c_2 = loop.a_0 * loop.b_0, loop.a_1 * loop.b_0 + loop.a_0 * loop.b_1
    c_3, c_4 = loop.a_0 + loop.b_0 + loop.a_1 * loop.b_1, loop.a_1 + loop.b_1
    w_2 = 2.0 * c_1 / (c_3 + sqrt(c_3 * c_3 - 4.0 * c_1))  # the smaller root of w_2^2 - c_3 w_2 + c_1
    return (c_2 - c_4 * w_2) * w_2 / (loop.b_0 * loop.g), sqrt(w_2)


class DisplacementLimits(NamedTuple):
    """D_m_min of SSC from torque and speeds. by_torque 1 where it is chosen, 0 where the rule by the load is; T_0
    friction of all motors and gears at the shaft with an empty wire [N m]; c_T torque that the active motors need per
    torque of the load at the shaft [-]; i_T inverse of the torque that they have at full displacement and the highest
    permitted pressure [1/(N m)]; J inertia at the shaft with a full drum [kg m^2]; r_outer wire per motor angle where
    K_wire is 1 [m/rad]; alpha_speed smallest displacement with which full pumps turn motors and gears within their
    speed limits [-]; i_T_speed what the limit of the motors that hold the load adds, per torque of the load
    [1/(N m)]."""

    by_torque: float = 0.0
    T_0: float = 0.0
    c_T: float = 0.0
    i_T: float = 0.0
    J: float = 0.0
    r_outer: float = 1.0
    alpha_speed: float = 0.0
    i_T_speed: float = 0.0


class MotorSettings(NamedTuple):
    """alpha_min absolute minimum, alpha_ns and alpha_hs settings on the outermost layer [-]; alpha_swl displacement
    that SSC keeps for the SWL on the outermost layer [-]; u_thr threshold of SSC [-];
    i_F_swl inverse of the weight of the safe working load and the hook [1/N]; K_outer K_wire of the outermost layer;
    alpha_hold displacement that the operator holds in manual mode [-], 0 where he leaves it to the PLC; limits those of
    SSC from torque and speeds."""

    alpha_min: float
    alpha_ns: float
    alpha_hs: float
    alpha_swl: float
    u_thr: float
    i_F_swl: float
    K_outer: float
    alpha_hold: float
    limits: DisplacementLimits


@scalar
def reduction_linear(u_ff, u_thr):
    """k_red of the linear SSC, 0..1. Source: Moslatt 2020 eq. 2.10 (E eq. 2). Differs from print: |u_ff| is held at
    1."""
    return clip((abs(u_ff) - u_thr) / (1.0 - u_thr), 0.0, 1.0)


@scalar
def reduction_cubic(u_ff, u_thr):
    """k_red of the cubic SSC, 0..1. Source: Moslatt 2020 C eq. 13, whose coefficients are s^2 (3 - 2 s) for u_thr =
    0.6."""
    s = reduction_linear(u_ff, u_thr)
    return s * s * (3.0 - 2.0 * s)


@scalar
def displacement_ssc(k_red, alpha_min):
    """u_m = 1 - k_red (D_m_max - D_m_min) / D_m_max. Source: Moslatt 2020 eq. 2.9; alpha_min = D_m_min / D_m_max."""
    return 1.0 - k_red * (1.0 - alpha_min)


@scalar
def displacement_calc_min(F_load, K_wire, settings):
    """D_calc_min / D_m_max that the load cell asks for [-]: the displacement for the SWL in proportion to the actual
    load.

    alpha_swl is that of NS unless the crane file gives another.

    Source: Moslatt 2020 eq. 2.11 and paper C ("30 % of the actual load rather than of the SWL"); the rule itself is not
    printed. F_load [N]; the torque of a given wire force shrinks with the layer, hence K_wire.
    """
    return clip(settings.alpha_swl * F_load * settings.i_F_swl * settings.K_outer / K_wire, 0.0, 1.0)


@scalar
def displacement_for_torque(F_load, a, K_wire, limits):
    r"""D_calc_min / D_m_max from friction, load and inertia against the permitted pressure [-].

    .. math:: D_{calcMin} = \frac{T_0 + c_T F r + J |a| / r}{p_{most} - p_{boost}}, \quad r = r_{outer}/K_{wire}

    F_load load cell [N]; a acceleration of the wire [m/s^2]. Source: Moslatt 2020 paper C ("must overcome friction,
    load dynamics and inertia accelerations" within the maximum system pressure); no equation is printed.
    """
    r = limits.r_outer / K_wire
    return clip((limits.T_0 + limits.c_T * F_load * r + limits.J * abs(a) / r) * limits.i_T, 0.0, 1.0)


@scalar
def displacement_for_speed(F_load, K_wire, limits):
    """D_abs_min / D_m_max: full pumps then turn no motor and no gear beyond its limit [-]. The motors that hold the
    load have their displacement from it, and their limit from that. Source: Moslatt 2020 eq. 2.11, paper C."""
    return fmax(limits.alpha_speed, clip(limits.i_T_speed * F_load * limits.r_outer / K_wire, 0.0, 1.0))


@scalar
def displacement_min_moving(F_load, a, K_wire, settings):
    """D_m_min / D_m_max = max(D_abs_min, D_calc_min) / D_m_max while the wire has the acceleration a [m/s^2] [-], by
    the rule of `[control] displacement_limit`. Source: Moslatt 2020 eq. 2.11."""
    s = settings.limits
    by_load = fmax(settings.alpha_min, displacement_calc_min(F_load, K_wire, settings))
    speed = fmax(settings.alpha_min, displacement_for_speed(F_load, K_wire, s))
    return fmax(speed, displacement_for_torque(F_load, a, K_wire, s)) if s.by_torque > 0.5 else by_load


@scalar
def displacement_of_ssc(r, motors):
    """Displacement that the linear SSC demands, from what a controller senses [-]. Source: Moslatt 2020 eqs 2.9 to
    2.11."""
    least = displacement_min_moving(r.F, r.y.a_tip, r.y.K_wire, motors)
    return displacement_ssc(reduction_linear(r.u_ff, motors.u_thr), least)


@scalar
def displacement_min(F_load, K_wire, settings):
    """The same at a steady wire speed [-]."""
    return displacement_min_moving(F_load, 0.0, K_wire, settings)


@scalar
def displacement_by_layer(alpha_outer, K_wire, settings):
    """Fixed displacement for constant wire force on every layer (classic levels 2 and 3) [-].

    alpha_outer is the setting on the outermost layer; the displacement shrinks with the diameter of the layer in use.
    """
    return clip(alpha_outer * settings.K_outer / K_wire, settings.alpha_min, 1.0)


RETURN = 0.2
"""Rate at which the stroke that was taken back is given again [1/s]: slow against the oil's swing, which a limit that
returns at once would feed. Assumed."""


class PowerLimit(NamedTuple):
    """P_max largest hydraulic power of all pumps together [W], at their constant speed also their torque limit; Q_p,
    Q_pp full flow of the active and of the passive pumps [m^3/s]."""

    P_max: float
    Q_p: float
    Q_pp: float


@scalar
def within_power(u, dp, Q, P):
    """Pump command u [-] that takes no more than P [W] from the drive; dp pressure that the pumps work against, from
    their suction to their pressure side for u > 0 [Pa]; Q flow at full stroke [m^3/s]. Where the load drives the pumps
    nothing is held back: with less displacement the oil would only brake it harder.
    """
    P_u = Q * u * dp
    return u * (P / P_u) if P_u > P else u


@scalar
def stroke_left(u, dp, Q, P, before, t_cycle):
    """Largest pump stroke that the torque limit leaves [-], from that of the cycle before: taken back at once, given
    again slowly.

    u, dp, Q, P as in `within_power`.
    """
    held = within_power(u, dp, Q, P)
    grown = fmin(before + RETURN * t_cycle, 1.0)
    return fmin(grown, abs(held)) if held != u else grown


@scalar
def within_stroke(u, left):
    """Pump command within the stroke that is left [-]."""
    return clip(u, -left, left)


class PassiveSettings(NamedTuple):
    """D_m_max all passive motors [m^3/rad]; Q_p_max all passive pumps [m^3/s]; p_lp low side [Pa]; p_set accumulator at
    mid stroke [Pa]; K_acc [1/Pa]; dp_least pressure below which the torque law stops dividing [Pa]; least displacement,
    1: fixed [-]."""

    D_m_max: float
    Q_p_max: float
    p_lp: float
    p_set: float
    K_acc: float
    dp_least: float
    least: float


@scalar
def displacement_for_weight(F_load, r_eff, p_hp, settings):
    """Displacement with which the passive motors hold the weight [-]; r_eff = drum radius / i_hD [m].

    Source: Moslatt 2020 F, system description: torque from load cell and measured pressure.
    """
    dp = fmax(p_hp - settings.p_lp, settings.dp_least)
    return clip(F_load * r_eff / (settings.D_m_max * dp), settings.least, 1.0)


@scalar
def make_up(p_mean, u_m, omega_op, settings):
    """Command of the passive pumps [-1, 1]: pressure error, and the oil that the operator's own motion takes [-].

    p_mean slow mean of the accumulator pressure [Pa]; omega_op motor speed that the operator asks for, hoisting
    positive [rad/s].
    """
    taken = settings.D_m_max * u_m * omega_op / settings.Q_p_max
    return clip(settings.K_acc * (settings.p_set - p_mean) + taken, -1.0, 1.0)


SMALL = 0.02
"""Pump command below which the winch counts as standing [-]: 2 % of its speed, no more than leakage takes."""


class BrakeSettings(NamedTuple):
    """fitted 1 where there is a brake, else 0; t_wait time at zero speed before it closes, t_close, t_open times of
    travel, t_most longest wait for the motors' torque [s]; dp_near pressure by which that torque may be off [Pa];
    K_fill pump command per missing pressure, K_leak pump command that replaces what leaks, per pressure [1/Pa]; u_most
    largest pump command against the closed brake [-].
    """

    fitted: float
    t_wait: float
    t_close: float
    t_open: float
    t_most: float
    dp_near: float
    K_fill: float
    K_leak: float
    u_most: float


IDLE_MOST = 1.0e6
"""Where the count of the idle time ends [s]: longer than any time that it is compared with, and short enough for a
cycle of a microsecond still to count."""


@scalar
def idle_time(idle, stands, t_cycle):
    """Time for which nothing was commanded [s], negative: time since a speed is commanded again."""
    return fmin(fmax(idle, 0.0) + t_cycle, IDLE_MOST) if stands else fmax(fmin(idle, 0.0) - t_cycle, -IDLE_MOST)


@scalar
def closed_share(on, idle, missing, s, t_cycle):
    """How far the brake is closed after this cycle, 0 open to 1 closed; on before it.

    idle as in `idle_time`; missing pressure by which the motors do not yet carry the load [Pa]. A closed brake waits
    for them, at most t_most; one that is half closed opens at once.
    """
    closes = s.fitted > 0.5 and idle >= s.t_wait
    opens = idle < 0.0 and (on < 1.0 or abs(missing) <= s.dp_near or idle <= -s.t_most)
    more = t_cycle / fmax(s.t_close, t_cycle) if closes else 0.0
    less = t_cycle / fmax(s.t_open, t_cycle) if opens else 0.0
    return clip(on + more - less, 0.0, 1.0)


@scalar
def fill(dp_load, missing, s):
    """Pump command that brings the motors to the load's torque behind a closed brake [-]."""
    return clip(s.K_fill * missing + s.K_leak * dp_load, -s.u_most, s.u_most)
