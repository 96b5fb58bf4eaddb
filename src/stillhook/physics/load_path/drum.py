"""Drum with its layers of wire, the wire below it and the load on it; the inertia at the motor shaft."""

from typing import NamedTuple

from stillhook.physics.scalar import G, ceil, clip, fmax, scalar, sqrt

PI = 3.141592653589793


class Drum(NamedTuple):
    """d bare drum diameter [m]; d_wire wire diameter [m]; turns per layer; layers; d_max outer diameter that published
    numbers use [m]; L_full wire on the full drum [m]; m_wire wire mass per length [kg/m]."""

    d: float
    d_wire: float
    turns: float
    layers: float
    d_max: float
    L_full: float
    m_wire: float


class Inertia(NamedTuple):
    """J_motor all motors and J_gear gears at the motor shaft [kg m^2]; J_drum about the drum's axis [kg m^2]; i_i2 = 1
    / i_hD^2."""

    J_motor: float
    J_gear: float
    J_drum: float
    i_i2: float


LAST_TURNS = 3.0
"""Turns of wire that must stay on the drum (usual practice)."""

WIRE_SLACK = 0.05
"""Wire that may be taken in beyond the hook's place at the crane tip before it counts as hauled into it [m]."""


@scalar
def wire_usable(drum):
    """Wire that can be paid out with the last turns kept on the bare drum [m]."""
    return drum.L_full - LAST_TURNS * PI * drum.d


@scalar
def wire_at_end(s_w, drum):
    """1 where the last turns are paid out, or where the hook would be pulled into the crane tip, else 0; s_w wire paid
    out [m]."""
    return 1.0 if s_w < -WIRE_SLACK or s_w > wire_usable(drum) else 0.0


@scalar
def layers_filled(L_left, drum):
    r"""Number of layers that a length of wire fills, as a real number in 0..layers.

    .. math:: L = \pi N (k\,d + k^2 d_w)
    """
    c = fmax(L_left, 0.0) / (PI * drum.turns)
    k = (sqrt(drum.d * drum.d + 4.0 * drum.d_wire * c) - drum.d) / (2.0 * drum.d_wire)
    return clip(k, 0.0, drum.layers)


@scalar
def layer_diameter(k, drum):
    """Diameter of the wire centre on the layer in use [m], k from `layers_filled`."""
    n = clip(ceil(k - 1.0e-9), 1.0, drum.layers)
    return drum.d + (2.0 * n - 1.0) * drum.d_wire


@scalar
def wire_to_layer(n, drum):
    """Wire on the drum with n layers full [m]."""
    return PI * drum.turns * (n * drum.d + n * n * drum.d_wire)


@scalar
def K_wire(d_layer, drum):
    """Ratio of the largest diameter to the present one [-], at least 1. Source: Moslatt 2020 E eq. 5."""
    return drum.d_max / d_layer


@scalar
def wire_inertia(L_left, k, drum):
    """Inertia of the wire left, as a hollow cylinder about the drum's axis [kg m^2]."""
    r_1 = 0.5 * drum.d
    r_2 = r_1 + k * drum.d_wire
    return 0.5 * drum.m_wire * fmax(L_left, 0.0) * (r_1 * r_1 + r_2 * r_2)


@scalar
def shaft_inertia(L_left, k, drum, inertia):
    """All inertia at the motor shaft [kg m^2]: motors, gears, drum and wire left. Source: Moslatt 2020 figure 2.19.

    Differs from print: eq. 2.15 adds a J-dot term; it stays below 0.5 N m and is left out.
    """
    return inertia.J_motor + inertia.J_gear + (inertia.J_drum + wire_inertia(L_left, k, drum)) * inertia.i_i2


class Wire(NamedTuple):
    """EA = fill E A [N]; L_0 wire between drum and crane tip [m]; mu mass per length [kg/m]; zeta damping ratio of the
    load's first swing on the wire [-]."""

    EA: float
    L_0: float
    mu: float
    zeta: float


@scalar
def wire_stiffness(s_w, wire):
    """Stiffness k = f E A / L of the wire out [N/m]; s_w wire paid out [m]. Source: Moslatt 2020 eq. 2.16.

    With s_w below 0 the hook is at the crane tip: the wire from there to the drum is left (such a run is marked).
    """
    return wire.EA / (wire.L_0 + fmax(s_w, 0.0))


@scalar
def damping_time(m, k, zeta):
    r"""Time constant of the material's damping, c = beta k [s]: :math:`\beta = 2 \zeta / \omega = 2 \zeta \sqrt{m /
    k}`.

    Parameters: m mass that swings [kg]; k stiffness of the wire out [N/m]; zeta damping ratio of that swing [-].
    """
    return 2.0 * zeta * sqrt(m / k)


@scalar
def wire_damping(s_w, m, wire):
    """Damping c of the wire out [N s/m], at its present length; s_w wire paid out [m], m mass on it [kg].

    The ratio zeta is that of the load's first swing, which takes a third of the wire's mass along. Source: Moslatt 2020
    paper C, subsystem for load. Differs from print: zeta is a number of the crane (paper C assumes 0.95), and c follows
    the length of the wire.
    """
    k = wire_stiffness(s_w, wire)
    return damping_time(m + wire.mu * fmax(s_w, 0.0) / 3.0, k, wire.zeta) * k


@scalar
def wire_tension(stretch, stretch_rate, k, c):
    """Tension [N], never negative: a slack wire carries nothing. stretch [m], stretch_rate [m/s], k [N/m], c [N
    s/m]."""
    return fmax(k * stretch + c * stretch_rate, 0.0)


class Load(NamedTuple):
    """W weight, in water less buoyancy [N]; m moving mass, in water with added mass [kg], i_m = 1 / m; b quadratic drag
    [N s^2/m^2]; U speed of the current across it [m/s]."""

    W: float
    m: float
    i_m: float
    b: float
    U: float


@scalar
def suspended_load(payload, hook, displaced, added, drag, U):
    """What hangs from the wire: payload and hook [kg]; displaced mass of water and added mass of the payload [kg]; drag
    [N s^2/m^2]; current [m/s]. The hook's own buoyancy is left out (a few per cent of 3 t)."""
    m = payload + hook + added
    return Load(W=(payload - displaced) * G + hook * G, m=m, i_m=1.0 / m, b=drag, U=U)


@scalar
def drag_force(v, load):
    r"""Drag that opposes the motion [N], positive upwards for a sinking load; v upward speed [m/s].

    .. math:: F = -b\sqrt{v^2 + U^2}\,v
    """
    return -load.b * v * sqrt(v * v + load.U * load.U)


@scalar
def load_acceleration(F, v, load):
    """Upward acceleration [m/s^2]; F wire tension [N], v upward speed [m/s]."""
    return (F - load.W + drag_force(v, load)) * load.i_m
