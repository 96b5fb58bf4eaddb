"""A long wire as even elements, the hook at its end: what its rows share in a step of the implicit midpoint rule, and
the elimination of its speeds from the top down.

A node has a displacement q [m] against the unstretched wire, a speed v [m/s] and a weight W [N]; c and d are the two
columns of the elimination. Elements and weights: `stillhook.physics.load_path.rope`.
"""

from typing import NamedTuple

from stillhook.physics.load_path.drum import wire_stiffness
from stillhook.physics.load_path.rope import Element
from stillhook.physics.scalar import scalar


class Hook(NamedTuple):
    """The body at the end of a wire."""

    m: float  # mass [kg]
    W: float  # weight; its own buoyancy is left out [N]


class Wire(NamedTuple):
    """What a wire remembers."""

    element: Element  # in this cycle
    v_w_0: float  # wire speed one step ago [m/s]
    v_before: float  # speed of the first node in the middle of the last step but one [m/s]


class Rows(NamedTuple):
    """What the rows of a wire share in a step: d, off interior diagonal and off-diagonal [kg]; first row: d_0 diagonal
    [kg], T_0 the winch's pull on a node at rest [N] and G_0 its fall per speed of the node [N s/m], taut 1 where the
    wire pulls at the winch, else 0."""

    d: float
    off: float
    d_0: float
    T_0: float
    G_0: float
    taut: float


class Sums(NamedTuple):
    """Over the wire in one step: damping of the elements and gravity, as power [W]."""

    damping: float
    gravity: float


@scalar
def rows_of(wire, y, v_w, q, tip, c_0, hoist, h):
    """What the rows share in a step h [s]: y state of the load path and v_w wire speed that the winch gives [m/s]; q
    displacement of the first node [m]; tip in the middle of the step; c_0 damping from drum to tip [N s/m]."""
    e = wire.element
    G = 0.5 * h * (e.c + 0.5 * h * e.k)
    k_0 = wire_stiffness(y.s_w, hoist.wire)
    half = 0.5 * (v_w - wire.v_w_0)
    s_w = y.s_w - 0.5 * h * (v_w + 0.5 * half)
    top = tip.s - (s_w - hoist.s_w_0)
    v_top = tip.v + v_w + half
    G_0 = 0.5 * h * k_0 + c_0
    T_0 = k_0 * (top - q) + c_0 * v_top
    taut = 1.0 if T_0 - G_0 * y.v_load > 0.0 else 0.0
    return Rows(
        d=10.0 * e.m + 2.0 * G, off=e.m - G, d_0=5.0 * e.m + G + taut * 0.5 * h * G_0, T_0=T_0, G_0=G_0, taut=taut
    )


@scalar
def first_row(e, r, q, q_below, v, v_below, W, h):
    """c and d of the first node, at which the winch pulls."""
    pull = 0.5 * h * (r.taut * r.T_0 - W - e.k * (q - q_below))
    R = e.m * (5.0 * v + v_below) + pull
    return r.off / r.d_0, R / r.d_0


@scalar
def inner_row(e, r, c_above, d_above, q_above, q, q_below, v_above, v, v_below, W, h):
    """c and d of a node between two others, from those of the one above."""
    moves = 10.0 * v + v_above + v_below
    stretch = 2.0 * q - q_above - q_below
    R = e.m * moves - 0.5 * h * (W + e.k * stretch)
    pivot = 1.0 / (r.d - r.off * c_above)
    return r.off * pivot, (R - r.off * d_above) * pivot


@scalar
def hook_row(e, r, hook, c_above, d_above, q_above, q, v_above, v, W, h):
    """A [kg] and R [kg m/s] of the hook with the wire above it: it would move at R / A without what joins it to the
    payload."""
    R = e.m * (5.0 * v + v_above) + hook.m * v - 0.5 * h * (W + e.k * (q - q_above))
    return 0.5 * r.d + hook.m - r.off * c_above, R - r.off * d_above
