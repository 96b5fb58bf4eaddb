"""The one writer of a history: it acknowledges rows, events and saved states."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
import socket
import sqlite3
import threading
import time as clock
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stillhook.base.arrays import FloatArray
from stillhook.base.extras import need
from stillhook.base.variable import Variable
from stillhook.errors import LiveError
from stillhook.live.history.budget import Budget
from stillhook.live.history.columns import columns_of, from_text, to_text
from stillhook.live.history.events import Event, EventKind, add_events
from stillhook.live.history.journal import (
    JOURNAL,
    LOCK,
    NUMBER,
    connect,
    create,
    in_one_line,
    lock,
    packed,
    transaction,
)
from stillhook.live.history.moments import LATEST, show_moment
from stillhook.units import number, quote

HOUR = 3600.0
JITTER = 60.0
"""Time by which a clock may go back across the hour without a new file [s]."""
STEP_BACK = 1.0
"""A clock that goes back by more is an event [s]."""
LARGEST_FILE = 200_000_000
"""Doubles that a file holds at most [bytes]: 70 Hz of 100 values for an hour, and what an archiver needs in memory."""
MOST_ROWS = 100_000
"""Of a batch."""
LARGEST_STATE = 64_000_000
"""Of a saved state [bytes]."""
STATES = 3
"""Saved states that are stored of each name."""
HIGHEST_STATUS = 2**31
_STATE_NAME = re.compile(r"[A-Za-z][\w.-]{0,63}", re.ASCII)


class SavedState(NamedTuple):
    """A saved state: the last row that was acknowledged before it, UTC [s since 1970], and its bytes."""

    row: int
    time: float
    data: bytes


class History:
    """The writer of a history; what it returns from is on the disk.

    One process writes a history at a time, several of its threads may; others `read` it meanwhile, and `archive` moves
    its full hours into Parquet files.

    Parameters: folder, made where it is missing; columns of a row: names of the nomenclature, or a `Variable` of one's
    own with its unit (SI); budget of the folder. Columns may differ from those that the folder had so far.

    Errors: LiveError, one line, where the folder has another writer, cannot be written, or holds a journal of another
    version.
    """

    def __init__(self, folder: str | Path, columns: Sequence[str | Variable], *, budget: Budget | None = None) -> None:
        self.folder = Path(folder)
        self._path = self.folder / JOURNAL
        need("duckdb", f"{self.folder}", LiveError)
        self.columns = columns_of(columns, str(self.folder))
        budget = budget or Budget()
        budget.check()
        held = lock(self.folder, LOCK)
        if held is None:
            raise LiveError(f"{self.folder}: {_writer(self.folder)}. Stop it, or choose another folder.")
        self._held, self._pid, self._guard, self._open = held, os.getpid(), threading.RLock(), False
        self._longest = max(1, LARGEST_FILE // (NUMBER * (2 + len(self.columns))))
        try:
            if not self._path.exists():
                create(self.folder)
            self._connection = connect(self.folder)
            try:
                with in_one_line(self._path):
                    self._begin(budget)
            except BaseException:
                self._connection.close()
                raise
        except BaseException:
            held.close()
            raise
        self._open = True

    def _begin(self, budget: Budget) -> None:
        """Continue behind what is there."""
        c = self._connection
        for (text,) in c.execute("SELECT columns FROM layouts").fetchall():
            self._refuse_other_units(from_text(text))
        text = to_text(self.columns)
        facts = {
            "writer": json.dumps({"process": self._pid, "host": socket.gethostname(), "since": clock.time()}),
            "budget": json.dumps(budget._asdict()),
        }
        with transaction(c):
            c.executemany("INSERT OR REPLACE INTO facts VALUES (?, ?)", facts.items())
            c.execute("INSERT OR IGNORE INTO layouts (columns) VALUES (?)", (text,))
            (self._layout,) = c.execute("SELECT id FROM layouts WHERE columns = ?", (text,)).fetchone()
            ends = c.execute(
                "SELECT max(last), max(run) FROM (SELECT last, run FROM batches UNION ALL SELECT last, run FROM hours)"
            ).fetchone()
            self._row, self._run = ends[0] or 0, (ends[1] or 0) + 1
            self._hour: int | None = None
            self._in_run, self._last_time = 0, -np.inf
            newest = c.execute("SELECT run, hour, layout, t_max FROM batches ORDER BY first DESC LIMIT 1").fetchone()
            if newest is not None:
                self._last_time = newest[3]
                if newest[2] == self._layout:
                    self._run, self._hour = newest[:2]
                    (self._in_run,) = c.execute(
                        "SELECT sum(last - first + 1) FROM batches WHERE run = ?", (self._run,)
                    ).fetchone()
            add_events(c, [Event(EventKind.START, f"process {self._pid} writes, after row {self._row}")], self._row)

    def _refuse_other_units(self, stored: Sequence[Variable]) -> None:
        units = {column.name.lower(): column for column in stored}
        for column in self.columns:
            old = units.get(column.name.lower(), column)
            if (old.name, old.unit) != (column.name, column.unit):
                raise LiveError(
                    f"{self.folder}: {column.name} in {column.unit} is stored as {old.name} in {old.unit}. Choose"
                    " another name."
                )

    @property
    def last_row(self) -> int:
        """Number of the last row that is acknowledged; 0 before the first."""
        return self._row

    def append(
        self,
        time: ArrayLike,
        values: ArrayLike,
        status: ArrayLike = 0,
        *,
        events: Sequence[Event] = (),
        states: Mapping[str, bytes] | None = None,
    ) -> int:
        """Store rows, with events and saved states at their end, all or nothing; returns the number of the last row.

        Parameters: time UTC [s since 1970], (n,) or one number; values (n, columns) in the order of `columns` [SI], NaN
        where there is none; status of each row, a whole number of the caller's meaning, 0 for good.

        Errors: LiveError, one line, and nothing is stored: a time that is missing or not in seconds, another number of
        values, a full disk.
        """
        t, x, flags = self._rows(time, values, status)
        saved = dict(states or {})
        for name, data in saved.items():
            _check_state(name, data)
        with self._guard:
            self._refuse_unusable()
            row, place = self._row, (self._run, self._hour, self._in_run)
            happened = [*self._clock_events(t), *events]
            try:
                with in_one_line(self._path), transaction(self._connection):
                    for begin, end in self._pieces(t):
                        row = self._insert(row, t[begin:end], flags[begin:end], x[begin:end])
                    add_events(self._connection, happened, row)
                    for name, data in saved.items():
                        self._insert_state(name, data, row, float(t[-1]) if len(t) else clock.time())
            except BaseException:
                self._run, self._hour, self._in_run = place
                raise
            self._row = row
            if len(t):
                self._last_time = float(t[-1])
            return row

    def event(self, kind: EventKind, text: str, *, data: Mapping[str, object] | None = None) -> None:
        """Store one event; see `append` for several, and for those that belong to rows. Errors: LiveError."""
        self.append((), np.empty((0, len(self.columns))), events=[Event(kind, text, data or {})])

    def save_state(self, name: str, data: bytes) -> None:
        """Store a state, such as bytes of `Session.save`; the last few of each name are there. Errors: LiveError."""
        self.append((), np.empty((0, len(self.columns))), states={name: data})

    def last_state(self, name: str) -> SavedState | None:
        """The newest state of this name whose bytes are those that were stored; None where there is none. A damaged one
        is an event. Errors: LiveError."""
        with self._guard, in_one_line(self._path):
            self._refuse_unusable()
            for identity, sound, state in stored_states(self._connection, name):
                if sound:
                    return state
                with transaction(self._connection):
                    self._connection.execute("DELETE FROM states WHERE id = ?", (identity,))
                    text = f"saved state {name} after row {state.row} is damaged: the one before it is taken"
                    add_events(self._connection, [Event(EventKind.DAMAGED, text)], self._row)
        return None

    def close(self) -> None:
        """Give the folder free. Rows that are not in a file yet stay in the journal."""
        if os.getpid() != self._pid:  # a child that was forked has neither
            return
        with self._guard:
            if self._open:
                with contextlib.suppress(LiveError):  # a full disk keeps nobody from closing
                    self.event(EventKind.STOP, f"process {self._pid} stops, after row {self._row}")
                self._connection.close()
                self._open = False
            self._held.close()

    def __enter__(self) -> History:
        return self

    def __exit__(self, *of: object) -> None:
        self.close()

    # What is behind it

    def _rows(self, time: ArrayLike, values: ArrayLike, status: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Rows as arrays, checked. Errors: LiveError."""
        place, width = str(self.folder), len(self.columns)
        try:
            t = np.atleast_1d(np.asarray(time, dtype=np.float64))
            x = np.asarray(values, dtype=np.float64)
            flags = np.asarray(status, dtype=np.float64)
            if t.ndim != 1 or x.shape != (len(t), width):
                shape = " x ".join(map(str, x.shape)) or "one"
                raise LiveError(f"{place}: {shape} values: give {len(t)} rows of {width} columns.")
            flags = np.array(np.broadcast_to(flags, t.shape))
        except (ValueError, TypeError) as problem:
            raise LiveError(
                f"{place}: rows cannot be stored ({problem}). Give numbers, NaN where there is none."
            ) from None
        if len(t) > MOST_ROWS:
            raise LiveError(f"{place}: {len(t)} rows at once: give at most {MOST_ROWS}.")
        if len(wrong := t[~((t >= 0.0) & (t < LATEST))]):
            raise LiveError(f"{place}: time = {wrong[0]:.6g}: give UTC in seconds since 1970.")
        if len(wrong := flags[~((flags >= 0.0) & (flags < HIGHEST_STATUS) & (flags == np.floor(flags)))]):
            raise LiveError(f"{place}: status = {wrong[0]:.6g}: give a whole number from 0 to {HIGHEST_STATUS - 1}.")
        return t, x, flags

    def _pieces(self, t: FloatArray) -> Iterator[tuple[int, int]]:
        """Parts of a batch that lie in one run each; run, hour and rows in it are those of the part."""
        hours, begin = np.floor(t / HOUR).astype(np.int64), 0
        while begin < len(t):
            end = self._end_of_run(t, hours, begin)
            if end == begin:
                self._run, self._hour, self._in_run = self._run + 1, int(hours[begin]), 0
                end = self._end_of_run(t, hours, begin)
            yield begin, end
            self._in_run += end - begin
            begin = end

    def _end_of_run(self, t: FloatArray, hours: NDArray[np.int64], begin: int) -> int:
        """Place of the first row from `begin` on that belongs to another run."""
        if self._hour is None:
            return begin
        most = min(len(t), begin + self._longest - self._in_run)
        leaves = np.flatnonzero((hours[begin:most] > self._hour) | (t[begin:most] < self._hour * HOUR - JITTER))
        return begin + int(leaves[0]) if len(leaves) else most

    def _insert(self, row: int, t: FloatArray, status: FloatArray, x: FloatArray) -> int:
        data, last = packed(t, status, x), row + len(t)
        self._connection.execute(
            "INSERT INTO batches VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
            (row + 1, last, t.min(), t.max(), self._hour, self._run, self._layout, zlib.crc32(data), data),
        )
        return last

    def _insert_state(self, name: str, data: bytes, row: int, time: float) -> None:
        self._connection.execute(
            "INSERT INTO states (name, time, row, sha256, data) VALUES (?, ?, ?, ?, ?)",
            (name, time, row, hashlib.sha256(data).hexdigest(), data),
        )
        self._connection.execute(
            "DELETE FROM states WHERE name = ? AND id NOT IN"
            " (SELECT id FROM states WHERE name = ? ORDER BY id DESC LIMIT ?)",
            (name, name, STATES),
        )

    def _clock_events(self, t: FloatArray) -> list[Event]:
        """The largest step back of the clock, where there is one."""
        steps = np.diff(t, prepend=self._last_time)
        i = int(np.argmin(steps)) if len(t) else 0
        if not len(t) or steps[i] >= -STEP_BACK:
            return []
        text = f"time goes back by {number(float(-steps[i]))} s, to {show_moment(t[i])}, at row {self._row + i + 1}"
        return [Event(EventKind.CLOCK, text, {"row": self._row + i + 1, "step": float(steps[i])}, float(t[i]))]

    def _refuse_unusable(self) -> None:
        if os.getpid() != self._pid:
            raise LiveError(f"{self.folder}: opened by process {self._pid}. Open it in the process that writes.")
        if not self._open:
            raise LiveError(f"{self.folder}: closed. Open it again.")


