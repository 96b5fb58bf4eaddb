r"""Feedforward by the plant (FF): what friction, inertia, leakage and oil take of the wanted motion is commanded ahead,
with the share of the known friction, leakage and capacitance of the oil learned from pressures and motor speed.

Sources: feedforward by a plant and inverse of an actuator are textbook control (Åström and Hägglund, Advanced PID
Control, 2006, section 5); least squares with exponential forgetting as in Ljung, System Identification, 1999, section
11.2. What is put together here, its trust and its numbers are our own.
"""

from typing import Annotated, NamedTuple

from stillhook.control.commands import displacement_min_moving, displacement_ssc, feedback, reduction_linear
from stillhook.control.interface import Demand, Setting
from stillhook.control.plc import low_pass
from stillhook.physics.records import replace
from stillhook.physics.scalar import clip, copysign, exp, fmax, scalar, sqrt

NAME = "ff"
LABEL = "FF"
TITLE = "feedforward by the plant (FF): friction, leakage and oil learned; motors as under SSC"
ORDER = 8
USES = ("u_thr", "alpha_min", "alpha_swl")

OMEGA_0 = 2.0
"""Speed over which friction is taken to reverse, least [rad/s]."""
OMEGA_TEACH = 4.0
"""Speed below which nothing is learned of friction [rad/s]: there it is on its way from one sign to the other."""
TAU_D = 0.03
"""Low-pass of differences of measured signals [s]."""
TAU_Q = 0.1
"""Low-pass of the flows, and of the pressure, that leakage and oil are learned from [s]."""
P_RIDGE, P_DOT_RIDGE = 4.0e5, 1.4e6
"""Deviation of pressure [Pa] and of its rate [Pa/s] to which the known leakage and capacitance count as measured."""
RIDGE = 0.005
"""The same for friction, over the known one, squared [-]."""
T_STEP = 0.02
"""Step of the differences by which wanted pressures are differentiated [s]."""
TAU_TRUST = 5.0
"""Time in which the law comes in or goes [s]."""
R_LEAST, R_ENOUGH = 0.3, 0.6
"""Share of the variance of the measured torque that friction must explain for some and for full trust [-]."""
W_LEAST, W_ENOUGH = 0.2, 0.4
"""The same of the memory's weight [-]: 22 % and 51 % of its time."""
ALPHA_LEAST = 0.05
"""Displacement below which nothing is divided by it [-]."""


class Settings(NamedTuple):
    """Table `[control.ff]` of a crane file."""

    tau_k: Annotated[float, Setting("time", "30 s", "memory of what is learned of the plant", least=5.0, most=3600.0)]
    tau_r: Annotated[
        float, Setting("time", "50 ms", "time in which friction reverses", search=(0.02, 0.15), least=1e-3, most=1.0)
    ]
    tau_load: Annotated[
        float, Setting("time", "10 s", "mean of the load cell for the load's part of leakage", least=1.0, most=3600.0)
    ]
    k_most: Annotated[float, Setting("", 4.0, "largest share of the known friction", least=0.1, most=20.0)]


class Memory(NamedTuple):
    """What it carries from cycle to cycle."""

    begun: float = 0.0  # 1 after the first cycle [-]
    trust: float = 0.0  # part of the law that is in force, the rest is SSC [-]
    a_tip: float = 0.0  # signals of the cycle before
    alpha_m: float = 0.0
    omega_m: float = 0.0
    dp: float = 0.0
    j_tip: float = 0.0  # their rates, filtered [m/s^3]
    alpha_dot: float = 0.0  # [1/s]
    omega_dot: float = 0.0  # [rad/s^2]
    F_mean: float = 0.0  # slow mean of the load cell [N]
    u_p: float = 0.0  # command of the cycle before, within its limits [-]
    alpha_p: float = 0.0  # stroke of the pumps by a model of their controls [-]
    alpha_p_dot: float = 0.0  # [1/s]
    Q_f: float = 0.0  # flow that pumps give and motors do not take, filtered [m^3/s]
    p_f: float = 0.0  # pressure difference, filtered [Pa]
    w: float = 0.0  # weight of what was learned [-]; then weighted sums
    x: float = 0.0  # of `frictions` x, z and measured friction y [N m]
    z: float = 0.0
    y: float = 0.0
    xx: float = 0.0
    xz: float = 0.0
    zz: float = 0.0
    xy: float = 0.0
    zy: float = 0.0
    yy: float = 0.0
    p: float = 0.0  # the same of pressure [Pa], its rate and the flow
    d: float = 0.0
    q: float = 0.0
    pp: float = 0.0
    pd: float = 0.0
    dd: float = 0.0
    pq: float = 0.0
    dq: float = 0.0


