"""How a pressure or a speed rings after a start or a reversal: period, damping, and how much of a series is ringing at
all.

Datasets of runs and of measured logs alike, sampled evenly; see `stillhook.metrics`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import StillhookError
from stillhook.metrics import time_step
from stillhook.units import quote

if TYPE_CHECKING:
    import xarray

ORDER = 3
"""Order of the Butterworth filter, run forwards and backwards, that parts ringing from the motion below it."""


class Ringing(NamedTuple):
    """What a series does after a start. period first to second peak [s], as Moslatt 2020 paper C measures it; later
    mean spacing of the peaks from the second on [s]; decay rate at which the peaks' height above rest falls [1/s]; zeta
    damping ratio that belongs to it [-]; t_peak [s] and height above rest [unit of the series] of every peak. NaN where
    there are too few
    peaks."""

    period: float
    later: float
    decay: float
    zeta: float
    t_peak: FloatArray
    height: FloatArray


def ringing(
    run: xarray.Dataset, name: str, *, start: float, least: float, free: float | None = None, settled: float = 2.0
) -> Ringing:
    r"""Period and damping of a series that rings down to rest.

    .. math:: y_i = y_0\,e^{-\sigma t_i}, \qquad \zeta = \frac{\sigma}{\sqrt{\sigma^2 + (2 \pi / T)^2}}

    with sigma the slope of a straight line through the logarithms of the peaks, T their mean spacing.

    Parameters: run with `name` over "time"; start [s] peaks count from here on; least [unit of the series] how far a
    peak must exceed its surroundings (its prominence) and, for the decay, the value at rest; free [s] from when on the
    ringing is left alone (end of a ramp), for the decay only, default start; settled [s] last part of the run, whose
    mean is the rest.
    Errors: StillhookError where the run has no such series or ends before it could settle.
    Source: Moslatt 2020 paper C, table 1 ("the time between first and second peak").
    """
    from scipy.signal import find_peaks  # heavy: only where ringing is measured

    t, x = _series(run, name)
    if not (start < t[-1] - settled and least > 0.0):
        raise StillhookError(
            f"ringing: start = {start:g} s, settled = {settled:g} s, least = {quote(least)}: the series ends at"
            f" {t[-1]:g} s. Start before the settled part, and give a least height above 0."
        )
    y = x - float(np.mean(x[t > t[-1] - settled]))
    peaks, _ = find_peaks(y, prominence=least)
    peaks = peaks[t[peaks] >= start]
    t_peak, height = t[peaks], y[peaks]
    selected = (t_peak >= (start if free is None else free)) & (height >= least)
    decay, T = _decay(t_peak[selected], height[selected])
    return Ringing(
        period=float(t_peak[1] - t_peak[0]) if len(t_peak) > 1 else math.nan,
        later=float(np.mean(np.diff(t_peak[1:]))) if len(t_peak) > 2 else math.nan,
        decay=decay,
        zeta=decay / math.hypot(decay, 2.0 * math.pi / T),
        t_peak=t_peak,
        height=height,
    )


def _decay(t: FloatArray, height: FloatArray) -> tuple[float, float]:
    """Rate at which peaks fall [1/s], and their mean spacing [s]."""
    if len(t) < 2:
        return math.nan, math.nan
    return -float(np.polyfit(t, np.log(height), 1)[0]), float(np.mean(np.diff(t)))


def rms_above(run: xarray.Dataset, name: str, *, frequency: float, start: float = 0.0) -> float:
    """Root mean square of what a series does above a frequency [unit of the series], from `start` [s] on.

    The share that is not the wave's: pressure and speed oscillate with the circuit's eigenfrequency, waves are well
    below it.

    Parameters: run with `name` over "time"; frequency [Hz] of the high-pass filter, below half the sampling rate.
    Errors: StillhookError where the run has no such series, or the filter cannot be had.
    Valid: the filter runs in both directions over the entire series, so that nothing is shifted; give `start` behind
    the ramp.
    """
    from scipy.signal import butter, sosfiltfilt  # heavy: only where ringing is measured

    t, x = _series(run, name)
    dt = time_step(run)
    if not 0.0 < frequency < 0.5 / dt:
        raise StillhookError(
            f"rms_above: frequency = {frequency:g} Hz: give one between 0 and {0.5 / dt:g} Hz, half the sampling rate."
        )
    high = sosfiltfilt(butter(ORDER, frequency, "highpass", fs=1.0 / dt, output="sos"), x)
    return float(np.sqrt(np.mean(np.square(high[t >= start]))))


def _series(run: xarray.Dataset, name: str) -> tuple[FloatArray, FloatArray]:
    """Time [s] and values of a series. Errors: StillhookError where there is none."""
    time_step(run)
    if name not in run or run[name].dims != ("time",):
        raise StillhookError(
            f'ringing: the Dataset has no series {quote(name)} over "time" alone. Give one run with time series.'
        )
    return run["time"].values, np.asarray(run[name].values, dtype=np.float64)
