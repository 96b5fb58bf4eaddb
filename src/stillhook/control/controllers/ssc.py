"""Semi-secondary control (SSC): the motors' displacement falls with the feedforward beyond a threshold."""

from stillhook.control.commands import displacement_of_ssc
from stillhook.control.interface import Demand
from stillhook.physics.scalar import scalar

NAME = "ssc"
LABEL = "SSC"
TITLE = "semi-secondary control (SSC): motors reduced in proportion to the feedforward"
ORDER = 5
USUAL = True
USES = ("u_thr", "alpha_min", "alpha_swl")


@scalar
def cycle(r, plc):
    """Source: Moslatt 2020 eqs 2.9 to 2.11."""
    return Demand(r.u_ff + r.u_fb, displacement_of_ssc(r, plc.motors))
