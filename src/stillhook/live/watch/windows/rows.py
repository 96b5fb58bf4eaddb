"""Rows of crane and twin side by side: the last half minute and more, in whole batches."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.live.estimate.balance import ENCODER
from stillhook.live.watch.windows.batches import BATCH

HISTORY = 30.0
"""Rows before a batch that peak-to-peak values look back on [s]: the window of paper F, criterion 2b."""
AHEAD = 0.5
"""Rows after a batch, for signals of a clock that is late [s]."""
ABSURD = 1e9
"""Magnitude from which a number is not a reading [SI]: ten times any pressure, force or power of a winch."""
Signals = Mapping[str, FloatArray]


class Piece(NamedTuple):
    """A batch with its history before it. t (n,) [s]; crane, twin: signals (n,) [SI], NaN where unknown; those of the
    encoder's clock as they were by the clock of the pressures; new: rows of the batch itself."""

    t: FloatArray
    crane: Signals
    twin: Signals
    new: slice
    every: float


class RowBuffer:
    """The rows that a batch needs. names of the signals; every: time between rows [s]."""

    def __init__(self, names: tuple[str, ...], every: float) -> None:
        self.names, self.every = names, every
        self._batch, self._ahead = max(2, round(BATCH / every)), round(AHEAD / every)
        self._most = round(HISTORY / every) + self._batch + 2 * self._ahead
        self._data = np.full((2, len(names), 2 * self._most), np.nan)
        self._end = self._new = 0
        self.rows = 0

    def add(self, crane: Mapping[str, float], twin: Mapping[str, float]) -> bool:
        """One more row; whether a batch is complete."""
        if self._end == self._data.shape[2]:
            self._data[:, :, : self._most] = self._data[:, :, -self._most :].copy()
            self._end = self._most
        for side, of in enumerate((crane, twin)):
            values = np.array([of.get(name, math.nan) for name in self.names])
            self._data[side, :, self._end] = np.where(np.abs(values) < ABSURD, values, np.nan)
        self._end += 1
        self._new += 1
        self.rows += 1
        return self._new >= self._batch + self._ahead

    def piece(self, offset: float) -> Piece:
        """The complete batch; offset: the encoder's rows of the crane are so much later [s]."""
        end = self._end - (self._new - self._batch)
        start = max(0, end - self._batch - round(HISTORY / self.every), end - self.rows)
        self._new -= self._batch
        t: FloatArray = self.every * np.arange(start, end, dtype=np.float64)
        crane, twin = (dict(self._signals(side, start, end)) for side in (0, 1))
        if offset:
            for name in ENCODER:
                if name in crane:
                    whole = self._data[0, self.names.index(name), : self._end]
                    crane[name] = np.interp(t + offset, np.arange(self._end) * self.every, whole)
        return Piece(t, crane, twin, slice(len(t) - self._batch, len(t)), self.every)

    def _signals(self, side: int, start: int, end: int) -> Iterator[tuple[str, FloatArray]]:
        for k, name in enumerate(self.names):
            x = self._data[side, k, start:end]
            if np.isfinite(x[-self._batch :]).any():
                yield name, x.copy()
