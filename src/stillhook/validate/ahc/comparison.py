"""Comparison of a segment of the crane with the twin: control errors of equal definition, their shape, and their
peak-to-peak values over moving windows."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.metrics import peak_to_peak
from stillhook.statistics.time_lag import dot
from stillhook.validate.ahc.replay import Replay, about_mean

EVERY = 0.5
"""Spacing of the windows' ends [s]: a sixtieth of paper F's window, fine enough that values between two of them do not
matter."""


@dataclass(frozen=True)
class Windows:
    """Moving windows of one unbroken part, each (n,): ends [s from the record's first sample]; peak-to-peak errors and
    tip [m]."""

    test: str
    ends: FloatArray
    measured: FloatArray
    simulated: FloatArray
    s_tip_pp: FloatArray

    @property
    def x(self) -> FloatArray:
        """Deviation |simulated - measured| of every window [m]."""
        return np.abs(self.simulated - self.measured)

    @property
    def eta_measured(self) -> FloatArray:
        """Compensation efficiency, measured [-]; NaN where the tip does not move."""
        return efficiency(self.measured, self.s_tip_pp)

    @property
    def eta_simulated(self) -> FloatArray:
        """Compensation efficiency, simulated [-]; NaN where the tip does not move."""
        return efficiency(self.simulated, self.s_tip_pp)

    @property
    def eta_deviation(self) -> FloatArray:
        """Deviation |eta_c simulated - eta_c measured| of every window [-]."""
        return np.abs(self.eta_simulated - self.eta_measured)


def efficiency(e_c_pp: FloatArray, s_tip_pp: FloatArray) -> FloatArray:
    """1 - e_c_pp / s_tip_pp [-], NaN where the tip does not move. Source: paper F eq. 3."""
    moves = s_tip_pp > 0.0
    return np.where(moves, 1.0 - e_c_pp / np.where(moves, s_tip_pp, 1.0), np.nan)


def windows(
    test: str, t: FloatArray, step: float, measured: FloatArray, simulated: FloatArray, s_tip: FloatArray, window: float
) -> Windows:
    """Windows over an unbroken part, trailing and full of numbers in all three signals. t (n,) [s] even by step [s];
    errors and tip (n,) [m], NaN where not known; window [s]."""
    import xarray  # heavy: only where data are at hand

    table = xarray.DataArray(np.stack([measured, simulated, s_tip]), coords={"time": t}, dims=("signal", "time"))
    if len(t) < 2 or t[-1] - t[0] < window - 1e-9:
        return Windows(test, *(np.zeros(0) for _ in range(4)))
    pp = peak_to_peak(table, step, window).values[:, :: max(1, round(EVERY / step))]
    full = np.isfinite(pp).all(axis=0)
    return Windows(test, t[:: max(1, round(EVERY / step))][full], pp[0, full], pp[1, full], pp[2, full])


def mean_and_s(x: FloatArray) -> tuple[float, float]:
    """Average and standard deviation of deviations. Source: paper F eqs 7 and 6."""
    if len(x) < 2:
        return (float(x[0]) if len(x) else math.nan), math.nan
    return float(np.mean(x)), float(np.std(x, ddof=1))


def gaussian_share(limit: float, mean: float, s: float) -> float:
    """Share of deviations below a limit, Gaussian about their mean, as in paper F. Print reads 96 % below 6 cm and 86 %
    below 5 cm off a mean of 3.3 cm and s of 1.5 cm; the latter is 87 %."""
    if not s > 0.0:
        return float(mean < limit)
    return 0.5 * (1.0 + math.erf((limit - mean) / (s * math.sqrt(2.0))))


def counted_share(limit: float, x: FloatArray) -> float:
    """Share of deviations below a limit, counted."""
    return float(np.mean(x < limit))


SLOW = 0.2
"""Noise of the tip is what moves faster than a moving mean of this width [s]."""


@dataclass(frozen=True)
class Comparison:
    """A segment of crane and twin over the samples that count: simulated signals (n,) [SI]; control errors (n,) [m];
    noise: share of the tip signal's noise in the measured error [-]; moving windows."""

    replay: Replay
    simulated: dict[str, FloatArray]
    e_measured: FloatArray
    e_simulated: FloatArray
    noise: float
    windows: Windows

    @property
    def name(self) -> str:
        return self.replay.name

    @property
    def seconds(self) -> float:
        """Length that counts [s]."""
        return len(self.e_measured) * self.replay.record.step

    @property
    def pair(self) -> tuple[FloatArray, FloatArray]:
        """Measured and simulated control error where both are known."""
        good = np.isfinite(self.e_measured) & np.isfinite(self.e_simulated)
        return self.e_measured[good], self.e_simulated[good]

    @property
    def quiet(self) -> tuple[FloatArray, FloatArray]:
        """The same without the tip's noise, which is common to both and would make errors of any two shapes similar."""
        good = np.isfinite(self.e_measured) & np.isfinite(self.e_simulated)
        noise = self.noise * self.replay.noise[good]
        return self.e_measured[good] - noise, self.e_simulated[good] - noise


def by_case(comparisons: Iterable[Comparison]) -> dict[str, list[Comparison]]:
    """Comparisons of each load case."""
    cases: dict[str, list[Comparison]] = {}
    for c in comparisons:
        cases.setdefault(c.name, []).append(c)
    return cases


def compare(r: Replay, run: dict[str, FloatArray], measured: FloatArray, window: float, *, logged: bool) -> Comparison:
    """The twin's error as the crane's PLC would show it: with the noise of the tip signal, as far as the crane's error
    contains it. measured (n,) [m]: logged by the PLC or, with logged False, made from tip and wire, about its mean;
    window [s]."""
    share = noise_share(r, measured) if logged else 1.0
    simulated = run["e_c_measured"] + share * r.noise
    if not logged:
        simulated = about_mean(simulated)
    parts = windows(r.name, r.t, r.record.step, measured, simulated, r.s_tip, window)
    return Comparison(r, run, measured, simulated, share, parts)


def noise_share(r: Replay, measured: FloatArray) -> float:
    """Share of the logged tip's noise in the PLC's error: 1 where the PLC received that signal, 0 where only the log's
    is noisy."""
    from scipy.ndimage import uniform_filter1d  # heavy: only where data are at hand

    finite = np.isfinite(measured)
    e, n = np.where(finite, measured, 0.0), np.where(finite, r.noise, 0.0)
    size = max(3, round(SLOW / r.record.step)) | 1
    e, n = (x - uniform_filter1d(x, size) for x in (e, n))
    e, n = (x[finite & (uniform_filter1d(finite.astype(float), size) > 1.0 - 0.5 / size)] for x in (e, n))
    power = dot(n, n)
    return min(1.0, max(0.0, dot(e, n) / power)) if power > 0.0 else 0.0


Pairs = Sequence[tuple[FloatArray, FloatArray, float]]
"""Measured and simulated error of unbroken parts, without NaN [m], and the spacing of their samples [s]."""

SECTION = 60.0
"""Length of a section of Welch's method [s]: two windows, so that waves of 30 s still make two periods."""
BAND = (1.0 / 30.0, 0.5)
"""Wave band [Hz]: periods of 2 to 30 s, in which the tip moves and the winch responds."""
FLOOR = 0.01
"""Spectral lines below this part of the measured peak are noise, and not compared."""


class Shape(NamedTuple):
    """correlation [-]; distance: rms difference of the spectra in the wave band [dB], NaN where the parts are shorter
    than a section."""

    correlation: float
    distance: float


def correlation(rows: FloatArray) -> float:
    """Correlation of the two columns of rows (n, 2) [-]; NaN where one does not move."""
    if not len(rows):
        return math.nan
    a, b = (np.ascontiguousarray(column) for column in rows.T)
    a, b = a - a.mean(), b - b.mean()
    size = math.sqrt(dot(a, a) * dot(b, b))
    return dot(a, b) / size if size > 0.0 else math.nan


def shape(pairs: Pairs) -> Shape:
    """The shape of measured against simulated errors; every second counts alike, however fast a part was logged."""
    if not pairs:
        return Shape(math.nan, math.nan)
    centred = [(m - m.mean(), s - s.mean(), step) for m, s, step in pairs]
    slowest = max(step for _, _, step in pairs)
    both = np.concatenate([np.column_stack([m, s])[:: max(1, round(slowest / step))] for m, s, step in centred])
    return Shape(correlation(both), _distance(centred))


def _distance(pairs: Pairs) -> float:
    """Of the mean spectra of the parts, each weighted by its length, up to the highest frequency that all of them have;
    lines are 1/SECTION apart at every spacing."""
    from scipy.signal import welch  # heavy: only where data are at hand

    long = [(m, s, step) for m, s, step in pairs if len(m) >= round(SECTION / step)]
    if not long:
        return math.nan
    powers = [welch(np.stack([m, s]), fs=1.0 / step, nperseg=round(SECTION / step))[1] for m, s, step in long]
    seconds = [len(m) * step for m, _, step in long]
    n = min(power.shape[1] for power in powers)
    measured, simulated = np.sum([w * power[:, :n] for w, power in zip(seconds, powers, strict=True)], axis=0) / sum(
        seconds
    )
    f = np.arange(n, dtype=np.float64) / SECTION
    band = (f >= BAND[0]) & (f <= BAND[1])
    if not measured[band].sum() > 0.0:  # a constant error has no shape
        return math.nan
    strong = band & (measured > FLOOR * measured[band].max())
    apart = 10.0 * np.log10(np.maximum(simulated[strong], 1e-30) / measured[strong])
    return float(np.sqrt(np.mean(apart**2)))
