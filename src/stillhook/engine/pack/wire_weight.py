"""What a winch carries besides hook and payload: the wire between crane tip and hook."""

from __future__ import annotations

from stillhook.spec.crane import Crane
from stillhook.spec.scenario import RHO_SEA

RHO_STEEL = 7850.0
"""Density of a wire's steel [kg/m^3] (EN 10025 and the rope makers' tables). A rope's grease and core are lighter, so
that it displaces somewhat more water than its mass in steel: for a rope of 14 % grease the weight in water is 2 % less
than here."""


def wire_carried(crane: Crane, s_w: float, h_tip: float) -> float:
    """Mass whose weight is that of the wire out in still water: all of it in air, less the water that its steel
    displaces below [kg].

    .. math:: \\mu \\left( \\min(s_w, h_{tip}) + \\left(1 - \\frac{\\rho}{\\rho_{steel}}\\right) \\max(s_w - h_{tip}, 0)
    \\right)

    Parameters: s_w wire from crane tip to hook [m], h_tip height of the tip above the water line [m]. The wire between
    drum and tip lies on the boom and weighs nothing on the winch, as in `stillhook.engine.pack.programme.hanging`. Sea
    water of 1,025 kg/m^3.
    """
    out = max(s_w, 0.0)
    air = min(out, max(h_tip, 0.0))
    return crane.wire.mass_per_length * (air + (out - air) * (1.0 - RHO_SEA / RHO_STEEL))
