"""Directions of waves: what a file or forecast means by one, shares of measured directions, and short-crested
waves."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from enum import Enum
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.errors import SeaError
from stillhook.units import parse, quote

Angles = TypeVar("Angles", float, NDArray[np.float64])

FULL = 2.0 * math.pi


def parse_direction(text: object, where: str = "direction") -> float:
    """A direction as text with its unit, 0 to 360 deg [rad]. Errors: UnitError, SeaError."""
    value = parse(text, "angle", where)
    if not 0.0 <= value <= FULL * (1.0 + 1e-12):
        raise SeaError(f"{where} = {quote(text)}: not between 0 deg and 360 deg. Give the direction within one turn.")
    return value


class DirectionSense(Enum):
    """What the numbers of a file say."""

    FROM_NORTH = "coming from, clockwise from north"
    TO_NORTH = "going to, clockwise from north"
    FROM_EAST = "coming from, counter-clockwise from east"
    TO_EAST = "going to, counter-clockwise from east"


def coming_from(direction: Angles, sense: DirectionSense) -> Angles:
    """Where waves come from, clockwise from north [rad, 0 to 2 pi], of a direction [rad] that is meant in `sense`."""
    match sense:
        case DirectionSense.FROM_NORTH:
            return wrapped(direction)
        case DirectionSense.TO_NORTH:
            return wrapped(direction + math.pi)
        case DirectionSense.FROM_EAST:
            return wrapped(math.pi / 2.0 - direction)
        case DirectionSense.TO_EAST:
            return wrapped(1.5 * math.pi - direction)


def relative(come_from: Angles, heading: Angles | float) -> Angles:
    """beta [rad, 0 to 2 pi] of waves that come from `come_from` [rad clockwise from north] on a ship that heads
    `heading` [same].

    Waves from dead ahead (come_from = heading) are a head sea: pi. Waves from starboard (heading + pi/2) travel to
    port: pi/2. Its own inverse: of beta and the heading it is where the waves come from.
    """
    return wrapped(heading + math.pi - come_from)


def wrapped(angle: Angles) -> Angles:
    """The angle within 0 to 2 pi [rad]."""
    return angle % FULL


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
    # |1 - phi_1 e^(-i theta) - phi_2 e^(-2 i theta)|^2, multiplied out
    of_turn, of_phi = (2.0 * turn.real, 2.0 * turn.imag), (-2.0 * phi_2.real, -2.0 * phi_2.imag)
    squares = [1.0 + np.abs(phi_1) ** 2 + np.abs(phi_2) ** 2, *of_turn, *of_phi]
    waves = [np.ones(fine), np.cos(angle), np.sin(angle), np.cos(2.0 * angle), np.sin(2.0 * angle)]
    back = np.stack(squares, axis=-1) @ np.stack(waves)
    share = (1.0 / back).reshape(*c_1.shape, count, FINE).sum(axis=-1)
    return np.asarray(share / share.sum(axis=-1, keepdims=True), dtype=np.float64)


class Directions(ABC):
    """How the variance of each of m bands is shared out over directions, in n records.

    theta (k,): where waves come from, clockwise from north [rad], even over the full circle.
    """

    theta: FloatArray

    @abstractmethod
    def shares(self, i: int) -> FloatArray:
        """Shares of the directions in the i-th record (m, k), adding up to 1 over k; NaN where unknown."""

    @abstractmethod
    def turn(self) -> ComplexArray:
        """Mean of e^(i theta) over directions (n, m): its argument is the mean direction."""


@dataclass(frozen=True, eq=False)
class Directional(Directions):
    """Shares as such: theta (k,); share (n, m, k)."""

    theta: FloatArray
    share: FloatArray = field(repr=False)

    def shares(self, i: int) -> FloatArray:
        return np.asarray(self.share[i], dtype=np.float64)

    def turn(self) -> ComplexArray:
        return np.asarray(self.share @ np.exp(1j * self.theta), dtype=np.complex128)


@dataclass(frozen=True, eq=False)
class Coefficients(Directions):
    """The first two Fourier coefficients of a buoy, (n, m): first r_1 e^(i alpha_1), second r_2 e^(2 i alpha_2).

    Shares are those of the maximum-entropy method in 36 sectors, worked out record by record.
    """

    first: ComplexArray = field(repr=False)
    second: ComplexArray = field(repr=False)
    theta: FloatArray = field(default_factory=sectors, repr=False)

    def shares(self, i: int) -> FloatArray:
        return maximum_entropy(self.first[i], self.second[i])

    def turn(self) -> ComplexArray:
        return self.first
