r"""Motion of the wire's top end that does not follow the tip: the effect of friction and saturation under irregular
motion.

Of a sine they leave harmonics; of a random motion slow wandering (the position loop takes ten seconds to win back what
a wave has cost) and a broad tail. Both are independent of the tip in the sense of the mean square, so their spectrum
adds to that of C s_tip. It is measured on the twin under irregular motions, over the deviation sigma_v of the tip's
speed and its zero-crossing period T_z.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.errors import LiftError


class Places(NamedTuple):
    """Four neighbours of n motions in a table over period and deviation: rows, columns and shares (n,) of each; beyond
    (n,), factor on variances beyond the ends of the table."""

    corners: tuple[tuple[NDArray[Any], NDArray[Any], FloatArray], ...]
    beyond: FloatArray

    def rows(self, some: NDArray[Any]) -> Places:
        """Those of some of the motions."""
        return Places(tuple((i[some], j[some], share[some]) for i, j, share in self.corners), self.beyond[some])

    def at(self, values: FloatArray) -> FloatArray:
        """Of variances at all periods and deviations of the table (j, k, s), those of the motions: (n, s)."""
        y = np.log(np.maximum(values, 1e-300))
        return np.asarray(np.exp(sum(share[:, None] * y[i, j] for i, j, share in self.corners)) * self.beyond[:, None])


@dataclass(frozen=True, eq=False)
class Remnant:
    """T_z (j,) [s] and sigma_v (k,) [m/s] ascending; omega (b,) [rad/s] ascending; S (j, k, b) one-sided density of the
    remnant [m^2 s/rad]; gain (k,) factor by which C of sines is to be multiplied under irregular motion [-], near 1;
    peak (j, k) largest peak-to-peak of the wire's end in 30 s over its standard deviation, in a motion that lasts
    `lasts` [s]: the error by friction is bounded, and Gaussian rules overestimate it by half; None where it is not
    known.

    Between its values S is interpolated in logarithms of everything. Beyond the last periods and frequencies the
    nearest holds; beyond the smallest and largest sigma_v the remnant goes with the tip's motion, as of a stuck and of
    a saturated winch.
    """

    T_z: FloatArray = field(repr=False)
    sigma_v: FloatArray = field(repr=False)
    omega: FloatArray = field(repr=False)
    S: FloatArray = field(repr=False)
    gain: ComplexArray = field(repr=False)
    peak: FloatArray | None = field(default=None, repr=False)
    lasts: float = 600.0

    def __post_init__(self) -> None:
        if self.S.shape != (len(self.T_z), len(self.sigma_v), len(self.omega)) or self.gain.shape != self.sigma_v.shape:
            raise LiftError(
                f"remnant: densities of shape {self.S.shape} for {len(self.T_z)} periods and {len(self.sigma_v)}"
                " deviations."
            )

    def on(self, omega: FloatArray) -> FloatArray:
        """Variance in each of frequencies omega (m,) [rad/s], ascending, that resolve what it goes through: (j, k, m)
        [m^2]."""
        x = np.log(omega)
        S = np.exp([[np.interp(x, np.log(self.omega), np.log(row)) for row in rows] for rows in self.S])
        step = np.diff(omega)
        return np.asarray(S * (np.concatenate((step, [0.0])) + np.concatenate(([0.0], step))) / 2.0)

    def places(self, sigma_v: ArrayLike, T_z: ArrayLike) -> Places:
        """Positions in the table of irregular motions of deviation sigma_v and period T_z, (n,) each."""
        sigma = np.asarray(sigma_v, dtype=np.float64)
        i, f = _place(np.log(self.T_z), np.log(np.asarray(T_z, dtype=np.float64)))
        j, g = _place(np.log(self.sigma_v), np.log(sigma))
        i_1, j_1 = np.minimum(i + 1, len(self.T_z) - 1), np.minimum(j + 1, len(self.sigma_v) - 1)
        corners = ((i, j, (1.0 - f) * (1.0 - g)), (i, j_1, (1.0 - f) * g), (i_1, j, f * (1.0 - g)), (i_1, j_1, f * g))
        return Places(corners, (sigma / np.clip(sigma, self.sigma_v[0], self.sigma_v[-1])) ** 2)

    def peak_at(self, sigma_v: ArrayLike, T_z: ArrayLike) -> FloatArray | None:
        """peak for irregular motions of deviation sigma_v and period T_z, (n,) each."""
        if self.peak is None:
            return None
        peak = self.peak
        return np.asarray(sum(share * peak[i, j] for i, j, share in self.places(sigma_v, T_z).corners))

    def gain_at(self, sigma_v: ArrayLike) -> ComplexArray:
        """gain at deviations sigma_v, shape of sigma_v."""
        x, knots = np.log(np.maximum(sigma_v, 1e-12)), np.log(self.sigma_v)
        return np.asarray(np.interp(x, knots, self.gain.real) + 1j * np.interp(x, knots, self.gain.imag))


def _place(knots: FloatArray, x: FloatArray) -> tuple[NDArray[Any], FloatArray]:
    """Lower neighbours of x in knots, and the shares of the upper ones; the ends hold."""
    low = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, max(len(knots) - 2, 0))
    span = knots[low + 1] - knots[low] if len(knots) > 1 else np.ones_like(x)
    return low, np.clip((x - knots[low]) / span, 0.0, 1.0)
