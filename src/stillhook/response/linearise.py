r"""Drag of the payload made linear: as much damping as takes the same power out of the motion.

Harmonic: :math:`\Sigma = \frac{8}{3\pi} B \hat v`; Gaussian: :math:`\Sigma = \sqrt{8/\pi}\, B \sigma_v`, with B = rho C_D A_p/2 and v the
speed of the payload through the water. Source: DNV-RP-N103 section 5 (check against your edition),
there 4/(3 pi) rho C_D A omega z for a harmonic.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stillhook.response.hung import Hung
from stillhook.response.rod import transfers

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def drag_of_harmonic(B: float, v: ArrayLike) -> FloatArray:
    """Linear drag [N s/m] of a speed amplitude v [m/s]; B [N s^2/m^2]."""
    return np.asarray(8.0 / (3.0 * math.pi) * B * np.asarray(v, dtype=np.float64))


def drag_of_gaussian(B: float, sigma_v: ArrayLike) -> FloatArray:
    """Linear drag [N s/m] of a Gaussian speed of deviation sigma_v [m/s]; B [N s^2/m^2]."""
    return np.asarray(math.sqrt(8.0 / math.pi) * B * np.asarray(sigma_v, dtype=np.float64))


class Answer(NamedTuple):
    """Complex answer of one quantity: to the motion u of the wire's top end, and to the wave's elevation above the load [per m]."""

    u: ComplexArray
    wave: ComplexArray


QUANTITIES = ("load", "load_rate", "relative", "top", "top_rate", "sling", "sling_rate")
"""Displacement of the payload and its speed, its speed through the water; tension at the crane tip and in the slings with their rates."""


def answers(omega: FloatArray, hung: Hung, drag: ArrayLike, give: ArrayLike = 0.0) -> dict[str, Answer]:
    """Every one of `QUANTITIES` at omega and linear drags [N s/m] that broadcast with it; give of the winch [m/N].

    The wave's force on the payload is that of the water's acceleration on displaced water and added mass, and of drag by its speed.
    """
    t = transfers(omega, hung.rod, hung.end, drag, give)
    water, rate = hung.decay(omega), 1j * omega
    inertia = -(omega**2) * (hung.rho_V + hung.end.A33)
    F = (inertia + rate * np.asarray(drag, dtype=np.float64)) * water
    load = Answer(t.load_u, t.load_F * F)
    top, sling = Answer(t.top_u, t.top_F * F), Answer(t.sling_u, t.sling_F * F)
    return {
        "load": load,
        "load_rate": Answer(rate * load.u, rate * load.wave),
        "relative": Answer(rate * load.u, rate * (load.wave - water)),
        "top": top,
        "top_rate": Answer(rate * top.u, rate * top.wave),
        "sling": sling,
        "sling_rate": Answer(rate * sling.u, rate * sling.wave),
    }
