"""Position control: speed feedforward and position feedback, for drives that take a speed command alone."""

from stillhook.control.interface import SPEED, Demand
from stillhook.physics.scalar import scalar

NAME = "position"
LABEL = "position control"
TITLE = "position control: speed feedforward and position feedback, for drives that take a speed command"
ORDER = 7
USUAL = True
DRIVES = (SPEED,)


@scalar
def cycle(r, plc):
    """u_p = u_ff + u_fb: the wire speed wanted over that at full command. Source: Moslatt 2020 E eqs 4 and 6, without a
    displacement to set."""
    return Demand(r.u_ff + r.u_fb, 1.0)
