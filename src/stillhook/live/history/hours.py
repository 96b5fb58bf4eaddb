"""Full hours as Parquet files, each named by the journal with its SHA-256, and by the manifest of their folder, which
is signed where the user has a key: what is written on is the journal's alone.

A file is complete and on the disk before the transaction that names it and deletes its rows from the journal. Killed
before that transaction, the file counts for nothing and is written again; after it, the rows are in the file alone.
"""

from __future__ import annotations

import json
import logging
import sqlite3
from collections.abc import Mapping, Sequence
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import durable_file
from stillhook.base.extras import need
from stillhook.base.variable import Variable
from stillhook.errors import LiveError, SimulationError
from stillhook.formats.table.parquet import open_duckdb, sql_text
from stillhook.live.history.budget import release_pages, remove_oldest
from stillhook.live.history.columns import ROW, STATUS, TIME, from_text, heading
from stillhook.live.history.events import Event, EventKind, add_events
from stillhook.live.history.journal import (
    ARCHIVE_LOCK,
    HOURS,
    JOURNAL,
    VERSION,
    connect,
    in_one_line,
    lock,
    transaction,
    unpacked,
)
from stillhook.trust.manifest import NAME, Part
from stillhook.trust.results import add_parts

LOG = logging.getLogger("stillhook")
HOUR = 3600
MEMORY = "1GB"
"""That DuckDB may take in an archiver."""


class HourRows(NamedTuple):
    """Rows of one run out of the journal: rows (n,), and time, status and values (2 + columns, n); lines on batches
    that are damaged and left out."""

    first: int
    last: int
    columns: tuple[Variable, ...]
    rows: FloatArray
    numbers: FloatArray
    damaged: tuple[tuple[int, int], ...]


def archive(folder: str | Path) -> list[Path]:
    """Move full hours out of the journal into Parquet files, and keep the folder within its budget.

    The writer may continue meanwhile, in another process or in this one. Call it about once an hour, best in a process
    of its own: it takes some seconds, and memory for one file.

    Parameters
    ----------
    folder : str or Path
        Folder of a history.

    Returns
    -------
    list of Path
        Files that were written; the hour that is being written is not among them.

    Raises
    ------
    LiveError
        Where no history is there, another process archives it, DuckDB is missing, or the disk is full: then what was
        acknowledged is still in the journal.
    """
    place = Path(folder)
    need("duckdb", str(place), LiveError)
    with closing(connect(place)) as connection, in_one_line(place / JOURNAL):
        held = lock(place, ARCHIVE_LOCK)
        if held is None:
            raise LiveError(f"{place}: another process archives it. Wait until it is done.")
        with closing(held):
            _remove_leftovers(connection, place)
            written: dict[Path, Part] = {}
            full = "SELECT DISTINCT run FROM batches WHERE run < (SELECT max(run) FROM batches) ORDER BY run"
            try:
                for (run,) in connection.execute(full).fetchall():
                    written |= _archive_run(connection, place, run)
            finally:
                removed = remove_oldest(connection, place)
                _enter(place / HOURS, written, removed)
            release_pages(connection)
    return [file for file in written if file.exists()]


def _enter(folder: Path, written: Mapping[Path, Part], removed: int) -> None:
    """Enter files that were written now into the manifest of their folder, and take out those that the budget removed.
    An hour is in the history without it: a line on standard error where it cannot be written."""
    parts = {file.name: part for file, part in written.items() if file.exists()}
    if not parts and not (removed and (folder / NAME).exists()):
        return
    try:
        add_parts(folder, "history", parts)
    except SimulationError as problem:
        LOG.warning(f"{folder}: its manifest is not of all its hours: {problem}")


