"""A test of a campaign as the steps use it: signals on one even grid, its uninterrupted parts, and its load cases.

Transients in a test of the winch dynamics: quick changes of the pumps' command, each until the next change.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.typing import NDArray

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.sea.motion.recorded import wave_periods, window_spans
from stillhook.spec.scenario import Mode
from stillhook.statistics.time_lag import dot
from stillhook.validate.data_set.campaign import CraneTest, Kind
from stillhook.variables import PHYSICAL

if TYPE_CHECKING:
    from stillhook.logs.types import Log
    from stillhook.validate.data_set.campaign import CraneTest


@dataclass(frozen=True)
class Segment:
    """An uninterrupted part [first, last) of a record in one mode with one load. load: payload on the hook without the
    hook [kg]; s_w at its start, s_w_min, s_w_max [m]; s_tip_pp: largest peak-to-peak of the tip over 30 s [m], 0 where
    it does not move; period: mean zero-crossing period of the tip [s], NaN where it does not move."""

    test: str
    first: int
    last: int
    start: float
    """Time of its first sample [s]."""
    duration: float
    load: float
    s_w: float
    s_w_min: float
    s_w_max: float
    s_tip_pp: float
    period: float
    mode: Mode


@dataclass(frozen=True)
class ClockError:
    """Another clock of a log. against: reference of the comparison, "" where only roughly aligned; offset [s] and drift
    [-] that were corrected; u: standard uncertainty of the remainder [s]; u_drift."""

    signals: tuple[str, ...]
    against: str
    offset: float
    drift: float
    u: float
    u_drift: float


@dataclass(frozen=True)
class Record:
    """One test, read. `signals` on the even grid `t` (n,) [s from the first sample that counts], SI, NaN where unknown;
    step [s], an integer number of PLC cycles. s_tip, v_tip, a_tip are those that the PLC reads; e_c_measured is its
    error; mode by the numbers of `stillhook.variables`. Only wire out and tip height are derived where possible; see
    `derived`."""

    test: CraneTest
    log: Log
    t: FloatArray
    step: float
    signals: Mapping[str, FloatArray]
    segments: tuple[Segment, ...]
    statements: tuple[str, ...]
    """Statements from reading: quality, clocks, lags."""
    doubtful: Mapping[str, BoolArray] = field(default_factory=dict)
    """(n,) samples at a sensor limit, bridged over a short gap, or unknown, by signal."""
    derived: frozenset[str] = frozenset()
    """Signals that were not logged but derived from others: s_w from a speed, s_tip from the PLC's error."""
    zero: float = 0.0
    """Time of t = 0 in the log [s from its first sample]."""
    lost: float = 0.0
    """Share of the expected samples (by the log's rate) that are missing."""
    longest_hole: float = 0.0
    """Longest time between two samples [s]."""
    clocks: tuple[ClockError, ...] = ()
    """Other clocks of the log: errors that were corrected."""

    def has(self, *names: str) -> bool:
        """Whether these signals are available, logged or derived."""
        return all(name in self.signals for name in names)

    def part(self, segment: Segment, name: str) -> FloatArray:
        """A signal during a segment."""
        return self.signals[name][segment.first : segment.last]


LEAST: Mapping[Kind, float] = {Kind.AHC: 60.0, Kind.LIMITS: 5.0, Kind.DYNAMICS: 5.0}
"""Shortest usable part [s]: two windows of paper F; some moves of the joystick."""
SMOOTH = 0.5
"""Span of the mean that removes noise from the tip before its waves are counted [s]."""
MOVES = 0.02
"""Peak-to-peak tip motion from which the tip moves [m]: several times the noise of a motion reference unit."""


def split(parts: Sequence[tuple[int, int]], at: Sequence[int]) -> list[tuple[int, int]]:
    """Runs cut at samples."""
    out = []
    for a, b in parts:
        cuts = [a, *sorted(c for c in set(at) if a < c < b), b]
        out += list(pairwise(cuts))
    return out


def segment(
    test: CraneTest,
    samples: slice,
    mode: Mode,
    load: float,
    t: FloatArray,
    step: float,
    signals: Mapping[str, FloatArray],
    window: float,
) -> Segment:
    """Samples of a record with one mode and one payload [kg], with its ranges; window of the tip's range [s]."""
    wire_out = signals["s_w"][samples] if "s_w" in signals else np.zeros(0)
    wire_out = wire_out[np.isfinite(wire_out)]
    low, high, first = (wire_out.min(), wire_out.max(), wire_out[0]) if len(wire_out) else (np.nan, np.nan, np.nan)
    pp, period = _tip(signals["s_tip"][samples] if "s_tip" in signals else np.zeros(0), step, window)
    return Segment(
        test=test.name,
        first=samples.start,
        last=samples.stop,
        start=float(t[samples.start]),
        duration=float(t[samples.stop - 1] - t[samples.start]),
        load=load,
        s_w=float(first),
        s_w_min=float(low),
        s_w_max=float(high),
        s_tip_pp=pp,
        period=period,
        mode=mode,
    )


