"""Compliance of a winch to a changing tension while it compensates: compressibility of the oil, slip, passive circuit,
sliding friction."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.errors import LiftError


@dataclass(frozen=True, eq=False)
class WinchCompliance:
    """Wire paid out per tension, complex, over frequency and the deviation of the tip's speed: omega (m,) [rad/s] and
    sigma_v (k,) [m/s] ascending, Y (m, k) [m/N]. Linear in the logarithms of both; beyond the ends the nearest
    holds."""

    omega: FloatArray = field(repr=False)
    sigma_v: FloatArray = field(repr=False)
    Y: ComplexArray = field(repr=False)

    def __post_init__(self) -> None:
        if self.Y.shape != (len(self.omega), len(self.sigma_v)):
            raise LiftError(
                f"compliance: a table of shape {self.Y.shape} for {len(self.omega)} frequencies and {len(self.sigma_v)}"
                " deviations."
            )

    def at(self, omega: FloatArray, sigma_v: float) -> ComplexArray:
        """Y [m/N] at frequencies (n,) [rad/s] and one deviation of the tip's speed [m/s]."""
        x = np.log([max(sigma_v, 1e-12)])
        over_sigma = np.concatenate([_joined(x, np.log(self.sigma_v), row) for row in self.Y])
        return _joined(np.log(omega), np.log(self.omega), over_sigma)


def _joined(x: FloatArray, knots: FloatArray, values: ComplexArray) -> ComplexArray:
    return np.asarray(np.interp(x, knots, values.real) + 1j * np.interp(x, knots, values.imag), dtype=np.complex128)
