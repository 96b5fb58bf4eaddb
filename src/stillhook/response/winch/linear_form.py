"""The winch under compensation in linear form: describing function, remnant that does not follow the tip,
compliance."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
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
    nearest holds; beyond the smallest and largest sigma_v the remnant is proportional to the tip's motion, as of a
    stuck and of a saturated winch.
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
        x, knots = np.log(omega), np.log(self.omega)
        S = np.exp([[np.interp(x, knots, row) for row in rows] for rows in np.log(self.S)])
        step = np.diff(omega)
        return np.asarray(S * (np.concatenate((step, [0.0])) + np.concatenate(([0.0], step))) / 2.0)

    def places(self, sigma_v: ArrayLike, T_z: ArrayLike) -> Places:
        """Positions in the table of irregular motions of deviation sigma_v and period T_z, (n,) each."""
        sigma = np.asarray(sigma_v, dtype=np.float64)
        i, i_1, f = neighbours(np.log(self.T_z), np.log(np.asarray(T_z, dtype=np.float64)))
        j, j_1, g = neighbours(np.log(self.sigma_v), np.log(sigma))
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
        return _joined(np.log(np.maximum(sigma_v, 1e-12)), np.log(self.sigma_v), self.gain)


def neighbours(knots: FloatArray, x: FloatArray) -> tuple[NDArray[np.intp], NDArray[np.intp], FloatArray]:
    """Lower and upper neighbours of x (n,) in ascending knots, and the shares of the upper ones; the ends hold."""
    low = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, max(len(knots) - 2, 0))
    high = np.minimum(low + 1, len(knots) - 1)
    span = np.where(high > low, knots[high] - knots[low], 1.0)
    return low, high, np.clip((x - knots[low]) / span, 0.0, 1.0)


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
        x, knots = np.log([max(sigma_v, 1e-12)]), np.log(self.sigma_v)
        same = np.flatnonzero(knots == x)
        over_sigma = self.Y[:, same[0]] if len(same) else np.concatenate([_joined(x, knots, row) for row in self.Y])
        return _joined(np.log(omega), np.log(self.omega), over_sigma)


def _joined(x: FloatArray, knots: FloatArray, values: ComplexArray) -> ComplexArray:
    return np.asarray(np.interp(x, knots, values.real) + 1j * np.interp(x, knots, values.imag), dtype=np.complex128)


HARMONICS = (2, 3, 4, 5)
"""Harmonics of the tip's frequency that are kept in addition to the fundamental."""
NODES = 32
"""Points of the Gauss-Laguerre rule over the amplitudes of an irregular motion; half of them give the same within
1e-3."""
STILL = 1e-9
"""Speed amplitude below which a tip counts as moving no less [m/s]: only so that nothing is divided by 0."""


