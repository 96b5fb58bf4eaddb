"""A deck under a payload: a place that moves up and down, and pushes what stands on it, through a spring and a damper
side by side.

Deck is a record of the kernels: s, v, a of its motion at the start of a PLC cycle [m, m/s, m/s^2], z height of it above
still water at rest [m], k [N/m], c [N s/m], followed 1 where the PLC's reference is the tip less the deck.
"""

import math
from typing import NamedTuple

from stillhook.physics.scalar import fmax, scalar

SMALLEST = 1.0e-9
"""Change of the settlement over a step from which its secant is taken in place of its slope [m]."""
HALVINGS = 60


class Deck(NamedTuple):
    s: float
    v: float
    a: float
    z: float
    k: float
    c: float
    followed: float


class Push(NamedTuple):
    """F of the deck on the payload over a step [N] as foreseen at the payload's speed v [m/s], and afterwards as it
    was; slope by which it falls with that speed [N s/m]; left 1 once the payload was clear of the deck."""

    F: float
    slope: float
    v: float
    left: float


@scalar
def deck_height(deck, tau):
    """Height of the deck above still water tau [s] into the cycle [m]."""
    return deck.z + deck.s + tau * (deck.v + 0.5 * tau * deck.a)


@scalar
def deck_push(z, v, deck, tau, h, left):
    r"""See `Push`: on a payload at z [m] that moves at v [m/s] over a step h that begins tau into the cycle [s].

    .. math:: F = \frac{k}{2}\frac{c_1^2 - c_0^2}{p_1 - p_0} + c\,\frac{c_1 - c_0}{h} \geq 0,\qquad c_i = \max(p_i, 0)

    p settlement of the payload in the deck at both ends of the step [m], negative while it is clear. The spring gives
    back what it took, whenever within a step the payload touches; only the damper takes energy.
    """
    p_0, p_1 = deck_height(deck, tau) - z, deck_height(deck, tau + h) - z - h * v
    c_0, c_1, dp = fmax(p_0, 0.0), fmax(p_1, 0.0), p_1 - p_0
    steep = abs(dp) > SMALLEST
    spring = 0.5 * deck.k * (c_1 * c_1 - c_0 * c_0) / (dp if steep else 1.0) if steep else 0.5 * deck.k * (c_0 + c_1)
    F = spring + deck.c * (c_1 - c_0) / h
    stiffness = (deck.k * c_1 - spring) / (dp if steep else 1.0) if steep else 0.5 * deck.k
    slope = h * stiffness + (deck.c if p_1 > 0.0 else 0.0)
    return Push(F, slope, v, left) if F > 0.0 else Push(0.0, 0.0, v, left)


def restitution(zeta: float) -> float:
    r"""Speed after over speed before a hit on spring and damper that push and do not pull, its weight left out [-].

    .. math:: e = \exp\left(-\frac{\zeta}{\sqrt{1-\zeta^2}}\left(\pi - \operatorname{atan2}(2\zeta\sqrt{1-\zeta^2},
        1 - 2\zeta^2)\right)\right)

    and its continuation from damping ratio zeta 1 on. Source: Schwager and Poeschel 2007, Granular Matter 9, 465-469.
    """
    if zeta == 1.0:
        return math.exp(-2.0)
    if zeta > 1.0:
        w = math.sqrt(zeta * zeta - 1.0)
        return math.exp(-zeta / w * math.log((zeta + w) / (zeta - w)))
    w = math.sqrt(1.0 - zeta * zeta)
    return math.exp(-zeta / w * (math.pi - math.atan2(2.0 * zeta * w, 1.0 - 2.0 * zeta * zeta)))


def damping_ratio(e: float) -> float:
    """Damping ratio whose `restitution` is e, 0.05 to 1 [-]."""
    lo, hi = 0.0, 4.0
    for _ in range(HALVINGS):
        mid = 0.5 * (lo + hi)
        lo, hi = (mid, hi) if restitution(mid) > e else (lo, mid)
    return lo if e < 1.0 else 0.0
