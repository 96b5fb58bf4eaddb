r"""Crane tip of one vessel against a place on the deck of another, in the same waves.

Both answer every wave, each with the phase that the wave has at its reference point. With the other vessel's reference
point at (X, Y) from that of the crane's, and its bow turned by alpha from the crane vessel's, both counter-clockwise,

.. math:: H_{rel}(\omega, \beta) = H_{tip}(\omega, \beta)
          - H_{deck}(\omega, \beta - \alpha)\, e^{-i k (X\cos\beta + Y\sin\beta)}

Sideways as well, without the low-frequency motions that mooring or DP leave. Linear; each vessel alone in the waves:
shielding, and motions by the other's waves, are left out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.sea.vessel.boom import TipPoint
from stillhook.sea.vessel.rao import Rao, wavenumber
from stillhook.units import show


@dataclass(frozen=True, eq=False)
class OtherVessel:
    """A vessel that a payload is lifted from or set down on.

    rao: its transfer functions; at: place on its deck from its own reference point [m]; heading: direction of its bow,
    counter-clockwise from that of the crane vessel [rad]; position (x, y) of its reference point from that of the crane
    vessel [m], None where the place on deck is below the crane tip.
    """

    rao: Rao
    at: TipPoint
    heading: float = 0.0
    position: tuple[float, float] | None = None

    def placed(self, x: float, y: float) -> tuple[float, float]:
        """Its reference point from that of the crane vessel with the crane tip over (x, y) [m]."""
        if self.position is not None:
            return self.position
        c, s = math.cos(self.heading), math.sin(self.heading)
        return x - (c * self.at.x - s * self.at.y), y - (s * self.at.x + c * self.at.y)

    def lag(self, omega: FloatArray, beta: FloatArray, x: float, y: float, depth: float) -> ComplexArray:
        """The wave at its reference point over that at the crane vessel's, the crane tip over (x, y) [m], in water of
        a depth [m]."""
        X, Y = self.placed(x, y)
        along = np.asarray(X * np.cos(beta) + Y * np.sin(beta))
        return np.asarray(np.exp(-1j * along[..., None] * wavenumber(omega, depth)))

    def inputs(self) -> list[Any]:
        """What its motion follows from, as plain data."""
        position = None if self.position is None else list(self.position)
        return [self.rao.digest.hex(), self.at.x, self.at.y, self.heading, position]

    def describe(self) -> str:
        """The vessel and the place on its deck, in words and units."""
        below = "below the crane tip"
        if self.position is not None:
            x, y = (show(v, "length", 4) for v in self.position)
            below = f"its reference point at x {x}, y {y} from that of the crane vessel"
        return f"{self.rao.name}, deck at {self.at.describe()}, {below}, bow at {show(self.heading, 'angle', 4)}"


@dataclass(frozen=True)
class DeckMotion:
    """Height of the place on the deck of another vessel, per metre of wave at the crane vessel's reference point: a
    `VerticalMotion` of places of the crane tip. depth of the water [m]: the phase between the vessels."""

    other: OtherVessel
    depth: float = field(default=math.inf)

    @property
    def name(self) -> str:
        """What moves."""
        return f"deck of {self.other.rao.name}"

    @property
    def omega(self) -> FloatArray:
        """Frequencies of its table [rad/s]."""
        return self.other.rao.omega

    def vertical(self, omega: ArrayLike, beta: ArrayLike, x: float, y: float) -> ComplexArray:
        """Height of the deck with the tip over (x, y) [m], per metre of wave: (k,), or (j, k) for headings (j,)."""
        omega, beta = np.atleast_1d(np.asarray(omega, dtype=np.float64)), np.asarray(beta, dtype=np.float64)
        deck = self.other.rao.vertical(omega, beta - self.other.heading, self.other.at.x, self.other.at.y)
        return np.asarray(deck * self.other.lag(omega, beta, x, y, self.depth))


@dataclass(frozen=True)
class RelativeMotion:
    """Height of a crane tip over the deck of another vessel, per metre of wave: a `VerticalMotion` of places of the
    crane tip. depth of the water [m]: the phase between the vessels; left: part of the tip's motion that a winch
    leaves, 0 for the deck alone; of_deck times the deck's motion that is added, 1 - left for a hook that follows it."""

    crane: Rao
    other: OtherVessel
    depth: float = field(default=math.inf)
    left: float = 1.0
    of_deck: float = -1.0

    @property
    def name(self) -> str:
        """What moves against what."""
        return f"{self.crane.name} against {self.other.rao.name}"

    @property
    def omega(self) -> FloatArray:
        """Frequencies that both tables have [rad/s]."""
        a, b = self.crane.omega, self.other.rao.omega
        marks = np.union1d(a, b)
        return np.asarray(marks[(marks >= max(a[0], b[0])) & (marks <= min(a[-1], b[-1]))])

    def vertical(self, omega: ArrayLike, beta: ArrayLike, x: float, y: float) -> ComplexArray:
        """Height of the tip over (x, y) [m] against the deck, per metre of wave at the crane vessel's reference point:
        (k,), or (j, k) for headings (j,)."""
        omega, beta = np.atleast_1d(np.asarray(omega, dtype=np.float64)), np.asarray(beta, dtype=np.float64)
        deck = DeckMotion(self.other, self.depth).vertical(omega, beta, x, y)
        return np.asarray(self.left * self.crane.vertical(omega, beta, x, y) + self.of_deck * deck)

    def deck(self, omega: FloatArray, beta: FloatArray, x: float, y: float, z: float) -> ComplexArray:
        """Motion of the place on deck, z above the waterline [m], forward and to port of the crane vessel [m], and
        the deck's roll and pitch [rad], per metre of wave at the crane vessel's reference point, the crane tip over
        (x, y): (4, j, k)."""
        alpha, at = self.other.heading, self.other.at
        of_wave = self.other.rao.at(omega, beta - alpha)
        X, Y = sideways(of_wave, at.x, at.y, z)
        c, s = math.cos(alpha), math.sin(alpha)
        return np.asarray([c * X - s * Y, s * X + c * Y, of_wave[3], of_wave[4]]) * self.other.lag(
            omega, beta, x, y, self.depth
        )


def sideways(motions: ComplexArray, x: float, y: float, z: float) -> tuple[ComplexArray, ComplexArray]:
    """Motion forward and to port of a place (x, y, z) of a vessel [m], of its six motions about its reference point
    (6, ...)."""
    surge, sway, _, roll, pitch, yaw = motions
    return surge + z * pitch - y * yaw, sway - z * roll + x * yaw
