"""Drum of the reference plant: wire turn by turn on layers that are pressed together, with a turn on which it climbs to
the next one.

Written for the reference plant alone: nothing here comes from the twin's drum (`stillhook.physics.load_path.drum`).
"""

from typing import NamedTuple

from stillhook.physics.scalar import ceil, clip, fmax, scalar, sqrt

PI = 3.141592653589793
CLIMB = 0.5
"""Turns over which the wire climbs to the next layer, half of them on each (assumed: grooved drums cross over on a part
of a turn)."""


class TrueDrum(NamedTuple):
    """d bare drum [m]; pitch radial height of a layer, a pressed wire [m]; turns in a layer; L_full wire on it with all
    wire in [m]; m_wire mass per length [kg/m]; inertia: J_shaft of motors and gears at the motor shaft, J_drum about
    its axis [kg m^2]; i_i inverse gear ratio."""

    d: float
    pitch: float
    turns: float
    L_full: float
    m_wire: float
    J_shaft: float
    J_drum: float
    i_i: float


class Wound(NamedTuple):
    """layer in use, a whole number; turn on that layer, 0 to turns; d of the wire's centre there [m]; below wire on the
    full layers [m]."""

    layer: float
    turn: float
    d: float
    below: float


@scalar
def wire_on_layers(n, drum):
    """Wire on n full layers [m]: each has so many turns at its own centre."""
    return PI * drum.turns * n * (drum.d + n * drum.pitch)


@scalar
def _risen(turns):
    """Share of a layer's height that the wire has climbed so many turns after the layer was full, before it: negative
    [-]."""
    u = clip(turns / CLIMB + 0.5, 0.0, 1.0)
    return u * u * (3.0 - 2.0 * u)


@scalar
def wound(L_left, drum):
    """Where the wire leaves a drum with L_left on it [m]. Each turn is as long as its circle; about the end of a layer
    the wire climbs to the next, smoothly."""
    L = fmax(L_left, 0.0)
    r = 0.5 * drum.d / drum.pitch
    layer = fmax(ceil(sqrt(r * r + L / (PI * drum.turns * drum.pitch)) - r - 1e-9), 1.0)
    d = drum.d + (2.0 * layer - 1.0) * drum.pitch
    below = wire_on_layers(layer - 1.0, drum)
    turn = (L - below) / (PI * d)
    missing = 1.0 - _risen(turn) if layer > 1.0 else 0.0
    climbing = _risen(turn - drum.turns) - missing
    return Wound(layer, turn, d + 2.0 * drum.pitch * climbing, below)


@scalar
def inertia_true(L_left, w, drum):
    """All inertia at the motor shaft [kg m^2]: the full layers as a ring, the wire of the layer in use at its own
    radius."""
    r_1, r = 0.5 * drum.d, 0.5 * drum.d + (w.layer - 0.5) * drum.pitch
    r_2 = r_1 + (w.layer - 1.0) * drum.pitch
    ring = 0.5 * w.below * (r_1 * r_1 + r_2 * r_2) + (fmax(L_left, 0.0) - w.below) * r * r
    return drum.J_shaft + (drum.J_drum + drum.m_wire * ring) * drum.i_i * drum.i_i
