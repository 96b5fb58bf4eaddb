"""SSC with a tension loop: beside the compensation of the tip the winch gives way to the load's swing on a long wire."""

from typing import Annotated, NamedTuple

from stillhook.control.commands import displacement_min_moving, displacement_ssc, reduction_linear
from stillhook.control.interface import Demand, Setting
from stillhook.control.plc import low_pass
from stillhook.physics.scalar import G, clip, fmax, fmin, scalar, sqrt

NAME = "rope"
LABEL = "SSC with tension loop"
TITLE = "SSC with a tension loop that damps the load on a long wire"
ORDER = 8
USES = ("u_thr", "alpha_min", "alpha_swl")

IN_WATER = 0.87
"""Weight of steel in sea water over that in air [-]: 1 - 1025/7850."""


class Settings(NamedTuple):
    """Table `[control.rope]` of a crane file."""

    K_c: Annotated[float, Setting("", 4.0, "c over stiffness of the wire times lag of the loop", least=2.0, most=100.0)]
    tau_f: Annotated[float, Setting("time", "0.2 s", "low-pass of the load cell in the loop", least=0.05, most=2.0)]
    T_ret: Annotated[float, Setting("time", "20 s", "in which wire given way returns", least=5.0, most=300.0)]
    tau_s: Annotated[float, Setting("time", "20 s", "over which the mean of the load is taken", least=5.0, most=300.0)]
    share: Annotated[float, Setting("", 0.2, "deviation over weight of the load from which it fades out", most=1.0)]
    v_max: Annotated[float, Setting("speed", "0.2 m/s", "largest speed of giving way", most=2.0)]
    x_max: Annotated[float, Setting("length", "0.5 m", "most wire given way", most=5.0)]


class Memory(NamedTuple):
    """What it carries from cycle to cycle."""

    t: float = 0.0  # time over which the mean is taken so far [s]
    F: float = 0.0  # load without the wire's weight, low-pass filtered [N]
    F_s: float = 0.0  # its slow mean [N]
    x: float = 0.0  # wire given way, paid out positive [m]


@scalar
def cycle(r, plc, s, m):
    y, h, plant = r.y, plc.t_cycle, plc.plant
    F_y = y.F - IN_WATER * G * plant.m_wire * y.s_w
    t = fmin(m.t + h, s.tau_s)
    F = low_pass(m.F, F_y, s.tau_f, h) if m.t > 0.0 else F_y
    F_s = m.F_s + (F - m.F_s) * h / t
    dF = F - F_s
    tau = 0.5 * h + plc.t_compute + s.tau_f + 2.0 * plant.zeta_p / fmax(plant.omega_np, 1.0)
    c = fmax(s.K_c * tau * plant.EA / fmax(y.s_w + plant.L_0, 1.0), sqrt(plant.EA * plant.m_wire))
    full = s.share * fmax(F_s, 0.0)
    trusted = clip((2.0 * full - abs(dF)) / fmax(full, 1.0), 0.0, 1.0) if plant.omega_np > 0.0 else 0.0
    v = clip(trusted * dF / c, -s.v_max, s.v_max)
    x = clip((m.x + h * v) / (1.0 + h / s.T_ret), -s.x_max, s.x_max)
    v_x = (x - m.x) / h
    u = -(plc.gains.K_1 * v_x * y.K_wire * y.alpha_m + plc.gains.K_p * x) / y.f_pump
    u_m = displacement_ssc(
        reduction_linear(r.u_ff, plc.motors.u_thr), displacement_min_moving(r.F, y.a_tip, y.K_wire, plc.motors)
    )
    return Demand(r.u_ff + r.u_fb + u, u_m), Memory(t, F, F_s, x)
