"""Wire between drum and load: a spring and a damper that cannot push."""

from typing import NamedTuple

from stillhook.physics.scalar import fmax, scalar


class Wire(NamedTuple):
    """EA = fill E A [N]; L_0 wire between drum and crane tip [m]; c damping [N s/m]."""

    EA: float
    L_0: float
    c: float


@scalar
def wire_stiffness(s_w, wire):
    """Stiffness k = f E A / L of the wire out [N/m]; s_w wire paid out [m]. Source: Moslatt 2020 eq. 2.16.

    With s_w below 0 the hook is at the crane tip: the wire from there to the drum is left (such a run is marked).
    """
    return wire.EA / (wire.L_0 + fmax(s_w, 0.0))


@scalar
def wire_tension(stretch, stretch_rate, k, wire):
    """Tension [N], never negative: a slack wire carries nothing. stretch [m], stretch_rate [m/s], k [N/m]."""
    return fmax(k * stretch + wire.c * stretch_rate, 0.0)
