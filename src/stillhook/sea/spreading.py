r"""Short-crested waves: how the variance of a wave train is shared out over directions.

.. math:: D(\theta) = \frac{\Gamma(n/2 + 1)}{\sqrt\pi\, \Gamma(n/2 + 1/2)} \cos^n(\theta), \quad |\theta| \le \pi/2

Source: DNV-RP-C205 (wind sea n 2 to 4, swell n above 6); check against your edition. It is another function than cos^(2s)(theta/2), which
reaches round to the opposite direction.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

DIRECTIONS = 36
"""Directions over 180 deg: 5 deg apart. Their sums of smooth functions of direction are right to rounding for whole exponents up to 70."""


def cos_power(n: float, count: int = DIRECTIONS) -> tuple[FloatArray, FloatArray]:
    """Directions off the mean one [rad], even and symmetric within +-90 deg, and their shares of the variance, both (count,).

    The shares add up to 1 with no rounding left (`math.fsum`). n exponent, positive.
    """
    theta = (np.arange(count) + 0.5) / count * math.pi - math.pi / 2.0
    weight = np.cos(theta) ** n
    weight = (weight + weight[::-1]) / 2.0
    weight /= math.fsum(weight)
    middle = count // 2
    weight[middle] += 1.0 - math.fsum(weight)
    return theta, weight
