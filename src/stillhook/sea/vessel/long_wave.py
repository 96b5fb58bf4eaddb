r"""Water waves much longer than a floating body: their number on water of some depth, and how every body rides on them.

In exp(+i omega t), with x forward, y to port, z up and waves that travel in direction beta (counter-clockwise from the
bow), the surface is :math:`\zeta = \Re\, a\, e^{i(\omega t - k(x\cos\beta + y\sin\beta))}`. Water goes round in circles
(on depth h: ellipses, wider by coth kh), forward under a crest, so that per metre of amplitude, as k -> 0,

.. math:: \eta_1 \to -i\cos\beta,\quad \eta_2 \to -i\sin\beta,\quad \eta_3 \to 1,\quad
          \eta_4/k \to -i\sin\beta,\quad \eta_5/k \to i\cos\beta,\quad \eta_6/k \to -\sin\beta\cos\beta.

Roll and pitch are the slopes of the surface, roll only where its natural period is far off; yaw is that of a slender
ship.
"""

from __future__ import annotations

import math

import numpy as np

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.sea.vessel.ship_motion import STANDARD_GRAVITY


def wavenumber(omega: FloatArray, depth: float = math.inf) -> FloatArray:
    r"""k [rad/m] of waves of omega [rad/s], any shape, on water of some depth [m]: :math:`\omega^2 = g k \tanh kh`."""
    deep = np.asarray(omega, dtype=np.float64) ** 2 / STANDARD_GRAVITY
    if not math.isfinite(depth):
        return deep
    kh = (
        deep * depth / np.sqrt(np.tanh(np.maximum(deep * depth, 1e-300)))
    )  # within 5 % of the root; Newton's steps end at rounding
    for _ in range(6):
        t = np.tanh(kh)
        kh = kh - (kh * t - deep * depth) / np.maximum(t + kh * (1.0 - t**2), 1e-300)
    return np.asarray(kh / depth)


def long_wave_limits(beta: FloatArray) -> ComplexArray:
    """Limits (6, m) on deep water at headings beta (m,) [rad]: surge, sway, heave per metre; roll, pitch, yaw per metre
    and wavenumber."""
    c, s = np.cos(beta), np.sin(beta)
    return np.array([-1j * c, -1j * s, np.ones_like(c), -1j * s, 1j * c, -s * c], dtype=np.complex128)


def long_wave_scales(omega: FloatArray, depth: float = math.inf) -> FloatArray:
    """What the limits are multiplied by at frequencies (k,): (6, k); coth kh across the wave, 1 up, k for rotations, k
    coth kh for yaw."""
    k = wavenumber(omega, depth)
    wide = 1.0 / np.tanh(k * depth) if math.isfinite(depth) else np.ones_like(k)
    return np.array([wide, wide, np.ones_like(k), k, k, k * wide])
