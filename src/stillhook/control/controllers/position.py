"""Position control: speed feedforward, position feedback and dynamic pressure feedback, for drives that take a speed
command alone."""

from typing import Annotated, NamedTuple

from stillhook.control.interface import SPEED, Demand, Setting
from stillhook.control.plc import low_pass
from stillhook.physics.scalar import scalar

NAME = "position"
LABEL = "position control"
TITLE = "position control: speed feedforward and position feedback, for drives that take a speed command"
ORDER = 7
USUAL = True
DRIVES = (SPEED,)


class Settings(NamedTuple):
    """Table `[control.position]` of a crane file."""

    K_dp: Annotated[
        float,
        Setting(
            "gain_per_pressure",
            "0 1/bar",
            "speed command given way per deviation of the pressure difference",
            most=1.0e-5,
        ),
    ]
    tau_mean: Annotated[
        float,
        Setting(
            "time",
            "1 s",
            "time constant of the mean that the pressure difference deviates from",
            least=0.01,
            most=3600.0,
        ),
    ]


class Memory(NamedTuple):
    """What it carries from cycle to cycle."""

    dp_mean: float = 0.0  # slow mean of the pressure difference [Pa]
    begun: float = 0.0  # 1 after the first cycle, which starts the mean [-]


@scalar
def cycle(r, plc, s, m):
    r"""u_p: the wire speed wanted over that at full command.

    .. math:: u_p = u_{ff} + u_{fb} - K_{dp}\,(\Delta p - \overline{\Delta p})/f_{pump}

    Under a load that pulls harder than its mean the winch gives way, which damps oil and load; a steady load shifts
    nothing. A drive without pressures reads 0 and is not damped.
    Source: u_ff and u_fb of Moslatt 2020 E eqs 4 and 6, without a displacement to set; the damping is dynamic pressure
    feedback as in Merritt, Hydraulic Control Systems (1967).
    Differs from print: the pressure is fed back by the PLC, a cycle and its computing time late.
    """
    dp = r.y.dp
    dp_mean = low_pass(m.dp_mean, dp, s.tau_mean, plc.t_cycle) if m.begun > 0.0 else dp
    u_dp = -s.K_dp * (dp - dp_mean) / r.y.f_pump
    return Demand(r.u_ff + r.u_fb + u_dp, 1.0), Memory(dp_mean, 1.0)
