"""Semi-secondary control with the cubic reduction: smooth at the threshold and at the end."""

from stillhook.control.commands import displacement_min_moving, displacement_ssc, reduction_cubic
from stillhook.control.interface import Demand
from stillhook.physics.scalar import scalar

NAME = "ssc-cubic"
TITLE = "semi-secondary control with the cubic reduction of paper C"
ORDER = 6
USES = ("u_thr", "alpha_min", "alpha_swl")


@scalar
def cycle(r, plc):
    """Source: Moslatt 2020 C eq. 13."""
    s = plc.motors
    u_m = displacement_ssc(reduction_cubic(r.u_ff, s.u_thr), displacement_min_moving(r.F, r.y.a_tip, r.y.K_wire, s))
    return Demand(r.u_ff + r.u_fb, u_m)
