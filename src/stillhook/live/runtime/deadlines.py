"""Absolute deadlines on a clock that never jumps, the scheduling class of a process, and how late it wakes."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from typing import NamedTuple

PRIORITY = 50
"""Priority within SCHED_FIFO: above ordinary real-time work of a system, below its interrupt threads."""
NS = 1_000_000_000
CONSEQUENCE = (
    "another process can delay a cycle by tens of milliseconds, and late cycles are counted. Give the program"
    " CAP_SYS_NICE, or its user an rtprio of 50 in limits.conf"
)


class Scheduling(NamedTuple):
    """The scheduling class that a process got."""

    real_time: bool
    line: str


def ask_for_real_time() -> Scheduling:
    """Put this process into the real-time class SCHED_FIFO where that is allowed."""
    if not hasattr(os, "sched_setscheduler"):
        return Scheduling(False, f"No real-time class: this system has no SCHED_FIFO; {CONSEQUENCE}.")
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except OSError as problem:
        return Scheduling(False, f"No real-time class ({problem.strerror}): {CONSEQUENCE}.")
    return Scheduling(True, f"Real-time class SCHED_FIFO, priority {PRIORITY}.")


def leave_real_time() -> None:
    """Put this process back into the ordinary class: its end holds up no other twin then."""
    if hasattr(os, "sched_setscheduler"):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


def yield_processor() -> None:
    """Let others of the same priority go first: a twin that catches up after a stall holds up no other one."""
    if hasattr(os, "sched_yield"):
        os.sched_yield()


def ordinary() -> Scheduling:
    """What a process has that did not ask."""
    return Scheduling(False, f"Ordinary class, as requested: {CONSEQUENCE}.")


def two_shares() -> Sequence[frozenset[int]]:
    """Its processors in two parts, the second of one; empty where a process has one alone, or cannot choose."""
    if not hasattr(os, "sched_getaffinity"):
        return ()
    *first, last = sorted(os.sched_getaffinity(0))
    return (frozenset(first), frozenset([last])) if first else ()


class Deadlines:
    """Deadlines at whole cycles after a start, so that a late cycle delays none of the later ones.

    Parameters: cycle [s].
    """

    def __init__(self, cycle: float) -> None:
        self._cycle = round(cycle * NS)
        self._start = time.monotonic_ns() + self._cycle

    def at(self, n: int) -> float:
        """Deadline n on the monotonic clock [s]."""
        return (self._start + n * self._cycle) / NS

    def lateness(self, n: int) -> float:
        """Time that has gone since deadline n, negative before it [s]."""
        return (time.monotonic_ns() - self._start - n * self._cycle) / NS

    def wait(self, n: int, behind: float = 0.0) -> float:
        """Sleep until deadline n, or so much longer [s], and return how late it is then [s]."""
        while (ahead := behind - self.lateness(n)) > 0.0:
            time.sleep(ahead)
        return self.lateness(n)
