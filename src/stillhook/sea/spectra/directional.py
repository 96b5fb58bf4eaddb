"""Which way the waves of measured records come from: as shares of sectors, or as the Fourier coefficients that buoys
measure."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field

import numpy as np

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.sea.spectra.spreading import maximum_entropy, sectors


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
