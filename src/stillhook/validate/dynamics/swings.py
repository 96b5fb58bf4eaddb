"""Gradients, periods and damping of every turn: the crane's compared with the twin's, by its file and tuned.

Quantities that paper F compares visually: pressure gradients, periods and damping of the winch's oscillation, in
each turn of a test.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.statistics.estimate import Estimate, t_factor
from stillhook.validate.data_set.record import Transient, filled, smoothed
from stillhook.validate.dynamics.form import Tuning, normalised_rms
from stillhook.validate.dynamics.runs import SIGNALS, SMOOTH, DynamicsSegment

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


def swing_of(turn: Transient, t: FloatArray, p_a: FloatArray, p_b: FloatArray, samples: slice) -> Swing:
    """The swing after a turn. t (n,) [s]; p_a, p_b (n,) [Pa] of one machine, the log's or the twin's; samples: those of
    the turn."""
    step = float(t[1] - t[0])
    times = t[samples]
    ahead = _at(times, turn.start)
    a, b = (smoothed(filled(p[samples]), step, SMOOTH) for p in (p_a, p_b))
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


A, B = SIGNALS.index("p_a"), SIGNALS.index("p_b")


@dataclass(frozen=True)
class SwingComparison:
    """Swings of all turns: crane, twin as its file has it (before), twin tuned (after); misfit before and after:
    normalised rms of each signal's deviation [-]."""

    crane: tuple[Swing, ...]
    before: tuple[Swing, ...]
    after: tuple[Swing, ...]
    misfit_before: dict[str, float]
    misfit_after: dict[str, float]

    def error(self, name: str, tuned: bool, line: str = "") -> Estimate:
        """Errors of a field of `Swing`, simulated over measured, less 1; of the turns of one line ("A" or "B") alone
        where it is stated."""
        pairs = zip(self.crane, self.after if tuned else self.before, strict=True)
        values = [(getattr(c, name), getattr(x, name)) for c, x in pairs if line in ("", c.line)]
        measured, simulated = np.reshape(values, (-1, 2)).T
        shown = np.isfinite(measured) & np.isfinite(simulated) & (measured != 0.0)
        return Estimate.of_mean(simulated[shown] / measured[shown] - 1.0, t_factor(int(shown.sum()) - 1))


def compare_swings(
    time_segments: Sequence[DynamicsSegment], turns: Sequence[Transient], tuning: Tuning
) -> SwingComparison:
    """The swings of every turn of crane and twin, evaluated alike; none for a line that was not logged."""
    rows: list[list[Swing]] = [[], [], []]
    for time_segment, before, after in zip(time_segments, tuning.before, tuning.after, strict=True):
        nothing = np.full(len(time_segment.t), np.nan)
        crane = tuple(time_segment.measured.get(name, nothing) for name in ("p_a", "p_b"))
        machines = (crane, (before[:, A], before[:, B]), (after[:, A], after[:, B]))
        time = time_segment.record.t[time_segment.first : time_segment.first + len(time_segment.t)]
        for turn in (x for x in turns if time_segment.holds(x)):
            samples = slice(turn.first - time_segment.first, turn.last - time_segment.first)
            for k, (p_a, p_b) in enumerate(machines):
                rows[k].append(swing_of(turn, time, p_a, p_b, samples))
    crane_swings, before_swings, after_swings = (tuple(swings) for swings in rows)
    misfits = [dict(normalised_rms(time_segments, outputs)) for outputs in (tuning.before, tuning.after)]
    return SwingComparison(crane_swings, before_swings, after_swings, *misfits)
