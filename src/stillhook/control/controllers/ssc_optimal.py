r"""Semi-secondary control whose displacement is an optimum of pressure, flow and travel in place of a threshold.

Source: own. Differs from Moslatt 2020 eqs 2.9 and 2.10, which reduce the motors with the pump command beyond a
threshold, whatever the pressure; the smallest displacement is that of eq. 2.11.
"""

from typing import Annotated, NamedTuple

from stillhook.control.commands import displacement_min_moving, displacement_ssc, reduction_linear
from stillhook.control.interface import Demand, Setting
from stillhook.control.plc import low_pass
from stillhook.physics.scalar import clip, fmax, fmin, scalar, sqrt

NAME = "ssc-optimal"
TITLE = "semi-secondary control, motors at the displacement of least pressure, flow and travel"
ORDER = 9
USES = ("u_thr", "alpha_min", "alpha_swl")

P_1 = 3.5e7
"""Pressure difference that costs 1 [Pa]: the order of a relief valve's setting."""
P_LEAST = 1.0e6
"""Least pressure difference that counts [Pa]."""
ALPHA_LEAST = 0.05
"""Displacement below which nothing is divided by it [-]."""
TAU_D = 0.03
"""Low-pass of the rate of the measured displacement [s]."""


class Settings(NamedTuple):
    """Table `[control.ssc_optimal]` of a crane file."""

    w_Q: Annotated[float, Setting("", 0.0, "cost of full flow over that of 350 bar", search=(0.0, 0.3), most=100.0)]
    w_s: Annotated[float, Setting("time", "0 s", "cost of the motors' travel", search=(0.0, 10.0), most=3600.0)]
    u_most: Annotated[
        float, Setting("", 0.9, "largest share of the flow that is used", search=(0.6, 1.0), least=0.1, most=1.0)
    ]
    t_ahead: Annotated[
        float, Setting("time", "0.2 s", "time by which the motors are late", search=(0.0, 1.0), most=5.0)
    ]
    k_a: Annotated[float, Setting("", 1.0, "x", least=-5,most=5.0)]


class Memory(NamedTuple):
    """What it carries from cycle to cycle."""

    begun: float = 0.0  # 1 after the first cycle [-]
    u_m: float = 1.0  # demand of the cycle before [-]
    alpha_m: float = 0.0  # measured in the cycle before [-]
    alpha_dot: float = 0.0  # its rate, filtered [1/s]


@scalar
def pressure_needed(y, r_w, plant):
    """Pressure difference for friction, inertia and the active motors' part of the load at full displacement [Pa]."""
    T = plant.T_dry + (plant.B * abs(y.v_tip - y.v_op) + plant.J * abs(y.a_tip)) / r_w
    return fmax(T / fmax(plant.D_m, 1e-9) + abs(y.dp_load) * y.alpha_m, P_LEAST)


@scalar
def newton(alpha, before, A, B, w):
    """A step from alpha to the least of A / alpha^2 + B alpha^2 + w (alpha - before)^2, convex for alpha > 0."""
    i_2 = 1.0 / (alpha * alpha)
    slope = B * alpha - A * i_2 / alpha + w * (alpha - before)
    return fmax(alpha - slope / (3.0 * A * i_2 * i_2 + B + w), 0.5 * alpha)


@scalar
def largest_displacement(U, U_leak, u_most):
    """Largest alpha with U alpha + U_leak / alpha = u_most: flow of the motion, and leakage at its pressure [-]."""
    return (u_most + sqrt(fmax(u_most * u_most - 4.0 * U * U_leak, 0.0))) / fmax(2.0 * U, 0.1)


@scalar
def cycle(r, plc, s, m):
    r"""Demand of one PLC cycle, and what it remembers."""
    y, plant, motors, gains, h = r.y, plc.plant, plc.motors, plc.gains, plc.t_cycle
    alpha_m = fmax(y.alpha_m, ALPHA_LEAST)
    alpha_dot = m.begun * low_pass(m.alpha_dot, (alpha_m - m.alpha_m) / h, TAU_D, h)
    r_w = 0.5 * plant.d_max / (y.K_wire * plant.i_hD)
    U_later = gains.K_1 * abs(y.v_tip - y.v_op + s.t_ahead * y.a_tip) * y.K_wire / y.f_pump
    U = fmax(abs(r.u_ff) / alpha_m, U_later)
    p = pressure_needed(y, r_w, plant)
    A = p * p / (P_1 * P_1)
    alpha = m.u_m
    for _ in range(4):
        alpha = newton(alpha, m.u_m, A, s.w_Q * U * U, s.w_s / h)
    least = displacement_min_moving(r.F, y.a_tip, y.K_wire, motors)
    most = largest_displacement(U, plant.G_leak * p / fmax(plant.Q_p * y.f_pump, 1e-9), s.u_most)
    best = clip(fmin(alpha, most), least, 1.0)
    u_m = best if plant.D_m > 0.0 else displacement_ssc(reduction_linear(r.u_ff, motors.u_thr), least)
    lead = gains.K_2 / fmax(gains.K_1, 1e-9) + plc.t_lead_ff
    u_p = r.u_ff * (1.0 + s.k_a * lead * alpha_dot / alpha_m) + r.u_fb
    return Demand(u_p, u_m), Memory(1.0, u_m, alpha_m, alpha_dot)
