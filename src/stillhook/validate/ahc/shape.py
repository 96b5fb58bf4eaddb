"""Similarity of measured and simulated control errors: correlation, lag, and spectra."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.statistics.series import dot
from stillhook.statistics.time_lag import lag

Pairs = Sequence[tuple[FloatArray, FloatArray, float]]
"""Measured and simulated error of unbroken parts, without NaN [m], and the spacing of their samples [s]."""

SECTION = 60.0
"""Length of a section of Welch's method [s]: two windows, so that waves of 30 s still make two periods."""
BAND = (1.0 / 30.0, 0.5)
"""Wave band [Hz]: periods of 2 to 30 s, in which the tip moves and the winch responds."""
FLOOR = 0.01
"""Spectral lines below this part of the measured peak are noise, and not compared."""
LONGEST_LAG = 1.0
"""Largest lag considered [s]."""


class Spectra(NamedTuple):
    """f (n,) [Hz]; power densities of the measured and the simulated error [m^2/Hz], weighted by the lengths of the
    parts."""

    f: FloatArray
    measured: FloatArray
    simulated: FloatArray


class Shape(NamedTuple):
    """correlation [-]; lag of the measured error behind the simulated one, u_lag its standard uncertainty
    [s]; band_ratio: rms in the wave band, simulated over measured [-]; band_share: part of the measured energy that
    lies in the wave band [-]; distance: rms difference of the spectra in the wave band [dB], NaN where the parts are
    shorter than a
    section."""

    correlation: float
    lag: float
    u_lag: float
    band_ratio: float
    band_share: float
    distance: float


def correlation(rows: FloatArray) -> float:
    """Correlation of the two columns of rows (n, 2) [-]; NaN where one does not move."""
    if not len(rows):
        return math.nan
    a, b = (np.ascontiguousarray(column) for column in rows.T)
    a, b = a - a.mean(), b - b.mean()
    size = math.sqrt(dot(a, a) * dot(b, b))
    return dot(a, b) / size if size > 0.0 else math.nan


def shape(pairs: Pairs) -> tuple[Shape, Spectra | None]:
    """The shape of measured against simulated errors; every second counts alike, however fast a part was logged."""
    if not pairs:
        return Shape(*(math.nan for _ in Shape._fields)), None
    centred = [(m - m.mean(), s - s.mean(), step) for m, s, step in pairs]
    slowest = max(step for _, _, step in pairs)
    both = np.concatenate([np.column_stack([m, s])[:: max(1, round(slowest / step))] for m, s, step in centred])
    spectra = _spectra(centred)
    ratio, share, distance = _comparison(spectra) if spectra is not None else (math.nan, math.nan, math.nan)
    return Shape(correlation(both), *_lag(centred), ratio, share, distance), spectra


def _lag(pairs: Pairs) -> tuple[float, float]:
    """Lag of the measured error behind the simulated one, and its standard uncertainty [s]; NaN where too little shows
    it."""
    lags = [
        x
        for m, s, step in pairs
        if (x := lag(np.arange(len(m), dtype=np.float64) * step, s, m, LONGEST_LAG)) is not None
    ]
    if not lags:
        return math.nan, math.nan
    weight = np.array([x.pieces for x in lags]) / sum(x.pieces for x in lags)
    seconds, u = (np.array([getattr(x, name) for x in lags]) for name in ("seconds", "u"))
    return float(np.sum(weight * seconds)), float(np.sqrt(np.sum((weight * u) ** 2)))


def _spectra(pairs: Pairs) -> Spectra | None:
    """Means over the parts, up to the highest frequency that all of them have; lines lie 1/SECTION apart at every
    spacing."""
    from scipy.signal import welch  # heavy: only where data are at hand

    long = [(m, s, step) for m, s, step in pairs if len(m) >= round(SECTION / step)]
    if not long:
        return None
    powers = [welch(np.stack([m, s]), fs=1.0 / step, nperseg=round(SECTION / step))[1] for m, s, step in long]
    seconds = [len(m) * step for m, _, step in long]
    n = min(power.shape[1] for power in powers)
    measured, simulated = np.sum([w * power[:, :n] for w, power in zip(seconds, powers, strict=True)], axis=0) / sum(
        seconds
    )
    return Spectra(np.arange(n, dtype=np.float64) / SECTION, measured, simulated)


def _comparison(x: Spectra) -> tuple[float, float, float]:
    band = (x.f >= BAND[0]) & (x.f <= BAND[1])
    m, s = float(x.measured[band].sum()), float(x.simulated[band].sum())
    if not m > 0.0:  # a constant error has no shape
        return math.nan, math.nan, math.nan
    strong = band & (x.measured > FLOOR * x.measured[band].max())
    apart = 10.0 * np.log10(np.maximum(x.simulated[strong], 1e-30) / x.measured[strong])
    return math.sqrt(s / m), m / float(x.measured[1:].sum()), float(np.sqrt(np.mean(apart**2)))
