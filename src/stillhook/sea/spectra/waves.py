"""Waves counted in a motion: how far it goes over a moving window, and from one upward crossing of its mean to the
next."""

from __future__ import annotations

import numpy as np

from stillhook.base.arrays import FloatArray

DEAD_BAND = 0.1
"""Part of the standard deviation that a wave must go beyond the mean, either way, to count: noise about the mean is no
wave."""


def trailing_spans(x: FloatArray, n: int, axis: int = -1) -> FloatArray:
    """Largest less smallest of each sample and the n - 1 before it, shape of x; NaN where one of them is. Of the first
    n - 1 samples it is that of what there is so far, mirrored."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d  # heavy: only where windows are requested

    unknown = np.isnan(x)
    trail = (n - 1) // 2  # shifts the centred filters so that the window ends at its sample
    hi = maximum_filter1d(np.where(unknown, -np.inf, x), n, axis=axis, origin=trail)
    lo = minimum_filter1d(np.where(unknown, np.inf, x), n, axis=axis, origin=trail)
    holes = maximum_filter1d(unknown.astype(float), n, axis=axis, origin=trail) > 0.0
    return np.where(holes, np.nan, hi - lo)


def window_spans(s: FloatArray, n: int) -> FloatArray:
    """Largest less smallest over every whole window of n samples; over all of them where there are fewer."""
    return trailing_spans(s, n)[n - 1 :] if len(s) > n else np.array([np.ptp(s)])


def wave_periods(s: FloatArray, dt: float) -> FloatArray:
    """Time between one upward crossing of the mean and the next, for every whole wave of a motion sampled every dt
    [s]."""
    y = s - s.mean() if len(s) else s
    band = DEAD_BAND * y.std() if len(s) else 0.0
    if band == 0.0:
        return np.zeros(0)
    side = np.where(y > band, 1, np.where(y < -band, -1, 0))
    last = np.maximum.accumulate(np.where(side != 0, np.arange(len(y)), 0))
    side = side[last]  # within the dead band the side of before counts
    into = np.flatnonzero((side[1:] > 0) & (side[:-1] < 0)) + 1
    up = np.flatnonzero((y[:-1] <= 0.0) & (y[1:] > 0.0))
    below = up[np.searchsorted(up, into) - 1]  # where the mean was crossed before the wave went beyond the dead band
    return np.asarray(np.diff(below + y[below] / (y[below] - y[below + 1])) * dt, dtype=np.float64)
