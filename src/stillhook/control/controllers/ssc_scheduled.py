"""Semi-secondary control whose position gain falls with the square of the motors' displacement."""

from stillhook.control.commands import displacement_of_ssc
from stillhook.control.interface import Demand
from stillhook.physics.scalar import scalar

NAME = "ssc-scheduled"
LABEL = "SSC, scheduled gain"
TITLE = "semi-secondary control with the position gain scheduled by the motors' displacement"
ORDER = 10
USES = ("u_thr", "alpha_min", "alpha_swl")


@scalar
def cycle(r, plc):
    r"""SSC with the gain :math:`K_p \alpha_m^2`; K_p is that of motors at full displacement.

    A constant K_p is that of the smallest displacement, at which the loop is first unstable: wire speed per pump
    command is as 1 / alpha_m, the frequency of the oil as alpha_m, and the gain that leaves a margin about as its
    square. Source: own; gain scheduling as in Åström and Wittenmark, Adaptive Control, 1995, chapter 9.
    """
    alpha_m = r.y.alpha_m
    return Demand(r.u_ff + r.u_fb * alpha_m * alpha_m, displacement_of_ssc(r, plc.motors))