def _remove_leftovers(connection: sqlite3.Connection, folder: Path) -> None:
    """Files of an archiver or of a removal that was killed; and an event for a file that is gone."""
    named = dict(connection.execute("SELECT file, first FROM hours WHERE removed = 0").fetchall())
    present = {path.name for path in (folder / HOURS).glob("*.parquet")}
    for name in present - named.keys():
        (folder / HOURS / name).unlink(missing_ok=True)
    for path in (folder / HOURS).glob(".*.parquet"):
        path.unlink(missing_ok=True)
    for name in sorted(named.keys() - present):
        with transaction(connection):
            connection.execute("UPDATE hours SET removed = 1 WHERE first = ?", (named[name],))
            add_events(connection, [Event(EventKind.DAMAGED, f"{HOURS}/{name} is gone")], 0)


def _archive_run(connection: sqlite3.Connection, folder: Path, run: int) -> dict[Path, Part]:
    """The file of a run and what it is, empty where nothing of it can be read."""
    batches = connection.execute(
        "SELECT first, last, crc, data FROM batches WHERE run = ? ORDER BY first", (run,)
    ).fetchall()
    t_min, t_max, hour, layout = connection.execute(
        "SELECT min(t_min), max(t_max), min(hour), min(layout) FROM batches WHERE run = ?", (run,)
    ).fetchone()
    (text,) = connection.execute("SELECT columns FROM layouts WHERE id = ?", (layout,)).fetchone()
    part = part_of(batches, from_text(text))
    del batches  # as large as what was made of them
    target = folder / HOURS / f"{datetime.fromtimestamp(hour * HOUR, UTC):%Y-%m-%dT%HZ}-{part.first:012d}.parquet"
    sound = len(part.rows) > 0
    written = _write(part, target) if sound else None
    stored = ("", 0, "") if written is None else (target.name, written.size, written.sha256)
    events = [
        Event(EventKind.DAMAGED, f"rows {first} to {last} are damaged in the journal: left out")
        for first, last in part.damaged
    ]
    with transaction(connection):
        connection.execute(
            "INSERT INTO hours VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
            (part.first, part.last, t_min, t_max, run, layout, *stored, int(not sound)),
        )
        connection.execute("DELETE FROM batches WHERE run = ?", (run,))
        add_events(connection, events, part.last)
    return {} if written is None else {target: written}


def part_of(batches: Sequence[tuple[int, int, int, bytes]], columns: tuple[Variable, ...]) -> HourRows:
    """Batches of equal columns, each with its first and last row, checksum and bytes, put together."""
    rows, numbers, damaged = [], [], []
    for first, last, crc, data in batches:
        batch = unpacked(data, last - first + 1, crc)
        if batch is None or len(batch) != 2 + len(columns):
            damaged.append((first, last))
        else:
            rows.append(np.arange(first, last + 1))
            numbers.append(batch)
    return HourRows(
        batches[0][0],
        batches[-1][1],
        columns,
        np.concatenate([np.empty(0, np.int64), *rows]),
        np.concatenate([np.empty((2 + len(columns), 0)), *numbers], axis=1),
        tuple(damaged),
    )


def table_of(part: HourRows) -> dict[str, Any]:
    """Columns by heading."""
    return {
        ROW: part.rows,
        TIME: part.numbers[0],
        STATUS: part.numbers[1].astype(np.int64),
        **{heading(column): part.numbers[2 + i] for i, column in enumerate(part.columns)},
    }


def _write(rows: HourRows, target: Path) -> Part:
    """Write a file, and wait for the disk. Returns what it is. Errors: LiveError."""
    import duckdb

    facts = json.dumps({"history": VERSION, "columns": [list(column) for column in rows.columns]})
    try:
        with durable_file(target) as file, closing(open_duckdb(threads=1, memory=MEMORY)) as connection:
            connection.register("part", table_of(rows))
            connection.execute(
                f"COPY (SELECT * FROM part) TO {sql_text(str(file))}"
                f" (FORMAT parquet, COMPRESSION zstd, USE_TMP_FILE false, KV_METADATA {{stillhook: {sql_text(facts)}}})"
            )
            return Part.of_file(file)
    except (duckdb.Error, SimulationError) as problem:
        reason = " ".join(str(problem).partition("{")[0].split())[:200].rstrip(".: ")
        raise LiveError(
            f"{target}: cannot be written ({reason}). Free some space: its rows stay in the journal."
        ) from None