def _tip(tip: FloatArray, step: float, window: float) -> tuple[float, float]:
    """Largest peak-to-peak over a window [m] and mean period of its waves [s]; 0 and NaN where it does not move."""
    tip = tip[np.isfinite(tip)]
    if len(tip) < 3:
        return 0.0, np.nan
    smooth = scipy.ndimage.uniform_filter1d(tip, max(1, round(SMOOTH / step)))
    pp = float(np.max(window_spans(smooth, round(window / step) + 1)))
    if pp < MOVES:
        return 0.0, np.nan
    periods = wave_periods(smooth, step)
    return pp, float(np.mean(periods)) if len(periods) else np.nan


TIP, WINCH = ("s_tip", "v_tip"), ("s_w", "v_w", "omega_m")
LENGTHS = ("s_tip", "s_w")
"""One of these alone shows a discontinuity. A speed of the winch jumps as friction breaks away; together with the tip
it is a discontinuity."""
NEIGHBOURS = 5
"""Samples on either side used to detect a jump, so that one bad sample does not count."""
BEYOND = 12.0
"""Times the median of such steps: noise reaches 6."""
LEAST_JUMP = {"s_tip": 0.03, "s_w": 0.03, "v_tip": 0.15, "v_w": 0.15, "omega_m": 0.0}
"""Smallest jump that counts [SI]: time-stamp errors of some milliseconds cause some millimetres."""
FASTEST = 3.0
"""Acceleration that neither tip nor wire exceeds [m/s^2]: curvature below it is not a jump."""


def seams(t: FloatArray, signals: Mapping[str, FloatArray]) -> list[tuple[int, str]]:
    """First sample after each discontinuity and the signals that jump, in words; t (n,) even [s]."""
    step = float(t[1] - t[0]) if len(t) > 1 else 1.0
    reach = NEIGHBOURS * step
    bent = {"length": 0.5 * FASTEST * reach**2, "speed": FASTEST * reach}
    names = [name for name in (*TIP, *WINCH) if name in signals]
    jumps = {name: _jumps(signals[name], max(LEAST_JUMP[name], bent.get(PHYSICAL[name].kind, 0.0))) for name in names}
    result: list[tuple[int, str]] = []
    for i in sorted({int(k) for at in jumps.values() for k in at}):
        if result and i - result[-1][0] <= 2 * NEIGHBOURS:
            continue
        at = [name for name in names if np.any(np.abs(jumps[name] - i) <= NEIGHBOURS)]
        if set(at) & set(LENGTHS) or (set(at) & set(TIP) and set(at) & set(WINCH)):
            result.append((i, _seam_text([PHYSICAL[name].meaning for name in at])))
    return result


def _seam_text(meanings: list[str]) -> str:
    if len(meanings) == 1:
        return f"{meanings[0]} jumps, and no other signal does: its sensor was reset, or it has its own clock"
    both = " and ".join(meaning.split(";")[0] for meaning in meanings[:2])
    return f"{both} jump: samples are missing without a gap in the time stamps"


def _jumps(x: FloatArray, floor: float) -> NDArray[np.intp]:
    """Samples at which a straight line through the NEIGHBOURS samples before misses the one through those after."""
    n = NEIGHBOURS
    if len(x) < 4 * n:
        return np.empty(0, np.intp)
    at = np.arange(n) - 0.5 * (n - 1)
    centre = np.convolve(x, np.full(n, 1.0 / n), mode="valid")
    slope = np.convolve(x, (at / np.sum(at * at))[::-1], mode="valid")
    before, after = slice(0, len(centre) - n), slice(n, len(centre))
    miss = np.abs((centre[after] - 0.5 * n * slope[after]) - (centre[before] + 0.5 * n * slope[before]))
    if not np.isfinite(miss).any():
        return np.empty(0, np.intp)
    peaks = np.flatnonzero(np.nan_to_num(miss) > max(BEYOND * float(np.nanmedian(miss)), floor))
    if not len(peaks):
        return np.empty(0, np.intp)
    groups = np.split(peaks, np.flatnonzero(np.diff(peaks) > n) + 1)
    return np.array([int(g[np.argmax(miss[g])]) + n for g in groups], dtype=np.intp)


FULL = 0.995
"""Share of the full command that counts as full: a log rounds to 0.1 to 0.4 %."""
FLAT = 2e-3  # of full command: samples this close to an extreme are on one level
DWELL = 0.3  # s at an extreme that no wave or ramp dwells at within FLAT
BELOW = 0.8  # of the highest command: there the law is not limited
MORE = 0.02  # of full command that must be requested beyond a level that is a limit
LOWEST = 0.3  # of full command: a plateau below is no limit of a pump


def ends_of(u: FloatArray, requested: FloatArray, step: float) -> tuple[float, float]:
    """Limits of a pump command [-], lower and upper: full command, or a lower level at which it visibly saturates. u
    logged, requested: output of the law without a limit (n,). A constant command while no more is requested, as with a
    joystick at rest, is not saturated."""
    return -_end(-u, -requested, step), _end(u, requested, step)


