"""The observer's process: of the ordinary class, and behind all others."""

from __future__ import annotations

import contextlib
import math
import os
import time

from stillhook.base.signals import let_through
from stillhook.live.observer.observer import Observer, Task, shown_names
from stillhook.live.observer.panel import HEAD, Panel
from stillhook.live.observer.signals import OF_INPUTS
from stillhook.live.runtime.board import Board
from stillhook.live.runtime.sink import event

LOOK = 0.2
"""Time between two looks at rows and messages [s]."""
JUMP, SLEW = 1.0, 0.1
"""What the wall clock may be off the monotonic one before it jumped or stands still [s], and how fast it may be moved
to the right time [s/s]: chrony does by 0.083."""
TOLD = 60.0
"""Time between two events of a clock that stands still, which is a jump of `JUMP` again and again [s]."""
POLITE = 5
"""Priority that it gives up: kernel and servers come first."""


def run_observer(task: Task, rows: str, panel: str) -> None:
    """Until it is asked to stop, or its parent is gone. rows, panel: names of the kernel's board and of its own."""
    if hasattr(os, "nice"):  # Windows has none
        os.nice(POLITE)
    own = Panel(panel)
    let_through(own.stop)
    with contextlib.closing(own), contextlib.closing(Board(rows)) as board:
        _loop(task, board, own)


def _loop(task: Task, board: Board, own: Panel) -> None:
    def tell(name: str, text: str, value: float) -> None:
        own.events.add(event("observer", name, text, value).to_json().encode())

    observer = Observer(task, time.time(), tell)
    names, signals = shown_names(task.settings), message_names(task)
    row, message, parent = board.rows.count, own.messages.count, os.getppid()
    wall, told = WallClock(time.time(), time.monotonic()), -math.inf
    while not own.stopping and os.getppid() == parent:
        if jump := wall.jump(time.time(), now := time.monotonic()):
            if abs(jump) > 2.0 * JUMP or now - told > TOLD:
                tell("clock", f"The clock of this machine jumped by {jump:.6g} s; the comparison begins again.", jump)
                told = now
            observer = Observer(task, time.time(), tell)
            row, message = board.rows.count, own.messages.count
        first, rows, lost = board.rows.since(row)
        row = first + len(rows)
        for each in rows:
            observer.see(each)
        first, messages, gone = own.messages.since(message)
        message = first + len(messages)
        for each in messages:
            arrival, stamp, *values = each[: HEAD + len(signals)].tolist()
            known = {n: x for n, x in zip(signals, values, strict=True) if math.isfinite(x)}
            observer.hear(arrival, stamp, known)
        if lost or gone:
            tell(
                "lost", f"{lost} rows and {gone} messages came and went unread: the observer is too slow.", lost + gone
            )
        observer.advance(time.time())
        own.values.publish(padded([observer.values[name] for name in names], own.values.width))
        own.proposals.add(observer.proposal._replace(time=time.monotonic()).to_json())
        time.sleep(LOOK)


class WallClock:
    """The wall clock of this machine beside the monotonic one. Parameters: what both show [s]."""

    def __init__(self, wall: float, steady: float) -> None:
        self._offset, self._steady = wall - steady, steady

    def jump(self, wall: float, steady: float) -> float:
        """By how much it was set, or stood still, since it last did; 0 where it keeps time or is moved slowly [s]."""
        off, most = wall - steady - self._offset, SLEW * (steady - self._steady)
        self._steady = steady
        if abs(off) > JUMP:
            self._offset += off
            return off
        self._offset += min(max(off, -most), most)
        return 0.0


def message_names(task: Task) -> tuple[str, ...]:
    """Names of the values of a message."""
    return (*task.settings.signals, *OF_INPUTS)


def padded(values: list[float], width: int) -> list[float]:
    """A row of a ring."""
    return [*values, *[math.nan] * (width - len(values))]