with_command = replace(Memory, "u_p", "trust")


@scalar
def frictions(omega, omega_0, plant):
    r"""The two parts of the known friction at the motor shaft, against the motion, the reversal rounded: level with
    rise, and what falls off with the speed, over its known share of the level [N m].

    .. math:: x = \tanh(\omega/\omega_0)\,T_{dry} + B \omega, \quad
        z = \tanh(\omega/\omega_0)\,T_{dry}\,e^{-|\omega| i_{stick}}
    """
    E = exp(-2.0 * clip(abs(omega) / omega_0, 0.0, 20.0))
    T = copysign((1.0 - E) / (1.0 + E), omega) * plant.T_dry
    return T + plant.B * omega, T * exp(-abs(omega) * plant.i_omega_stick)


@scalar
def friction(omega, omega_0, k, k_stick, plant):
    """Friction at the motor shaft by learned shares [N m]."""
    x, z = frictions(omega, omega_0, plant)
    return k * x + k_stick * z


@scalar
def weighted(held, x, keep, more):
    """A weighted sum that forgets: keep of what it held, and more of x."""
    return keep * held + more * x


@scalar
def rate(held, before, now, begun, t_cycle):
    """Filtered rate of a measured signal [1/s of it]; 0 in the first cycle."""
    return begun * low_pass(held, (now - before) / t_cycle, TAU_D, t_cycle)


@scalar
def ramp(x, least, enough):
    """0 up to least, 1 from enough on."""
    return clip((x - least) / (enough - least), 0.0, 1.0)


@scalar
def least_squares(w, x, z, y, xx, xz, zz, xy, zy, r_x, r_z, a_0, b_0):
    """a and b of y = a x + b z + intercept, by weighted sums; the intercept takes drift and offset of pressures and
    load cell. r_x, r_z variances of x and z to which the known a_0 and b_0 count as measured: where x and z do not
    change, a and b are those."""
    c_xx, c_xz, c_zz = xx / w - x * x / (w * w) + r_x, xz / w - x * z / (w * w), zz / w - z * z / (w * w) + r_z
    c_xy, c_zy = xy / w - x * y / (w * w) + r_x * a_0, zy / w - z * y / (w * w) + r_z * b_0
    det = c_xx * c_zz - c_xz * c_xz
    return (c_xy * c_zz - c_zy * c_xz) / det, (c_zy * c_xx - c_xy * c_xz) / det


@scalar
def explained(m, w, a, b):
    """Part of the variance of the measured friction that a x + b z explains [-]."""
    x, y = a * m.x + b * m.z, m.y
    var_y = m.yy / w - y * y / (w * w)
    error = (a * a * m.xx + 2.0 * a * b * m.xz + b * b * m.zz - 2.0 * (a * m.xy + b * m.zy) + m.yy) / w
    return 1.0 - (error - (x - y) * (x - y) / (w * w)) / fmax(var_y, 1e-3)


@scalar
def lag_of_oil(plant):
    """2 zeta_0 / omega_0 [s]: by what strong SSC's lead is longer for the oil, see
    `stillhook.analysis.controllers.lateness`; here friction and oil are inverted."""
    D_2 = fmax(plant.D_m * plant.D_m, 1e-12)
    return plant.B / (D_2 * fmax(plant.i_C_h, 1.0)) + plant.J * plant.G_leak / D_2


