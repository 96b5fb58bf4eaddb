"""What is watched of one signal while its samples stream past: values beyond what can be, standstill, ends of the
sensor.

Only a few numbers per signal and long runs of equal values are kept, so that memory does not grow with the samples.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.logs.types import Signal

LEAST_RUN = 2.0  # s: a signal that keeps its last digit for a shorter time is not worth reporting
RANGE_STEP = 2.5e-4  # of the range: one step of a 12-bit converter; nearer to an end is at the end
NOISE = 0.3  # of the changes that turn back: 2/3 in white noise, few in a smooth signal
NOISE_STEPS = 2.5  # last digits: a coarse signal that flickers between two values turns back by one
SIMILAR = 0.1  # of a value: so near, the signal is in the same state
MIN_SIMILAR_BINS = 20  # bins in that state, for a word on its noise
SPAN = 3.0  # last digits between the largest and smallest of the ten samples of a bin: noise of one digit and more
MOST_BINS = 500  # bins around an extreme whose values are kept; enough to distinguish a rail from a coarse reading


@dataclass(frozen=True)
class Run:
    """Equal values in a row: from the first to the last sample [s]."""

    start: float
    end: float
    samples: int
    value: float
    noisy: bool = False
    """Whether the signal has noise at this value, so that it cannot be stationary by chance."""


@dataclass
class Rail:
    """Samples that are exactly at the extreme of a signal, and the values around them."""

    value: float = np.nan
    bins: list[NDArray[np.int64]] = field(default_factory=list)
    hits: int = 0
    """Samples at the extreme in the bins that were looked at."""
    mixed: int = 0
    """Bins that hold the extreme and other values; the first MOST_BINS are looked at."""
    levels: dict[float, int] = field(default_factory=dict)


@dataclass
class Watch:
    signal: Signal
    limit: float
    """Magnitude that no sample can have [SI]."""
    good: int = 0
    beyond: int = 0
    beyond_at: float = np.nan
    beyond_line: int = 0
    beyond_value: float = np.nan
    lowest: float = np.inf
    highest: float = -np.inf
    runs: list[Run] = field(default_factory=list)
    """Runs of at least LEAST_RUN."""
    changes: int = 0
    """Runs of equal values, all of them."""
    turns: int = 0
    """Changes whose direction is the opposite of the change before: 2/3 of them in noise, few in a smooth signal."""
    turned: float = 0.0
    """Sum of the sizes of these changes."""
    smallest: float = np.inf
    """Smallest change: the last digit of the signal."""
    spans: list[NDArray[np.float32]] = field(default_factory=list)
    """Largest less smallest sample of each bin."""
    at_ends: list[NDArray[np.int64]] = field(default_factory=list)
    """Bins with samples at an end of the sensor's range."""
    at_ends_samples: int = 0
    top: Rail = field(default_factory=Rail)
    bottom: Rail = field(default_factory=Rail)
    _start: float = np.nan
    _end: float = np.nan
    _value: float = np.nan
    _samples: int = 0
    _slope: float = 0.0

    def screened(self, values: FloatArray, t: FloatArray, line_of: Callable[[int], int]) -> FloatArray:
        """The samples with those made NaN that cannot be; the first is remembered."""
        bad = ~(np.abs(values) <= self.limit)
        if not bad.any():
            return values
        beyond = bad & np.isfinite(values)
        if beyond.any():
            i = int(np.argmax(beyond))
            if not self.beyond:
                self.beyond_at, self.beyond_line, self.beyond_value = float(t[i]), line_of(i), float(values[i])
            self.beyond += int(beyond.sum())
        return np.where(bad, np.nan, values)

    def feed(self, t: FloatArray, values: FloatArray, index: NDArray[np.int64], starts: NDArray[np.intp]) -> None:
        """Whole bins (stretches of about 0.1 s): times, samples, number of the bin of each sample, where each bin
        starts."""
        span = np.fmax.reduceat(values, starts) - np.fmin.reduceat(values, starts)
        self.spans.append(span.astype(np.float32))
        good = int(np.count_nonzero(~np.isnan(values)))
        if good:
            self.good += good
            low, high = float(np.fmin.reduce(values)), float(np.fmax.reduce(values))
            if high >= self.highest:
                _rail(self.top, high, values, index, starts, fresh=high > self.highest)
            if low <= self.lowest:
                _rail(self.bottom, low, values, index, starts, fresh=low < self.lowest)
            self.lowest, self.highest = min(self.lowest, low), max(self.highest, high)
            self._ends(values, index)
        self._standstill(t, values)

    def _ends(self, values: FloatArray, index: NDArray[np.int64]) -> None:
        lo, hi = self.signal.lo, self.signal.hi
        if (
            lo is None
            or hi is None
            or (self.highest < hi - RANGE_STEP * (hi - lo) and self.lowest > lo + RANGE_STEP * (hi - lo))
        ):
            return
        step = RANGE_STEP * (hi - lo)
        at = (values >= hi - step) | (values <= lo + step)
        if at.any():
            self.at_ends.append(np.unique(index[at]))
            self.at_ends_samples += int(at.sum())

    def _standstill(self, t: FloatArray, values: FloatArray) -> None:
        step = np.diff(values, prepend=self._value)  # NaN is unequal to all: it ends a run and is itself a run
        change = np.flatnonzero(step != 0.0)
        self._turns(step[change])
        self.changes += len(change)
        if not len(change):
            self._samples, self._end = self._samples + len(t), float(t[-1])
            return
        self._note(
            self._start,
            float(t[change[0] - 1]) if change[0] else self._end,
            self._samples + int(change[0]),
            self._value,
        )
        begins, ends = t[change[:-1]], t[change[1:] - 1]
        for i in np.flatnonzero(ends - begins >= LEAST_RUN):
            self._note(float(begins[i]), float(ends[i]), int(change[i + 1] - change[i]), float(values[change[i]]))
        last = int(change[-1])
        self._start, self._end, self._samples, self._value = (
            float(t[last]),
            float(t[-1]),
            len(t) - last,
            float(values[last]),
        )

    def _turns(self, steps: FloatArray) -> None:
        """The changes of a piece, for what noise the signal has."""
        slopes = np.concatenate(([self._slope], steps))
        turn = slopes[1:] * slopes[:-1] < 0.0
        self.turns += int(np.count_nonzero(turn))
        self.turned += float(np.abs(steps[turn]).sum())
        self._slope = float(slopes[-1])
        sizes = np.abs(steps)
        self.smallest = min(self.smallest, float(np.fmin.reduce(sizes, initial=np.inf)))

    @property
    def noisy(self) -> bool:
        """Whether the signal has noise of several last digits."""
        return self.turns > NOISE * max(1, self.changes) and self.turned > NOISE_STEPS * self.smallest * max(
            1, self.turns
        )

    def noisy_at(self, run: Run, t: FloatArray, means: FloatArray) -> bool:
        """Whether the signal, where it holds about the value of a run, has noise of several last digits, so that no run
        is by chance.

        Noise may grow with the value: a coarse speed is stationary near zero and flickers at full speed.
        """
        if not self.noisy:
            return False
        span = np.concatenate(self.spans)
        steady = np.zeros(len(means), np.bool_)
        steady[1:-1] = np.abs(means[2:] - means[:-2]) <= max(self.smallest, self.turned / self.turns)
        similar = steady & (np.abs(means - run.value) <= max(SIMILAR * abs(run.value), NOISE_STEPS * self.smallest))
        for other in self.runs:
            similar[(t >= other.start) & (t <= other.end)] = False
        return bool(similar.sum() >= MIN_SIMILAR_BINS and np.median(span[similar]) >= SPAN * self.smallest)

    def _note(self, start: float, end: float, samples: int, value: float) -> None:
        if end - start >= LEAST_RUN and not np.isnan(value):
            self.runs.append(Run(start, end, samples, value))

    def finish(self) -> None:
        self._note(self._start, self._end, self._samples, self._value)


def _rail(
    rail: Rail, value: float, values: FloatArray, index: NDArray[np.int64], starts: NDArray[np.intp], *, fresh: bool
) -> None:
    """Takes the samples at an extreme, and their neighbours in the same bins, into the tally; a new extreme starts it
    afresh."""
    if fresh:
        rail.value, rail.bins, rail.hits, rail.mixed, rail.levels = value, [], 0, 0, {}
    hits = np.add.reduceat((values == value).astype(np.int64), starts)
    sizes = np.diff(starts, append=len(values))
    touched = np.flatnonzero(hits)
    rail.bins.append(index[starts[touched]])
    mixed = touched[hits[touched] < sizes[touched]]
    looked = mixed[: max(0, MOST_BINS - rail.mixed)]
    rail.mixed += len(mixed)
    rail.hits += int(hits[looked].sum())
    if not len(looked):
        return
    among = np.zeros(len(starts), np.bool_)
    among[looked] = True
    near = values[np.repeat(among, sizes)]
    for level, count in zip(*np.unique(near[~np.isnan(near)], return_counts=True), strict=True):
        rail.levels[float(level)] = rail.levels.get(float(level), 0) + int(count)
