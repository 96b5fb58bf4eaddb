"""Ship motion and crane-tip motion from CSV files whose header names columns and units.

`time [s],heave [m],roll [deg],pitch [deg]` or `time [s];tip [m]`. Columns in any order; others are left alone. Time is
in a unit of time, or `time [UTC]` with ISO 8601 stamps. Separators are comma, semicolon and tab; with the latter two
the decimal sign may be a comma. Lines that begin with # and blank lines do not count; a byte-order mark, CRLF and
quotes do no harm. Heave and tip count up, roll with port side up, pitch with bow up, unless `heave="down"` is said.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime

import numpy as np
import polars as pl
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.errors import MotionError, UnitError
from stillhook.formats.motion.ship_log import DEFAULT_MAX_GAP, HeaveSign, RawLog, finish, head_of, sign_of
from stillhook.sea.motion.recorded import Recorded
from stillhook.sea.vessel.ship_motion import ShipMotion, sea_worthy
from stillhook.units import KINDS, parse, quote

COLUMNS = {"time": "time", "heave": "length", "roll": "angle", "pitch": "angle", "tip": "length"}
EXAMPLES = {"time": "time [s]", "heave": "heave [m]", "roll": "roll [deg]", "pitch": "pitch [deg]", "tip": "tip [m]"}
EXAMPLE = '"time [s],heave [m],roll [deg],pitch [deg]" or "time [s],tip [m]"'
STAMPS = "UTC"  # the unit of a time column that holds ISO 8601 stamps
_PREAMBLE = re.compile(rb"(?:[ \t]*\n|#[^\n]*(?:\n|\Z))*")
Rows = NDArray[np.intp]
_HEADING = re.compile(r"([^\[\]]*?)\s*(?:\[([^\[\]]*)\])?")


@dataclass(frozen=True)
class _Table:
    """A CSV as text: where its header is, what it names, and its rows (blank ones included) as strings."""

    name: str
    header_line: int
    headings: tuple[str, ...]
    body_line: int
    """Line number of the first line of the body, which is the first line of data."""
    body: bytes
    separator: str
    rows: pl.DataFrame

    def line_of(self, row: int) -> int:
        """Line number in the file of a row: comments were passed over, blank lines were not."""
        passed = -1
        for number, line in enumerate(self.body.split(b"\n"), start=self.body_line):
            passed += not line.startswith(b"#")
            if passed == row:
                return number
        return self.header_line

    def column(self, name: str) -> int | None:
        matches = [i for i, heading in enumerate(self.headings) if _split(heading)[0] == name]
        if len(matches) > 1:
            raise MotionError(f'{self.name}: line {self.header_line}: {len(matches)} columns "{name}". Keep one.')
        return matches[0] if matches else None


def _split(heading: str) -> tuple[str, str | None]:
    """Name in lower case, and unit, of a heading such as `Heave [m]`."""
    match = _HEADING.fullmatch(heading)
    return (match[1].strip().lower(), match[2]) if match else (heading.lower(), None)


def _load(path: str | os.PathLike[str]) -> _Table:
    file, _ = head_of(path)
    table = _headed(file.name, file.read_bytes())
    if not table.body.strip():
        raise MotionError(f"{table.name}: has a header (line {table.header_line}) and no data below it.")
    schema = {f"c{i}": pl.String for i in range(len(table.headings))}
    try:
        rows = pl.read_csv(
            table.body, has_header=False, schema=schema, separator=table.separator, comment_prefix="#", quote_char=None
        )
    except (pl.exceptions.PolarsError, OSError) as problem:
        raise _ragged(table, problem) from None
    return replace(table, rows=rows)


def _headed(name: str, data: bytes) -> _Table:
    """The table with its header read and its rows not yet."""
    data = data.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    begin = _preamble(data, 0)
    end = data.find(b"\n", begin) % (len(data) + 1)
    below = _preamble(data, end + 1)
    line, header = data.count(b"\n", 0, begin) + 1, data[begin:end].strip()
    if not header:
        raise MotionError(f"{name}: has comments but no header. Begin with a line such as {EXAMPLE}.")
    try:
        text = header.decode("utf-8")
    except UnicodeDecodeError:
        raise MotionError(f"{name}: line {line}: is not UTF-8 text. Save the file as CSV UTF-8.") from None
    separator = next((sign for sign in (";", "\t", ",") if sign in text), ",")
    headings = tuple(heading.strip().strip('"').strip() for heading in text.split(separator))
    return _Table(name, line, headings, data.count(b"\n", 0, below) + 1, data[below:], separator, pl.DataFrame())


def _preamble(data: bytes, begin: int) -> int:
    """Where the blank lines and comments end that begin there."""
    match = _PREAMBLE.match(data, begin)
    return match.end() if match else begin


def _ragged(table: _Table, problem: Exception) -> MotionError:
    """What is wrong with a file that cannot be split into columns."""
    expected = len(table.headings)
    for number, line in enumerate(table.body.split(b"\n"), start=table.body_line):
        place = f"{table.name}: line {number}"
        try:
            fields = line.decode("utf-8").split(table.separator)
        except UnicodeDecodeError:
            return MotionError(f"{place}: is not UTF-8 text. Save the file as CSV UTF-8.")
        if line.strip() and not line.startswith(b"#") and len(fields) != expected:
            comma = (
                ' A decimal comma needs ";" between columns.'
                if table.separator == "," and len(fields) > expected
                else ""
            )
            return MotionError(
                f"{place}: {len(fields)} fields where the header has {expected}.{comma} Correct the line."
            )
    return MotionError(f"{table.name}: cannot be read as CSV ({quote(str(problem).splitlines()[0])}).")


def _numbers(table: _Table, index: int, kept_rows: Rows, kind: str) -> FloatArray:
    """A column in SI; `kept` holds the rows that are not blank."""
    name, unit = _split(table.headings[index])
    place = f"{table.name}: line {table.header_line}: column {quote(table.headings[index])}"
    text = table.rows.to_series(index).str.strip_chars(' \t"')[kept_rows]
    if name == "time" and unit == STAMPS:
        return _stamps(table, text, kept_rows)
    allowed = ", ".join((*KINDS[kind].allowed, *((STAMPS,) if name == "time" else ())))
    if unit is None:
        raise UnitError(f'{place} has no unit. Write it as "{EXAMPLES[name]}" (allowed: {allowed}).')
    if unit.strip() not in KINDS[kind].allowed:
        raise UnitError(f"{place}: unit {quote(unit)} is not one of {allowed}.")
    if table.separator != ",":
        text = text.str.replace(",", ".", literal=True)
    values = text.cast(pl.Float64, strict=False).to_numpy().astype(np.float64)
    _refuse(table, ~np.isfinite(values), text, kept_rows, name, "a finite number")
    return values * parse(f"1 {unit}", kind, place)


def _stamps(table: _Table, text: pl.Series, kept_rows: Rows) -> FloatArray:
    """ISO 8601 stamps as seconds since 1970; a stamp without a zone is UTC, as the header says."""

    def seconds(stamp: str | None) -> float:
        try:
            read = datetime.fromisoformat(stamp or "")
        except ValueError:
            return float("nan")
        return (read if read.tzinfo else read.replace(tzinfo=UTC)).timestamp()

    values = np.array([seconds(stamp) for stamp in text.to_list()])
    _refuse(table, np.isnan(values), text, kept_rows, "time", "an ISO 8601 stamp such as 2014-08-01T00:00:00.95Z")
    return values


def _refuse(table: _Table, bad: NDArray[np.bool_], text: pl.Series, kept_rows: Rows, name: str, expected: str) -> None:
    if not bad.any():
        return
    row = int(np.argmax(bad))
    more = f" ({int(bad.sum())} such values)" if bad.sum() > 1 else ""
    cut = " The file seems cut off there." if row == len(bad) - 1 else ""
    raise MotionError(
        f"{table.name}: line {table.line_of(int(kept_rows[row]))}: {name} = {quote(text[row] or '')} is not"
        f" {expected}{more}."
        f"{cut} Correct or remove the line."
    )


def _increasing(table: _Table, t: FloatArray, kept_rows: Rows) -> None:
    back = np.diff(t) <= 0.0
    if back.any():
        i = int(np.argmax(back))
        verb = "repeats" if t[i + 1] == t[i] else "runs back to"
        raise MotionError(
            f"{table.name}: line {table.line_of(int(kept_rows[i + 1]))}: time {verb} {t[i + 1]:.10g} s after"
            f" {t[i]:.10g} s "
            f"({int(back.sum())} in all). Times must increase: sort the lines and remove doubles."
        )


def _columns(table: _Table, names: tuple[str, ...]) -> tuple[dict[str, FloatArray | None], Callable[[int], int]]:
    """The named columns in SI (None where the file has none), and the line number of each sample."""
    blank = pl.all_horizontal(pl.all().is_null() | (pl.all().str.strip_chars() == ""))
    kept_rows = np.flatnonzero(~table.rows.select(blank).to_series().to_numpy())
    columns: dict[str, FloatArray | None] = {}
    for name in names:
        index = table.column(name)
        columns[name] = None if index is None else _numbers(table, index, kept_rows, COLUMNS[name])
        if columns[name] is None and name == "heave" and table.column("tip") is not None:
            raise MotionError(f"{table.name}: holds a column tip, so the motion of a crane tip. Read it without tip=.")
        if columns[name] is None and name in ("time", "heave", "tip"):
            present = ", ".join(quote(heading) for heading in table.headings)
            raise MotionError(
                f'{table.name}: line {table.header_line}: no column "{EXAMPLES[name]}" among {present}. Begin the '
                f"file with a header such as {EXAMPLE}."
            )
    time = columns["time"]
    assert time is not None  # refused above
    _increasing(table, time, kept_rows)
    return columns, lambda i: table.line_of(int(kept_rows[i]))


def _raw(table: _Table, height: str) -> RawLog:
    """Time and the column `height` (heave or tip), with roll and pitch next to heave."""
    columns, line_of = _columns(table, ("time", height, *(("roll", "pitch") if height == "heave" else ())))
    t, s = columns["time"], columns[height]
    assert t is not None  # refused in _columns
    assert s is not None
    unused = len(table.headings) - sum(c is not None for c in columns.values())
    counts = {"lines": len(t), "other columns": unused}
    return RawLog(
        source=table.name,
        form="CSV",
        time="file",
        t=t,
        heave=s,
        roll=columns.get("roll"),
        pitch=columns.get("pitch"),
        line_of=line_of,
        counts=counts,
        column=height,
    )


def read_ship_csv(
    path: str | os.PathLike[str],
    *,
    heave: HeaveSign = "up",
    max_gap: str = DEFAULT_MAX_GAP,
    start: str | None = None,
    duration: str | None = None,
) -> ShipMotion:
    """Ship motion from a CSV with time and heave, and roll and pitch where a crane tip off the sensor is needed.

    Parameters as `read_psxn` has them; heave counts up by default. Errors: MotionError or UnitError of one line with
    file, line and column for a missing column, a missing or unknown unit, a value that is not a number, times that
    do not increase, gaps longer than max_gap, a heave beyond 20 m or that never changes, angles beyond 45 deg.
    """
    table = _load(path)
    sign = sign_of(heave, table.name)
    return finish(_raw(table, "heave"), heave=sign, max_gap=max_gap, start=start, duration=duration)


def read_tip_csv(
    path: str | os.PathLike[str],
    *,
    max_gap: str = DEFAULT_MAX_GAP,
    start: str | None = None,
    duration: str | None = None,
    every: str | None = "0.5 s",
) -> Recorded:
    """Crane-tip motion from a CSV with time and tip, the height of the crane tip, positive up.

    Parameters and errors as in `read_ship_csv`; every as in `tip_motion`.
    """
    piece = finish(_raw(_load(path), "tip"), heave="up", max_gap=max_gap, start=start, duration=duration)
    motion = Recorded(piece.t, piece.heave, source=piece.report.source, report=piece.report.describe())
    return sea_worthy(motion, every)


def has_column(path: str | os.PathLike[str], name: str) -> bool:
    """Whether the header of a CSV names a column."""
    file, head = head_of(path)
    return _headed(file.name, head).column(name) is not None
