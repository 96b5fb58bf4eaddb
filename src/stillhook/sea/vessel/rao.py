r"""Motion transfer functions of a vessel (RAO): one type, in one convention; readers translate into it.

Water waves much longer than a floating body: their number on water of some depth, and how every body follows them.

In exp(+i omega t), with x forward, y to port, z up and waves that travel in direction beta (counter-clockwise from the
bow), the surface is :math:`\zeta = \Re\, a\, e^{i(\omega t - k(x\cos\beta + y\sin\beta))}`. Water goes round in circles
(on depth h: ellipses, wider by coth kh), forward under a crest, so that per metre of amplitude, as k -> 0,

.. math:: \eta_1 \to -i\cos\beta,\quad \eta_2 \to -i\sin\beta,\quad \eta_3 \to 1,\quad
          \eta_4/k \to -i\sin\beta,\quad \eta_5/k \to i\cos\beta,\quad \eta_6/k \to -\sin\beta\cos\beta.

Roll and pitch are the slopes of the surface, roll only where its natural period is far off; yaw is that of a slender
ship.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import ComplexArray, FloatArray, fill
from stillhook.errors import SeaError
from stillhook.physics.scalar import G
from stillhook.units import quote


def wavenumber(omega: FloatArray, depth: float = math.inf) -> FloatArray:
    r"""k [rad/m] of waves of omega [rad/s], any shape, on water of some depth [m]: :math:`\omega^2 = g k \tanh kh`."""
    deep = np.asarray(omega, dtype=np.float64) ** 2 / G
    if not math.isfinite(depth):
        return deep
    # within 5 % of the root; Newton's steps end at rounding
    kh = deep * depth / np.sqrt(np.tanh(np.maximum(deep * depth, 1e-300)))
    for _ in range(6):
        t = np.tanh(kh)
        kh = kh - (kh * t - deep * depth) / np.maximum(t + kh * (1.0 - t**2), 1e-300)
    return np.asarray(kh / depth)


def long_wave_limits(beta: FloatArray) -> ComplexArray:
    """Limits (6, m) on deep water at headings beta (m,) [rad]: surge, sway, heave per metre; roll, pitch, yaw per metre
    and wavenumber."""
    c, s = np.cos(beta), np.sin(beta)
    return np.array([-1j * c, -1j * s, np.ones_like(c), -1j * s, 1j * c, -s * c], dtype=np.complex128)


def long_wave_scales(omega: FloatArray, depth: float = math.inf) -> FloatArray:
    """What the limits are multiplied by at frequencies (k,): (6, k); coth kh across the wave, 1 up, k for rotations, k
    coth kh for yaw."""
    k = wavenumber(omega, depth)
    wide = 1.0 / np.tanh(k * depth) if math.isfinite(depth) else np.ones_like(k)
    return np.array([wide, wide, np.ones_like(k), k, k, k * wide])


DOFS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
TURN = 2.0 * np.pi
OPEN = (5.0, 12.0)  # s: waves in which `Rao.leeway` is reported


class VerticalMotion(Protocol):
    """What moves up and down with the waves at a place x, y [m] from a vessel's reference point: the vessel itself, or
    what it moves against (`stillhook.sea.vessel.relative`). Fields and `vertical` as of `Rao`."""

    @property
    def name(self) -> str:
        """What moves, in words."""

    @property
    def omega(self) -> FloatArray:
        """Frequencies of its table [rad/s], rising."""

    def vertical(self, omega: ArrayLike, beta: ArrayLike, x: float, y: float) -> ComplexArray:
        """Vertical motion per metre of wave, as `Rao.vertical`."""


@dataclass(frozen=True, eq=False)
class Rao:
    """Motion of a vessel per metre of wave amplitude, as complex numbers.

    Convention (the only one inside Stillhook): time exp(+i omega t); x forward, y to port, z up, right-handed, origin
    at the motion reference point; wave crest at the reference point at phase 0; heading beta = direction in which the
    waves travel, counter-clockwise from the bow: 0 following, pi/2 coming from starboard, pi head sea, 3 pi/2 coming
    from port. omega (n,) [rad/s] ascending; beta (m,) [rad] ascending in [0, 2 pi), all round (readers mirror half
    tables explicitly); H (6, m, n): surge, sway, heave [m/m], roll, pitch, yaw [rad/m] (pitch positive: bow down; roll
    positive: port side up). origin: where the reference point is in the ship, in words; source: file and format; notes:
    what the reader did and what deserves a look; depth of the water [m] that the table is for.

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
        shape = (len(DOFS), beta.size, omega.size)
        if omega.ndim != 1 or beta.ndim != 1 or H.shape != shape or min(shape) < 2:
            problem = f"transfer functions of shape {H.shape} for {omega.size} frequencies and {beta.size} headings"
            raise SeaError(f"{where}: {problem}. They are (6, headings, frequencies), with at least two of each.")
        if not all(np.isfinite(x).all() for x in (omega, beta, H)):
            problem = "a frequency, heading or transfer function is not a finite number"
            raise SeaError(f"{where}: {problem}. Correct the table.")
        if omega[0] <= 0.0 or (np.diff(omega) <= 0.0).any():
            raise SeaError(f"{where}: frequencies must be above 0 and ascend, each once. Sort the table.")
        if not self.depth > 0.0:
            do = "Give the depth of the water, or none where it is deep."
            raise SeaError(f"{where}: depth {self.depth:g} m is not above 0. {do}")
        if beta[0] < 0.0 or beta[-1] >= TURN or (np.diff(beta) <= 0.0).any():
            raise SeaError(f"{where}: headings must ascend from 0 up to below 360 deg, each once. Sort the table.")
        fill(self, omega=omega, beta=beta, H=H)

    def at(self, omega: ArrayLike, beta: ArrayLike) -> ComplexArray:
        """H at frequencies (k,) [rad/s] and a heading [rad]: shape (6, k); at headings (j,): shape (6, j, k).

        Frequency: the mean of the straight line and the monotone cubic (PCHIP) through the complex values, so that real
        and imaginary part stay between the two values that they are between. Straight lines cut the corners of a phase
        that turns and give too little motion (of a table with every second frequency left out they lose 3.4 % of a
        tip's variance, PCHIP 1.2 %, a spline nothing, which swings about a narrow peak), and are what most programs do:
        on 36 frequencies of a ship of 83 m a tip's sigma_z in waves of 8 s is 1.2 % less by lines than by a spline. The
        mean is within 1 % of either. `leeway` states what the table leaves open. Below the lowest frequency: the
        deviation from the limits of a floating body in waves much longer than it fades with the wavenumber. Above the
        highest: 0, as if so short a wave moved nothing (`Rao.notes` says how much the table still holds there).
        Heading: periodic cubic spline through the complex values, all round; a straight line would cut the corner of a
        phase that turns, and lose up to 6 % of a tip's motion in short waves between headings 10 deg apart.
        """
        beta = np.asarray(beta, dtype=np.float64)
        H = self._mixed(omega, self.heading_weights(beta.ravel()), np.eye(len(DOFS)))
        return H.reshape(len(DOFS), *beta.shape, H.shape[-1])

    def vertical(self, omega: ArrayLike, beta: ArrayLike, x: float, y: float) -> ComplexArray:
        """Vertical motion of the point (x, y) [m] per metre of wave, eta_3 + y eta_4 - x eta_5: shape (k,), or (j, k)
        for headings (j,).

        x forward and y to port of the reference point; the wave's phase stays that at the reference point.
        """
        beta = np.asarray(beta, dtype=np.float64)
        H = self._mixed(omega, self.heading_weights(beta.ravel()), np.array([[0.0, 0.0, 1.0, y, -x, 0.0]]))
        return H.reshape(*beta.shape, H.shape[-1])

    def table(self, omega: ArrayLike) -> ComplexArray:
        """H at frequencies (k,) [rad/s] and every heading of the table, (6, m, k); `heading_weights` @ it: at any."""
        return self._mixed(omega, np.eye(len(self.beta)), np.eye(len(DOFS)))

    def heading_weights(self, beta: ArrayLike) -> FloatArray:
        """Shares (j, m) of the table's headings in the motions at headings (j,) [rad], any turn; rows add to 1."""
        wrapped = np.asarray(beta, dtype=np.float64)
        if not np.isfinite(wrapped).all():
            raise SeaError(f"{self.name}: heading {quote(str(beta))} is not a number. Give an angle in deg or rad.")
        return np.asarray(self._spline(self.beta[0] + np.mod(wrapped - self.beta[0], TURN)))

    def __getstate__(self) -> dict[str, Any]:
        """Its fields alone: what it remembers of them is made again."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    def leeway(self, x: float, y: float) -> float:
        """How far the table leaves the vertical motion of the point (x, y) [m] open between its frequencies, as a share
        of it: half of what a cubic spline and straight lines differ by, in root mean square over waves of OPEN periods,
        from the side where it is most.
        """
        from scipy.interpolate import CubicSpline

        h = np.asarray(self.H[2] + y * self.H[3] - x * self.H[4])
        omega = np.linspace(max(TURN / OPEN[1], self.omega[0]), min(TURN / OPEN[0], self.omega[-1]), 400)
        line = np.array(
            [np.interp(omega, self.omega, row.real) + 1j * np.interp(omega, self.omega, row.imag) for row in h]
        )
        spline = CubicSpline(self.omega, h, axis=1)(omega)
        straight, curved = (np.sqrt(np.mean(np.abs(H) ** 2, axis=1)) for H in (line, spline))
        return float(np.max(np.abs(curved - straight) / (curved + straight)))

    @cached_property
    def digest(self) -> bytes:
        """Hash of the numbers, under any names."""
        arrays = (self.omega, self.beta, self.H, np.array(self.depth))
        return hashlib.sha256(b"".join(a.tobytes() for a in arrays)).digest()

    @cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import CubicSpline  # heavy: only where a vessel is used

        each = np.eye(len(self.beta))
        return CubicSpline(np.append(self.beta, self.beta[0] + TURN), np.vstack([each, each[:1]]), bc_type="periodic")

    @cached_property
    def _curves(self) -> ComplexArray:
        """Coefficients of the cubics in frequency, (4, 6, m, n - 1), highest power first."""
        from scipy.interpolate import PchipInterpolator

        values = np.moveaxis(self.H, -1, 0)
        re, im = PchipInterpolator(self.omega, values.real, axis=0), PchipInterpolator(self.omega, values.imag, axis=0)
        c = 0.5 * (re.c + 1j * im.c)
        c[3] += 0.5 * values[:-1]
        c[2] += 0.5 * np.diff(values, axis=0) / np.diff(self.omega)[:, None, None]
        return np.ascontiguousarray(np.moveaxis(c, 1, -1))

    def _mixed(self, omega: ArrayLike, headings: FloatArray, motions: FloatArray) -> ComplexArray:
        """Sums of motions (q, 6) over sums of headings (j, m) at frequencies (k,): (q, j, k)."""
        omega = np.atleast_1d(np.asarray(omega, dtype=np.float64))
        first, last = self.omega[0], self.omega[-1]
        inside = np.clip(omega, first, last)
        i = np.clip(np.searchsorted(self.omega, inside, side="right") - 1, 0, len(self.omega) - 2)
        d = inside - self.omega[i]
        c = headings @ np.tensordot(motions, self._curves, axes=(1, 1))  # (q, 4, m, n - 1) to (q, 4, j, n - 1)
        H = c[:, 0][..., i]
        for power in (1, 2, 3):
            H = H * d + c[:, power][..., i]
        H[..., omega > last] = 0.0
        below = omega < first
        if below.any():
            long = self._long_waves(omega[below])
            H[..., below] = np.einsum("qd,jm,dmk->qjk", motions, headings, long, optimize=True)
        return np.asarray(H)

    def _long_waves(self, omega: FloatArray) -> ComplexArray:
        """H (6, m, k) at every heading of the table and frequencies below it."""
        first = self.omega[:1]
        limit = long_wave_limits(self.beta)
        deviation = self.H[:, :, 0] / long_wave_scales(first, self.depth) - limit
        fade = wavenumber(omega, self.depth) / wavenumber(first, self.depth)
        share = limit[..., None] + deviation[..., None] * fade
        return np.asarray(share * long_wave_scales(omega, self.depth)[:, None])
