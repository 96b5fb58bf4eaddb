"""Manual: the operator moves the winch; the tip is not compensated and nothing is fed back."""

from stillhook.control.commands import displacement_min, displacement_ssc, reduction_linear
from stillhook.control.interface import DISPLACEMENT, SPEED, Demand
from stillhook.physics.scalar import scalar

NAME = "manual"
TITLE = "manual: the operator moves the winch, no heave compensation"
ORDER = 0
COMPENSATES = False
DRIVES = (DISPLACEMENT, SPEED)


@scalar
def cycle(r, plc):
    """Full displacement at low speed by the law of SSC, unless the operator holds a displacement, as in the friction
    tests of Moslatt 2020 section 2.2."""
    s = plc.motors
    u_m = displacement_ssc(reduction_linear(r.u_ff, s.u_thr), displacement_min(r.F, r.y.K_wire, s))
    if s.alpha_hold > 0.0:
        u_m = s.alpha_hold
    return Demand(r.u_ff + r.u_fb, u_m)
