"""Samples of one clock on their way to bins of time: SI, order in time, gaps, means.

A bin is emitted when it is whole, so that the means do not depend on where the file was cut into pieces.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.errors import LogError
from stillhook.logs.formats.source import Want
from stillhook.logs.streaming import Watch
from stillhook.logs.types import Signal

GAP = 5.0  # median spacings: a longer step is a gap ...
LEAST_GAP = 0.2  # s: ... if it is also longer than this, two bins of the default; shorter ones hide in a bin
RESTART = 1.0  # s: time that runs back further is another start of the clock, not a late or repeated sample ...
RESTART_SPACINGS = 20.0  # ... and further than this many spacings, for slow logs
LONGEST = 1e7  # s: four months; a stamp so far from the first is none
MOST_BACKWARDS = 0.2  # of the samples: with more left out, the stamps are too coarse for the samples
EDGE = 1e-4  # of a bin: a sample that rounding (dates in floats: 0.2 us) puts just below an edge belongs above it
LOOK = 0.1  # s: noise, rails and motion are looked for on so long a stretch, however narrow the bins are
Line = Callable[[int], int]


def together(every: float) -> int:
    """Bins of this width [s] that a check looks at together: an odd number, so that one is in the middle; 1 from LOOK
    on."""
    return 2 * round(0.5 * (max(1.0, LOOK / every) - 1.0)) + 1


def stretches(index: NDArray[np.int64], every: float) -> NDArray[np.int64]:
    """Number of the stretch of about LOOK that each bin belongs to."""
    bins = together(every)
    return index if bins == 1 else (index + bins // 2) // bins


def on_stretches(values: FloatArray, starts: NDArray[np.intp]) -> FloatArray:
    """Means of the finite values from each start to the next one, NaN where there are none."""
    if len(starts) == len(values):
        return values
    good = np.isfinite(values)
    number = np.add.reduceat(good.astype(np.int64), starts)
    sums = np.add.reduceat(np.where(good, values, 0.0), starts)
    return np.where(number > 0, sums / np.maximum(number, 1), np.nan)


@dataclass
class Column:
    signal: Signal
    want: Want
    factor: float
    offset: float
    unit: str
    watch: Watch
    texts: tuple[str, ...] = ()
    """Examples of cells that are not numbers."""
    means: list[FloatArray] = field(default_factory=list)
    missing: list[NDArray[np.int32]] = field(default_factory=list)


@dataclass
class Count:
    """How often something happened, when first and last [s], and in which line first; examples of cells."""

    number: int = 0
    start: float = np.nan
    end: float = np.nan
    line: int = 0
    largest: float = 0.0

    def add(self, number: int, start: float, end: float, line: int) -> None:
        if not self.number:
            self.start, self.line = start, line
        self.number, self.end = self.number + number, end


@dataclass
class Track:
    """Everything that one clock stamped."""

    file: str
    row: str
    columns: list[Column]
    spacing: float
    """Median spacing of the samples [s]."""
    every: float
    origin: float | None
    """Time of the first sample [s], by the first sample itself where it is not known before."""
    time_column: str
    samples: int = 0
    backwards: Count = field(default_factory=Count)
    untimed: Count = field(default_factory=Count)
    gaps: list[tuple[float, float]] = field(default_factory=list)
    _last: float = -np.inf
    _t: FloatArray = field(default_factory=lambda: np.empty(0))
    _rows: list[FloatArray] = field(default_factory=list)
    _index: list[NDArray[np.int64]] = field(default_factory=list)
    _at: list[FloatArray] = field(default_factory=list)
    _number: list[NDArray[np.int64]] = field(default_factory=list)

    def feed(self, time: FloatArray, raw: Sequence[FloatArray], line_of: Line) -> None:
        """The next rows: stamps [s] and raw numbers of each column, NaN where missing."""
        self.samples += len(time)
        time = self._possible(time)
        ordered = self._in_order(time, line_of)
        t = time[ordered] if len(ordered) < len(time) else time
        if not len(t):
            return
        if self.origin is None:
            self.origin = float(t[0])
        t = t - self.origin
        self._find_gaps(t)
        rows = []
        for column, numbers in zip(self.columns, raw, strict=True):
            with np.errstate(over="ignore", invalid="ignore"):  # beyond the largest float is beyond what can be
                values = (numbers[ordered] if len(ordered) < len(numbers) else numbers) * column.factor + column.offset
            rows.append(column.watch.screened(values, t, lambda i: line_of(int(ordered[i]))))
        self._keep(t, rows)

    def _possible(self, time: FloatArray) -> FloatArray:
        """Stamps with those made NaN that are none: infinite, or months away from the first."""
        finite = np.isfinite(time)
        if not finite.any():
            return np.full(len(time), np.nan)
        zero = self.origin if self.origin is not None else float(time[np.argmax(finite)])
        with np.errstate(invalid="ignore", over="ignore"):
            near = np.abs(time - zero) <= LONGEST
        return time if near.all() else np.where(near, time, np.nan)

    def _in_order(self, time: FloatArray, line_of: Line) -> NDArray[np.intp]:
        """Rows whose stamp is a number later than all before; the others are counted, a restart of the clock is
        refused."""
        step = np.diff(time, prepend=self._last + (self.origin or 0.0) if np.isfinite(self._last) else -np.inf)
        if (step > 0.0).all() and np.isfinite(time).all():
            return np.arange(len(time), dtype=np.intp)
        finite = np.isfinite(time)
        if not finite.all():
            bad = np.flatnonzero(~finite)
            self.untimed.add(len(bad), np.nan, np.nan, line_of(int(bad[0])))
        rows = np.flatnonzero(finite)
        if not len(rows):
            return rows
        before = self._last + (self.origin or 0.0) if np.isfinite(self._last) else -np.inf
        latest = np.maximum.accumulate(np.concatenate(([before], time[rows])))[:-1]
        back = time[rows] <= latest
        if back.any():
            far = latest - time[rows]
            self._refuse_restart(rows, time, far, line_of)
            first, last = (int(rows[i]) for i in (np.argmax(back), len(back) - 1 - np.argmax(back[::-1])))
            zero = self.origin if self.origin is not None else float(time[rows[0]])
            self.backwards.add(int(back.sum()), float(time[first]) - zero, float(time[last]) - zero, line_of(first))
            self.backwards.largest = max(self.backwards.largest, float(far[back].max()))
        return rows[~back]

    def _refuse_restart(self, rows: NDArray[np.intp], time: FloatArray, far: FloatArray, line_of: Line) -> None:
        beyond = far > max(RESTART, RESTART_SPACINGS * self.spacing)
        if beyond.any():
            i = int(np.argmax(beyond))
            raise LogError(
                f"{self.file}: {self.row} {line_of(int(rows[i]))}: time in {self.time_column} runs back by {far[i]:.6g}"
                " s. The clock restarted, or two logs were joined: cut the file there and give the parts as logs of"
                " their own (or correct a stamp that jumped ahead before it)."
            )

    def _find_gaps(self, t: FloatArray) -> None:
        step = np.diff(t, prepend=self._last) if np.isfinite(self._last) else np.diff(t)
        since = len(t) - len(step)  # 1 where the very first sample has no step
        for i in np.flatnonzero(step > max(GAP * self.spacing, LEAST_GAP)) + since:
            self.gaps.append((float(t[i - 1]) if i else self._last, float(t[i])))
        self._last = float(t[-1])

    def _keep(self, t: FloatArray, rows: list[FloatArray], last: bool = False) -> None:
        """Emits the complete stretches and their bins; the samples of the last one wait for the next rows."""
        if len(self._t):
            t = np.concatenate((self._t, t))
            rows = [np.concatenate((old, new)) for old, new in zip(self._rows, rows, strict=True)]
        index = np.floor(t / self.every + 0.5 + EDGE).astype(np.int64)
        wide = stretches(index, self.every)
        end = len(t) if last else int(np.searchsorted(wide, wide[-1])) if len(t) else 0
        self._t, self._rows = t[end:], [values[end:] for values in rows]
        if not end:
            return
        t, index, wide, rows = t[:end], index[:end], wide[:end], [values[:end] for values in rows]
        starts = np.flatnonzero(np.diff(index, prepend=index[0] - 1))
        wide_starts = np.flatnonzero(np.diff(wide, prepend=wide[0] - 1))
        counts = np.diff(starts, append=end).astype(np.int64)
        self._index.append(index[starts])
        self._at.append(np.add.reduceat(t, starts) / counts)
        self._number.append(counts)
        for column, values in zip(self.columns, rows, strict=True):
            _reduce(column, values, starts, counts)
            column.watch.feed(t, values, wide, wide_starts)

    def finish(self) -> Binned:
        """The bins, once all rows were fed. Errors: LogError where most stamps repeat."""
        if len(self._t):
            self._keep(np.empty(0), [np.empty(0) for _ in self.columns], last=True)
        if self.backwards.number > MOST_BACKWARDS * self.samples:
            raise LogError(
                f"{self.file}: {self.backwards.number} of {self.samples} samples have a time in {self.time_column} that"
                f" is not later than the one before, first in {self.row} {self.backwards.line}. The stamps are too"
                " coarse for the samples: export them with fractions of a second."
            )
        index = _joined(self._index, np.int64)
        means = [_joined(c.means, np.float64) for c in self.columns]
        missing = [_joined(c.missing, np.int32) for c in self.columns]
        wide = stretches(index, self.every)
        starts = np.flatnonzero(np.diff(wide, prepend=wide[0] - 1)) if len(wide) else np.empty(0, np.intp)
        at, number = _joined(self._at, np.float64), _joined(self._number, np.int64)
        return Binned(index.astype(np.float64) * self.every, means, missing, at, number, wide, starts)


def _joined(parts: list[Any], dtype: type) -> Any:
    """The parts as one array; they are given free, since long logs have many."""
    joined = np.concatenate([np.empty(0, dtype), *parts])
    parts.clear()
    return joined


@dataclass(frozen=True)
class Binned:
    """The bins of a track: centre [s], means and missing samples by column; mean stamp of the samples in
    each bin [s] and their number; the stretch that each bin belongs to, and the bin that each stretch starts with."""

    t: FloatArray
    means: list[FloatArray]
    missing: list[NDArray[np.int32]]
    at: FloatArray
    number: NDArray[np.int64]
    wide: NDArray[np.int64]
    starts: NDArray[np.intp]


def _reduce(column: Column, values: FloatArray, starts: NDArray[np.intp], counts: NDArray[np.int64]) -> None:
    bad = np.isnan(values)
    if not bad.any():
        column.means.append(np.add.reduceat(values, starts) / counts)
        column.missing.append(np.zeros(len(starts), np.int32))
        return
    good = np.add.reduceat((~bad).astype(np.int64), starts)
    sums = np.add.reduceat(np.where(bad, 0.0, values), starts)
    column.means.append(np.where(good > 0, sums / np.maximum(good, 1), np.nan))
    column.missing.append((counts - good).astype(np.int32))
