"""How much a history may be: the oldest hours go first, and each that goes is an event."""

from __future__ import annotations

import json
import math
import sqlite3
from pathlib import Path
from typing import NamedTuple

from stillhook.errors import LiveError
from stillhook.live.history.events import Event, EventKind, add_events
from stillhook.live.history.journal import HOURS, transaction
from stillhook.live.history.moments import show_moment

DAY = 86400.0
SLACK = 100_000_000
"""Free space that the journal's file keeps [bytes]."""


class Budget(NamedTuple):
    """What a history may hold at most, None without a bound: journal and files together [bytes]; days of data, counted
    as what files cover, so that a clock that jumps removes nothing; events."""

    bytes: int | None = 20_000_000_000
    days: float | None = None
    events: int = 1_000_000

    def check(self) -> None:
        """Errors: LiveError for a budget that nothing fits into."""
        for name, value in self._asdict().items():
            if value is not None and not (math.isfinite(value) and value > 0):
                raise LiveError(f"budget: {name} = {value}: give a number above 0, or None for no bound.")


def budget_of(connection: sqlite3.Connection) -> Budget:
    """The budget that the last writer stored; the usual one where it was killed before."""
    row = connection.execute("SELECT value FROM facts WHERE name = 'budget'").fetchone()
    return Budget() if row is None else Budget(**json.loads(row[0]))


def used_by_journal(connection: sqlite3.Connection) -> int:
    """Pages that hold something [bytes]; SQLite fills the others again."""
    size, count, free = (
        connection.execute(f"PRAGMA {name}").fetchone()[0] for name in ("page_size", "page_count", "freelist_count")
    )
    return int(size * (count - free))


class _Oldest(NamedTuple):
    """Rows that go next: those of a file, or of a run of the journal."""

    first: int
    last: int
    t_min: float
    t_max: float
    run: int
    layout: int
    file: str


def release_pages(connection: sqlite3.Connection) -> None:
    """Shorten the journal's file where more of it is free than two hours take: it was not archived for long."""
    size, free = (connection.execute(f"PRAGMA {name}").fetchone()[0] for name in ("page_size", "freelist_count"))
    if size * free > SLACK:
        connection.executescript(f"PRAGMA incremental_vacuum({free - SLACK // size})")  # execute frees one page alone
        connection.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchall()


def remove_oldest(connection: sqlite3.Connection, folder: Path) -> int:
    """Remove hours, oldest rows first, until the budget holds: files, then full hours of the journal where no file is
    left. The journal names a file no more before it is deleted. Gives the number of files."""
    budget, files = budget_of(connection), 0
    while (oldest := _oldest_beyond(connection, budget)) is not None:
        first, last = oldest.first, oldest.last
        with transaction(connection):
            if oldest.file:
                connection.execute("UPDATE hours SET removed = 1 WHERE first = ?", (first,))
            else:
                connection.execute("INSERT INTO hours VALUES (?, ?, ?, ?, ?, ?, ?, 0, '', 1)", oldest)
                connection.execute("DELETE FROM batches WHERE run = ?", (oldest.run,))
            text = f"rows {first} to {last}, {show_moment(oldest.t_min)} to {show_moment(oldest.t_max)}: removed, the"
            text += " history is at its budget"
            add_events(connection, [Event(EventKind.REMOVED, text, {"first": first, "last": last})], last)
        if oldest.file:
            (folder / HOURS / oldest.file).unlink(missing_ok=True)
            files += 1
    _remove_events(connection, budget.events)
    return files


def _oldest_beyond(connection: sqlite3.Connection, budget: Budget) -> _Oldest | None:
    """What has to go next; None where the budget holds, or nothing but the hour that is being written is left."""
    size, covered = connection.execute(
        "SELECT coalesce(sum(bytes), 0), coalesce(sum(t_max - t_min), 0.0) FROM hours WHERE removed = 0"
    ).fetchone()
    too_long = budget.days is not None and covered > budget.days * DAY
    too_large = budget.bytes is not None and size + used_by_journal(connection) > budget.bytes
    query = "SELECT first, last, t_min, t_max, run, layout, file FROM hours WHERE removed = 0 ORDER BY first LIMIT 1"
    row = connection.execute(query).fetchone() if too_long or too_large else None
    if row is None and too_large:
        query = (
            "SELECT min(first), max(last), min(t_min), max(t_max), run, min(layout), '' FROM batches"
            " WHERE run < (SELECT max(run) FROM batches) GROUP BY run ORDER BY run LIMIT 1"
        )
        row = connection.execute(query).fetchone()
    return None if row is None else _Oldest(*row)


def _remove_events(connection: sqlite3.Connection, most: int) -> None:
    (count, newest) = connection.execute("SELECT count(*), max(id) FROM events").fetchone()
    if count <= most:
        return
    with transaction(connection):
        last = newest - most + 1  # one place for the event that says so
        (gone,) = connection.execute("SELECT count(*) FROM events WHERE id <= ?", (last,)).fetchone()
        connection.execute("DELETE FROM events WHERE id <= ?", (last,))
        text = f"{gone} events, up to number {last}: removed, the history holds {most}"
        add_events(connection, [Event(EventKind.REMOVED, text, {"last": last, "count": gone})], 0)
