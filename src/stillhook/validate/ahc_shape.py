"""Are two control errors of similar shape? Correlation, lag, and spectra of the measured and the simulated one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook.validate.sums import dot

FloatArray = NDArray[np.float64]
Pairs = Sequence[tuple[FloatArray, FloatArray]]

SECTION = 60.0
"""Length of a section of Welch's method [s]: two windows, so that waves of 30 s still make two periods."""
BAND = (1.0 / 30.0, 0.5)
"""Wave band [Hz]: periods of 2 to 30 s, in which the tip moves and the winch answers."""
FLOOR = 0.01
"""Spectral lines below this part of the measured peak are noise, and not compared."""
LONGEST_LAG = 1.0
"""Largest lag that is looked for [s]."""


class Spectra(NamedTuple):
    """f (n,) [Hz]; power densities of the measured and the simulated error [m^2/Hz], weighted by the lengths of the parts."""

    f: FloatArray
    measured: FloatArray
    simulated: FloatArray


class Shape(NamedTuple):
    """correlation [-]; lag by which the measured error comes after the simulated one [s]; band_ratio: rms in the wave band, simulated over
    measured [-]; band_share: part of the measured energy that lies in the wave band [-]; distance: rms difference of the spectra in the
    wave band [dB], NaN where the parts are shorter than a section."""

    correlation: float
    lag: float
    band_ratio: float
    band_share: float
    distance: float


def correlation(rows: FloatArray) -> float:
    """Correlation of the two columns of rows (n, 2) [-]; NaN where one does not move."""
    x = rows - rows.mean(axis=0)
    size = math.sqrt(dot(x[:, 0], x[:, 0]) * dot(x[:, 1], x[:, 1]))
    return dot(x[:, 0], x[:, 1]) / size if size > 0.0 else math.nan


def shape(pairs: Pairs, step: float) -> tuple[Shape, Spectra | None]:
    """The shape of measured against simulated errors, each pair one unbroken part without NaN [m], even by step [s]."""
    centred = [(m - m.mean(), s - s.mean()) for m, s in pairs]
    whole = np.column_stack([np.concatenate(x) for x in zip(*centred, strict=True)])
    spectra = _spectra(centred, step)
    ratio, share, distance = _compared(spectra) if spectra is not None else (math.nan, math.nan, math.nan)
    return Shape(correlation(whole), lag(centred, step), ratio, share, distance), spectra


def lag(pairs: Pairs, step: float) -> float:
    """Time by which the first of each pair comes after the second [s]: where their correlation peaks, between samples by a parabola.

    NaN where the peak lies at the end of what is looked for.
    """
    from scipy.signal import correlate  # heavy: only where data are at hand

    reach = round(LONGEST_LAG / step)
    product, power, own = np.zeros(2 * reach + 1), np.zeros(2 * reach + 1), 0.0
    for m, s in pairs:
        if len(m) > 4 * reach:
            middle = m[reach : len(m) - reach]
            product += correlate(s, middle, "valid", "fft")
            total = np.concatenate(([0.0], np.cumsum(s**2)))
            power += total[len(middle) :] - total[: len(total) - len(middle)]
            own += dot(middle, middle)
    if not (own > 0.0 and power.min() > 0.0):
        return math.nan
    like = product / np.sqrt(power * own)
    k = int(np.argmax(like))
    if not 0 < k < 2 * reach:
        return math.nan
    a, b, c = like[k - 1 : k + 2]
    return float((reach - k - 0.5 * (a - c) / (a - 2.0 * b + c)) * step)


def _spectra(pairs: Pairs, step: float) -> Spectra | None:
    from scipy.signal import welch  # heavy: only where data are at hand

    n = round(SECTION / step)
    long = [(m, s) for m, s in pairs if len(m) >= n]
    if not long:
        return None
    f, total, parts = np.zeros(0), 0, []
    for pair in long:
        f, power = welch(np.stack(pair), fs=1.0 / step, nperseg=n)
        parts.append(power * len(pair[0]))
        total += len(pair[0])
    measured, simulated = sum(parts) / total
    return Spectra(f, measured, simulated)


def _compared(x: Spectra) -> tuple[float, float, float]:
    band = (x.f >= BAND[0]) & (x.f <= BAND[1])
    m, s = float(x.measured[band].sum()), float(x.simulated[band].sum())
    strong = band & (x.measured > FLOOR * x.measured[band].max())
    apart = 10.0 * np.log10(np.maximum(x.simulated[strong], 1e-30) / x.measured[strong])
    return math.sqrt(s / m), m / float(x.measured[1:].sum()), float(np.sqrt(np.mean(apart**2)))
