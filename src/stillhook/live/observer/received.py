"""Measured values as they came in, so that each row of the twin has what had come until then."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray

BACK = 60.0
"""A time that much before the newest state is of a clock that was set back [s]; rows are asked for sooner than that."""
MOST = 2000
"""States that wait for rows: ten seconds of messages as fast as they are taken."""


class _State(NamedTuple):
    """From a time on [s]: newest value of each signal, and when it came (n,)."""

    since: float
    values: FloatArray
    arrivals: FloatArray


class Received:
    """Newest values of signals over time. Parameters: names; timeout [s]: older values are unknown."""

    def __init__(self, names: Sequence[str], timeout: float) -> None:
        self._place = {name: i for i, name in enumerate(names)}
        self._timeout = timeout
        self._states: deque[_State] = deque(maxlen=MOST)
        self._begin()

    def _begin(self) -> None:
        nothing = np.full(len(self._place), np.nan)
        self._states.clear()
        self._states.append(_State(-math.inf, nothing, nothing))

    def take(self, now: float, values: Mapping[str, float]) -> None:
        """Values that came in now [s]. Where the clock was set back, what came before is forgotten."""
        if now < self._states[-1].since - BACK:
            self._begin()
        _, known, arrivals = self._states[-1]
        known, arrivals = known.copy(), arrivals.copy()
        for name, value in values.items():
            if name in self._place:
                known[self._place[name]], arrivals[self._place[name]] = value, now
        self._states.append(_State(now, known, arrivals))

    def passed(self, now: float) -> FloatArray:
        """Values, then ages [s], at a time of which nothing earlier will be asked any more."""
        if now < self._states[-1].since - BACK:
            self._begin()
        while len(self._states) > 1 and self._states[1].since <= now:
            self._states.popleft()
        return self._beside(self._states[0], now)

    def newest(self, now: float) -> FloatArray:
        """The same of now [s]."""
        return self._beside(self._states[-1], now)

    def _beside(self, state: _State, now: float) -> FloatArray:
        ages = np.maximum(now - state.arrivals, 0.0)
        return np.concatenate([np.where(ages <= self._timeout, state.values, np.nan), ages])
