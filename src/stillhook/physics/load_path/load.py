"""Hook and payload on the wire, in air or fully submerged."""

from typing import NamedTuple

from stillhook.physics.scalar import scalar


class Load(NamedTuple):
    """W weight, in water less buoyancy [N]; m moving mass, in water with added mass [kg], i_m = 1 / m; b quadratic drag
    [N s^2/m^2]."""

    W: float
    m: float
    i_m: float
    b: float


@scalar
def drag_force(v, load):
    """Drag that opposes the motion [N], positive upwards for a sinking load; v upward speed [m/s]."""
    return -load.b * v * abs(v)


@scalar
def load_acceleration(F, v, load):
    """Upward acceleration [m/s^2]; F wire tension [N], v upward speed [m/s]."""
    return (F - load.W + drag_force(v, load)) * load.i_m
