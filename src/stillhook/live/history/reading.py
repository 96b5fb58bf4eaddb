"""A history as one table: Parquet files and journal together, read by DuckDB, as a Dataset in the schema of logs."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import atomic_file
from stillhook.base.extras import need
from stillhook.base.variable import Variable, flags
from stillhook.errors import LiveError
from stillhook.formats.out import of_run, write_table
from stillhook.formats.table.netcdf import write_netcdf
from stillhook.formats.table.parquet import open_duckdb, sql_file, sql_name
from stillhook.live.history.columns import ROW, STATUS, TIME, heading
from stillhook.live.history.journal import HOURS
from stillhook.live.history.moments import LATEST, moment, show_moment
from stillhook.live.history.selection import RemovedError, Selection, refuse_removed, select
from stillhook.units import parse, quote

if TYPE_CHECKING:
    import duckdb
    import xarray

Table = dict[str, NDArray[Any]]
MOST_NUMBERS = 100_000_000
"""That a Dataset may hold: 0.8 GB."""
MEMORY = "4GB"
"""That DuckDB may take while it reads."""
NONE = -1
"""Row and status of a time without rows."""
TRIES = 5
"""Times that a range is read again because hours in it were removed."""
THREADS = 2
INTERVAL = "interval"


class Pick(StrEnum):
    """What stands for an interval about a time: the row nearest to that time, as it was, or the mean, the least or the
    most of the numbers in it."""

    NEAREST = "nearest"
    MEAN = "mean"
    LEAST = "least"
    MOST = "most"


_SQL = {Pick.MEAN: "avg({0})", Pick.LEAST: "min({0})", Pick.MOST: "max({0})"}


def read(
    folder: str | Path,
    *,
    start: str | float | None = None,
    end: str | float | None = None,
    signals: Sequence[str] | None = None,
    every: str | None = None,
    pick: Pick = Pick.NEAREST,
) -> xarray.Dataset:
    """Rows of a history, out of Parquet files and journal as one table.

    Parameters
    ----------
    folder : str or Path
        Folder of the history; it may be written and archived at the same time.
    start, end : str or float, optional
        UTC as ISO 8601, or in seconds since 1970: rows from start on, and before end.
    signals : sequence of str, optional
        Names of columns; default all that there are.
    every : str, optional
        Evenly spaced, as metrics need it: an interval such as "1 s" about each time, counted from the first row.
        Without it the rows are as they were stored, in the order of their numbers.
    pick : Pick, default "nearest"
        What stands for an interval; NaN counts for nothing, and where there is no number the result is NaN.

    Returns
    -------
    Dataset
        Columns over "time" [s from the first row], with "utc", "row" (that one, or the first of an interval) and
        "status" (of an interval: all of them, bit by bit), both -1 where there are no rows; units and meanings in
        attributes, "start" in UTC [s since 1970], and "left_out": a line on each part that is damaged.

    Raises
    ------
    LiveError
        One line: no history, an unknown name or time, nothing in this range, more than fits into memory.
    UnitError
        For an interval without its unit.
    """
    place, pick = Path(folder), Pick(pick)
    need("duckdb", str(place), LiveError)
    width = None if every is None else parse(every, "time", "every")
    if width is not None and not width > 0.0:
        raise LiveError(f'every = {quote(every)}: give a time above 0, such as "1 s".')
    ends = moment(start, "start", 0.0), moment(end, "end", LATEST)
    if not ends[0] < ends[1]:
        raise LiveError(f"start = {quote(start)}, end = {quote(end)}: the end must come after the start.")
    for _ in range(TRIES):
        try:
            selection = select(place, ends, signals)
            table = _query(place, selection, ends, width, pick)
        except RemovedError:
            continue
        return _dataset(place, selection, table, width)
    raise LiveError(f"{place}: its hours are removed as fast as they are read. Read a later range.")


def _query(folder: Path, selection: Selection, ends: tuple[float, float], width: float | None, pick: Pick) -> Table:
    """Columns by heading, a row for each row of the history, or each interval that has some. Errors: LiveError;
    RemovedError."""
    import duckdb

    headings = [heading(column) for column in selection.columns]
    if width is None and selection.rows * (len(headings) + 3) > MOST_NUMBERS:
        raise LiveError(
            f"{folder}: {selection.rows} rows of {len(headings)} columns are more than fits into memory. Choose"
            " signals, a shorter range, or every."
        )
    try:
        with closing(open_duckdb(threads=THREADS, memory=MEMORY)) as connection:
            _view(connection, selection, headings, ends)
            query = f"SELECT {', '.join(map(sql_name, (ROW, TIME, STATUS, *headings)))} FROM within"
            if width is not None:
                query = _intervals(folder, connection, headings, width, pick)
            columns = connection.execute(query).fetchnumpy()
    except duckdb.Error as problem:
        for path in selection.files:
            if not path.exists():
                refuse_removed(folder, path.name)
        reason = " ".join(str(problem).split())[:200].rstrip(".")
        raise LiveError(f"{folder}: cannot be read ({reason}). Check the files in {HOURS}.") from None
    table = {name: np.asarray(np.ma.filled(x, np.nan if x.dtype.kind == "f" else NONE)) for name, x in columns.items()}
    order = np.argsort(table[ROW if width is None else INTERVAL], kind="stable")
    return {name: x[order] for name, x in table.items()}


def _view(
    connection: duckdb.DuckDBPyConnection, selection: Selection, headings: Sequence[str], ends: tuple[float, float]
) -> None:
    """A view `within` of all rows between two times: columns that a part lacks are NULL there."""
    blank = ", ".join(f"NULL::DOUBLE AS {sql_name(name)}" for name in (TIME, *headings))
    parts = [f"SELECT * FROM (SELECT NULL::BIGINT AS row, NULL::BIGINT AS status, {blank}) WHERE false"]
    if selection.files:
        names = ", ".join(map(sql_name, (ROW, TIME, STATUS, *selection.in_files)))
        files = ", ".join(sql_file(path) for path in selection.files)
        parts.append(f"SELECT {names} FROM read_parquet([{files}], union_by_name = true, hive_partitioning = false)")
    for i, table in enumerate(selection.journal):
        connection.register(f"journal_{i}", table)
        parts.append(f"SELECT * FROM journal_{i}")
    begin, end = (f"{at!r}::DOUBLE" for at in ends)
    connection.execute(
        f"CREATE TEMP VIEW within AS SELECT * FROM ({' UNION ALL BY NAME '.join(parts)})"
        f" WHERE {sql_name(TIME)} >= {begin} AND {sql_name(TIME)} < {end}"
    )


def _intervals(
    folder: Path, connection: duckdb.DuckDBPyConnection, headings: Sequence[str], width: float, pick: Pick
) -> str:
    """The query for intervals. Errors: LiveError for too many of them."""
    t = sql_name(TIME)
    first, last = connection.execute(f"SELECT min({t}), max({t}) FROM within").fetchall()[0]
    if first is None:
        return "SELECT *, 0 AS interval FROM within"
    if ((last - first) / width + 1.0) * (len(headings) + 3) > MOST_NUMBERS:
        raise LiveError(
            f"{folder}: {(last - first) / width:.3g} times of {len(headings)} columns are more than fits into memory."
            " Choose signals, a shorter range, or a longer every."
        )
    near = f"{{'far': abs({t} - {first!r}::DOUBLE - {INTERVAL} * {width!r}::DOUBLE), 'row': row}}"
    spaced = (
        f"(SELECT *, round(({t} - {first!r}::DOUBLE) / {width!r}::DOUBLE)::BIGINT AS {INTERVAL} FROM within) AS spaced"
    )
    if pick is Pick.NEAREST:
        nearest = f"SELECT {INTERVAL}, arg_min(row, {near}) AS row, bit_or(status) AS status FROM {spaced}"
        columns = ", ".join(f"within.{sql_name(name)}" for name in (ROW, TIME, *headings))
        return (
            f"SELECT of.{INTERVAL}, of.status, {columns} FROM within"
            f" JOIN ({nearest} GROUP BY {INTERVAL}) AS of ON within.row = of.row"
        )
    picked = [f"{_SQL[pick].format(sql_name(name))} AS {sql_name(name)}" for name in headings]
    columns = ", ".join((INTERVAL, f"min({t}) AS {t}", "min(row) AS row", "bit_or(status) AS status", *picked))
    return f"SELECT {columns} FROM {spaced} GROUP BY {INTERVAL}"


def _dataset(folder: Path, selection: Selection, table: Table, width: float | None) -> xarray.Dataset:
    import xarray

    at: FloatArray = table[TIME]
    if not len(at):
        left_out = "".join(f" {line}." for line in selection.left_out[:1])
        raise LiveError(f"{folder}: no rows in this range.{left_out} Choose another.")
    start = float(at[0] if width is None else at.min())
    t: FloatArray = at - start
    columns = table
    if width is not None:
        t = width * np.arange(int(table[INTERVAL][-1]) + 1, dtype=np.float64)
        columns = {name: _spread(x, table[INTERVAL], len(t)) for name, x in table.items()}
    of = {"units": "1"}
    data: dict[str, Any] = {
        column.name: ("time", columns[heading(column)], _attributes(column)) for column in selection.columns
    }
    data[ROW] = "time", columns[ROW], {**of, "long_name": "number of the row, which only rises"}
    data[STATUS] = "time", columns[STATUS], {**of, "long_name": "status of the row, 0 for good"}
    utc = np.datetime64(0, "s") + np.round((t + start) * 1e9).astype("timedelta64[ns]")
    facts = {"title": f"history {folder.name}", "start": start, "start_utc": show_moment(start)}
    return xarray.Dataset(
        data,
        coords={"time": ("time", t, {"units": "s", "long_name": "time from the first row"}), "utc": ("time", utc)},
        attrs={**facts, "left_out": "\n".join(selection.left_out)},
    )


def _spread(x: NDArray[Any], at: NDArray[Any], n: int) -> NDArray[Any]:
    """Values at their places among n, nothing at the others."""
    spread = np.full(n, np.nan if x.dtype.kind == "f" else NONE, dtype=x.dtype)
    spread[at] = x
    return spread


def _attributes(column: Variable) -> dict[str, Any]:
    facts = {"units": column.unit, "long_name": column.meaning, "sign": column.sign, "source": column.source}
    return {**{name: text for name, text in facts.items() if text}, **flags(column.meaning)}


def save(run: xarray.Dataset, file: str | Path) -> Path:
    """Write what `read` gave: .nc as it is; .csv, .parquet, .mat, .mf4 as a table that `read_log` takes, its time in
    UTC [s since 1970].

    Parameters
    ----------
    run : Dataset
        What `read` gave.
    file : str or Path
        It appears under its name when it is complete; its suffix says the format.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ConvertError
        For another suffix, or where the library of a format is missing.
    SimulationError
        Where the file cannot be written.
    """
    target = Path(file)
    if target.suffix.lower() == ".nc":
        with atomic_file(target) as part:
            write_netcdf(part, {"": run}, packed="")
        return target
    return write_table(of_run(run.assign_coords(time=run["time"] + run.attrs["start"])), target)
