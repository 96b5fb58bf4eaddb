r"""Wave spectra and seas: what the water does, before any ship. One-sided, in SI, over angular frequency.

How steep a sea is, and whether wind can raise one so steep.

.. math:: S_p = \frac{2\pi}{g}\frac{H_{m0}}{T_p^2}, \quad S_s = \frac{2\pi}{g}\frac{H_{m0}}{T_z^2}

Source: DNV-RP-C205 (limits of the average steepness of short-term sea states); check against your edition.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import SeaError
from stillhook.physics.scalar import G as G
from stillhook.sea.spectra.directions import cos_power


class WaveSpectrum(ABC):
    """A one-sided variance density of the sea surface, S(omega) [m^2 s/rad]: its integral over omega from 0 on is the
    variance.

    Integrals of S with anything (a squared transfer function, a power of omega) are sums over `grid` with `weights`.
    """

    @abstractmethod
    def density(self, omega: FloatArray) -> FloatArray:
        """S [m^2 s/rad] at omega [rad/s], shape of omega; 0 where the spectrum has nothing."""

    @abstractmethod
    def moment(self, n: int) -> float:
        """m_n, the integral of omega^n S [m^2 rad^n/s^n] for n = -1 to 4, over all omega where that converges, else up
        to `omega_cut`."""

    @abstractmethod
    def grid(self) -> FloatArray:
        """Angular frequencies [rad/s], ascending, that resolve the spectrum up to `omega_cut`."""

    @property
    @abstractmethod
    def omega_cut(self) -> float:
        """Where `grid` ends, and up to where moments are taken that do not converge [rad/s]."""

    @abstractmethod
    def describe(self) -> str:
        """The spectrum in words and units."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """Plain SI numbers and texts; `stillhook.sea.spectra.text.spectrum_from_dict` is the way back."""

    def notes(self) -> tuple[str, ...]:
        """What the spectrum had to say about how it was made, a line each."""
        return ()

    def weights(self) -> FloatArray:
        """Weights [rad/s] with which sums over `grid` are integrals: the trapezoid rule; band widths where it is
        measured in bands."""
        return trapezoid(self.grid())

    @property
    def peak_period(self) -> float:
        """Period of the highest point of S(omega) [s], right to 1e-4; NaN where there are no waves."""
        omega = self.grid()
        top = int(np.argmax(self.density(omega)))
        close = np.linspace(omega[max(top - 1, 0)], omega[min(top + 1, len(omega) - 1)], 401)
        S = self.density(close)
        return 2.0 * math.pi / float(close[np.argmax(S)]) if S.max() > 0.0 else math.nan

    @property
    def H_m0(self) -> float:
        """Significant wave height 4 sqrt(m_0) [m]."""
        return 4.0 * math.sqrt(self.moment(0))

    @property
    def T_m01(self) -> float:
        """Mean period 2 pi m_0/m_1 [s]; NaN where there are no waves."""
        return _period(self.moment(0), self.moment(1), 1)

    @property
    def T_m02(self) -> float:
        """Zero-crossing period T_z = 2 pi sqrt(m_0/m_2) [s]; NaN where there are no waves."""
        return _period(self.moment(0), self.moment(2), 2)

    @property
    def T_e(self) -> float:
        """Energy period 2 pi m_-1/m_0 [s]; NaN where there are no waves."""
        return _period(self.moment(-1), self.moment(0), 1)


def _period(upper: float, lower: float, order: int) -> float:
    return 2.0 * math.pi * float((upper / lower) ** (1.0 / order)) if lower > 0.0 else math.nan


def trapezoid(omega: FloatArray) -> FloatArray:
    """Weights of the trapezoid rule on ascending points, shape (n,) as they."""
    step = np.diff(omega)
    return np.concatenate(([0.0], step)) / 2.0 + np.concatenate((step, [0.0])) / 2.0


@dataclass(frozen=True)
class Train:
    """Waves of one spectrum from one side.

    beta: mean direction in which they travel, counter-clockwise from the bow [rad] (0 following, pi/2 coming from
    starboard, pi head sea). spread: exponent n of cos^n(theta - beta) within +-90 deg; None: long-crested.
    Errors: SeaError for a direction that is not a number, and for an exponent outside 1 to 200.
    """

    spectrum: WaveSpectrum
    beta: float
    spread: float | None = None

    def __post_init__(self) -> None:
        if not math.isfinite(self.beta):
            raise SeaError(f"waves: direction {self.beta:g} rad is not a number. Give the heading in deg or rad.")
        if self.spread is not None:
            check_spread(self.spread)

    def directions(self) -> tuple[FloatArray, FloatArray]:
        """Directions of travel [rad] and their shares of the variance, both (k,); k = 1 when long-crested."""
        if self.spread is None:
            return np.array([self.beta]), np.ones(1)
        theta, weight = cos_power(self.spread)
        return self.beta + theta, weight

    def describe(self) -> str:
        """The train in words and units."""
        spread = "long-crested" if self.spread is None else f"cos^{self.spread:g} spread"
        return f"{self.spectrum.describe()}, travelling to {math.degrees(self.beta):.6g} deg from the bow, {spread}"


LEAST_SPREAD, LARGEST_SPREAD = 1.0, 200.0


def check_spread(n: float, where: str = "spread") -> float:
    """The exponent of a cos^n spreading, if it is one. Errors: SeaError outside 1 to 200."""
    if not LEAST_SPREAD <= n <= LARGEST_SPREAD:
        allowed = f"between {LEAST_SPREAD:g} and {LARGEST_SPREAD:g}"
        raise SeaError(f"{where} {n:g}: is not {allowed}. Leave it out for long-crested waves.")
    return n


@dataclass(frozen=True)
class Sea:
    """Wave trains on top of one another, such as wind sea and swell; independent of one another."""

    trains: tuple[Train, ...]

    def __post_init__(self) -> None:
        if not self.trains:
            raise SeaError("sea: no waves given. Give at least one wave train.")

    @property
    def H_m0(self) -> float:
        """Significant wave height of all trains together [m]."""
        return 4.0 * math.sqrt(self.moment(0))

    def moment(self, n: int) -> float:
        """m_n of all trains together [m^2 rad^n/s^n]."""
        return math.fsum(train.spectrum.moment(n) for train in self.trains)

    def describe(self) -> str:
        """The sea in words and units; of many trains, as a directional record has, the first and the height of all."""
        if len(self.trains) > 4:
            first = self.trains[0].describe()
            return f"{len(self.trains)} wave trains, Hm0={self.H_m0:.4g} m in all, the first {first}"
        return " + ".join(train.describe() for train in self.trains)


LIMITS: Mapping[str, tuple[tuple[float, float], tuple[float, float]]] = MappingProxyType(
    {
        "T_p": ((8.0, 1.0 / 15.0), (15.0, 1.0 / 25.0)),
        "T_m02": ((6.0, 1.0 / 10.0), (12.0, 1.0 / 15.0)),
    }
)
"""Steepest sea by period: up to the first [s], from the second on, and straight between them."""


def steepness(H_m0: float, T: float) -> float:
    """2 pi H_m0/(g T^2) [1] of a height [m] and a period [s]; NaN without a period."""
    return 2.0 * math.pi * H_m0 / (G * T**2) if T > 0.0 else math.nan


def steepest(T: float, period: str) -> float:
    """Largest steepness of a sea [1] of a period [s]: "T_p" or "T_m02"."""
    (a, s_a), (b, s_b) = LIMITS[period]
    return float(np.interp(T, (a, b), (s_a, s_b)))


def highest_sea(T_p: float) -> float:
    """Significant wave height of the steepest sea of a peak period [s] (DNV-RP-C205) [m]."""
    return steepest(T_p, "T_p") * G * T_p**2 / (2.0 * math.pi)


def doubts(H_m0: float, T_p: float, T_m02: float) -> tuple[str, ...]:
    """What contradicts a sea of this height [m] and these periods [s], a line each; nothing for a sound one."""
    lines = []
    for name, T in (("T_p", T_p), ("T_m02", T_m02)):
        s, most = steepness(H_m0, T), steepest(T, name)
        if s > most:
            lines.append(f"above the steepness limit: 2 pi H_m0/(g {name}^2) = {s:.3g}, limit {most:.3g} (DNV-RP-C205)")
    return tuple(lines)
