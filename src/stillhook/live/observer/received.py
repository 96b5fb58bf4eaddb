"""Measured values as they came in, so that each row of the twin has what had come until then."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray

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
        nothing = np.full(len(self._place), np.nan)
        self._states: deque[_State] = deque([_State(-math.inf, nothing, nothing)], MOST)

    def take(self, now: float, values: Mapping[str, float]) -> None:
        """Values that came in now [s]."""
        _, known, arrivals = self._states[-1]
        known, arrivals = known.copy(), arrivals.copy()
        for name, value in values.items():
            if name in self._place:
                known[self._place[name]], arrivals[self._place[name]] = value, now
        self._states.append(_State(now, known, arrivals))

    def passed(self, now: float) -> FloatArray:
        """Values, then ages [s], at a time of which nothing earlier will be asked any more."""
        while len(self._states) > 1 and self._states[1].since <= now:
            self._states.popleft()
        return self._beside(self._states[0], now)

    def newest(self, now: float) -> FloatArray:
        """The same of now [s]."""
        return self._beside(self._states[-1], now)

    def _beside(self, state: _State, now: float) -> FloatArray:
        ages = np.maximum(now - state.arrivals, 0.0)
        return np.concatenate([np.where(ages <= self._timeout, state.values, np.nan), ages])