def stored_states(connection: sqlite3.Connection, name: str) -> Iterator[tuple[int, bool, SavedState]]:
    """States of a name, the newest first: identity, whether its bytes are those that were stored, and the state."""
    query = "SELECT row, time, data, sha256, id FROM states WHERE name = ? ORDER BY id DESC"
    for row, time, data, sha256, identity in connection.execute(query, (name,)).fetchall():
        yield identity, hashlib.sha256(data).hexdigest() == sha256, SavedState(row, time, data)


def _check_state(name: str, data: object) -> None:
    if not _STATE_NAME.fullmatch(name):
        raise LiveError(f"saved state {quote(name)}: a name is a letter, then letters, digits, ., _ and -, at most 64.")
    if not isinstance(data, bytes) or len(data) > LARGEST_STATE:
        raise LiveError(f"saved state {name}: give bytes, at most {LARGEST_STATE / 1e6:g} MB.")


def _writer(folder: Path) -> str:
    """Who writes a history, in words."""
    try:
        with contextlib.closing(connect(folder)) as connection:
            (text,) = connection.execute("SELECT value FROM facts WHERE name = 'writer'").fetchone()
        at = json.loads(text)
        return f"process {at['process']} on {at['host']} writes it since {show_moment(at['since'])}"
    except (LiveError, sqlite3.Error, TypeError, KeyError, ValueError):
        return "another process writes it"
