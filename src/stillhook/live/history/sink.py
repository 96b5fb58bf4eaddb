"""Where a running twin puts its rows and events: into a history, a commit a second, without ever holding the twin up.

What cannot be stored (a full disk) waits in memory for a while; what is dropped then is counted, said once on standard
error, and an event as soon as the history takes it again.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import time as clock
from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.signals import held_back, let_through
from stillhook.base.variable import Variable
from stillhook.errors import LiveError
from stillhook.live.history.budget import Budget
from stillhook.live.history.events import Event, EventKind
from stillhook.live.history.hours import HOUR, archive
from stillhook.live.history.journal import JOURNAL, connect, in_one_line
from stillhook.live.history.moments import LATEST
from stillhook.live.history.writer import History, stored_states
from stillhook.report.terminal import say
from stillhook.variables import BY_NAME

TIME, FLAGS, OWN_TIME = "time_utc", "cycle_flags", "time"
"""Numbers of a row of the runtime that a history has in places of its own: UTC, status, and the winch's own time."""
WINCH_TIME = "t_winch"
COMMIT = 1.0
"""Time between two commits of rows [s]."""
EVENT_COMMIT = 0.1
"""Events are stored at once, but no oftener than this [s]."""
STATE = "twin"
"""Name of the states that it stores."""
MOST_WAITING = 6000
"""Rows, and events, that wait in memory: a minute of 10 ms."""
POLITE = 10
"""Priority that an archiver gives up."""


class _Waiting(NamedTuple):
    """A row that is not stored yet: UTC [s], status, values."""

    time: float
    status: float
    values: FloatArray


class HistorySink:
    """A sink of `stillhook.live.runtime` that writes a history.

    Parameters: folder; own: unit and meaning of the numbers of a row that are not variables of Stillhook; every: one
    row of so many is stored (10 of a cycle of 10 ms: 10 Hz), with the status of all of them, bit by bit; budget. Full
    hours are archived in a process of their own.

    Errors: LiveError, one line, at the first row, where the history is refused.
    """

    def __init__(
        self,
        folder: str | Path,
        own: Mapping[str, tuple[str, str]] | None = None,
        *,
        every: int = 10,
        budget: Budget | None = None,
    ) -> None:
        self._folder, self._own, self._budget = Path(folder), dict(own or {}), budget
        if type(every) is not int or every < 1:
            raise LiveError(f"{self._folder}: every = {every!r}: give a whole number of rows from 1.")
        self._every = every
        self.history: History | None = None
        self._waiting: list[_Waiting] = []
        self._events: list[Event] = []
        self._states: dict[str, bytes] = {}
        self._dropped = self._flags = 0
        self._problem = ""
        self._rows_at = self._events_at = -np.inf
        self._hour: float | None = None
        self._archiver: multiprocessing.process.BaseProcess | None = None

    def rows(self, first: int, names: Sequence[str], rows: Sequence[FloatArray]) -> None:
        """Take complete rows in their order; they are on the disk a second later. Errors: LiveError."""
        if self.history is None:
            columns = [self._column(name) for name in names if name not in (TIME, FLAGS)]
            self.history = History(self._folder, columns, budget=self._budget)
        places = [i for i, name in enumerate(names) if name not in (TIME, FLAGS)]
        at, flags = names.index(TIME), names.index(FLAGS) if FLAGS in names else None
        for number, row in enumerate(rows, first):
            self._flags |= 0 if flags is None else int(row[flags])
            if number % self._every:
                continue
            if 0.0 <= row[at] < LATEST:
                self._waiting.append(_Waiting(float(row[at]), float(self._flags), row[places]))
            else:
                self._dropped, self._problem = self._dropped + 1, f"time {row[at]:.6g}"
            self._flags = 0
        now = clock.monotonic()
        if now - self._rows_at >= COMMIT or (self._events and now - self._events_at >= EVENT_COMMIT):
            self._store()

    def event(self, happened: Event) -> None:
        """Take an event; it is on the disk when this returns, or with the next ones in a flood of them."""
        self._events.append(happened)
        if self.history is not None and clock.monotonic() - self._events_at >= EVENT_COMMIT:
            self._store()

    def save_state(self, data: bytes) -> None:
        """Store a state of the twin in one commit with all rows so far; the newest one waits where that fails."""
        self._states = {STATE: data}
        if self.history is not None:
            self._store()

    def last_state(self) -> bytes | None:
        """The newest state that is not damaged, of a history without a writer. Errors: LiveError."""
        if not (self._folder / JOURNAL).exists():
            return None
        with closing(connect(self._folder)) as connection, in_one_line(self._folder / JOURNAL):
            return next((state.data for _, sound, state in stored_states(connection, STATE) if sound), None)

    def close(self) -> None:
        """Store what waits, and give the folder free."""
        if self.history is not None:
            self._store()
            self.history.close()
            self.history = None

    # What is behind it

    def _column(self, name: str) -> Variable:
        unit, meaning = self._own.get(name, ("", ""))
        if name == OWN_TIME:
            name = WINCH_TIME
        column = name.replace(".", "_")  # settings of a controller, such as ff.tau_k
        row = BY_NAME.get(name) or Variable(column, column, unit or "1", "", "", meaning, "")
        return row if row.unit else row._replace(unit="1")

    def _store(self) -> None:
        """Commit rows and events; where that fails they wait, within bounds."""
        assert self.history is not None
        self._rows_at = self._events_at = clock.monotonic()
        waiting, events = self._waiting, self._events
        if self._dropped:
            text = f"{self._dropped} rows or events were not stored: {self._problem}"
            events = [*events, Event(EventKind.DAMAGED, text, {"dropped": self._dropped})]
        values = np.array([row.values for row in waiting]).reshape(len(waiting), len(self.history.columns))
        try:
            times, flags = [row.time for row in waiting], [row.status for row in waiting]
            self.history.append(times, values, flags, events=events, states=self._states)
        except LiveError as problem:
            self._keep_some(str(problem))
            return
        self._waiting, self._events, self._states, self._dropped, self._problem = [], [], {}, 0, ""
        if waiting:
            self._archive_after(waiting[-1].time // HOUR)

    def _keep_some(self, problem: str) -> None:
        if not self._problem:
            say(f"history: {problem} The twin continues.")
        self._problem = problem
        beyond = [max(0, len(each) - MOST_WAITING) for each in (self._waiting, self._events)]
        self._waiting, self._events = self._waiting[beyond[0] :], self._events[beyond[1] :]
        self._dropped += sum(beyond)

    def _archive_after(self, hour: float) -> None:
        """Archive full hours when one ends, and what a former process left at the start."""
        if hour == self._hour or (self._archiver is not None and self._archiver.is_alive()):
            return
        self._hour = hour
        self._archiver = multiprocessing.get_context("spawn").Process(target=_archive, args=(self._folder,))
        with held_back():
            self._archiver.start()


def _archive(folder: Path) -> None:
    """Archive behind everything else that the machine does, or say in one line why not."""
    let_through(sys.exit)
    if hasattr(os, "nice"):  # Windows has none
        os.nice(POLITE)
    try:
        archive(folder)
    except LiveError as problem:
        say(f"history: {problem}")
