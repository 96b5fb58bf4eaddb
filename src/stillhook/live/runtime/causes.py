"""Why a cycle began late, as far as a Linux system says it: a look costs some microseconds."""

from __future__ import annotations

import contextlib
import os
from enum import IntEnum
from typing import NamedTuple

from stillhook.live.runtime.memory import page_faults

STEAL = 8
"""Place of the stolen time in the first line of /proc/stat."""
NS = 1.0e-9


class Cause(IntEnum):
    """What delayed a cycle."""

    NONE = 0
    PROCESSOR = 1
    PAGES = 2
    HOST = 3
    CYCLE = 4
    TIMER = 5

    @property
    def text(self) -> str:
        """In words."""
        return TEXTS[self]


TEXTS = {
    Cause.NONE: "not late",
    Cause.PROCESSOR: "waited for a processor (others of its class, or a limit of its group)",
    Cause.PAGES: "waited for the disk (pages of memory)",
    Cause.HOST: "the host of this virtual machine took the processor",
    Cause.CYCLE: "the cycle before took too long",
    Cause.TIMER: "the system's timer came late (a host that does not say what it takes, or interrupts held up)",
}


class Mark(NamedTuple):
    """Counts of a thread: time in which it was ready and had no processor [s], and pages that came from the disk."""

    waited: float
    faults: int


class Watch:
    """Looks for causes in a thread that waits for cycles, made in it."""

    def __init__(self) -> None:
        self._schedule = _opened("/proc/thread-self/schedstat")
        self._before, self._over = self._mark(), False

    def close(self) -> None:
        """Close its file."""
        if self._schedule is not None:
            os.close(self._schedule)

    def begin(self, over: bool) -> None:
        """Before the wait for a cycle. over: whether its deadline is: its delay then begins in the cycle before."""
        self._over = over
        if not over:
            self._before = self._mark()

    def look(self, lateness: float) -> Cause:
        """Why a cycle is late, as far as this thread shows it [s]."""
        before, now = self._before, self._mark()
        self._before = now
        if now.waited - before.waited > 0.5 * lateness:
            return Cause.PROCESSOR
        if now.faults > before.faults:
            return Cause.PAGES
        return Cause.CYCLE if self._over else Cause.TIMER

    def _mark(self) -> Mark:
        waited = 0.0 if self._schedule is None else NS * int(os.pread(self._schedule, 64, 0).split()[1])
        return Mark(waited, page_faults())


class Stolen:
    """Time that the host of a virtual machine took, which the system counts in steps of 10 ms and some time later."""

    def __init__(self) -> None:
        self._file = _opened("/proc/stat")
        self._seen = self._steps()

    def close(self) -> None:
        """Close its file."""
        if self._file is not None:
            os.close(self._file)

    def more(self) -> bool:
        """Whether it grew since the last look."""
        before, self._seen = self._seen, self._steps()
        return self._seen > before

    def _steps(self) -> int:
        return 0 if self._file is None else int(os.pread(self._file, 256, 0).split(None, STEAL + 1)[STEAL])


def _opened(path: str) -> int | None:
    """A file of the system that is read again and again; None where it is not there."""
    with contextlib.suppress(OSError, ValueError, IndexError):
        file = os.open(path, os.O_RDONLY)
        os.pread(file, 256, 0).split()[1]
        return file
    return None
