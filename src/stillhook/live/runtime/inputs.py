"""Inputs from outside: what is in force at a cycle, how old it is, and what holds when nothing comes any more.

Inputs of two sorts. Streamed ones (the tip's motion, the operator's speed, commands) come again and again and have a
time-out. Settings (mode, gains) are written once and hold.

The motion of the tip, or of the vessel that moves it, is carried from its arrival to the cycle by its own speed and
acceleration, for at most `CARRIED`; then it coasts to rest with the time constant `COAST`, so that a lost connection
does not shake the wire. The operator's speed and the pumps' command go to zero at the time-out, so that no winch hoists
for ever. Every other input is held.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.engine.inputs import COMMANDS
from stillhook.live.runtime.board import INPUT_CELLS, MOST_INPUTS
from stillhook.live.runtime.ring import Ring
from stillhook.sea.vessel.vessel_tip import GIVEN, NEEDED

MOTION = ("s_tip", "v_tip", "a_tip")
JETS = (MOTION, *GIVEN.values())
"""Numbers that move the tip, or the vessel and its boom: each with rate and acceleration, whole or not at all."""
MOVING = tuple(name for jet in JETS for name in jet)
RATES = ("v_op", "u_p")
"""Inputs that move the winch as long as they hold: they go to zero at the time-out."""
MODE = "mode"
TIMEOUT = 1.0
"""Age at which a streamed input is stale where nothing else is given [s]."""
CARRIED = 0.1
"""Age up to which the tip's motion is carried on by its acceleration [s]."""
COAST = 0.5
"""Time constant with which a motion that ended comes to rest [s]."""


class Motion(NamedTuple):
    """Motion of the crane tip, up positive [m, m/s, m/s^2], or a number of the vessel's with rate and acceleration."""

    s: float
    v: float
    a: float


def carried(sample: Motion, age: float) -> Motion:
    """A motion at an age after its sample [s]."""
    t = min(max(age, 0.0), CARRIED)
    s, v, a = sample.s + sample.v * t + 0.5 * sample.a * t * t, sample.v + sample.a * t, sample.a
    if age <= CARRIED:
        return Motion(s, v, a)
    left = math.exp(-(age - CARRIED) / COAST)
    return Motion(s + v * COAST * (1.0 - left), v * left, -v * left / COAST)


class InputWriter:
    """The one place of the servers' process that writes inputs. Parameters: ring of the board; names of inputs."""

    def __init__(self, ring: Ring, names: Sequence[str]) -> None:
        self._ring, self._at = ring, {name: INPUT_CELLS * i for i, name in enumerate(names)}
        self._cells: FloatArray = np.zeros(INPUT_CELLS * MOST_INPUTS)

    def write(self, values: Mapping[str, float], arrival: float, stamp: float = math.nan) -> None:
        """Publish values by name, together. arrival: on the monotonic clock [s]; stamp: their own, UTC [s]."""
        for name, value in values.items():
            at = self._at[name]
            self._cells[at : at + INPUT_CELLS] = value, arrival, stamp
        self._ring.publish(self._cells)


class Received(NamedTuple):
    """An input as it came in: value, and when [s]."""

    value: float
    arrival: float


