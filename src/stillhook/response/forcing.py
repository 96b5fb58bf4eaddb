"""Forcing by a sea at the crane tip and at the load, as spectra: of the tip's height, of the wave at the load, and the
cross spectrum of both."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.errors import SeaError
from stillhook.sea.spectra.measured import SpectrumSeries
from stillhook.sea.spectra.spectrum import Sea, check_spread
from stillhook.sea.spectra.spreading import cos_power
from stillhook.sea.vessel.long_wave import wavenumber
from stillhook.sea.vessel.rao import Rao
from stillhook.statistics.series import over_frequency

PARTS = 8
"""Parts of a measured band: a wire that rings with 1 % of damping at 1.3 rad/s is then integrated to 1e-4 over a band
of 0.01 Hz."""
LOWEST, HIGHEST, STEP = 0.15, 3.0, 0.0075
"""Frequencies on which seas in words are taken [rad/s]: 42 s to 2.1 s, in steps that resolve that ringing."""


@dataclass(frozen=True, eq=False)
class Forcing:
    """n sea states at m frequencies. omega, width (m,) [rad/s]; tip (n, m) variance of the tip's height in each [m^2];
    wave (n, m) that of the surface above the load [m^2]; cross (n, m) mean of tip times conjugate wave [m^2], complex.
    Rows of a missing sea are NaN.
    """

    omega: FloatArray = field(repr=False)
    width: FloatArray = field(repr=False)
    tip: FloatArray = field(repr=False)
    wave: FloatArray = field(repr=False)
    cross: ComplexArray = field(repr=False)

    def __len__(self) -> int:
        return len(self.tip)

    def deviation(self, order: int = 0) -> FloatArray:
        """Standard deviation of the tip's height (0) [m], speed (1) [m/s] or acceleration (2) [m/s^2] in each sea,
        (n,)."""
        return np.asarray(np.sqrt(over_frequency(self.tip, self.omega[None, :] ** (2 * order))[:, 0]))


def forcing_of_series(
    series: SpectrumSeries,
    vessel: Rao,
    x: float,
    y: float,
    beta: ArrayLike,
    *,
    spread: float | None = None,
    depth: float = math.inf,
    parts: int = PARTS,
) -> Forcing:
    """Forcing of every record of a series of measured spectra.

    x, y place of tip and load from the vessel's reference point [m]; beta direction of travel from the bow [rad], one,
    or one for each record (n,); spread exponent of cos^n about it, None for long-crested waves; depth of the water [m].
    A measured band is flat, and taken in `parts` parts: the transfer functions change within it. Errors: SeaError for
    headings of another number.
    """
    headings = np.asarray(beta, dtype=np.float64)
    if headings.ndim and headings.shape != (len(series),):
        raise SeaError(
            f"{series.source}: {headings.size} headings for {len(series)} records. Enter one for all, or one for each."
        )
    offsets = (np.arange(parts) + 0.5) / parts - 0.5
    omega = (series.omega[:, None] + offsets * series.width[:, None]).ravel()
    width = np.repeat(series.width / parts, parts)
    distinct, row = np.unique(np.mod(headings.ravel(), 2.0 * math.pi), return_inverse=True)
    power, cross = (
        np.array(each)
        for each in zip(*(tip_by_wave(omega, vessel, x, y, b, spread, depth) for b in distinct), strict=True)
    )
    wave = np.repeat(series.S, parts, axis=1) * width
    rows = row.ravel() if headings.ndim else np.zeros(1, dtype=int)
    return Forcing(omega, width, wave * power[rows], wave, wave * cross[rows])


def forcing_of_seas(seas: Sea | Sequence[Sea], vessel: Rao, x: float, y: float, *, depth: float = math.inf) -> Forcing:
    """Forcing of one sea or several, each of one train of waves or more; directions are theirs. See
    `forcing_of_series`."""
    listed = [seas] if isinstance(seas, Sea) else list(seas)
    if not listed:
        raise SeaError("seas: the list is empty. Enter at least one sea.")
    omega = np.arange(LOWEST + STEP / 2.0, HIGHEST, STEP)
    shape = (len(listed), len(omega))
    tip, wave, mixed = np.zeros(shape), np.zeros(shape), np.zeros(shape, dtype=complex)
    known: dict[tuple[float, float | None], tuple[FloatArray, ComplexArray]] = {}
    for n, sea in enumerate(listed):
        for train in sea.trains:
            key = (train.beta, train.spread)
            if key not in known:
                known[key] = tip_by_wave(omega, vessel, x, y, *key, depth)
            S = train.spectrum.density(omega) * STEP
            tip[n] += known[key][0] * S
            mixed[n] += known[key][1] * S
            wave[n] += S
    return Forcing(omega, np.full(len(omega), STEP), tip, wave, mixed)


def tip_by_wave(
    omega: FloatArray, vessel: Rao, x: float, y: float, beta: float, spread: float | None, depth: float = math.inf
) -> tuple[FloatArray, ComplexArray]:
    """Variance of the tip, and mean of tip times conjugate wave above the load, both per variance of the waves, (m,)
    each; depth of the water [m], which sets the wave's phase there (the vessel's motions are those of its file)."""
    theta, share = (np.zeros(1), np.ones(1)) if spread is None else cos_power(check_spread(spread))
    directions = beta + theta
    R = vessel.vertical(omega, directions, x, y)
    along = x * np.cos(directions) + y * np.sin(directions)
    wave = np.exp(-1j * np.outer(along, wavenumber(omega, depth)))
    return share @ np.abs(R) ** 2, share @ (R * np.conj(wave))
