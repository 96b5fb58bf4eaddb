"""Classic level 1: motors at full displacement."""

from stillhook.control.interface import Demand
from stillhook.physics.scalar import scalar

NAME = "level-1"
TITLE = "classic level 1: motors at full displacement"
ORDER = 1
FAMILY = "classic"


@scalar
def cycle(r, plc):
    """Source: Moslatt 2020 section 2.4."""
    return Demand(r.u_ff + r.u_fb, 1.0)