def _end(u: FloatArray, requested: FloatArray, step: float) -> float:
    good = np.isfinite(u) & np.isfinite(requested)
    top = float(u[good].max()) if good.any() else 0.0
    if top >= FULL or top < LOWEST:
        return FULL
    a, b = max(stretches_of(good & (u > top - FLAT)), key=lambda ab: ab[1] - ab[0])
    if (b - a) * step < DWELL:
        return FULL
    below = good & (np.abs(u) < BELOW * top)
    power = dot(requested[below], requested[below])
    # the log's own law may request more or less than the twin's
    gain = dot(u[below], requested[below]) / power if power > 0.0 else 1.0
    return top - FLAT if gain * float(requested[a:b].max()) > top + MORE else FULL


def stretches_of(mask: NDArray[np.bool_], *, bridge: int = 0) -> list[tuple[int, int]]:
    """Samples [a, b) of every uninterrupted span of a mask; gaps of up to `bridge` samples are bridged."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    spans: list[tuple[int, int]] = []
    for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if spans and a - spans[-1][1] <= bridge:
            spans[-1] = (spans[-1][0], b)
        else:
            spans.append((a, b))
    return spans


RATE = 0.15
"""Change of the pumps' command that is quick [1/s]: full stroke in some 7 s; joystick ramps of a friction test are
slower."""
SPAN = 0.05
"""Time over which that rate is taken [s]: above the quantisation of a command, below any joystick's ramp."""
JOIN = 0.15
"""Pause within one change [s]."""
LEAST_CHANGE = 0.05
"""Change of the pumps' command that counts as a turn [-]: it moves the motors at full displacement by some 5 % of their
highest speed."""
LONGEST = 8.0
"""Longest time considered after a turn [s]: the oscillation of the winch has then long decayed."""
BEFORE = 0.1
"""Quiet time before a turn that belongs to it [s]."""


@dataclass(frozen=True)
class Transient:
    """A quick change of the pumps' command and the response: samples [first, last) from just before the change to the
    next one; turn: sample at which it begins; start: its time [s]; took: how long it lasts [s]; before, after: the
    command [-]."""

    test: str
    first: int
    last: int
    turn: int
    start: float
    took: float
    before: float
    after: float

    @property
    def change(self) -> float:
        """Change of the pumps' command, hoisting positive [-]."""
        return self.after - self.before


def find_transients(record: Record, segment: Segment) -> tuple[Transient, ...]:
    """The quick changes of u_p in a segment, in order of time."""
    u = filled(record.part(segment, "u_p"))
    spans = quick_changes(u, record.step)
    n, pad = len(u), max(1, round(BEFORE / record.step))
    result = []
    for i, (a, b) in enumerate(spans):
        end = spans[i + 1][0] - pad if i + 1 < len(spans) else n
        last = min(end, a + round(LONGEST / record.step), n)
        before, after = float(np.median(u[max(0, a - pad) : a + 1])), float(np.median(u[b : min(n, b + pad + 1)]))
        k = segment.first + a
        result.append(
            Transient(
                test=record.test.name,
                first=max(segment.first, k - pad),
                last=segment.first + last,
                turn=k,
                start=float(record.t[k]),
                took=(b - a) * record.step,
                before=before,
                after=after,
            )
        )
    return tuple(result)


def quick_changes(u: FloatArray, step: float) -> list[tuple[int, int]]:
    """First and last sample of every quick change of a command u (n,) on an even grid of step [s]."""
    k = max(1, round(SPAN / step))
    if len(u) <= 2 * k:
        return []
    quick = np.flatnonzero(np.abs(u[k:] - u[:-k]) > RATE * k * step)
    if not len(quick):
        return []
    apart = np.flatnonzero(np.diff(quick) > max(1, round(JOIN / step)))
    firsts, lasts = quick[np.concatenate([[0], apart + 1])], quick[np.concatenate([apart, [len(quick) - 1]])] + k
    return [(int(a), int(b)) for a, b in zip(firsts, lasts, strict=True) if abs(u[b] - u[a]) >= LEAST_CHANGE]


def filled(x: FloatArray) -> FloatArray:
    """A signal with unknown samples interpolated linearly; zeros where nothing is known."""
    good = np.isfinite(x)
    if good.all():
        return x
    return np.interp(np.arange(len(x)), np.flatnonzero(good), x[good]) if good.any() else np.zeros_like(x)


def smoothed(x: FloatArray, step: float, over: float) -> FloatArray:
    """A signal's centred mean over a time [s], without lag; at its ends over the available samples."""
    k = max(1, round(over / step) | 1)
    weights = np.ones(k)
    out: FloatArray = np.convolve(x, weights, "same") / np.convolve(np.ones(len(x)), weights, "same")
    return out


def quick_enough(transients: Sequence[Transient], period: float) -> tuple[Transient, ...]:
    """The turns whose command changes within the period of the winch's oscillation [s]: a slower one hardly excites
    it."""
    return tuple(x for x in transients if x.took <= period + SPAN)
