"""A long wire as elements of even length, and slings that pull and cannot push."""

from typing import NamedTuple

from stillhook.physics.load_path.drum import damping_time
from stillhook.physics.scalar import clip, fmax, scalar

LEAST_WIRE = 1.0
"""Shortest wire that is divided into elements [m]: with less out the hook is at the crane tip."""


class Rope(NamedTuple):
    """Wire below the crane tip. EA = f E A [N]; mu mass per length [kg/m]; w_air, w_water weight per length in air, and
    in water less the steel's buoyancy [N/m]; zeta damping ratio of the load's first swing by the wire's material [-];
    h_tip crane tip above still water [m]; L_0 wire between drum and crane tip [m]; M mass of hook and payload [kg]; n
    elements."""

    EA: float
    mu: float
    w_air: float
    w_water: float
    zeta: float
    h_tip: float
    L_0: float
    M: float
    n: float


class Element(NamedTuple):
    """l length [m]; m a twelfth of its mass [kg]; k stiffness [N/m]; c damping [N s/m]."""

    l: float
    m: float
    k: float
    c: float


class Sling(NamedTuple):
    """All slings together: k [N/m], c [N s/m]."""

    k: float
    c: float


class Pull(NamedTuple):
    """Sling tension F [N] over a step, and the speeds of its upper and lower end in the middle of it [m/s]."""

    F: float
    v_up: float
    v_down: float


@scalar
def element(s_w, m_a, rope):
    r"""One of n even elements of the wire out, s_w [m], with m_a [kg] of water moving along with the payload.

    Damping is that of the material, c = beta k with one beta for the whole wire
    (`stillhook.physics.load_path.drum.damping_time`). Its mass matrix is m [[5, 1], [1, 5]] with m = mu l / 12, half
    way between lumped and consistent: waves then travel right to the fourth order of the element's length, and with 20
    elements the first three periods of wire and load are right to 2e-4.
    Source: Hughes, The Finite Element Method, chapter 7 (higher-order mass).
    """
    l = fmax(s_w, LEAST_WIRE) / rope.n
    k, s = rope.EA / l, fmax(s_w, 0.0)
    beta = damping_time(rope.M + m_a + rope.mu * s / 3.0, rope.EA / (rope.L_0 + s), rope.zeta)
    return Element(l, rope.mu * l / 12.0, k, beta * k)


@scalar
def element_weight(i, l, rope):
    """Weight of element number i from the crane tip, of length l [m]: as in air down to still water, less buoyancy
    below it [N].

    The elements lie as if the wire hung straight from the mean height of the tip.
    """
    dry = clip(rope.h_tip - i * l, 0.0, l)
    return rope.w_air * dry + rope.w_water * (l - dry)


@scalar
def pull_of_sling(x, A_up, R_up, A_down, R_down, h, sling):
    r"""Sling between two bodies over a step h of the implicit midpoint rule: :math:`F = \max(0, k x_{mid} + c \dot
    x_{mid})`.

    Without the sling the bodies would move at R_up / A_up and R_down / A_down [m/s]; A [kg], R [kg m/s]; each gets half
    the impulse F h within the half step. x stretch at the start, upper less lower displacement [m].
    F grows with the speed at which the ends part, and slows it: one F solves both, and it is the larger of 0 and that
    of a taut sling.
    """
    G = 0.5 * h * sling.k + sling.c
    ease = 0.5 * h * (1.0 / A_up + 1.0 / A_down)
    F = fmax((sling.k * x + G * (R_up / A_up - R_down / A_down)) / (1.0 + G * ease), 0.0)
    return Pull(F, (R_up - 0.5 * h * F) / A_up, (R_down + 0.5 * h * F) / A_down)


@scalar
def sling_energy(x, sling):
    """Strain energy of a sling stretched by x [m]: none where it is slack [J]."""
    taut = fmax(x, 0.0)
    return 0.5 * sling.k * taut * taut


@scalar
def sling_mean(x, rate, h, sling):
    """Tension over a step [N] of slings stretched by x [m] at its start whose ends part at `rate` in its middle
    [m/s]."""
    F = sling.k * (x + 0.5 * h * rate) + sling.c * rate
    return F if F > 0.0 else 0.0
