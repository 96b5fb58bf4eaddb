"""Quantities that paper F compares visually: pressure gradients, periods and damping of the winch's oscillation, in
each turn of a test."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.validate.data_set.records.transients import Transient, filled, smoothed

SMOOTH = 0.03
"""Centred mean before the detection of peaks [s]: a twentieth of the winch's period, and three samples of a PLC's
log."""
LEAST_RISE = 10e5
"""Least rise of a line's pressure for a gradient [Pa]: some twenty deviations of a transmitter's noise."""
SIGNIFICANT = 0.1
LEAST_PEAK = 3e5
"""A peak of p_a - p_b is significant above this part of the largest one, and above this height [Pa]."""
LOWER, UPPER = 0.25, 0.75
"""Part of a rise between which its gradient is taken: neither its rounded foot nor its rounded top."""
MOST_PEAKS = 4
LOOK = 3.0
"""Time after a turn in which peaks are detected [s]."""
PADDED = 2**15
"""Samples of the padded spectrum: at 10 ms one line every 3 mHz."""


class Swing(NamedTuple):
    """One turn. gradient of the line that rises first [Pa/s], and the line ("A", "B"); period between its first
    two significant peaks of p_a - p_b [s]; zeta damping ratio from the first two swings [-]; peaks (k,) their times
    [s]; NaN where it shows none.
    """

    line: str
    gradient: float
    period: float
    zeta: float
    peaks: FloatArray


def swing_of(turn: Transient, t: FloatArray, p_a: FloatArray, p_b: FloatArray, took: slice) -> Swing:
    """The swing after a turn. t (n,) [s]; p_a, p_b (n,) [Pa] of one machine, the log's or the twin's; took: the turn's
    samples in them."""
    step = float(t[1] - t[0])
    times = t[took]
    ahead = _at(times, turn.start)
    a, b = (smoothed(filled(p[took]), step, SMOOTH) for p in (p_a, p_b))
    up = turn.change > 0.0
    end = min(len(times), ahead + round(LOOK / step))
    y = (a - b if up else b - a)[:end]
    tops, heights = _peaks(y[ahead:], times[ahead:end])
    period = float(tops[1] - tops[0]) if len(tops) > 1 else math.nan
    return Swing(
        "A" if up else "B", _gradient((a if up else b)[:end], times[:end], ahead), period, _damping(heights), tops
    )


def _at(t: FloatArray, time: float) -> int:
    return int(np.clip(np.searchsorted(t, time - 1e-9), 0, len(t) - 1))


def _peaks(y: FloatArray, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Times and prominences of the first significant peaks, each refined by a parabola through three samples."""
    from scipy.signal import find_peaks

    if len(y) < 3:
        return np.empty(0), np.empty(0)
    least = max(LEAST_PEAK, SIGNIFICANT * float(np.ptp(y)))
    tops, properties = find_peaks(y, prominence=least)
    tops, heights = tops[:MOST_PEAKS], properties["prominences"][:MOST_PEAKS]
    l, m, r = y[tops - 1], y[tops], y[tops + 1]
    bend = l - 2.0 * m + r
    shift = np.where(bend < 0.0, 0.5 * (l - r) / np.where(bend < 0.0, bend, -1.0), 0.0)
    return t[tops] + shift * (t[1] - t[0]), heights


def _damping(heights: FloatArray) -> float:
    """Damping ratio from the prominences of the second and third peak, whose feet are both troughs of the same
    swing."""
    if len(heights) < 3 or not heights[1] > heights[2] > 0.0:
        return math.nan
    decrement = math.log(heights[1] / heights[2])
    return decrement / math.hypot(decrement, 2.0 * math.pi)


def _gradient(p: FloatArray, t: FloatArray, ahead: int) -> float:
    """Slope of the first rise of a line's pressure between LOWER and UPPER of it [Pa/s]; NaN where it hardly rises."""
    low = float(np.median(p[: ahead + 1]))
    tops, _ = _peaks(p[ahead:], t[ahead:])
    if not len(tops):
        return math.nan
    top = ahead + _at(t[ahead:], float(tops[0])) + 1
    rise = p[ahead:top] - low
    high = float(rise.max()) if len(rise) else 0.0
    if high < LEAST_RISE:
        return math.nan
    foot, head = (_crossing(rise, t[ahead:top], x * high) for x in (LOWER, UPPER))
    return (UPPER - LOWER) * high / (head - foot) if head > foot else math.nan


def _crossing(y: FloatArray, t: FloatArray, level: float) -> float:
    """Time at which y first reaches a level, between samples."""
    k = int(np.argmax(y >= level))
    if k == 0:
        return float(t[0])
    return float(t[k - 1] + (level - y[k - 1]) / (y[k] - y[k - 1]) * (t[k] - t[k - 1]))


def dominant_period(parts: Sequence[FloatArray], step: float, low: float = 0.5, high: float = 10.0) -> float:
    """Period of the largest line in the summed spectra of several stretches of p_a - p_b [s], between low and high
    [Hz]; NaN for none."""
    total: FloatArray | None = None
    for y in parts:
        if len(y) < 16:
            continue
        k = np.arange(len(y))
        power = np.abs(np.fft.rfft((y - np.polyval(np.polyfit(k, y, 1), k)) * np.hanning(len(y)), PADDED)) ** 2
        total = power if total is None else total + power
    if total is None:
        return math.nan
    f = np.fft.rfftfreq(PADDED, step)
    band: NDArray[np.bool_] = (f >= low) & (f <= high)
    return float(1.0 / f[band][np.argmax(total[band])])
