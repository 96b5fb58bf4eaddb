"""SSC with a tension loop: on a long wire the winch yields to the load's swing, as a damper at the top would."""

from typing import Annotated, NamedTuple

from stillhook.control.commands import displacement_of_ssc
from stillhook.control.interface import Demand, Setting
from stillhook.control.plc import low_pass
from stillhook.physics.scalar import G, clip, fmax, fmin, scalar, sqrt

NAME = "rope"
LABEL = "SSC with tension loop"
TITLE = "SSC with a tension loop, which damps the load on a long wire"
ORDER = 8
YIELDS = True
BEGINS = 15.0
USES = ("u_thr", "alpha_min", "alpha_swl")

IN_WATER = 0.87
"""Weight of steel in sea water over that in air [-]: 1 - 1025/7850."""
WANDER = 0.002
"""Standard deviation of the wire's slow variation that noise of the load cell may make [m]. Chosen."""
IMPEDANCE = 3.0
"""Least c over the wave impedance of the wire [-]: at 1.3 the loop swings with oil and drum, on
`deep-250t`."""
QUICK = 0.3
"""Low-pass of the load cell over sqrt(m_SWL / k), the SWL's time on the wire [-], where that is quicker than `tau_f`:
on a short wire a slower one turns damping into stiffness. Chosen."""
LEAST_ALPHA = 0.1
"""Displacement of the motors below which c grows no further [-]: below that of any crane."""
LEAST = 0.001
"""Root mean square of the given wire that is worth giving, at the least [m]. Chosen."""
T_WORTH, WORTH, MOST_WORTH = 30.0, 4.0, 100.0
"""Mean square of the wire that the loop would give: its time constant [s]; over that of noise, where the loop begins
to act, half of where it acts in full [-]; most that counts [-]. Chosen."""
T_START = 12.0
"""Time in the second half of which the loop comes in [s]."""
STEADY = 0.01
"""Difference of the operator's speed from its slow mean above which the loop fades out [m/s]: the load is accelerated
and its drag changes. Chosen."""


class Settings(NamedTuple):
    """Table `[control.rope]` of a crane file."""

    K_c: Annotated[float, Setting("", 5.1, "c over wire stiffness times lag of the loop", least=0.5, most=100.0)]
    tau_f: Annotated[
        float, Setting("time", "0.2 s", "low-pass of the load cell in the loop, at most", least=0.05, most=1.0)
    ]
    T_ret: Annotated[
        float,
        Setting("time", "12 s", "time in which given wire returns, and of the mean load", least=5.0, most=300.0),
    ]
    noise: Annotated[float, Setting("", 0.002, "noise of the load cell over the SWL, standard deviation", most=0.1)]
    share: Annotated[
        float, Setting("", 0.1, "deviation over weight of the load, above which the loop fades out", most=1.0)
    ]
    v_max: Annotated[float, Setting("speed", "0.2 m/s", "largest speed at which the winch yields", most=2.0)]
    x_max: Annotated[float, Setting("length", "0.5 m", "most wire that is given", most=5.0)]


class Memory(NamedTuple):
    """What it carries from cycle to cycle."""

    age: float = 0.0  # time in force over T_START, up to 1 or that of T_ret [-]
    F: float = 0.0  # load cell less the wire's weight, low-pass filtered [N]
    F_s: float = 0.0  # its slow mean [N]
    v_s: float = 0.0  # slow mean of the operator's speed [m/s]
    x: float = 0.0  # wire given, paid out positive [m]
    x_F: float = 0.0  # wire that the loop would give [m]
    q: float = 4.0 * WORTH  # its mean square over that of noise [-]; so large that the loop acts when it comes in


