"""Progress of long work: its share done, from 0 to 1, of whatever parts it is made."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping

Progress = Callable[[float], None]
"""Is called with the share of the work that is done, 0 to 1, never falling."""


KEPT = 0.1
"""Part of its expected time below which a part of the work is taken not to have been done, its results being kept from
before: no machine is so much faster."""


class Parts:
    """Progress of work in parts, one after another, of which each is expected to take so many seconds; never goes back.

    Only ratios of the times matter: a slower machine is slower in all parts. A part that takes next to no time leaves
    its share to the parts that follow. progress None: nobody listens.
    """

    def __init__(
        self, progress: Progress | None, expected: Mapping[str, float], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.progress, self.ahead, self.clock = progress, dict(expected), clock
        self.done, self.share = 0.0, -1.0
        self.size, self.begin = 0.0, clock()

    def __call__(self, name: str) -> Progress:
        """Progress of the part of this name, which has begun now."""
        self.done += self.size if self.clock() - self.begin > KEPT * self.size else 0.0
        whole = self.done + sum(self.ahead.values())
        self.size, self.begin = self.ahead.pop(name), self.clock()
        low, high = self.done / whole, (self.done + self.size) / whole
        self.at(low)
        return lambda share: self.at(low + (high - low) * min(max(share, 0.0), 1.0))

    def at(self, share: float) -> None:
        """The whole is done up to this share."""
        if share > self.share:
            self.share = share
            if self.progress is not None:
                self.progress(share)


class TimeLeft:
    """Time that work still takes, from the shares that it has reported, which are in proportion to computing time.

    The speed is the mean since the first report: what was done before it, such as results that were kept from an
    earlier run, says nothing about it. Between reports the time counts down. clock gives seconds.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.clock = clock
        self.first: tuple[float, float] | None = None
        self.last = (0.0, 0.0)

    def report(self, share: float) -> None:
        """The share that is done now, never falling."""
        if self.first is None:
            self.first = self.last = (self.clock(), share)
        elif share > self.last[1]:
            self.last = (self.clock(), share)

    @property
    def seconds(self) -> float | None:
        """Time left [s]; None until more is done than at the first report."""
        if self.first is None or self.last == self.first:
            return None
        (t_0, share_0), (t_1, share_1) = self.first, self.last
        left = (1.0 - share_1) * (t_1 - t_0) / (share_1 - share_0)
        return max(left - (self.clock() - t_1), 0.0)

    def __str__(self) -> str:
        if self.seconds is None:
            return "-:--:--"
        minutes, seconds = divmod(round(self.seconds), 60)
        return f"{minutes // 60}:{minutes % 60:02d}:{seconds:02d}"


class Interrupted(Exception):
    """The caller's stop flag was set; nothing is returned."""


class Meter:
    """Adds up the work done by all parts and reports it to the caller; also carries the stop flag to the worker
    threads.

    total and done in any weight, such as cases.
    """

    def __init__(self, total: float, progress: Progress | None, done: float = 0.0) -> None:
        self.total, self.progress, self.done, self.stopped = total, progress, done, False
        self.lock = threading.Lock()

    def tell(self) -> None:
        if self.progress is not None:
            self.progress(min(self.done / self.total, 1.0))

    def part(self, weight: float) -> Progress:
        """Progress of a part of this weight, called with its share done. Raises Interrupted once the meter is
        stopped."""
        before = 0.0

        def reached(share: float) -> None:
            nonlocal before
            if self.stopped:
                raise Interrupted
            if share == before:
                return
            with self.lock:
                self.done += (share - before) * weight
                before = share
                self.tell()

        return reached
