r"""Linearised drag of the payload: the damping that takes the same power out of the motion.

Harmonic: :math:`\Sigma = \frac{8}{3\pi} B \hat v`; Gaussian: :math:`\Sigma = \sqrt{8/\pi}\, B \sigma_v`, with B = rho
C_D A_p/2 and v the speed of the payload through the water. Source: DNV-RP-N103 section 5 (check against your edition),
there 4/(3 pi) rho C_D A omega z for a harmonic.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.response.suspended_load import SuspendedLoad
from stillhook.response.wire_rod import transfers


def drag_of_gaussian(B: float, sigma_v: ArrayLike, V: float = 0.0) -> FloatArray:
    r"""Linear drag [N s/m] of a Gaussian speed of deviation sigma_v [m/s] about a mean speed V [m/s]; B [N s^2/m^2].

    .. math:: \Sigma = 2 B\,E|V + v| = 2 B \left(V\,\mathrm{erf}\frac{V}{\sqrt 2 \sigma_v}
        + \sqrt{2/\pi}\,\sigma_v\,e^{-V^2/2\sigma_v^2}\right)

    The slope with the least square error; at V = 0 it takes out the same power.
    """
    sigma = np.asarray(sigma_v, dtype=np.float64)
    if V == 0.0:
        return np.asarray(math.sqrt(8.0 / math.pi) * B * sigma)
    share, bell = _normal(V, sigma)
    return np.asarray(2.0 * B * (V * (2.0 * share - 1.0) + 2.0 * sigma * bell))


def mean_drag(B: float, V: float, sigma_v: ArrayLike) -> FloatArray:
    """Mean of B (V + v)|V + v| for a Gaussian v of deviation sigma_v [m/s] [N]; B [N s^2/m^2], V [m/s]."""
    sigma = np.asarray(sigma_v, dtype=np.float64)
    share, bell = _normal(V, sigma)
    return np.asarray(B * ((V**2 + sigma**2) * (2.0 * share - 1.0) + 2.0 * V * sigma * bell))


def _normal(V: float, sigma: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Standard normal distribution and density at V/sigma; of what does not scatter, those far out."""
    from scipy.special import ndtr  # heavy: only where something moves on

    x = V / np.where(sigma > 0.0, sigma, 1e-12)
    return np.asarray(ndtr(x)), np.asarray(np.exp(-0.5 * x**2) / math.sqrt(2.0 * math.pi))


class Answer(NamedTuple):
    """Complex answer of one quantity: to the motion u of the wire's top end, and to the wave's elevation above the load
    [per m]."""

    u: ComplexArray
    wave: ComplexArray


QUANTITIES = ("load", "load_rate", "relative", "top", "top_rate", "sling", "sling_rate")
"""Displacement of the payload and its speed, its speed through the water; tension at the crane tip and in the slings
with their rates."""


def answers(omega: FloatArray, load: SuspendedLoad, drag: ArrayLike, compliance: ArrayLike = 0.0) -> dict[str, Answer]:
    """Every one of `QUANTITIES` at omega and linear drags [N s/m] that broadcast with it; compliance of the winch
    [m/N].

    The wave's force on the payload is that of the water's acceleration on displaced water and added mass, and of drag
    by its speed.
    """
    t = transfers(omega, load.rod, load.end, drag, compliance)
    water, rate = load.decay(omega), 1j * omega
    inertia = -(omega**2) * (load.rho_V + load.end.A33)
    F = (inertia + rate * np.asarray(drag, dtype=np.float64)) * water
    motion = Answer(t.load_u, t.load_F * F)
    top, sling = Answer(t.top_u, t.top_F * F), Answer(t.sling_u, t.sling_F * F)
    return {
        "load": motion,
        "load_rate": Answer(rate * motion.u, rate * motion.wave),
        "relative": Answer(rate * motion.u, rate * (motion.wave - water)),
        "top": top,
        "top_rate": Answer(rate * top.u, rate * top.wave),
        "sling": sling,
        "sling_rate": Answer(rate * sling.u, rate * sling.wave),
    }
