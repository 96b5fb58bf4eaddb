r"""Feedforward by the plant (FF): what friction, inertia, leakage and oil take of the wanted motion is commanded ahead,
with the share of the known friction, leakage and capacitance of the oil learned from pressures and motor speed.

Sources: feedforward by a plant and inverse of an actuator are textbook control (Åström and Hägglund, Advanced PID
Control, 2006, chapter 5); least squares with exponential forgetting as in Ljung, System Identification, 1999, section
11.2. What is put together here, its trust and its numbers are our own.
"""

from typing import Annotated, NamedTuple

from stillhook.control.commands import displacement_of_ssc, feedback
from stillhook.control.interface import Demand, Setting
from stillhook.control.plc import low_pass
from stillhook.physics.records import replace
from stillhook.physics.scalar import clip, fmax, scalar, sqrt

NAME = "ff"
LABEL = "FF"
TITLE = "feedforward by the plant (FF): friction, leakage and oil learned; motors as under SSC"
ORDER = 8
USES = ("u_thr", "alpha_min", "alpha_swl")
LEARNS = True

OMEGA_0 = 2.0
"""Speed over which friction is taken to reverse, least [rad/s]."""
OMEGA_TEACH = 4.0
"""Speed below which nothing is learned of friction [rad/s]: there it is on its way from one sign to the other."""
TAU_D = 0.03
"""Low-pass of differences of measured signals [s]."""
TAU_Q = 0.1
"""Low-pass of the flows, and of the pressure, that leakage and oil are learned from [s]."""
P_UNIT = 1.0e7
"""Unit of the pressures in sums [Pa]: all that is remembered is then of like size."""
P_RIDGE, P_DOT_RIDGE = 0.04, 0.14
"""Deviation of pressure over P_UNIT [-] and of its rate [1/s] as of which leakage and capacitance follow measurements
more than the crane file."""
RIDGE = 0.005
"""The same for friction over its known level, a variance [-]."""
TAU_DAMP = 0.2
"""Time in which a deviation of the pressure becomes its mean, which nothing is done about [s]."""
T_STEP = 0.02
"""Step of the differences by which wanted pressures are differentiated [s]."""
TAU_TRUST = 5.0
"""Time in which the law is blended in or out [s]."""
R_LEAST, R_ENOUGH = 0.3, 0.6
"""Share of the variance of the measured torque that friction must explain for some and for full trust [-]."""
W_LEAST, W_ENOUGH = 0.2, 0.4
"""The same of the memory's weight [-]: 22 % and 51 % of its time."""
AT_REST = 100.0
"""Times by which the memory is longer while nothing is learned for want of motion [-]."""
T_FROZEN = 1.0
"""Time after which a pressure that stays the same counts as lost [s]."""
ALPHA_LEAST = 0.05
"""Displacement below which nothing is divided by it [-]."""


class Settings(NamedTuple):
    """Table `[control.ff]` of a crane file."""

    tau_k: Annotated[float, Setting("time", "30 s", "memory of what is learned of the plant", least=5.0, most=3600.0)]
    tau_r: Annotated[
        float,
        Setting(
            "time", "90 ms", "time in which the known friction reverses", search=(0.02, 0.15), least=1e-3, most=1.0
        ),
    ]
    k_damp: Annotated[
        float, Setting("", 1.5, "damping by the pressure, over the known leakage", search=(0.0, 4.0), most=10.0)
    ]
    tau_load: Annotated[
        float, Setting("time", "10 s", "mean of the load cell for the load's part of leakage", least=1.0, most=3600.0)
    ]
    k_most: Annotated[float, Setting("", 4.0, "largest share of the known friction", least=0.1, most=20.0)]


