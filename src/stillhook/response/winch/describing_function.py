r"""Residual of the crane tip's motion at the wire's top end under compensation: a transfer that depends on the speed of
the tip.

.. math:: u = C(\omega, a)\, s_{tip}, \qquad \hat v = \omega a

u is the motion of the wire's upper end (tip less wire paid out) at the tip's own frequency; C is a describing function:
phase and size of the fundamental under a sine of the tip, with the harmonics 2 to 5 in addition. C is tabulated over
the tip's speed amplitude, not its height: friction of a winch changes sides with its speed, and pumps saturate at a
speed, so that curves over speed are alike at all frequencies.

Between amplitudes the speed error |u| omega is interpolated, piecewise linear in the tip's speed amplitude: exact where
C is constant (a stuck winch), where it falls as 1/a (friction) and where u grows by all that the tip moves more
(saturation, which goes on beyond the last amplitude). Between frequencies C is linear in log omega; beyond both ends
the nearest holds.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.errors import LiftError
from stillhook.response.winch.compliance import WinchCompliance
from stillhook.response.winch.remnant import Remnant

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
    pumps stand at their stop [-]; about: winch, mode, load and wire in words; remnant: error under irregular motions
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
        one = np.ones((1, 1))
        fast = np.array([1e9])  # faster than any tip: below it a table is proportional to the amplitude
        return cls(
            np.ones(1),
            fast,
            np.asarray(one * C, dtype=np.complex128),
            np.zeros((len(HARMONICS), 1, 1)),
            0.0 * one,
            about or f"constant {C:g}",
        )

    def at(self, omega: ArrayLike, v: ArrayLike) -> ComplexArray:
        """C [-] at omega [rad/s] and the tip's speed amplitude v [m/s], above 0; both broadcast."""
        omega, v = np.broadcast_arrays(np.asarray(omega, dtype=np.float64), np.asarray(v, dtype=np.float64))
        low, high, share = self._places(omega.ravel())
        gain, columns = self._gain(self.C, v.ravel(), grows=True), np.arange(v.size)
        return np.asarray(gain[low, columns] + share * (gain[high, columns] - gain[low, columns])).reshape(omega.shape)

    def _places(self, omega: FloatArray) -> tuple[NDArray[np.intp], NDArray[np.intp], FloatArray]:
        """Neighbours of frequencies in the table, and the share of the upper one."""
        x, knots = np.log(omega), np.log(self.omega)
        low = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, max(len(knots) - 2, 0))
        high = np.minimum(low + 1, len(knots) - 1)
        span = np.where(high > low, knots[high] - knots[low], 1.0)
        return low, high, np.clip((x - knots[low]) / span, 0.0, 1.0)

    def _gain(self, table: NDArray[Any], v: FloatArray, *, grows: bool) -> NDArray[Any]:
        """A table at all its frequencies for speed amplitudes v (n,): (m, n). grows: beyond the last amplitude the
        wire's end takes all that the tip moves more; else its speed stays as it is there."""
        knots = np.concatenate(([0.0], self.v))
        e = np.concatenate((np.zeros((len(table), 1)), table * self.v), axis=1)
        i = np.clip(np.searchsorted(knots, v) - 1, 0, len(knots) - 2)
        inside = np.minimum(v, knots[-1])
        error = e[:, i] + (e[:, i + 1] - e[:, i]) * (inside - knots[i]) / (knots[i + 1] - knots[i])
        return np.asarray((error + (v - inside if grows else 0.0)) / v)

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
        gain = self._gain(self.C, v.ravel(), grows=True).reshape(len(self.omega), *v.shape)
        mean: ComplexArray = np.asarray(np.einsum("mny,y->mn", gain, weight), dtype=np.complex128)
        if self.remnant is not None:
            mean = mean * self.remnant.gain_at(sigma.ravel())
        low, high, share = self._places(frequency)
        transfer = mean[low] + share[:, None] * (mean[high] - mean[low])
        return np.asarray(transfer.T).reshape(*sigma.shape, len(frequency))


@cache
def _rayleigh() -> tuple[FloatArray, FloatArray]:
    """Points y and weights of the integral over y exp(-y), y = amplitude^2/(2 sigma^2)."""
    from scipy.special import roots_genlaguerre  # heavy: only where a residual is used

    y, weight = roots_genlaguerre(NODES, 1.0)
    return np.asarray(y), np.asarray(weight)
