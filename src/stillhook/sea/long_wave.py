r"""What every floating body does in waves much longer than it: it rides on the water. The test of any table of motions.

In exp(+i omega t), with x forward, y to port, z up and waves that travel in direction beta (counter-clockwise from the bow), the surface
is :math:`\zeta = \Re\, a\, e^{i(\omega t - k(x\cos\beta + y\sin\beta))}`. Water of deep sea goes round in circles, forward under a crest,
so that per metre of amplitude, as k -> 0,

.. math:: \eta_1 \to -i\cos\beta,\quad \eta_2 \to -i\sin\beta,\quad \eta_3 \to 1,\quad
          \eta_4/k \to -i\sin\beta,\quad \eta_5/k \to i\cos\beta,\quad \eta_6/k \to -\sin\beta\cos\beta.

Roll and pitch are the slopes of the surface, roll only where its natural period is far off; yaw is that of a slender ship.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from stillhook.sea.ship_motion import STANDARD_GRAVITY

FloatArray = NDArray[np.float64]
Number = TypeVar("Number", float, FloatArray)


def deep_wavenumber(omega: Number) -> Number:
    """k [rad/m] of a wave of omega [rad/s] on deep water, omega^2/g."""
    return omega**2 / STANDARD_GRAVITY


def long_wave_limits(beta: FloatArray) -> NDArray[np.complex128]:
    """Limits (6, m) at headings beta (m,) [rad]: surge, sway, heave per metre; roll, pitch, yaw per metre and wavenumber."""
    c, s = np.cos(beta), np.sin(beta)
    return np.array([-1j * c, -1j * s, np.ones_like(c), -1j * s, 1j * c, -s * c], dtype=np.complex128)
