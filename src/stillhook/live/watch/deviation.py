"""Measured against simulated, sample by sample: root mean squares over a sliding window, and alarms."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from typing import NamedTuple

from stillhook.units import show

COMPARED = ("s_w", "p_a", "p_b", "u_p")
"""Signals that are compared."""
LIMITS: Mapping[str, float] = {"s_w": 0.05, "p_a": 20.0e5, "p_b": 20.0e5, "u_p": 0.03}
"""Root mean square from which a deviation is an alarm [m, Pa, Pa, 1]: 5 cm and 3 % are those of paper F for the control
error and the command; 20 bar are twice what the crane of the synthetic sea trials, whose friction has another law than
its file, leaves in either line."""
WINDOW = 20.0
"""Length of the window [s]: a wave or two, so that hoisting and lowering both count."""
CLEARS_AT = 0.8
"""Part of the limit below which an alarm ends, so that it does not flicker."""


class Deviation(NamedTuple):
    """Of one signal: measured, simulated, root mean square and mean of their difference over the window, the limit, and
    whether it is an alarm; NaN and no alarm before the window is full once."""

    name: str
    measured: float
    simulated: float
    rms: float
    mean: float
    limit: float
    alarm: bool

    @property
    def status(self) -> str:
        """One word."""
        return "ALARM" if self.alarm else "ok" if math.isfinite(self.rms) else "filling"


class Deviations:
    """Sliding windows over pairs of measured and simulated values.

    Parameters: limits by signal; window [s]; every: time between samples [s].
    """

    def __init__(self, limits: Mapping[str, float] = LIMITS, *, window: float = WINDOW, every: float = 0.1) -> None:
        self._limits = dict(limits)
        self._length = max(2, round(window / every))
        self._windows: dict[str, _Window] = {name: _Window(self._length) for name in limits}
        self._alarms: set[str] = set()

    def add(self, measured: Mapping[str, float], simulated: Mapping[str, float]) -> list[Deviation]:
        """A sample of each side; signals that one of them lacks are left out."""
        result = []
        for name, limit in self._limits.items():
            if name not in measured or name not in simulated:
                continue
            m, s = measured[name], simulated[name]
            window = self._windows[name]
            if math.isfinite(m) and math.isfinite(s):
                window.add(m - s)
            rms, mean = window.rms, window.mean
            if rms > limit:
                self._alarms.add(name)
            elif rms < CLEARS_AT * limit:
                self._alarms.discard(name)
            result.append(Deviation(name, m, s, rms, mean, limit, name in self._alarms))
        return result


class _Window:
    def __init__(self, length: int) -> None:
        self._values: deque[float] = deque(maxlen=length)

    def add(self, value: float) -> None:
        self._values.append(value)

    @property
    def full(self) -> bool:
        return len(self._values) == self._values.maxlen

    @property
    def rms(self) -> float:
        return math.sqrt(math.fsum(x * x for x in self._values) / len(self._values)) if self.full else math.nan

    @property
    def mean(self) -> float:
        return math.fsum(self._values) / len(self._values) if self.full else math.nan


def shown(name: str, value: float) -> str:
    """A value with its unit."""
    if not math.isfinite(value):
        return "-"
    quantity = {"s_w": "length", "p_a": "pressure", "p_b": "pressure"}.get(name)
    if quantity == "length":
        return f"{value:.3f} m"
    return show(value, quantity) if quantity else f"{value:.4f}"