@scalar
def pump_command(omega, omega_dot, omega_ddot, alpha, alpha_dot, dp_load, k, k_stick, C, V, tau_r, plant):
    r"""Stroke of the pumps with which the motors have the wanted speed omega [rad/s], times the flow at full stroke
    [m^3/s].

    .. math:: p = \frac{J \dot\omega + k T_f(\omega)}{D_m \alpha_m}, \quad
        Q = D_m \alpha_m \omega + C (p_{load} + p) + V \dot p, \quad
        u\,Q_p = Q + \frac{2 \zeta_p}{\omega_{np}} \dot Q + \frac{1}{\omega_{np}^2} \ddot Q

    Rates of p by central differences over T_STEP, in which omega goes on by its rates; of the second rate of Q what
    pressure adds is left out. Friction reverses over OMEGA_0, or over what omega changes by in tau_r.
    """
    h, D = T_STEP, plant.D_m * alpha
    D_dot = plant.D_m * alpha_dot
    omega_0 = sqrt(OMEGA_0 * OMEGA_0 + tau_r * tau_r * omega_dot * omega_dot)
    later, before = omega + h * (omega_dot + 0.5 * h * omega_ddot), omega - h * (omega_dot - 0.5 * h * omega_ddot)
    least = plant.D_m * ALPHA_LEAST
    p = (plant.J * omega_dot + friction(omega, omega_0, k, k_stick, plant)) / D
    p_1 = (plant.J * (omega_dot + h * omega_ddot) + friction(later, omega_0, k, k_stick, plant)) / fmax(
        D + h * D_dot, least
    )
    p_0 = (plant.J * (omega_dot - h * omega_ddot) + friction(before, omega_0, k, k_stick, plant)) / fmax(
        D - h * D_dot, least
    )
    p_dot, p_ddot = (p_1 - p_0) / (2.0 * h), (p_1 - 2.0 * p + p_0) / (h * h)
    Q = D * omega + C * (dp_load + p) + V * p_dot
    Q_dot = D * omega_dot + D_dot * omega + C * p_dot + V * p_ddot
    Q_ddot = D * omega_ddot + 2.0 * D_dot * omega_dot
    i_np = 1.0 / plant.omega_np
    return Q + 2.0 * plant.zeta_p * i_np * Q_dot + i_np * i_np * Q_ddot