class Memory(NamedTuple):
    """What it carries from cycle to cycle."""

    begun: float = 0.0  # 1 after the first cycle [-]
    trust: float = 0.0  # part of the law that is in force, the rest is SSC [-]
    u_p: float = 0.0  # command of the cycle before, within its limits [-]
    a_tip: float = 0.0  # signals of the cycle before, as in `Sensed`
    alpha_m: float = 0.0
    omega_m: float = 0.0
    dp: float = 0.0
    stood: float = 0.0  # time for which dp has not changed [s]
    j_tip: float = 0.0  # their rates, filtered [m/s^3]
    alpha_dot: float = 0.0  # [1/s]
    omega_dot: float = 0.0  # [rad/s^2]
    F_mean: float = 0.0  # slow mean of the load cell, over the SWL [-]
    alpha_p: float = 0.0  # stroke of the pumps by a model of their controls [-]
    alpha_p_dot: float = 0.0  # [1/s]
    p_off: float = 0.0  # mean of the deviation of the pressure from the wanted one, over P_UNIT [-]
    Q_f: float = 0.0  # flow that pumps give and motors do not take, filtered, over full flow [-]
    p_f: float = 0.0  # pressure difference, filtered, over P_UNIT [-]
    w: float = 0.0  # weight of what was learned [-]; then weighted sums
    x: float = 0.0  # of `frictions` x, z and of measured friction y over T_dry [-]
    z: float = 0.0
    y: float = 0.0
    xx: float = 0.0
    xz: float = 0.0
    zz: float = 0.0
    xy: float = 0.0
    zy: float = 0.0
    yy: float = 0.0
    p: float = 0.0  # the same of p_f [-], its rate d [1/s] and the flow q [-]
    d: float = 0.0
    q: float = 0.0
    pp: float = 0.0
    pd: float = 0.0
    dd: float = 0.0
    pq: float = 0.0
    dq: float = 0.0


class Wanted(NamedTuple):
    """Motion of the motors that is wanted."""

    omega: float  # speed, hoisting positive [rad/s]
    omega_dot: float  # [rad/s^2]
    omega_ddot: float  # [rad/s^3]
    alpha: float  # displacement [-]
    alpha_dot: float  # [1/s]


with_command = replace(Memory, "u_p", "trust", "p_off")


@scalar
def exp_falling(x):
    """(1 + x / 16)^-16, within 0.02 of exp(-x) for x >= 0: Structured Text has no exp with the same bits."""
    y = 1.0 / (1.0 + 0.0625 * x)
    y_4 = y * y * y * y
    return y_4 * y_4 * y_4 * y_4


@scalar
def frictions(omega, omega_0, plant):
    r"""The two parts of the known friction at the motor shaft over its level T_dry, against the motion, the reversal
    rounded: level with rise, and what falls off with the speed [-].

    .. math:: x = S + B \omega / T_{dry}, \quad z = S\,e^{-|\omega| i_{stick}}, \quad
        S = \tfrac12 \sigma (3 - \sigma^2), \quad \sigma = \frac{2 \omega}{3 \omega_0} \ \text{within} \pm 1
    """
    sigma = clip(omega / (1.5 * omega_0), -1.0, 1.0)
    S = 0.5 * sigma * (3.0 - sigma * sigma)
    return S + plant.B * omega / level(plant), S * exp_falling(abs(omega) * plant.i_omega_stick)


@scalar
def level(plant):
    """Known level of friction, never 0 [N m]."""
    return fmax(plant.T_dry, 1.0)


@scalar
def friction(omega, omega_0, k, k_stick, plant):
    """Friction at the motor shaft by learned shares [N m]."""
    x, z = frictions(omega, omega_0, plant)
    return (k * x + k_stick * z) * level(plant)


@scalar
def forgetting(held, a, b, x):
    """A weighted sum that forgets a part a of what it held and takes a part b of x."""
    return (1.0 - a) * held + b * x


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
    error = (a * a * m.xx + 2.0 * a * b * m.xz + b * b * m.zz - 2.0 * (a * m.xy + b * m.zy) + m.yy) / w
    mean = (a * m.x + b * m.z - m.y) / w
    var_y = m.yy / w - m.y * m.y / (w * w)
    return (var_y - error + mean * mean) / (var_y + RIDGE)


