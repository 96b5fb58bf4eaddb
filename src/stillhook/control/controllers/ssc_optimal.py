r"""Semi-secondary control whose displacement is the optimum of a cost of pressure, flow and travel, with pumps that
follow the displacement's rate and pre-load the oil against stick-slip where the motion reverses.

Source: own; the smallest displacement is that of Moslatt 2020 eq. 2.11. Differs from eqs 2.9 and 2.10, which reduce the
motors with the pump command beyond a threshold, whatever the pressure and whatever the displacement that has been
reached.
"""

from typing import Annotated, NamedTuple

from stillhook.control.commands import displacement_min_moving, displacement_ssc, reduction_linear
from stillhook.control.interface import Demand, Setting
from stillhook.control.plc import low_pass
from stillhook.physics.scalar import clip, fmax, fmin, scalar, sqrt

NAME = "ssc-optimal"
TITLE = "semi-secondary control with motors at the optimum of pressure, flow and travel"
ORDER = 9
USES = ("u_thr", "alpha_min", "alpha_swl")

P_1 = 3.5e7
"""Pressure difference that costs 1 [Pa]: what closed circuits are permanently built for."""
P_LEAST = 1.0e6
"""Least pressure difference that counts [Pa]."""
U_LEAST = 0.05
"""Least part of the flow that counts [-]: below, any displacement is possible."""
ALPHA_LEAST = 0.05
"""Displacement below which nothing is divided by it [-]."""
TAU_D = 0.03
"""Low-pass of the rate of the measured displacement [s]."""
V_REVERSAL = 0.02
"""Wire speed over which friction reverses [m/s]."""
TAU_LOAD = 0.1
"""Time in which the oil of a reversal is pumped [s]."""


class Settings(NamedTuple):
    """Table `[control.ssc_optimal]` of a crane file."""

    w_Q: Annotated[float, Setting("", 0.0, "cost of full flow, that of 350 bar being 1", search=(0.0, 1.0), most=100.0)]
    w_s: Annotated[float, Setting("time", "0 s", "cost of the motors' travel", search=(0.0, 5.0), most=3600.0)]
    u_most: Annotated[
        float, Setting("", 0.9, "largest share of the pumps' flow", search=(0.75, 0.95), least=0.1, most=1.0)
    ]
    t_ahead: Annotated[
        float, Setting("time", "0.3 s", "time by which the motors act ahead", search=(0.1, 0.6), most=5.0)
    ]
    k_rate: Annotated[
        float, Setting("", 0.7, "part of the displacement's rate that pumps follow", search=(0.3, 1.0), most=1.5)
    ]
    k_load: Annotated[
        float,
        Setting("", 0.7, "part of the known friction that reversals are pre-loaded by", search=(0.0, 1.0), most=1.0),
    ]


class Memory(NamedTuple):
    """What it carries from cycle to cycle."""

    begun: float = 0.0  # 1 after the first cycle [-]
    u_m: float = 1.0  # demand of the cycle before [-]
    alpha_m: float = 1.0  # displacement that was measured in it [-]
    alpha_dot: float = 0.0  # its rate, filtered [1/s]
    sigma: float = 0.0  # direction of the motion, filtered [-]


@scalar
def pressure_at_full(y, r_w, plant):
    r"""Pressure difference for friction, inertia and the active motors' part of the load at full displacement [Pa].

    .. math:: p_1 = \frac{T_{dry} + B |\omega| + J |\dot\omega|}{D_m} + |p_{load}| \alpha_m

    r_w wire per motor angle on the layer in use [m/rad].
    """
    T = plant.T_dry + (plant.B * abs(y.v_tip - y.v_op) + plant.J * abs(y.a_tip)) / r_w
    return fmax(T / fmax(plant.D_m, 1e-9) + abs(y.dp_load) * y.alpha_m, P_LEAST)


@scalar
def newton(alpha, before, A, B, w):
    r"""A step from alpha to the least of the cost, which is convex for alpha > 0, at most by half [-].

    .. math:: c = \frac{A}{\alpha^2} + B \alpha^2 + w (\alpha - \alpha_{before})^2
    """
    i_2 = 1.0 / (alpha * alpha)
    slope = B * alpha - A * i_2 / alpha + w * (alpha - before)
    return clip(alpha - slope / (3.0 * A * i_2 * i_2 + B + w), 0.5 * alpha, 2.0 * alpha)


@scalar
def largest_displacement(U, U_leak, u_most):
    """The larger alpha with U alpha + U_leak / alpha = u_most: flow of the motion, and leakage at its pressure [-].
    Where leakage alone takes u_most, that of the least flow."""
    return (u_most + sqrt(fmax(u_most * u_most - 4.0 * U * U_leak, 0.0))) / (2.0 * U)


