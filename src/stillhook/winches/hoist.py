"""Drum, wire and load as the records of a winch hold them, and the drum as the motor shaft sees it."""

from typing import NamedTuple

from stillhook.physics.friction import Bristle, SystemFriction
from stillhook.physics.load_path.drum import Drum, Inertia, layer_diameter, layers_filled, shaft_inertia
from stillhook.physics.load_path.load import Load
from stillhook.physics.load_path.wire import Wire, wire_damping
from stillhook.physics.scalar import scalar
from stillhook.winches.records import Geometry


class Hoist(NamedTuple):
    """i_i inverse of the gear ratio motor to drum; s_w_0 wire paid out at the start [m]; n_motors all motors, active
    and passive; T_brake torque that the holding brake carries at the motor shaft [N m]."""

    drum: Drum
    inertia: Inertia
    wire: Wire
    load: Load
    friction: SystemFriction
    bristle: Bristle
    i_i: float
    s_w_0: float
    n_motors: float
    T_brake: float


@scalar
def drum_geometry(s_w, h):
    """Layer, diameter, r_eff, inertia and damping of the wire with s_w paid out [m]; taken once per PLC cycle."""
    L_left = h.drum.L_full - s_w
    layers = layers_filled(L_left, h.drum)
    d = layer_diameter(layers, h.drum)
    i_J = 1.0 / shaft_inertia(L_left, layers, h.drum, h.inertia)
    return Geometry(layers=layers, d=d, r_eff=0.5 * d * h.i_i, i_J=i_J, c=wire_damping(s_w, h.load.m, h.wire))


def shaft_inertia_without_wire(h: Hoist) -> float:
    """Inertia at the motor shaft with an empty drum, the least that there is [kg m^2]."""
    return h.inertia.J_motor + h.inertia.J_gear + h.inertia.J_drum * h.inertia.i_i2
