"""Signals that ask a process to end: SIGINT, SIGTERM, SIGHUP, and CTRL_BREAK on Windows.

In a command the first one raises `Stopped`, which is a KeyboardInterrupt, so that every block that cleans up after one
does; a server notes it instead and ends after its cycle. The exit code is 128 plus its number in both.
"""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any

SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name))
AGAIN = 1.0
"""Time within which a further signal is taken for the same request [s]: a supervisor sends one to every process and one
to the group of them, and no clean-up is to be cut off by the second."""
_received: list[int] = []


class Stopped(KeyboardInterrupt):
    """A signal asked this process to end."""


def received() -> int | None:
    """Number of the first signal that asked this process to end; None where none did."""
    return _received[0] if _received else None


def forget() -> None:
    """Begin anew: a process may run several commands."""
    _received.clear()


def stopped_by(number: int | None) -> tuple[str, int]:
    """The line of a process that a signal ended, and its exit code. number: of the signal, None: SIGINT."""
    number = signal.SIGINT if number is None else number
    by = "" if number == signal.SIGINT else f" by {signal.Signals(number).name}"
    return f"stopped{by}: no file was left half-written", 128 + number


@contextmanager
def raised() -> Iterator[None]:
    """Each request to end raises `Stopped` in the main thread meanwhile; afterwards it ends the process at once."""
    last = -AGAIN

    def handler(number: int, frame: FrameType | None) -> None:
        nonlocal last
        _received.append(number)
        now = time.monotonic()
        if now - last >= AGAIN:
            last = now
            raise Stopped

    changed = _handle(handler)
    try:
        yield
    finally:
        for each in changed:
            signal.signal(each, signal.SIG_DFL)


@contextmanager
def noted() -> Iterator[Callable[[], bool]]:
    """Requests to end are noted meanwhile; gives whether one came."""
    before = len(_received)
    changed = _handle(lambda number, frame: _received.append(number))
    try:
        yield lambda: len(_received) > before
    finally:
        for each, handler in changed.items():
            signal.signal(each, handler)


@contextmanager
def held_back() -> Iterator[None]:
    """Requests to end come after the block, also in processes that it starts: these call `let_through` when they are
    ready for them. Not on Windows."""
    if sys.platform == "win32":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def let_through(handler: Callable[[], None]) -> None:
    """In a process that another one of Stillhook started: what ends that one by SIGINT or SIGHUP, of a terminal that
    both have, ends this one when that one asks for it; SIGTERM calls the handler."""
    for each in SIGNALS:
        signal.signal(each, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: handler())
    if sys.platform != "win32":
        signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)


def _handle(handler: Callable[[int, FrameType | None], None]) -> dict[signal.Signals, Any]:
    """Handle what is not ignored, as nohup ignores SIGHUP. Gives the handlers before."""
    changed: dict[signal.Signals, Any] = {}
    for each in SIGNALS:
        before = signal.getsignal(each)
        if before is not signal.SIG_IGN:
            with suppress(ValueError):  # not in the main thread
                changed[each] = signal.signal(each, handler)
    return changed