@scalar
def cycle(r, plc, s, m):
    r"""SSC, and the wire x that yields to the deviation of the load from its mean.

    .. math:: \dot x = g_q\,g\,\frac{F - F_s}{c} - \frac{x}{T_{ret}}, \quad
        u_p = u_{ff} + u_{fb} - \frac{K_1 \dot x K_{wire} \alpha_m + K_p x}{f_{pump}}
    .. math:: c = \frac{1}{\alpha_m^2} \max\left(K_c\,\tau k,\ 3\sqrt{EA\,m_{wire}},\
        \frac{\sigma_F}{x_n}\sqrt{\tfrac14 t_{cycle} T_{ret}}\right), \quad k = \frac{EA}{s_w + L_0}

    F load cell less the wire's weight in water, behind a low-pass of tau_F = min(tau_f, `QUICK` sqrt(m_SWL / k)); F_s
    its mean over T_ret [N]; c damping [N s/m]: stable with the loop's lag tau = t_cycle / 2 + t_compute + tau_F +
    2 zeta_p / omega_np [s], no softer than three times the wave impedance of the wire, and so stiff that noise sigma_F
    of the load cell moves the wire by no more than x_n = `WANDER`; with the motors at less displacement the oil is
    softer, and its resonance nearer to those of the wire. g falls from 1 to 0 as abs(F - F_s) goes from
    `share` of the load's weight to twice that (landing, slack, splash), and as the operator's speed leaves its mean by
    `STEADY` to twice that; it rises from 0 to 1 in the second half of `T_START`, F_s until then the mean of all the
    time: the force at the start is that of a swing. g_q falls from 1 to 0 as the wire x_F that it would give with
    g_q = 1 has a mean square of 8 to 4 times that of noise (of `LEAST`, if more): less moves the load more than it
    damps it. K_p x moves the reference along: the wire that is given stays in e_c. A winch whose pumps' lag is not
    known (omega_np 0) is left with SSC.
    Source: own; the displacement is that of SSC. With a spring k and a mass m the damping ratio is sqrt(k m) / (2 c).
    """
    y, h, plant = r.y, plc.t_cycle, plc.plant
    F_y = y.F - IN_WATER * G * plant.m_wire * y.s_w
    begun, age = m.age > 0.0, fmin(m.age + h / T_START, fmax(s.T_ret / T_START, 1.0))
    k = plant.EA / (y.s_w + plant.L_0)
    tau_F = fmin(s.tau_f, QUICK * sqrt(plant.SWL / (G * k)))
    F = low_pass(m.F, F_y, tau_F, h) if begun else F_y
    F_s = low_pass(m.F_s, F, fmin(age * T_START, s.T_ret), h) if begun else F_y
    known = plant.omega_np > 0.0
    tau = 0.5 * h + plc.t_compute + tau_F + 2.0 * plant.zeta_p / (plant.omega_np if known else 1.0)
    noise = s.noise * plant.SWL * sqrt(0.25 * h * s.T_ret)
    stiff = fmax(fmax(s.K_c * tau * k, IMPEDANCE * sqrt(plant.EA * plant.m_wire)), noise / WANDER)
    alpha = fmax(y.alpha_m, LEAST_ALPHA)
    c = stiff / (alpha * alpha)
    full = s.share * fmax(F_s - 2.0 * G * plant.m_hook, 0.0)
    g = (
        clip((2.0 * full - abs(F - F_s)) / fmax(full, 1.0), 0.0, 1.0) * clip(2.0 * age - 1.0, 0.0, 1.0)
        if known
        else 0.0
    )
    v_s = low_pass(m.v_s, y.v_op, 0.5 * s.T_ret, h) if begun else y.v_op
    v = g * clip(2.0 - abs(y.v_op - v_s) / STEADY, 0.0, 1.0) * (F - F_s) / c
    x_F = (m.x_F + h * v) / (1.0 + h / s.T_ret)
    over = x_F / fmax(noise / c, LEAST)
    q = low_pass(m.q, fmin(over * over, MOST_WORTH), T_WORTH, h)
    x = m.x + h * clip(clip(q / WORTH - 1.0, 0.0, 1.0) * v, -s.v_max, s.v_max)
    x = clip(x / (1.0 + h / s.T_ret), -s.x_max, s.x_max)
    u_x = -(plc.gains.K_1 * (x - m.x) / h * y.K_wire * y.alpha_m + plc.gains.K_p * x) / y.f_pump
    return Demand(r.u_ff + r.u_fb + u_x, displacement_of_ssc(r, plc.motors)), Memory(age, F, F_s, v_s, x, x_F, q)
