"""Attempts that strangers make, as events: the first ones at once, a flood of them counted, none of them lost."""

from __future__ import annotations

import asyncio
import contextlib
import math
import time
from collections.abc import Callable

from stillhook.live.history.events import one_line

QUIET = 1.0
"""Time in which a burst is reported one by one, and after which the others are counted [s]."""
LONGEST = 200
"""Letters of a text that are kept."""


class Counted:
    """Parameters: tell: takes how many there were and a text on the last; burst: events in `QUIET` at most."""

    def __init__(self, tell: Callable[[int, str], None], burst: int = 1) -> None:
        self._tell, self._burst = tell, burst
        self._since, self._told, self._count, self._text = -math.inf, 0, 0, ""
        self._timer: asyncio.TimerHandle | None = None

    def add(self, text: str) -> None:
        """One more. What is not reported at once is within `QUIET` where a loop runs, else by `flush`."""
        self._count, self._text = self._count + 1, one_line(text[:LONGEST], LONGEST)
        now = time.monotonic()
        if now - self._since >= QUIET:
            self._since, self._told = now, 0
        if self._told < self._burst:
            self._told += 1
            self.flush()
        elif self._timer is None:
            with contextlib.suppress(RuntimeError):  # no loop
                self._timer = asyncio.get_running_loop().call_later(self._since + QUIET - now, self.flush)

    def flush(self) -> None:
        """Report what was not reported yet."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._count:
            count, self._count = self._count, 0
            self._tell(count, self._text)
