"""High speed (HS), classic level 3: motors at a small fixed displacement, for light loads."""

from stillhook.control.commands import displacement_by_layer
from stillhook.control.interface import Demand
from stillhook.physics.scalar import scalar

NAME = "hs"
LABEL = "HS"
TITLE = "classic control, high speed (HS): fixed motors at a small displacement, for light loads"
ORDER = 4
FAMILY = "classic"
USUAL = True
USES = ("alpha_hs",)
SWL_SHARE = 0.6
"""Source: Moslatt 2020 paper C: in HS the active motors deliver 30 % of 60 % of the SWL, and 90 t is the most that HS
may carry on a crane of 150 t."""


@scalar
def cycle(r, plc):
    """Source: Moslatt 2020 section 2.4."""
    return Demand(r.u_ff + r.u_fb, displacement_by_layer(plc.motors.alpha_hs, r.y.K_wire, plc.motors))