class Inputs:
    """Inputs as the kernel's process reads them.

    Parameters: ring of the board; names: streamed ones first; streamed: how many of them are; timeout [s]; speed: the
    winch's time over that of the wall. Ages are in the winch's time.
    """

    def __init__(self, ring: Ring, names: Sequence[str], streamed: int, timeout: float, speed: float = 1.0) -> None:
        self._speed = speed
        self._ring, self._names, self._timeout = ring, tuple(names), timeout
        self._streamed = set(self._names[:streamed])
        self._seen = ring.count
        self._values: dict[str, Received] = {}
        self._stamps: dict[str, float] = {}
        self._refused: dict[str, float] = {}
        self._changed: list[str] = []
        self._stopped: frozenset[str] = frozenset()
        self.stale: frozenset[str] = frozenset()
        self.age = 0.0
        self.source_delay = 0.0

    def read(self) -> None:
        """Take over what was published since; nothing new where a writer is just at it."""
        if self._ring.count == self._seen or (newest := self._ring.latest()) is None:
            return
        number, cells = newest
        self._seen = number + 1
        for i, name in enumerate(self._names):
            value, arrival, stamp = cells[INPUT_CELLS * i : INPUT_CELLS * (i + 1)].tolist()
            before = self._values.get(name)
            if (
                arrival
                and arrival != self._refused.get(name)
                and (before is None or arrival != before.arrival or value != before.value)
            ):
                self._values[name] = Received(value, arrival)
                self._changed.append(name)
                self._stamps[name] = stamp

    def due(self, now: float, utc_offset: float) -> dict[str, float]:
        """Values other than motions that changed, and what a time-out changes, for a cycle at `now` on the
        monotonic clock [s]. utc_offset: UTC less that clock [s]."""
        changed = {name: self._values[name].value for name in self._changed if name not in MOVING}
        stamped = [self._values[n].arrival + utc_offset - self._stamps[n] for n in self._changed]
        if delays := [delay for delay in stamped if math.isfinite(delay)]:
            self.source_delay = max(delays)
        self._changed.clear()
        if changed.get("override") == 0.0:
            self.refuse(("override", *COMMANDS))  # handed back: the winch takes those of the PLC again
        ages = {name: self._speed * (now - self._values[name].arrival) for name in self._values.keys() & self._streamed}
        self.age = max(ages.values(), default=0.0)
        self.stale = frozenset(name for name, age in ages.items() if age > self._timeout)
        stopping = self.stale.intersection(RATES)
        changed |= dict.fromkeys(stopping - self._stopped, 0.0)
        self._stopped = stopping
        return changed

    @property
    def partial(self) -> bool:
        """Whether some of the tip's or the vessel's motion was given, but not all of it."""
        given = [jet for jet in JETS if any(name in self._values for name in jet)]
        return given != self._complete() or (bool(given) and not self._chosen())

    def motion(self, now: float) -> dict[str, float]:
        """The tip's motion at `now`, or the vessel's, whichever came last; empty where neither was ever given whole."""
        of: dict[str, float] = {}
        for jet in self._chosen():
            samples = [self._values[name] for name in jet]
            age = self._speed * (now - min(sample.arrival for sample in samples))
            of |= zip(jet, carried(Motion(*(sample.value for sample in samples)), age), strict=True)
        return of

    def _complete(self) -> list[tuple[str, ...]]:
        return [jet for jet in JETS if all(name in self._values for name in jet)]

    def _chosen(self) -> list[tuple[str, ...]]:
        """Numbers of the motion that is in force; what it came after is forgotten, and does not go stale."""
        whole = self._complete()
        tip, vessel = whole[: MOTION in whole], whole[MOTION in whole :]
        if not all(name in self._values for name in NEEDED):
            return tip
        if not tip:
            return vessel
        later = self._arrival(tip) >= self._arrival(vessel)
        self.refuse(MOVING[len(MOTION) :] if later else MOTION)
        return tip if later else vessel

    def _arrival(self, jets: Sequence[tuple[str, ...]]) -> float:
        return max(self._values[name].arrival for jet in jets for name in jet)

    def refuse(self, names: Sequence[str]) -> None:
        """Forget values that the winch does not take: they do not go stale."""
        for name in names:
            if (received := self._values.pop(name, None)) is not None:
                self._refused[name] = received.arrival

    def saved(self, now: float) -> dict[str, tuple[float, float]]:
        """Streamed values with their age [s], for a saved state."""
        return {n: (r.value, self._speed * (now - r.arrival)) for n, r in self._values.items() if n in self._streamed}

    def resume(self, saved: Mapping[str, tuple[float, float]], now: float) -> None:
        """Continue with saved values at the ages that they had."""
        for name, (value, age) in saved.items():
            if name in self._streamed:
                self._values[name] = Received(value, now - age / self._speed)


def ordered(inputs: Sequence[str], parameters: Sequence[str]) -> tuple[tuple[str, ...], int]:
    """Names that may be written, streamed ones first, and how many of them are."""
    streamed = tuple(name for name in inputs if name != MODE)
    return (*streamed, MODE, *parameters), len(streamed)
