"""Slopes of one curve against another from differences over seconds, corrected for the lag between the two.

Differences of positions against integrals of speeds: a derivative of noisy samples in a regressor would draw the slope
towards zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.statistics.jackknife_regression import Fit, fit
from stillhook.validate.parameters.segments import LogPart

WINDOW = 2.0
"""Time over which differences are taken [s]: a fifth of a wave, in which the winch moves a hundred steps of its
encoder."""
SMOOTH = 0.2
"""Part of the window over which both curves are averaged at its ends [-]: noise is removed, and waves are attenuated
equally in both."""
BRIDGED = 0.1
"""Longest hole in a signal that a straight line may fill [s]."""
LAGS = 3
"""Rounds in which the lag is found: the second leaves it within a millisecond."""
LONGEST_LAG = 1.0
"""Largest lag that is corrected [s]."""
LEAST_MOTION = 1e-6


@dataclass(frozen=True)
class Slope:
    """fit: coefficients slope, and slope times lag left; lag: by which y comes later than x [s]; x, y: the differences,
    for figures."""

    fit: Fit
    lag: float
    x: FloatArray
    y: FloatArray

    @property
    def value(self) -> float:
        return float(self.fit.b[0])

    @property
    def half(self) -> float:
        """Half of the 95 % interval."""
        return self.fit.half(0)


def bridged(x: FloatArray, step: float) -> FloatArray:
    """The signal with short holes filled by straight lines; longer ones stay."""
    known = np.isfinite(x)
    if known.all() or not known.any():
        return x
    at = np.arange(len(x))
    filled = np.interp(at, at[known], x[known])
    edges = np.flatnonzero(np.diff(np.concatenate(([True], known, [True])).astype(np.int8)))
    for a, b in zip(edges[::2], edges[1::2], strict=True):
        if (b - a) * step > BRIDGED or a == 0 or b == len(x):
            filled[a:b] = np.nan
    return filled


def integral(x: FloatArray, step: float) -> FloatArray:
    """Integral from the start by trapezoids, (n,); NaN from the inside of a hole on is left to `differences`, by NaN at
    the hole."""
    known = bridged(x, step)
    safe = np.where(np.isfinite(known), known, 0.0)
    total = np.concatenate(([0.0], np.cumsum(0.5 * (safe[1:] + safe[:-1]) * step)))
    return np.where(np.isfinite(known), total, np.nan)


def smoothed(x: FloatArray, step: float, width: float = BRIDGED) -> FloatArray:
    """Mean over a window of odd samples about each moment, NaN where it holds one or reaches beyond an end."""
    half = max(1, round(0.5 * width / step))
    out = np.full(len(x), np.nan)
    if len(x) > 2 * half:
        out[half:-half] = np.convolve(x, np.full(2 * half + 1, 1.0 / (2 * half + 1)), mode="valid")
    return out


def means(x: FloatArray, step: float, width: float) -> FloatArray:
    """Means over a width [s], one a width."""
    every = max(1, round(width / step))
    return smoothed(x, step, every * step)[::every]


def rates(x: FloatArray, step: float, width: float) -> FloatArray:
    """Rates of such means [1/s]."""
    every = max(1, round(width / step))
    return np.asarray(np.gradient(smoothed(x, step, every * step), step)[::every])


def differences(x: FloatArray, step: float, window: float = WINDOW) -> FloatArray:
    """Change of a curve from one knot to the next, a window apart; NaN where there is a gap between."""
    every = max(1, round(window / step))
    knots = smoothed(x, step, SMOOTH * window)[::every]
    holes = np.cumsum(~np.isfinite(x))[::every]
    return np.where(np.diff(holes) == 0, np.diff(knots), np.nan)


def moments(part: LogPart, window: float = WINDOW) -> FloatArray:
    """Middles of the windows of `differences` [s from the start of the part]."""
    every = max(1, round(window / part.step))
    return part.t[::every][:-1] + 0.5 * every * part.step


def later(x: FloatArray, step: float, lag: float) -> FloatArray:
    """The curve as it is lag [s] later: y(t) = x(t - lag), NaN beyond its ends and beside its holes."""
    at = np.arange(len(x)) - lag / step
    return np.asarray(np.interp(at, np.arange(len(x)), x, left=np.nan, right=np.nan))


def slope(
    parts: Sequence[LogPart], curves: Sequence[tuple[FloatArray, FloatArray]], window: float = WINDOW
) -> Slope | None:
    """Slope of y against x: pairs (x, y) of curves, one per part, each (n,). None where the data do not determine it.

    A constant rate between them (an offset of a speed) is taken out part by part, and so is the lag.
    """
    lag, fitted = 0.0, None
    for _ in range(LAGS + 1):
        rows = [_rows(part, x, y, lag, window) for part, (x, y) in zip(parts, curves, strict=True)]
        dx, dv, dy, block = (np.concatenate(column) for column in zip(*rows, strict=True))
        if not np.isfinite(dx).any() or np.nanstd(dx) < LEAST_MOTION:
            return None
        fitted = fit((dx, dv), dy, block)
        if fitted is None:
            return None
        result = Slope(fitted, lag, dx, dy)
        lag = float(np.clip(lag - fitted.b[1] / fitted.b[0], -LONGEST_LAG, LONGEST_LAG)) if fitted.b[0] != 0.0 else lag
    return result


def _rows(part: LogPart, x: FloatArray, y: FloatArray, lag: float, window: float) -> tuple[NDArray[Any], ...]:
    moved = later(x, part.step, lag)
    dx, dy = differences(moved, part.step, window), differences(y, part.step, window)
    dv = differences(np.gradient(moved, part.step), part.step, window)
    use = np.isfinite(dx) & np.isfinite(dy) & np.isfinite(dv)
    levelled = [np.where(use, c, np.nan) for c in (dx, dv, dy)]
    centred = [c - np.nanmean(c) if use.any() else c for c in levelled]
    return (*centred, part.blocks(moments(part, window)))
