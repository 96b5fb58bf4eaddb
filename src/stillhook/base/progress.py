"""Progress of long work: its share done, from 0 to 1, of whatever parts it is made."""

from __future__ import annotations

import threading
from collections.abc import Callable

Progress = Callable[[float], None]
"""Is called with the share of the work that is done, 0 to 1, never falling."""


class Parts:
    """Progress of parts within the whole; never goes back. progress None: nobody listens."""

    def __init__(self, progress: Progress | None) -> None:
        self.progress, self.share = progress, 0.0

    def __call__(self, begin: float, end: float) -> Progress:
        """Progress of the part from share `begin` to share `end` of the whole, which has begun now."""
        self.at(begin)
        return lambda share: self.at(begin + (end - begin) * min(max(share, 0.0), 1.0))

    def at(self, share: float) -> None:
        """The whole is done up to this share."""
        if share > self.share or self.share == 0.0:
            self.share = share
            if self.progress is not None:
                self.progress(share)


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