@scalar
def lag_of_oil(plant):
    """2 zeta_0 / omega_0 [s]: by what strong SSC's lead is longer for the oil, see
    `stillhook.analysis.controllers.lateness`; here friction and oil are inverted."""
    D_2 = fmax(plant.D_m * plant.D_m, 1e-12)
    return plant.B / (D_2 * fmax(plant.i_C_h, 1.0)) + plant.J * plant.G_leak / D_2


@scalar
def shaft_pressure(t, motion, omega_0, k, k_stick, plant):
    r"""Pressure difference that inertia and friction take, a time t from now [Pa].

    .. math:: p = \frac{J \dot\omega + T_f(\omega)}{D_m \alpha_m}
    """
    omega = motion.omega + t * (motion.omega_dot + 0.5 * t * motion.omega_ddot)
    T = plant.J * (motion.omega_dot + t * motion.omega_ddot) + friction(omega, omega_0, k, k_stick, plant)
    return T / (fmax(plant.D_m, 1e-9) * fmax(motion.alpha + t * motion.alpha_dot, ALPHA_LEAST))


@scalar
def reversal(omega_dot, tau_r, k, k_stick, plant):
    r"""Speed over which friction reverses: OMEGA_0, or what the speed changes by in the time in which pumps reverse the
    pressure, which grows with the friction at rest [rad/s].

    .. math:: \omega_0^2 = \Omega_0^2 + \left(\tau_r \frac{k + k_{stick}}{1 + T_{stick} / T_{dry}} \dot\omega\right)^2
    """
    change = tau_r * (k + k_stick) / (1.0 + plant.T_stick / level(plant)) * omega_dot
    return sqrt(OMEGA_0 * OMEGA_0 + change * change)


@scalar
def pump_flow(motion, dp_load, omega_0, k, k_stick, C, V, plant):
    r"""Stroke of the pumps with which the motors have the wanted motion, times the flow at full stroke [m^3/s].

    .. math:: Q = D_m \alpha_m \omega + C (p_{load} + p) + V \dot p, \quad
        u\,Q_p = Q + \frac{2 \zeta_p}{\omega_{np}} \dot Q + \frac{1}{\omega_{np}^2} \ddot Q

    Rates of p by central differences over T_STEP; of the second rate of Q what pressure adds is left out.
    """
    D, D_dot, omega, omega_dot = plant.D_m * motion.alpha, plant.D_m * motion.alpha_dot, motion.omega, motion.omega_dot
    before = shaft_pressure(-T_STEP, motion, omega_0, k, k_stick, plant)
    p = shaft_pressure(0.0, motion, omega_0, k, k_stick, plant)
    later = shaft_pressure(T_STEP, motion, omega_0, k, k_stick, plant)
    p_dot, p_ddot = (later - before) / (2.0 * T_STEP), (later - 2.0 * p + before) / (T_STEP * T_STEP)
    Q = D * omega + C * (dp_load + p) + V * p_dot
    Q_dot = D * omega_dot + D_dot * omega + C * p_dot + V * p_ddot
    Q_ddot = D * motion.omega_ddot + 2.0 * D_dot * omega_dot
    i_np = 1.0 / fmax(plant.omega_np, 1.0)
    return Q + i_np * (2.0 * plant.zeta_p * Q_dot + i_np * Q_ddot)


