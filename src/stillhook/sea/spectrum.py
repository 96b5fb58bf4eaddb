"""Wave spectra and seas: what the water does, before any ship. One-sided, in SI, over angular frequency."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


class WaveSpectrum(ABC):
    """A one-sided variance density of the sea surface, S(omega) [m^2 s/rad]: its integral over omega from 0 on is the variance."""

    @abstractmethod
    def density(self, omega: FloatArray) -> FloatArray:
        """S [m^2 s/rad] at omega [rad/s], shape of omega; 0 where the spectrum has nothing."""

    @abstractmethod
    def moment(self, n: int) -> float:
        """m_n, the integral of omega^n S [m^2 rad^n/s^n], right to 1e-4 or better."""

    @abstractmethod
    def grid(self) -> FloatArray:
        """Angular frequencies [rad/s], ascending, on which the trapezoid rule gives moments 0 to 4 of what the spectrum holds to 1e-4."""

    @abstractmethod
    def describe(self) -> str:
        """The spectrum in words and units."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """Plain SI numbers and texts."""


@dataclass(frozen=True)
class Train:
    """Waves of one spectrum from one side.

    beta: mean direction in which they travel, counter-clockwise from the bow [rad] (0 following, pi/2 coming from starboard, pi head sea).
    spread: exponent n of cos^n(theta - beta) within +-90 deg; None: long-crested.
    """

    spectrum: WaveSpectrum
    beta: float
    spread: float | None = None


@dataclass(frozen=True)
class Sea:
    """Wave trains on top of one another, such as wind sea and swell; independent of one another."""

    trains: tuple[Train, ...]
