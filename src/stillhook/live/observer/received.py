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
    """From a time on [s]: newest value of each signal, and when it came by the wall clock and the monotonic (n,)."""

    since: float
    values: FloatArray
    arrivals: FloatArray
    steady: FloatArray


class Received:
    """Newest values of signals over time. Parameters: names; timeout [s]: older values are unknown.

    Rows of the twin have the time of the wall clock, so values are beside them by that; what is too old now is so by
    the monotonic clock, which nobody sets.
    """

    def __init__(self, names: Sequence[str], timeout: float) -> None:
        self._place = {name: i for i, name in enumerate(names)}
        self._timeout = timeout
        self._states: deque[_State] = deque(maxlen=MOST)
        self._begin()

    def _begin(self) -> None:
        nothing = np.full(len(self._place), np.nan)
        self._states.clear()
        self._states.append(_State(-math.inf, nothing, nothing, nothing))

    def take(self, now: float, steady: float, values: Mapping[str, float]) -> None:
        """Values that came in now, by the wall clock and the monotonic one [s]. Where the former was set back, what
        came before is forgotten."""
        if now < self._states[-1].since - BACK:
            self._begin()
        _, *known = self._states[-1]
        state = _State(now, *(of.copy() for of in known))
        for name, value in values.items():
            if name in self._place:
                i = self._place[name]
                state.values[i], state.arrivals[i], state.steady[i] = value, now, steady
        self._states.append(state)

    def passed(self, now: float) -> FloatArray:
        """Values, then ages [s], at a time of which nothing earlier will be asked any more."""
        if now < self._states[-1].since - BACK:
            self._begin()
        while len(self._states) > 1 and self._states[1].since <= now:
            self._states.popleft()
        first = self._states[0]
        return self._with_ages(first, now - first.arrivals)

    def newest(self, steady: float) -> FloatArray:
        """The same of now, by the monotonic clock [s]."""
        last = self._states[-1]
        return self._with_ages(last, steady - last.steady)

    def _with_ages(self, state: _State, ages: FloatArray) -> FloatArray:
        ages = np.maximum(ages, 0.0)
        return np.concatenate([np.where(ages <= self._timeout, state.values, np.nan), ages])