@scalar
def cycle(r, plc, s, m):
    r"""Demand of one PLC cycle, and what it remembers.

    .. math:: u_p = u_{SSC} + \gamma\,(u - K_p e_c - u_{SSC})

    u of `pump_command`, gamma the trust: 0 where the crane file has no closed circuit, until half of the memory is
    full, where friction does not explain the measured torque, and where its share is at its bound. Learned are, while
    the shaft turns, the pressures change and the pumps are within their limits, `regressed` from
    (dp - dp_load) D_m alpha_m - J domega/dt and `leakage_and_capacitance` from Q_p alpha_p - D_m alpha_m omega_m.

    Leads: the crane's, t_lead and t_lead_ff, as for strong SSC. What they have for the oil is taken off, and off that
    of the feedback half a cycle and the computing time; that of the feedforward is not shorter than these.
    """
    y, plant, h = r.y, plc.plant, plc.t_cycle
    known = plant.omega_np > 0.0 and plant.D_m > 0.0 and plant.Q_p > 0.0
    begun = m.begun
    j_tip = rate(m.j_tip, m.a_tip, y.a_tip, begun, h)
    alpha_dot = rate(m.alpha_dot, m.alpha_m, y.alpha_m, begun, h)
    omega_dot = rate(m.omega_dot, m.omega_m, y.omega_m, begun, h)
    F_mean = low_pass(m.F_mean, y.F, s.tau_load, h) if begun > 0.0 else y.F
    r_w = 0.5 * plant.d_max / (y.K_wire * plant.i_hD)
    D_now = fmax(plant.D_m * fmax(y.alpha_m, ALPHA_LEAST), 1e-9)

    # what is learned
    moves = abs(y.omega_m) > OMEGA_TEACH
    teaches = moves and abs(m.u_p) < 1.0 and y.dp != m.dp and begun > 0.0
    add = h / (s.tau_k + h)
    keep, more = (1.0 - add, add if teaches else 0.0) if moves else (1.0, 0.0)
    x, z = frictions(y.omega_m, OMEGA_0, plant)
    T_f = (y.dp - y.dp_load) * D_now - plant.J * omega_dot
    omega_2 = plant.omega_np * plant.omega_np
    alpha_p_dot = (m.alpha_p_dot + h * omega_2 * (m.u_p - m.alpha_p)) / (
        1.0 + 2.0 * h * plant.zeta_p * plant.omega_np + h * h * omega_2
    )
    alpha_p = m.alpha_p + h * alpha_p_dot
    Q_f = low_pass(m.Q_f, plant.Q_p * y.f_pump * alpha_p - plant.D_m * y.alpha_m * y.omega_m, TAU_Q, h)
    p_f = low_pass(m.p_f, y.dp, TAU_Q, h) if begun > 0.0 else y.dp
    d_f = begun * (p_f - m.p_f) / h
    n = Memory(
        begun=1.0,
        trust=m.trust,
        a_tip=y.a_tip,
        alpha_m=y.alpha_m,
        omega_m=y.omega_m,
        dp=y.dp,
        j_tip=j_tip,
        alpha_dot=alpha_dot,
        omega_dot=omega_dot,
        F_mean=F_mean,
        u_p=m.u_p,
        alpha_p=alpha_p,
        alpha_p_dot=alpha_p_dot,
        Q_f=Q_f,
        p_f=p_f,
        w=weighted(m.w, 1.0, keep, more),
        x=weighted(m.x, x, keep, more),
        z=weighted(m.z, z, keep, more),
        y=weighted(m.y, T_f, keep, more),
        xx=weighted(m.xx, x * x, keep, more),
        xz=weighted(m.xz, x * z, keep, more),
        zz=weighted(m.zz, z * z, keep, more),
        xy=weighted(m.xy, x * T_f, keep, more),
        zy=weighted(m.zy, z * T_f, keep, more),
        yy=weighted(m.yy, T_f * T_f, keep, more),
        p=weighted(m.p, p_f, keep, more),
        d=weighted(m.d, d_f, keep, more),
        q=weighted(m.q, Q_f, keep, more),
        pp=weighted(m.pp, p_f * p_f, keep, more),
        pd=weighted(m.pd, p_f * d_f, keep, more),
        dd=weighted(m.dd, d_f * d_f, keep, more),
        pq=weighted(m.pq, p_f * Q_f, keep, more),
        dq=weighted(m.dq, d_f * Q_f, keep, more),
    )
    w = fmax(n.w, 1e-6)
    T_2, G, i_C = fmax(plant.T_dry * plant.T_dry, 1.0), plant.G_leak, fmax(plant.i_C_h, 1.0)
    k_known = plant.T_stick / fmax(plant.T_dry, 1.0)
    k, k_stick = least_squares(w, n.x, n.z, n.y, n.xx, n.xz, n.zz, n.xy, n.zy, RIDGE * T_2, RIDGE * T_2, 1.0, k_known)
    r_2 = explained(n, w, k, k_stick)
    r_p, r_d = P_RIDGE * P_RIDGE, P_DOT_RIDGE * P_DOT_RIDGE
    C, V = least_squares(w, n.p, n.d, n.q, n.pp, n.pd, n.dd, n.pq, n.dq, r_p, r_d, G, 1.0 / i_C)
    C, V = clip(C, 0.2 * G, 4.0 * G), clip(V, 0.5 / i_C, 2.0 / i_C)
    within = ramp(k, 0.0, 0.1) * (1.0 - ramp(k, 0.9 * s.k_most, s.k_most))
    wanted = ramp(n.w, W_LEAST, W_ENOUGH) * ramp(r_2, R_LEAST, R_ENOUGH) * within if known else 0.0
    trust = low_pass(m.trust, wanted, TAU_TRUST, h)

    # what is commanded
    late = plc.t_compute + 0.5 * h
    oil = lag_of_oil(plant)
    t_ff, t_fb = fmax(plc.t_lead_ff - oil, late), fmax(plc.t_lead - oil - late, 0.0)
    v = y.v_tip - plc.t_lead_ff * y.a_tip
    omega = -(v + t_ff * y.a_tip - y.v_op) / r_w
    dp_load = y.dp_load + (F_mean - y.F) * r_w / D_now
    alpha = fmax(y.alpha_m + t_ff * alpha_dot, ALPHA_LEAST)
    Q = pump_command(
        omega,
        -(y.a_tip + t_ff * j_tip) / r_w,
        -j_tip / r_w,
        alpha,
        alpha_dot,
        dp_load,
        clip(k, 0.0, s.k_most),
        clip(k_stick, 0.0, s.k_most),
        C,
        V,
        s.tau_r,
        plant,
    )
    e_c = r.e_c + (t_fb - plc.t_lead) * (v + 0.5 * (t_fb + plc.t_lead) * y.a_tip)
    u_plant = (Q / plant.Q_p + feedback(e_c, plc.gains)) / y.f_pump
    u_ssc = r.u_ff + r.u_fb
    u_p = u_ssc + trust * (u_plant - u_ssc) if known else u_ssc
    k_red, alpha_min = (
        reduction_linear(r.u_ff, plc.motors.u_thr),
        displacement_min_moving(r.F, y.a_tip, y.K_wire, plc.motors),
    )
    return Demand(u_p, displacement_ssc(k_red, alpha_min)), with_command(n, clip(u_p, -1.0, 1.0), trust)