@dataclass(frozen=True, eq=False)
class Residual:
    """Table of C over frequency and speed amplitude of the tip.

    omega (m,) [rad/s] ascending; v (k,) speed amplitudes [m/s] ascending; C (m, k); harmonics (4, m, k): size of the
    wire's motion at 2 to 5 times the frequency over the tip's height; saturated (m, k): share of the time in which the
    pumps are at their stop [-]; about: winch, mode, load and wire in words; remnant: error under irregular motions
    that C does not describe, None for none; compliance: of the winch to a changing tension, None for zero; relieved (m,
    k): share of the time with a relief valve open [-], p_a (m, k): highest pressure of the hoisting side [Pa], None
    where they are not known. All but `compliance` hold at constant tension.
    Errors: LiftError for other shapes.
    """

    omega: FloatArray = field(repr=False)
    v: FloatArray = field(repr=False)
    C: ComplexArray = field(repr=False)
    harmonics: FloatArray = field(repr=False)
    saturated: FloatArray = field(repr=False)
    about: str = ""
    remnant: Remnant | None = None
    compliance: WinchCompliance | None = None
    relieved: FloatArray | None = field(default=None, repr=False)
    p_a: FloatArray | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        shape = (len(self.omega), len(self.v))
        if self.C.shape != shape or self.harmonics.shape != (len(HARMONICS), *shape) or self.saturated.shape != shape:
            raise LiftError(
                f"residual: tables of shape {self.C.shape} for {shape[0]} frequencies and {shape[1]} amplitudes."
            )
        for name, axis in (("omega", self.omega), ("v", self.v)):
            if len(axis) < 1 or axis[0] <= 0.0 or (np.diff(axis) <= 0.0).any():
                raise LiftError(f"residual: {name} must be above 0 and ascend, each value once.")

    @classmethod
    def constant(cls, C: complex, about: str = "") -> Residual:
        """The same residual at every frequency and amplitude: 1 for a winch on its brake, 0.2 for a compensation of 80
        % in phase."""
        unit = np.ones((1, 1))
        fast = np.array([1e9])  # faster than any tip: below it a table is proportional to the amplitude
        return cls(
            np.ones(1),
            fast,
            np.asarray(unit * C, dtype=np.complex128),
            np.zeros((len(HARMONICS), 1, 1)),
            0.0 * unit,
            about or f"constant {C:g}",
        )

    def at(self, omega: ArrayLike, v: ArrayLike) -> ComplexArray:
        """C [-] at omega [rad/s] and the tip's speed amplitude v [m/s], above 0; both broadcast."""
        omega, v = np.broadcast_arrays(np.asarray(omega, dtype=np.float64), np.asarray(v, dtype=np.float64))
        low, high, share = neighbours(np.log(self.omega), np.log(omega.ravel()))
        gain, columns = self._gain(v.ravel()), np.arange(v.size)
        return np.asarray(gain[low, columns] + share * (gain[high, columns] - gain[low, columns])).reshape(omega.shape)

    def _gain(self, v: FloatArray) -> ComplexArray:
        """C at all frequencies of the table for speed amplitudes v (n,): (m, n). Beyond the last amplitude the wire's
        end takes all that the tip moves more."""
        knots = np.concatenate(([0.0], self.v))
        e = np.concatenate((np.zeros((len(self.C), 1)), self.C * self.v), axis=1)
        i = np.clip(np.searchsorted(knots, v) - 1, 0, len(knots) - 2)
        inside = np.minimum(v, knots[-1])
        error = e[:, i] + (e[:, i + 1] - e[:, i]) * (inside - knots[i]) / (knots[i + 1] - knots[i])
        return np.asarray((error + (v - inside)) / v)

    def gaussian(self, omega: ArrayLike, sigma_v: ArrayLike) -> ComplexArray:
        r"""Equivalent transfer under an irregular motion of the tip, at omega (m,): (m,) or (n, m) for deviations
        sigma_v () or (n,) of the total speed of the tip [m/s].

        .. math:: C_{eq}(\omega, \sigma) = g(\sigma) \int_0^\infty y\, e^{-y}\, C(\omega, \sigma\sqrt{2 y})\, dy

        The heights of waves in a narrow Gaussian motion are Rayleigh distributed; the transfer with the least square
        error weighs C at every amplitude with its square. For a winch whose error followed from the speed at this
        instant alone it would be exact for any Gaussian motion. It is the total deviation of speed that counts at every
        frequency: friction feels the sum of all waves. g is the remnant's gain, the ratio of the twin to this rule:
        within some per cent of 1, less than 1.2 where pumps saturate.
        """
        sigma, frequency = np.asarray(sigma_v, dtype=np.float64), np.asarray(omega, dtype=np.float64)
        y, weight = _rayleigh()
        v = np.maximum(sigma.ravel()[:, None] * np.sqrt(2.0 * y), STILL)
        gain = self._gain(v.ravel()).reshape(len(self.omega), *v.shape)
        mean: ComplexArray = np.asarray(np.einsum("mny,y->mn", gain, weight), dtype=np.complex128)
        if self.remnant is not None:
            mean = mean * self.remnant.gain_at(sigma.ravel())
        low, high, share = neighbours(np.log(self.omega), np.log(frequency))
        transfer = mean[low] + share[:, None] * (mean[high] - mean[low])
        return np.asarray(transfer.T).reshape(*sigma.shape, len(frequency))


@cache
def _rayleigh() -> tuple[FloatArray, FloatArray]:
    """Points y and weights of the integral over y exp(-y), y = amplitude^2/(2 sigma^2)."""
    from scipy.special import roots_genlaguerre  # heavy: only where a residual is used

    y, weight = roots_genlaguerre(NODES, 1.0)
    return np.asarray(y), np.asarray(weight)
