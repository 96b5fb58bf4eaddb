"""Wire between drum and load, a spring and a damper that cannot push, and hook and payload on it."""

from typing import NamedTuple

from stillhook.physics.scalar import fmax, scalar, sqrt


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