@scalar
def unhurried(U, p_1, s):
    """Displacement of the least cost without travel, full where that is beyond it [-]: where the law begins."""
    square = p_1 / (P_1 * U * sqrt(fmax(s.w_Q, 1e-9)))
    return fmin(sqrt(square), 1.0)


@scalar
def optimal_displacement(U, p_1, U_leak, before, s, t_cycle):
    r"""Displacement of the least cost within the flow of the pumps [-].

    .. math:: \min_\alpha \left(\frac{p_1}{\alpha P_1}\right)^2 + w_Q (U \alpha)^2
        + \frac{w_s}{h} (\alpha - \alpha_{before})^2, \quad U \alpha + \frac{U_{leak}}{\alpha} \le u_{most}

    U share of the flow that the motion takes at full displacement [-]. Leakage's power has the form of the first part,
    motor speed over its limit that of the second. Without travel alpha^4 = p_1^2 / (P_1^2 w_Q U^2). Three steps of
    Newton from the demand of the cycle before.
    """
    A, B, w = p_1 * p_1 / (P_1 * P_1), s.w_Q * U * U, s.w_s / t_cycle
    alpha = newton(newton(newton(before, before, A, B, w), before, A, B, w), before, A, B, w)
    return fmin(alpha, largest_displacement(U, U_leak, s.u_most))


@scalar
def pre_load(sigma_dot, alpha_m, y, plant):
    r"""Pump command that fills the oil to the other sign of the known dry friction, while the motion reverses [-].

    .. math:: u = \frac{T_{dry}}{D_m \alpha_m} \frac{\dot\sigma}{i_C Q_p}

    Its volume is that by which line A, line B held by the boost pump, goes from one friction pressure to the other.
    """
    V = plant.T_dry / (fmax(plant.D_m, 1e-9) * alpha_m * fmax(plant.i_C_h, 1.0))
    return V * sigma_dot / fmax(plant.Q_p * y.f_pump, 1e-9)


@scalar
def cycle(r, plc, s, m):
    r"""Demand of one PLC cycle, and what it remembers.

    .. math:: u_p = u_{ff} \left(1 + k_{rate}\,t\,\frac{\dot\alpha_m}{\alpha_m}\right) + u_{fb}
        + k_{load} u_{load}, \quad t = \frac{K_2}{K_1} + t_{lead,ff}

    u_ff has the displacement as factor: pumps that follow it late let a moving displacement through to the wire. Flow
    and pressure are those of the tip's motion now, and t_ahead later. Without known motors (D_m = 0) it is SSC.
    """
    y, plant, motors, gains, h = r.y, plc.plant, plc.motors, plc.gains, plc.t_cycle
    known = 1.0 if plant.D_m > 0.0 else 0.0
    alpha_m = fmax(y.alpha_m, ALPHA_LEAST)
    alpha_dot = low_pass(m.alpha_dot, m.begun * (alpha_m - m.alpha_m) / h, TAU_D, h)
    r_w = 0.5 * plant.d_max / (y.K_wire * plant.i_hD)
    U_later = gains.K_1 * abs(y.v_tip + s.t_ahead * y.a_tip - y.v_op) * y.K_wire / y.f_pump
    U = fmax(fmax(abs(r.u_ff) / alpha_m, U_later), U_LEAST)
    p_1 = pressure_at_full(y, r_w, plant)
    U_leak = plant.G_leak * p_1 / fmax(plant.Q_p * y.f_pump, 1e-9)
    least = displacement_min_moving(r.F, y.a_tip, y.K_wire, motors)
    before = m.u_m if m.begun > 0.5 else unhurried(U, p_1, s)
    best = clip(optimal_displacement(U, p_1, U_leak, before, s, h), fmax(least, ALPHA_LEAST), 1.0)
    u_m = best if known > 0.5 else displacement_ssc(reduction_linear(r.u_ff, motors.u_thr), least)
    t = known * s.k_rate * (gains.K_2 / fmax(gains.K_1, 1e-9) + plc.t_lead_ff)
    direction = clip((y.v_op - y.v_tip) / V_REVERSAL, -1.0, 1.0)
    sigma = low_pass(m.sigma, direction, TAU_LOAD, h) if m.begun > 0.5 else direction
    u_load = s.k_load * pre_load(m.begun * (sigma - m.sigma) / h, alpha_m, y, plant)
    u_p = r.u_ff * (1.0 + t * alpha_dot / alpha_m) + r.u_fb + u_load
    return Demand(u_p, u_m), Memory(1.0, fmax(u_m, ALPHA_LEAST), alpha_m, alpha_dot, sigma)
