"""Classic level 2: full displacement on the outermost layer, less further in, so that the wire force is constant."""

from stillhook.control.commands import displacement_by_layer
from stillhook.control.interface import Demand
from stillhook.physics.scalar import scalar

NAME = "level-2"
TITLE = "classic level 2: constant wire force on every layer"
ORDER = 2
FAMILY = "classic"


@scalar
def cycle(r, plc):
    """Source: Moslatt 2020 section 2.4."""
    return Demand(r.u_ff + r.u_fb, displacement_by_layer(1.0, r.y.K_wire, plc.motors))
