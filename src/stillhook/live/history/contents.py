"""What a history holds, in numbers and in lines, and whether its files are as they were written."""

from __future__ import annotations

from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from stillhook.errors import LiveError
from stillhook.live.history.budget import Budget, budget_of, used_by_journal
from stillhook.live.history.columns import from_text
from stillhook.live.history.journal import HOURS, JOURNAL, LOCK, connect, in_one_line, locked, snapshot
from stillhook.live.history.moments import show_moment
from stillhook.live.history.selection import RemovedError, damage
from stillhook.units import number


@dataclass(frozen=True)
class Overview:
    """What a history holds: times UTC [s since 1970], NaN where there are no rows; sizes [bytes]."""

    folder: str
    start: float
    end: float
    rows: int
    """Rows that are there."""
    first_row: int
    last_row: int
    """Numbers of the first row that is there and of the last one ever; 0 where there is none."""
    removed_rows: int
    """Rows that the budget has removed."""
    rows_in_journal: int
    files: int
    file_bytes: int
    journal_bytes: int
    events: int
    states: tuple[str, ...]
    """Names of saved states."""
    columns: tuple[str, ...]
    """Names of columns, those of the last writer first."""
    budget: Budget
    written: bool | None
    """Whether a process writes it now; None where one may not look."""

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {**asdict(self), "budget": self.budget._asdict()}


def overview(folder: str | Path) -> Overview:
    """What a history holds.

    Parameters
    ----------
    folder : str or Path
        Folder of the history; it may be written at the same time.

    Returns
    -------
    Overview
        Times, rows, sizes, names.

    Raises
    ------
    LiveError
        Where no history is there.
    """
    place = Path(folder)
    with closing(connect(place)) as c, in_one_line(place / JOURNAL), snapshot(c):
        there = "(SELECT first, last, t_min, t_max FROM batches UNION ALL"
        there += " SELECT first, last, t_min, t_max FROM hours WHERE removed = 0)"
        start, end, rows, first = c.execute(
            f"SELECT min(t_min), max(t_max), coalesce(sum(last - first + 1), 0), coalesce(min(first), 0) FROM {there}"
        ).fetchone()
        in_journal, last_in_journal = c.execute(
            "SELECT coalesce(sum(last - first + 1), 0), coalesce(max(last), 0) FROM batches"
        ).fetchone()
        files, size = c.execute("SELECT count(*), coalesce(sum(bytes), 0) FROM hours WHERE removed = 0").fetchone()
        removed, last = c.execute(
            "SELECT coalesce(sum(iif(removed, last - first + 1, 0)), 0), coalesce(max(last), 0) FROM hours"
        ).fetchone()
        (events,) = c.execute("SELECT count(*) FROM events").fetchone()
        states = tuple(name for (name,) in c.execute("SELECT DISTINCT name FROM states ORDER BY name").fetchall())
        layouts = [from_text(text) for (text,) in c.execute("SELECT columns FROM layouts ORDER BY id DESC").fetchall()]
        budget, used = budget_of(c), used_by_journal(c)
    return Overview(
        folder=str(place),
        start=float("nan") if start is None else start,
        end=float("nan") if end is None else end,
        rows=rows,
        first_row=first,
        last_row=max(last, last_in_journal),
        removed_rows=removed,
        rows_in_journal=in_journal,
        files=files,
        file_bytes=size,
        journal_bytes=used,
        events=events,
        states=states,
        columns=tuple(dict.fromkeys(column.name for layout in layouts for column in layout)),
        budget=budget,
        written=locked(place, LOCK),
    )


def check(folder: str | Path) -> list[str]:
    """A line on each file of a history that is not as it was written; every byte is read.

    Parameters
    ----------
    folder : str or Path
        Folder of the history.

    Returns
    -------
    list of str
        Lines, none where all files are sound.

    Raises
    ------
    LiveError
        Where no history is there, or its journal is damaged.
    """
    place, lines = Path(folder), []
    with closing(connect(place)) as connection, in_one_line(place / JOURNAL):
        (state,) = connection.execute("PRAGMA quick_check(1)").fetchone()
        if state != "ok":
            raise LiveError(f"{place / JOURNAL}: it is damaged ({state}). Move it away, and keep the files in {HOURS}.")
        hours = connection.execute(
            "SELECT first, last, file, bytes, sha256 FROM hours WHERE removed = 0 ORDER BY first"
        ).fetchall()
    for first, last, file, size, sha256 in hours:
        try:
            problem = damage(place, file, size, sha256, again=True)
        except RemovedError:
            continue
        if problem:
            lines.append(f"rows {first} to {last}: {problem}")
    return lines


def describe(of: Overview) -> list[str]:
    """An overview in lines for a reader.

    Parameters
    ----------
    of : Overview
        What a history holds.

    Returns
    -------
    list of str
        Lines.
    """
    shown = ", ".join(of.columns[:12]) + (f" and {len(of.columns) - 12} more" if len(of.columns) > 12 else "")
    bounds = [f"{number(of.budget.bytes / 1e9)} GB"] if of.budget.bytes is not None else []
    bounds += [f"{number(of.budget.days)} days of data"] if of.budget.days is not None else []
    now = {True: ", written now", False: ", not written now", None: ""}[of.written]
    span = f"{show_moment(of.start)} to {show_moment(of.end)}" if of.rows else "no rows yet"
    return [
        f"{of.folder}: {span}{now}",
        f"rows {of.first_row} to {of.last_row} ({of.rows}): {of.rows - of.rows_in_journal} in"
        f" {of.files} files ({number(of.file_bytes / 1e6)} MB), {of.rows_in_journal} in the journal"
        f" ({number(of.journal_bytes / 1e6)} MB)",
        f"budget: {' and '.join(bounds) or 'none'}, {of.budget.events} events; {of.removed_rows} rows removed",
        f"{of.events} events; {'saved states of ' + ', '.join(of.states) if of.states else 'no saved states'}",
        f"{len(of.columns)} columns: {shown}",
    ]
