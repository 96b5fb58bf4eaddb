r"""Short-crested waves: how the variance of a wave train is shared out over directions.

.. math:: D(\theta) = \frac{\Gamma(n/2 + 1)}{\sqrt\pi\, \Gamma(n/2 + 1/2)} \cos^n(\theta), \quad |\theta| \le \pi/2

Source: DNV-RP-C205 (wind sea n 2 to 4, swell n above 6); check against your edition. It is another function than
cos^(2s)(theta/2), which reaches round to the opposite direction.
"""

from __future__ import annotations

import math

import numpy as np

from stillhook.base.arrays import ComplexArray, FloatArray

ULP = 2.0**-52
DIRECTIONS = 36
"""Directions over 180 deg: 5 deg apart. Their sums of smooth functions of direction are right to rounding for whole
exponents up to 70."""
AROUND, FINE = 36, 10
"""Sectors of the full circle into which measured directions are shared out, and points within each."""
MOST = 0.999
"""Closest to a single direction that measured numbers are taken [1]: 2.6 deg of spread."""


def cos_power(n: float, count: int = DIRECTIONS) -> tuple[FloatArray, FloatArray]:
    """Directions off the mean one [rad], even and symmetric within +-90 deg, and their shares of the variance, both
    (count,).

    The shares are whole multiples of 2^-52, so that they add up to exactly 1 in any order. n exponent, positive.
    """
    theta = (np.arange(count) - (count - 1) / 2.0) * (math.pi / count)
    weight = np.cos(theta) ** n
    weight = np.round(weight / weight.sum() / ULP) * ULP
    weight[count // 2] += 1.0 - weight.sum()
    return np.asarray(theta, dtype=np.float64), np.asarray(weight, dtype=np.float64)


def sectors(count: int = AROUND) -> FloatArray:
    """Middles of even sectors of the full circle (count,) [rad], from 0 on."""
    return np.asarray(np.arange(count) * (2.0 * math.pi / count), dtype=np.float64)


def maximum_entropy(c_1: ComplexArray, c_2: ComplexArray, count: int = AROUND) -> FloatArray:
    r"""The directional distribution that a buoy's four numbers leave the most open, and which is never negative.

    .. math:: D = \frac{1 - \varphi_1 c_1^* - \varphi_2 c_2^*}{2\pi |1 - \varphi_1 e^{-i\theta} - \varphi_2
    e^{-2i\theta}|^2}, \quad
              \varphi_1 = \frac{c_1 - c_2 c_1^*}{1 - |c_1|^2}, \quad \varphi_2 = c_2 - c_1 \varphi_1

    Parameters: c_1, c_2 (...) the means of e^(i theta) and e^(2 i theta): r_1 e^(i alpha_1) and r_2 e^(2 i alpha_2).
    Returns shares (..., count) that add up to 1: what D gives each of the `sectors`.
    Numbers that no distribution has (r_2 below what r_1 needs) are drawn to within 0.1 % of the nearest that one has.
    Source: Lygre and Krogstad 1986. The truncated Fourier series with the same numbers is negative over parts of the
    circle.
    """
    fine = FINE * count
    angle = (np.arange(fine) - (FINE - 1) / 2.0) * (2.0 * math.pi / fine)
    c_1 = c_1 * np.minimum(1.0, MOST / np.maximum(np.abs(c_1), MOST))
    remainder = 1.0 - np.abs(c_1) ** 2
    from_middle = c_2 - c_1**2  # c_2 of a distribution is within 1 - |c_1|^2 of c_1^2
    c_2 = c_1**2 + from_middle * np.minimum(1.0, MOST * remainder / np.maximum(np.abs(from_middle), MOST * remainder))
    phi_1 = (c_1 - c_2 * np.conj(c_1)) / remainder
    phi_2 = c_2 - c_1 * phi_1
    turn = phi_2 * np.conj(phi_1) - phi_1
    squares = [
        1.0 + np.abs(phi_1) ** 2 + np.abs(phi_2) ** 2,
        2.0 * turn.real,
        2.0 * turn.imag,
        -2.0 * phi_2.real,
        -2.0 * phi_2.imag,
    ]
    waves = [np.ones(fine), np.cos(angle), np.sin(angle), np.cos(2.0 * angle), np.sin(2.0 * angle)]
    back = np.stack(squares, axis=-1) @ np.stack(
        waves
    )  # |1 - phi_1 e^(-i theta) - phi_2 e^(-2 i theta)|^2, multiplied out
    share = (1.0 / back).reshape(*c_1.shape, count, FINE).sum(axis=-1)
    return np.asarray(share / share.sum(axis=-1, keepdims=True), dtype=np.float64)
