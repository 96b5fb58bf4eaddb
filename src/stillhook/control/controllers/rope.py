"""SSC with a tension loop: on a long wire the winch yields to the load's swing, as a damper at the top would."""

from typing import Annotated, NamedTuple

from stillhook.control.commands import displacement_of_ssc
from stillhook.control.interface import Demand, Setting
from stillhook.control.plc import low_pass
from stillhook.physics.scalar import G, clip, fmax, scalar, sqrt

NAME = "rope"
LABEL = "SSC with tension loop"
TITLE = "SSC with a tension loop, which damps the load on a long wire"
ORDER = 8
USES = ("u_thr", "alpha_min", "alpha_swl")

IN_WATER = 0.87
"""Weight of steel in sea water over that in air [-]: 1 - 1025/7850."""
WANDER = 0.002
"""Standard deviation of the wire's slow variation that noise of the load cell may make [m]; what it may cost where the
load hardly moves. Chosen."""
LEAST = 0.03
"""Damping ratio that the load's weight alone lets the loop add, below which it is off [-], on above 1.5 times that: a
light load on a short wire, where there is nothing to damp. Chosen."""
STEADY = 0.01
"""Difference of the operator's speed from its slow mean above which the loop fades out [m/s]: the load is accelerated
and its drag changes. Chosen."""


class Settings(NamedTuple):
    """Table `[control.rope]` of a crane file."""

    K_c: Annotated[float, Setting("", 2.5, "c over wire stiffness times lag of the loop", least=0.5, most=100.0)]
    tau_f: Annotated[float, Setting("time", "0.5 s", "low-pass of the load cell in the loop", least=0.05, most=1.0)]
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

    begun: float = 0.0  # 1 after the first cycle, which starts the filters [-]
    F: float = 0.0  # load cell less the wire's weight, low-pass filtered [N]
    F_s: float = 0.0  # its slow mean [N]
    v_s: float = 0.0  # slow mean of the operator's speed [m/s]
    x: float = 0.0  # wire given, paid out positive [m]


@scalar
def cycle(r, plc, s, m):
    r"""SSC, and the wire x that yields to the deviation of the load from its mean.

    .. math:: \dot x = g\,\frac{F - F_s}{c} - \frac{x}{T_{ret}}, \quad
        u_p = u_{ff} + u_{fb} - \frac{K_1 \dot x K_{wire} \alpha_m + K_p x}{f_{pump}}
    .. math:: c = \max\left(K_c\,\tau\,\frac{EA}{s_w + L_0},\ 2\sqrt{EA\,m_{wire}},\
        \frac{\sigma_F}{x_n}\sqrt{\tfrac14 t_{cycle} T_{ret}}\right)

    F load cell less the wire's weight in water, behind tau_f; F_s its mean over T_ret [N]; c damping [N s/m]: stable
    with the loop's lag tau = t_cycle / 2 + t_compute + tau_f + 2 zeta_p / omega_np [s], no softer than twice the wave
    impedance of the wire, and so stiff that noise sigma_F of the load cell moves the wire by no more than x_n =
    `WANDER`. g falls from 1 to 0 as abs(F - F_s) goes from `share` of the load's weight to twice that (landing,
    slack, splash), as the operator's speed leaves its mean by `STEADY` to twice that, and where the load's weight alone
    gives a damping ratio of 1.5 to once `LEAST`. K_p x moves the reference along: the wire that is given
    stays in e_c. A winch whose pumps' lag is not known (omega_np 0) is left with SSC.
    Source: own; the displacement is that of SSC. With a spring k and a mass m the damping ratio is sqrt(k m) / (2 c).
    """
    y, h, plant = r.y, plc.t_cycle, plc.plant
    F_y = y.F - IN_WATER * G * plant.m_wire * y.s_w
    begun = m.begun > 0.5
    F = low_pass(m.F, F_y, s.tau_f, h) if begun else F_y
    F_s = low_pass(m.F_s, F, s.T_ret, h) if begun else F_y
    known = plant.omega_np > 0.0
    tau = 0.5 * h + plc.t_compute + s.tau_f + 2.0 * plant.zeta_p / (plant.omega_np if known else 1.0)
    c_noise = s.noise * plant.SWL / WANDER * sqrt(0.25 * h * s.T_ret)
    k = plant.EA / (y.s_w + plant.L_0)
    c = fmax(fmax(s.K_c * tau * k, 2.0 * sqrt(plant.EA * plant.m_wire)), c_noise)
    full = s.share * fmax(F_s - 2.0 * G * plant.m_hook, 0.0)
    g = clip((2.0 * full - abs(F - F_s)) / fmax(full, 1.0), 0.0, 1.0) if known else 0.0
    g = g * clip(sqrt(k * fmax(F_s, 0.0) / G) / (c * LEAST) - 2.0, 0.0, 1.0)
    v_s = low_pass(m.v_s, y.v_op, 0.5 * s.T_ret, h) if begun else y.v_op
    g = g * clip(2.0 - abs(y.v_op - v_s) / STEADY, 0.0, 1.0)
    x = m.x + h * clip(g * (F - F_s) / c, -s.v_max, s.v_max)
    x = clip(x / (1.0 + h / s.T_ret), -s.x_max, s.x_max)
    u_x = -(plc.gains.K_1 * (x - m.x) / h * y.K_wire * y.alpha_m + plc.gains.K_p * x) / y.f_pump
    return Demand(r.u_ff + r.u_fb + u_x, displacement_of_ssc(r, plc.motors)), Memory(1.0, F, F_s, v_s, x)
