"""What a history has between two times, as of one moment: files that are as they were written, and rows of the journal.

Hours may be archived or removed while they are being read: the journal says which rows are in which file in one
snapshot, and a file that was removed after it needs a new one.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple

from stillhook.base.variable import Variable
from stillhook.errors import LiveError
from stillhook.live.history.columns import ROW, STATUS, TIME, from_text, heading
from stillhook.live.history.hours import part_of, table_of
from stillhook.live.history.journal import HOURS, JOURNAL, connect, in_one_line, snapshot
from stillhook.live.history.moments import show_moment
from stillhook.trust.manifest import Part
from stillhook.units import quote

MOST_IN_JOURNAL = 1_000_000_000
"""Bytes that are read from the journal, which takes twice as much memory."""
SHOWN = 20
"""Names that a message lists."""


class RemovedError(Exception):
    """A file was removed after the journal was read: read it again."""


class Selection(NamedTuple):
    """Files with the headings of columns that they have; rows of the journal by heading, a table for each set of
    columns; the wanted columns; number of rows; and a line on each part that is damaged and left out."""

    files: tuple[Path, ...]
    in_files: tuple[str, ...]
    journal: tuple[dict[str, Any], ...]
    columns: tuple[Variable, ...]
    rows: int
    left_out: tuple[str, ...]


def select(folder: Path, ends: tuple[float, float], signals: Sequence[str] | None) -> Selection:
    """What there is between two times [s since 1970]. signals: names, None for all. Errors: LiveError; RemovedError."""
    with closing(connect(folder)) as connection, in_one_line(folder / JOURNAL), snapshot(connection):
        within = "t_max >= ? AND t_min < ?"
        hours = connection.execute(
            f"SELECT file, bytes, sha256, first, last, layout FROM hours WHERE removed = 0 AND {within} ORDER BY first",
            ends,
        ).fetchall()
        (size,) = connection.execute(f"SELECT sum(length(data)) FROM batches WHERE {within}", ends).fetchone()
        if size is not None and size > MOST_IN_JOURNAL:
            raise LiveError(
                f"{folder}: {size / 1e9:.3g} GB of this range are not archived. Archive them, or choose a shorter"
                " range."
            )
        batches = connection.execute(
            f"SELECT layout, first, last, crc, data FROM batches WHERE {within} ORDER BY first", ends
        ).fetchall()
        layouts = {k: from_text(text) for k, text in connection.execute("SELECT id, columns FROM layouts").fetchall()}
        times = connection.execute(
            "SELECT min(t_min), max(t_max) FROM (SELECT t_min, t_max FROM batches UNION ALL"
            " SELECT t_min, t_max FROM hours WHERE removed = 0)"
        ).fetchone()
    if not hours and not batches:
        if times[0] is None:
            raise LiveError(f"{folder}: the history has no rows yet.")
        raise LiveError(
            f"{folder}: no rows in this range. There are rows from {show_moment(times[0])} to {show_moment(times[1])}."
        )
    used = dict.fromkeys([*(hour[5] for hour in hours), *(batch[0] for batch in batches)])
    columns = _wanted(folder, {c.name: c for layout in used for c in layouts[layout]}, signals)
    headings = {heading(column) for column in columns}
    files, in_files, journal, left_out, rows = [], set(), [], [], 0
    for file, size, sha256, first, last, layout in hours:
        if problem := damage(folder, file, size, sha256):
            left_out.append(f"rows {first} to {last}: {problem}: left out")
            continue
        files.append(folder / HOURS / file)
        in_files |= headings.intersection(map(heading, layouts[layout]))
        rows += last - first + 1
    for layout in dict.fromkeys(batch[0] for batch in batches):
        part = part_of([batch[1:] for batch in batches if batch[0] == layout], layouts[layout])
        left_out += [f"rows {first} to {last}: damaged in the journal: left out" for first, last in part.damaged]
        journal.append({name: x for name, x in table_of(part).items() if name in {ROW, TIME, STATUS, *headings}})
        rows += len(part.rows)
    return Selection(tuple(files), tuple(sorted(in_files)), tuple(journal), columns, rows, tuple(left_out))


def _wanted(folder: Path, there: dict[str, Variable], signals: Sequence[str] | None) -> tuple[Variable, ...]:
    names = list(there) if signals is None else list(dict.fromkeys(signals))
    if unknown := [name for name in names if name not in there]:
        shown = ", ".join(list(there)[:SHOWN]) + (" ..." if len(there) > SHOWN else "")
        raise LiveError(f"{folder}: {quote(unknown[0])} is not in this range. Choose from {shown}.")
    return tuple(there[name] for name in names)


_SOUND: dict[Path, tuple[int, int]] = {}
"""Files whose SHA-256 was right, with size and time of change, so that it is calculated once in a process."""


def damage(folder: Path, file: str, size: int, sha256: str, *, again: bool = False) -> str:
    """What is wrong with a Parquet file, in a few words; "" where it is as it was written.

    Parameters: size [bytes] and sha256 that it had; again: though it was right before. Errors: RemovedError.
    """
    path = (folder / HOURS / file).resolve()
    try:
        stat = path.stat()
        if stat.st_size != size:
            return f"{HOURS}/{file} has {stat.st_size} bytes in place of {size}"
        if again or _SOUND.get(path) != (size, stat.st_mtime_ns):
            if Part.of_file(path).sha256 != sha256:
                return f"{HOURS}/{file} has another SHA-256"
            _SOUND[path] = size, stat.st_mtime_ns
    except FileNotFoundError:
        refuse_removed(folder, file)
        return f"{HOURS}/{file} is gone"
    except OSError as problem:
        return f"{HOURS}/{file} cannot be read ({problem.strerror or problem})"
    return ""


def refuse_removed(folder: Path, file: str) -> None:
    """Errors: RemovedError where the history itself has removed a file."""
    with closing(connect(folder)) as connection, in_one_line(folder / JOURNAL):
        row = connection.execute("SELECT removed FROM hours WHERE file = ?", (file,)).fetchone()
    if row is not None and row[0]:
        raise RemovedError