@scalar
def learn(y, plc, s, m):
    """What is remembered of a cycle y: rates of signals, a model of the pumps' strokes, and while the shaft turns the
    sums of both regressions. The pumps at their limit and a pressure that is the same for T_FROZEN teach nothing, and
    what was learned fades.

    Measured friction: (dp - dp_load) D_m alpha_m - J domega/dt [N m]; flow that the motors do not take:
    Q_p alpha_p - D_m alpha_m omega_m [m^3/s], alpha_p by a step of the pumps' controls (backward Euler).
    """
    plant, h, begun, omega_np = plc.plant, plc.t_cycle, m.begun, plc.plant.omega_np
    omega_dot = rate(m.omega_dot, m.omega_m, y.omega_m, begun, h)
    alpha_p_dot = (m.alpha_p_dot + h * omega_np * omega_np * (m.u_p - m.alpha_p)) / (
        1.0 + h * omega_np * (2.0 * plant.zeta_p + h * omega_np)
    )
    alpha_p = m.alpha_p + h * alpha_p_dot
    p, F = y.dp / P_UNIT, y.F / fmax(plant.SWL, 1.0)
    p_f = p + begun * (low_pass(m.p_f, p, TAU_Q, h) - p)
    Q_f = low_pass(m.Q_f, y.f_pump * alpha_p - plant.D_m * y.alpha_m * y.omega_m / fmax(plant.Q_p, 1e-9), TAU_Q, h)
    d_f = begun * (p_f - m.p_f) / h
    x, z = frictions(y.omega_m, OMEGA_0, plant)
    T_f = ((y.dp - y.dp_load) * plant.D_m * y.alpha_m - plant.J * omega_dot) / level(plant)
    stood = m.stood + h if y.dp == m.dp else 0.0
    moves = abs(y.omega_m) > OMEGA_TEACH
    a = h / (s.tau_k * (1.0 if moves else AT_REST) + h)
    b = a if moves and abs(m.u_p) < 1.0 and stood < T_FROZEN else 0.0
    return Memory(
        begun=1.0,
        trust=m.trust,
        u_p=m.u_p,
        a_tip=y.a_tip,
        alpha_m=y.alpha_m,
        omega_m=y.omega_m,
        dp=y.dp,
        stood=stood,
        j_tip=rate(m.j_tip, m.a_tip, y.a_tip, begun, h),
        alpha_dot=rate(m.alpha_dot, m.alpha_m, y.alpha_m, begun, h),
        omega_dot=omega_dot,
        F_mean=F + begun * (low_pass(m.F_mean, F, s.tau_load, h) - F),
        alpha_p=alpha_p,
        alpha_p_dot=alpha_p_dot,
        p_off=m.p_off,
        Q_f=Q_f,
        p_f=p_f,
        w=forgetting(m.w, a, b, 1.0),
        x=forgetting(m.x, a, b, x),
        z=forgetting(m.z, a, b, z),
        y=forgetting(m.y, a, b, T_f),
        xx=forgetting(m.xx, a, b, x * x),
        xz=forgetting(m.xz, a, b, x * z),
        zz=forgetting(m.zz, a, b, z * z),
        xy=forgetting(m.xy, a, b, x * T_f),
        zy=forgetting(m.zy, a, b, z * T_f),
        yy=forgetting(m.yy, a, b, T_f * T_f),
        p=forgetting(m.p, a, b, p_f),
        d=forgetting(m.d, a, b, d_f),
        q=forgetting(m.q, a, b, Q_f),
        pp=forgetting(m.pp, a, b, p_f * p_f),
        pd=forgetting(m.pd, a, b, p_f * d_f),
        dd=forgetting(m.dd, a, b, d_f * d_f),
        pq=forgetting(m.pq, a, b, p_f * Q_f),
        dq=forgetting(m.dq, a, b, d_f * Q_f),
    )


@scalar
def learned(m, plant, k_most):
    """Shares k and k_stick of the known friction [-], leakage C [m^3/s/Pa] and capacitance V [m^3/Pa], all within their
    bounds, and the trust that they deserve [-]."""
    w, G, V_0 = fmax(m.w, 1e-6), plant.G_leak, 1.0 / fmax(plant.i_C_h, 1.0)
    r_p, r_d, unit = P_RIDGE * P_RIDGE, P_DOT_RIDGE * P_DOT_RIDGE, fmax(plant.Q_p, 1e-9) / P_UNIT
    k, k_stick = least_squares(
        w, m.x, m.z, m.y, m.xx, m.xz, m.zz, m.xy, m.zy, RIDGE, RIDGE, 1.0, plant.T_stick / level(plant)
    )
    c, v = least_squares(w, m.p, m.d, m.q, m.pp, m.pd, m.dd, m.pq, m.dq, r_p, r_d, G / unit, V_0 / unit)
    within = ramp(k, 0.0, 0.1) * (1.0 - ramp(k, 0.9 * k_most, k_most))
    sound = ramp(explained(m, w, k, k_stick), R_LEAST, R_ENOUGH) * ramp(m.w, W_LEAST, W_ENOUGH) * within
    trust = sound if plant.omega_np > 0.0 and plant.D_m > 0.0 and plant.Q_p > 0.0 else 0.0
    k, k_stick = clip(k, 0.0, k_most), clip(k_stick, 0.0, k_most)
    return k, k_stick, clip(c * unit, 0.2 * G, 4.0 * G), clip(v * unit, 0.5 * V_0, 2.0 * V_0), trust


