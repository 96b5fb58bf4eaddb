"""Motion transfer functions of a vessel (RAO): one type, in one convention; readers translate into it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stillhook.errors import SeaError
from stillhook.sea.long_wave import long_wave_limits, long_wave_scales, wavenumber
from stillhook.units import came

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Places = NDArray[np.intp]

DOFS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
TURN = 2.0 * np.pi


@dataclass(frozen=True, eq=False)
class Rao:
    """Motion of a vessel per metre of wave amplitude, as complex numbers.

    Convention (the only one inside Stillhook): time exp(+i omega t); x forward, y to port, z up, right-handed, origin at the motion
    reference point; wave crest at the reference point at phase 0; heading beta = direction in which the waves travel, counter-clockwise
    from the bow: 0 following, pi/2 coming from starboard, pi head sea, 3 pi/2 coming from port.
    omega (n,) [rad/s] ascending; beta (m,) [rad] ascending in [0, 2 pi), all round (readers mirror half tables explicitly);
    H (6, m, n): surge, sway, heave [m/m], roll, pitch, yaw [rad/m] (pitch positive: bow down; roll positive: port side up).
    origin: where the reference point is in the ship, in words; source: file and format; notes: what the reader did and what deserves
    a look; depth of the water [m] that the table is for.

    Errors: SeaError for arrays of other shapes, numbers that are not finite, frequencies or headings out of order.
    """

    name: str
    omega: FloatArray = field(repr=False)
    beta: FloatArray = field(repr=False)
    H: ComplexArray = field(repr=False)
    source: str = ""
    notes: tuple[str, ...] = ()
    origin: str = ""
    depth: float = np.inf

    def __post_init__(self) -> None:
        omega, beta = np.array(self.omega, dtype=np.float64), np.array(self.beta, dtype=np.float64)
        H = np.array(self.H, dtype=np.complex128)
        where = self.source or self.name or "vessel"
        if omega.ndim != 1 or beta.ndim != 1 or H.shape != (len(DOFS), len(beta), len(omega)) or len(omega) < 2 or len(beta) < 2:
            raise SeaError(
                f"{where}: transfer functions of shape {H.shape} for {omega.size} frequencies and {beta.size} headings. "
                "They are (6, headings, frequencies), with at least two of each."
            )
        if not (np.isfinite(omega).all() and np.isfinite(beta).all() and np.isfinite(H).all()):
            raise SeaError(f"{where}: a frequency, heading or transfer function is not a finite number. Mend the table.")
        if omega[0] <= 0.0 or (np.diff(omega) <= 0.0).any():
            raise SeaError(f"{where}: frequencies must be above 0 and ascend, each once. Sort the table.")
        if not self.depth > 0.0:
            raise SeaError(f"{where}: depth {self.depth:g} m is not above 0. Give the depth of the water, or none where it is deep.")
        if beta[0] < 0.0 or beta[-1] >= TURN or (np.diff(beta) <= 0.0).any():
            raise SeaError(f"{where}: headings must ascend from 0 up to below 360 deg, each once. Sort the table.")
        for name, array in (("omega", omega), ("beta", beta), ("H", H)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def at(self, omega: ArrayLike, beta: ArrayLike) -> ComplexArray:
        """H at frequencies (k,) [rad/s] and a heading [rad]: shape (6, k); at headings (j,): shape (6, j, k).

        Frequency: through every value of the table by monotone cubics (PCHIP) of real and imaginary part, so that neither goes beyond the
        two values that it lies between. Below the lowest frequency: the deviation from the limits of a floating body in waves much longer
        than it fades with the wavenumber. Above the highest: 0, as if so short a wave moved nothing (`Rao.notes` says how much the table
        still holds there). Heading: linear between the two nearest of the table, all round.
        """
        omega = np.atleast_1d(np.asarray(omega, dtype=np.float64))
        beta = np.asarray(beta, dtype=np.float64)
        low, high, share = self.heading_weights(beta.ravel())
        used, place = np.unique(np.concatenate([low, high]), return_inverse=True)
        H = self._at_headings(omega, used)
        i, j = np.split(place.ravel(), 2)
        share = share[None, :, None]
        return np.asarray(((1.0 - share) * H[:, i] + share * H[:, j]).reshape(len(DOFS), *beta.shape, len(omega)))

    def table(self, omega: ArrayLike) -> ComplexArray:
        """H at frequencies (k,) [rad/s] and at every heading of the table, (6, m, k): for many headings at once, with `heading_weights`."""
        return self._at_headings(np.atleast_1d(np.asarray(omega, dtype=np.float64)), np.arange(len(self.beta)))

    def heading_weights(self, beta: ArrayLike) -> tuple[Places, Places, FloatArray]:
        """Headings (j,) [rad], any turn, as places in the table: lower neighbour, upper neighbour, share of the upper; each (j,)."""
        turned = np.mod(np.atleast_1d(np.asarray(beta, dtype=np.float64)), TURN)
        if not np.isfinite(turned).all():
            raise SeaError(f"{self.name}: heading {came(str(beta))} is not a number. Give an angle in deg or rad.")
        m = len(self.beta)
        low = np.searchsorted(self.beta, turned, side="right") - 1
        high = (low + 1) % m
        span = np.mod(self.beta[high] - self.beta[low], TURN)
        share = np.mod(turned - self.beta[low], TURN) / span
        return np.asarray(low % m), np.asarray(high), np.asarray(share)

    def vertical(self, omega: ArrayLike, beta: ArrayLike, x: float, y: float) -> ComplexArray:
        """Vertical motion of the point (x, y) [m] per metre of wave, eta_3 + y eta_4 - x eta_5: shape (k,), or (j, k) for headings (j,).

        x forward and y to port of the reference point; the wave's phase stays that at the reference point.
        """
        H = self.at(omega, beta)
        return np.asarray(H[2] + y * H[3] - x * H[4])

    @cached_property
    def _curves(self) -> FloatArray:
        """Coefficients of the cubics in frequency, (4, n - 1, 6, m, 2): highest power first; real and imaginary part last."""
        from scipy.interpolate import PchipInterpolator  # heavy: only where a vessel is used

        values = np.moveaxis(self.H, -1, 0)
        curves: Any = PchipInterpolator(self.omega, np.stack([values.real, values.imag], axis=-1), axis=0)
        return np.asarray(curves.c, dtype=np.float64)

    def _at_headings(self, omega: FloatArray, places: Places) -> ComplexArray:
        """H at frequencies (k,) and some headings of the table, (6, len(places), k)."""
        first, last = self.omega[0], self.omega[-1]
        inside = np.clip(omega, first, last)
        i = np.clip(np.searchsorted(self.omega, inside, side="right") - 1, 0, len(self.omega) - 2)
        d = (inside - self.omega[i])[:, None, None, None]
        c = self._curves[:, :, :, places]
        parts = ((c[0, i] * d + c[1, i]) * d + c[2, i]) * d + c[3, i]
        H = np.moveaxis(parts[..., 0] + 1j * parts[..., 1], 0, -1)
        H[..., omega > last] = 0.0
        below = omega < first
        if below.any():
            H[..., below] = self._long_waves(omega[below], places)
        return np.ascontiguousarray(H)

    def _long_waves(self, omega: FloatArray, places: Places) -> ComplexArray:
        first = self.omega[:1]
        limit = long_wave_limits(self.beta[places])
        deviation = self.H[:, places, 0] / long_wave_scales(first, self.depth) - limit
        fade = wavenumber(omega, self.depth) / wavenumber(first, self.depth)
        return np.asarray((limit[..., None] + deviation[..., None] * fade) * long_wave_scales(omega, self.depth)[:, None])
