"""Motion transfer functions of a vessel (RAO): one type, in one convention; readers translate into it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Rao:
    """Motion of a vessel per metre of wave amplitude, as complex numbers.

    Convention (the only one inside Stillhook): time exp(+i omega t); x forward, y to port, z up, right-handed, origin at the motion
    reference point; wave crest at the reference point at phase 0; heading beta = direction in which the waves travel, counter-clockwise
    from the bow: 0 following, pi/2 coming from starboard, pi head sea, 3 pi/2 coming from port.
    omega (n,) [rad/s] ascending; beta (m,) [rad] ascending in [0, 2 pi), all round (readers mirror half tables explicitly);
    H (6, m, n): surge, sway, heave [m/m], roll, pitch, yaw [rad/m] (pitch positive: bow down; roll positive: port side up).
    """

    name: str
    omega: FloatArray = field(repr=False)
    beta: FloatArray = field(repr=False)
    H: ComplexArray = field(repr=False)
    source: str = ""
    notes: tuple[str, ...] = ()

    def at(self, omega: FloatArray, beta: float) -> ComplexArray:
        """H at omega (k,) [rad/s] and one heading [rad], shape (6, k): linear in heading (periodic), in frequency a curve through the
        complex values; towards long waves it goes to the limits of a floating body, above the highest frequency it is 0."""
        raise NotImplementedError

    def vertical(self, omega: FloatArray, beta: float, x: float, y: float) -> ComplexArray:
        """Vertical motion of the point (x, y) [m] per metre of wave, eta_3 + y eta_4 - x eta_5, shape (k,)."""
        raise NotImplementedError