@scalar
def cycle(r, plc, s, m):
    r"""Demand of one PLC cycle, and what it remembers.

    .. math:: u_p = u_{SSC} + \gamma\,(u - K_p e_c / f_{pump} - u_{SSC})

    u of `pump_flow`, with the damping, over the flow of the pumps that run. gamma, the trust, is 0 where the crane has
    no closed circuit, until a part of the memory is full, where friction does not explain what is measured, and where
    its share is at a bound; it follows with TAU_TRUST. Motors as under SSC.

    Leads: t_lead and t_lead_ff of the crane, as for strong SSC. What they have for the oil is taken off, and off that
    of the feedback half a cycle and the computing time, which that of the feedforward has at least. The acceleration
    may be that of a later time t_a already, and the displacement is measured without the motion unit's lateness.

    Damping: friction that falls with the speed makes winch and oil swing, sticking and slipping. Of the pressure beyond
    the wanted one, without its mean, the pumps give k_damp times the known leakage less.

    The load's part of leakage goes by a slow mean of the load cell: by its present value the load's swing on its wire
    would lose the damping that leakage gives it.
    """
    y, plant, h = r.y, plc.plant, plc.t_cycle
    n = learn(y, plc, s, m)
    k, k_stick, C, V, sound = learned(n, plant, s.k_most)
    trust = low_pass(m.trust, sound, TAU_TRUST, h)

    late, oil = plc.t_compute + 0.5 * h, lag_of_oil(plant)
    t_ff, t_fb = fmax(plc.t_lead_ff - oil, late), fmax(plc.t_lead - oil - late, 0.0)
    r_w = 0.5 * plant.d_max / (y.K_wire * plant.i_hD)
    t_mid = 0.5 * (t_fb + plc.t_lead)
    e_c = r.e_c + (t_fb - plc.t_lead) * (y.v_tip + (t_mid - plc.t_lead_ff) * y.a_tip)
    motion = Wanted(
        omega=-(y.v_tip + (t_ff - plc.t_lead_ff) * y.a_tip - y.v_op) / r_w,
        omega_dot=-(y.a_tip + (t_ff - r.t_a) * n.j_tip) / r_w,
        omega_ddot=-n.j_tip / r_w,
        alpha=fmax(y.alpha_m + late * n.alpha_dot, ALPHA_LEAST),
        alpha_dot=n.alpha_dot,
    )
    dp_load = y.dp_load + (n.F_mean * plant.SWL - y.F) * r_w / fmax(plant.D_m * fmax(y.alpha_m, ALPHA_LEAST), 1e-9)
    omega_0 = reversal(motion.omega_dot, s.tau_r, k, k_stick, plant)
    p_off = (y.dp - dp_load - shaft_pressure(-late, motion, omega_0, k, k_stick, plant)) / P_UNIT
    p_mean = p_off + m.begun * (low_pass(m.p_off, p_off, TAU_DAMP, h) - p_off)
    Q_damp = s.k_damp * plant.G_leak * (p_off - p_mean) * P_UNIT
    Q = pump_flow(motion, dp_load, omega_0, k, k_stick, C, V, plant) - Q_damp
    u_ssc = r.u_ff + r.u_fb
    u_plant = (Q / fmax(plant.Q_p, 1e-9) + feedback(e_c, plc.gains)) / y.f_pump
    u_p = u_ssc + trust * (u_plant - u_ssc)
    return Demand(u_p, displacement_of_ssc(r, plc.motors)), with_command(n, clip(u_p, -1.0, 1.0), trust, p_mean)
