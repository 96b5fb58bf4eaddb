"""Normal speed (NS), classic level 3: motors at a fixed displacement for the SWL."""

from stillhook.control.commands import displacement_by_layer
from stillhook.control.interface import Demand
from stillhook.physics.scalar import scalar

NAME = "ns"
LABEL = "NS"
TITLE = "classic control, normal speed (NS): fixed motors that carry the SWL"
ORDER = 3
FAMILY = "classic"
USUAL = True
USES = ("alpha_ns",)


@scalar
def cycle(r, plc):
    """Source: Moslatt 2020 section 2.4."""
    return Demand(r.u_ff + r.u_fb, displacement_by_layer(plc.motors.alpha_ns, r.y.K_wire, plc.motors))
