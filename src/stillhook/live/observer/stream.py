"""Values that come when they like, as rows at even times; and the sender's clock on that of this machine."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.live.observer.signals import HELD, SIGNALS

HOLE = 0.6
"""Longest time between two samples that a row is between [s]."""
MOST_SAMPLES = 1000
"""Samples of a signal that are kept."""
BIN, BINS = 5.0, 12
"""The least delay of a minute is the offset between both clocks: width of its bins [s], and how many."""
JUMP = 1.0
"""How much less than the least delay a message's may be [s]: beyond it the sender's clock jumped."""
LATE = 5.0
"""Delay beyond the least one from which a message's stamp is not believed [s]."""
BELIEVED = 20
"""Messages in a row whose stamps were not believed, after which the clock is taken to have jumped back."""


class SenderClock:
    """Times of messages on this machine's clock: their own stamps, moved by the least delay seen of late.

    Hours of offset change nothing; a stamp that jumps is not the time of a sample. Without a stamp the
    arrival counts.
    """

    def __init__(self) -> None:
        self._least: deque[tuple[float, float]] = deque(maxlen=BINS)
        self._doubted = 0
        self.jump = math.nan

    def at(self, arrival: float, stamp: float) -> float | None:
        """Time of a message [s]; None where its stamp cannot be. `jump` is then by how much the clock jumped, NaN where
        it did not."""
        self.jump = math.nan
        if not math.isfinite(stamp):
            return arrival
        delay = arrival - stamp
        least = min((d for _, d in self._least), default=delay)
        if delay > least + LATE:
            self._doubted += 1
            if self._doubted < BELIEVED:
                return None
        self._doubted = 0
        if not least - JUMP <= delay <= least + LATE:
            self.jump = least - delay
            self._least.clear()
        if not self._least or arrival - self._least[-1][0] > BIN:
            self._least.append((arrival, delay))
        elif delay < self._least[-1][1]:
            self._least[-1] = (self._least[-1][0], delay)
        return stamp + min(d for _, d in self._least)


class Stream:
    """The last seconds of each signal."""

    def __init__(self) -> None:
        self._samples: dict[str, deque[tuple[float, float]]] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """Signals that ever came."""
        return tuple(self._samples)

    def add(self, t: float, values: Mapping[str, float]) -> None:
        """Values at a time [s]; those of a signal that go back in time are left out."""
        for name, value in values.items():
            samples = self._samples.setdefault(name, deque(maxlen=MOST_SAMPLES))
            if not samples or t > samples[-1][0]:
                samples.append((t, value))

    def rows(self, times: FloatArray, names: Sequence[str] | None = None) -> dict[str, FloatArray]:
        """Values at increasing times [s] of these signals (default all), on straight lines between samples without
        spikes; NaN where none are near."""
        use = self.names if names is None else [name for name in names if name in self._samples]
        return {name: _at(times, name, np.array(self._samples[name])) for name in use}

    def forget(self, before: float) -> None:
        """Leave out what is before a time [s], but for the newest of it."""
        for samples in self._samples.values():
            while len(samples) > 1 and samples[1][0] <= before:
                samples.popleft()


def _at(times: FloatArray, name: str, samples: FloatArray) -> FloatArray:
    t, x = samples.T
    if name in HELD:
        place = np.searchsorted(t, times, side="right") - 1
        return np.where(place >= 0, x[np.maximum(place, 0)], np.nan)
    if name in SIGNALS and len(t) > 2:
        kept = ~spikes(x, SIGNALS[name].spike)
        t, x = t[kept], x[kept]
    after = np.searchsorted(t, times, side="left")
    inside = (after < len(t)) & ((after > 0) | (times == t[0]))
    after = np.clip(after, 1, max(1, len(t) - 1))
    if len(t) < 2:
        return np.full(len(times), np.nan)
    near = inside & (t[after] - t[after - 1] <= HOLE)
    return np.where(near, np.interp(times, t, x), np.nan)


def spikes(x: FloatArray, size: float) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Samples that are more than a size off the median of five about them: one or two that jump and come back, not a
    step that stays."""
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(x, 2, mode="edge"), 5)
    return np.asarray(np.abs(x - np.median(windows, axis=1)) > size)
