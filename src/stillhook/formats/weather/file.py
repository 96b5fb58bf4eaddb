"""Reads weather over time: tables of a spreadsheet, a hindcast or a forecast (CSV and its kin, gz too), NetCDF of one
place, files of NDBC.

Separators ; tab | , and blanks, decimal comma, comments (#), lines before the header, a row of units: see
`stillhook.formats.csv_table`; times: see `stillhook.formats.weather.times`; columns and units: see
`stillhook.formats.weather.columns`. Records must ascend in time, each time once; gaps are kept as gaps.

**Directions.** A file that does not say what its directions mean is read without them, and a note says so: `sense` must
be given. A heading such as wave_from_direction says it, a line "# wave direction: coming from, clockwise from north"
does, and NDBC's files do by their manual. Wind comes from where it is said to come from, as everywhere in meteorology,
unless the heading says "to".

Weather from NetCDF: hindcasts and forecasts of one place, as ERA5, NORA3 or a wave model give them (variables over
time).
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.errors import LogError, SeaError, WeatherError
from stillhook.formats.csv_table import COMMENTS, Dialect, csv_rows, dialect_of
from stillhook.formats.waves.ndbc.text import SHORT_FILL, is_ndbc, read_bytes, read_records
from stillhook.formats.waves.ndbc.text import numbers as ndbc_numbers
from stillhook.formats.waves.wavespectra import read_sea
from stillhook.formats.weather.columns import HEADINGS, SENSES, assembled, bare, columns, numbers
from stillhook.formats.weather.netcdf import is_netcdf, read_netcdf
from stillhook.formats.weather.times import ORDERS, read_times, stamped, step_of
from stillhook.library.catalogue import weather_file
from stillhook.library.toml.kinds import toml_instead
from stillhook.sea.spectra.directions import DirectionSense
from stillhook.sea.spectra.measured import SpectrumSeries
from stillhook.units import quote
from stillhook.weather.series import Weather

__all__ = ["SENSES", "read_weather"]

HEAD = 1 << 16
_TIMES = HEADINGS["times"]
_BLANK_IN_TIME = re.compile(rb"(\d) (\d{1,2}:\d\d)")


@dataclass(frozen=True)
class _Table:
    """Rows of a file as text, with the line of each; comments are its lines of remarks."""

    name: str
    dialect: Dialect
    rows: list[list[str]] = field(repr=False)
    lines: list[int] = field(repr=False)
    comments: tuple[str, ...]

    def column(self, place: int) -> list[str]:
        return [row[place] for row in self.rows]


def read_weather(
    source: str | os.PathLike[str],
    *,
    sense: DirectionSense | None = None,
    columns_as: Mapping[str, str] | None = None,
    time_column: str | None = None,
    date_order: str | None = None,
    step: float | None = None,
) -> Weather:
    """Weather of the library by name, or of a file.

    sense: what wave directions mean, needed where the file does not say; columns_as: name of `sea.weather.COLUMNS` ->
    heading of the file, with a unit in brackets if it has none; time_column: heading of the times; date_order: "mdy" or
    "dmy" where the file leaves it open; step [s]: what a record represents, where it is not the usual spacing. Errors:
    WeatherError of one line that names file and line.
    """
    path = weather_file(os.fspath(source))
    if line := toml_instead(path, "a table of weather"):
        raise WeatherError(line)
    if is_netcdf(path):
        return read_netcdf(path, sense=sense, columns_as=columns_as or {}, time_column=time_column, step=step)
    try:
        data = read_bytes(path)
        if is_ndbc(data[:HEAD].decode("latin-1")) and not _has_separators(data):
            return _read_ndbc(path, step)
    except SeaError as problem:
        raise WeatherError(_ours(str(problem))) from None
    if date_order is not None and date_order not in ORDERS:
        raise WeatherError(f"--date-order {quote(date_order)}: is not one of {', '.join(ORDERS)}.")
    table = _table(data, path.name)
    time, used, notes = _times(table, time_column, date_order)
    _ascending(time, table)
    headings = ["" if i in used else h for i, h in enumerate(table.dialect.headings)]
    recognised = columns(headings, table.dialect.units, columns_as or {}, path.name)
    if not recognised:
        have = ", ".join(quote(h) for h in headings if h)
        raise WeatherError(
            f"{path.name}: no column of weather among {have}. Name them: --column Hs=... --column wind=..."
        )
    read = [(c, *numbers(table.column(c.place), c, table.lines, table.dialect.decimal, path.name)) for c in recognised]
    values, more = assembled(read, table.comments, path.name, sense)
    unread = [h for i, h in enumerate(headings) if h and i not in {c.place for c in recognised}]
    notes = [*table.comments, *notes, *more, *([f"not read: {', '.join(unread)}"] if unread else [])]
    return Weather(time, values, step_of(time, step, path.name), path.name, tuple(notes))


def _ours(text: str) -> str:
    """A message of a reader of logs or spectra in the words of weather."""
    theirs_ours = (
        ("Give a log with", "Give a table with"),
        ("Export the log", "Export the table"),
        ("one file of waves", "one file of weather"),
        ("Give a text file of NDBC, plain or gz, or say what it is with --format", "Export the place as CSV"),
    )
    for theirs, ours in theirs_ours:
        text = text.replace(theirs, ours)
    return text


def _has_separators(data: bytes) -> bool:
    """Whether the line above the first row has a separator other than blanks."""
    above = b""
    for line in data[:HEAD].splitlines():
        if line.strip()[:1].isdigit():
            break
        above = line if line.strip() and not line.lstrip().startswith(COMMENTS) else above
    return any(sign in above for sign in (b",", b";", b"\t", b"|"))


def _table(data: bytes, name: str) -> _Table:
    head = data[:HEAD]
    if _has_separators(data):  # the blank within a time is none
        head = _BLANK_IN_TIME.sub(rb"\1T\2", head)
    try:
        dialect = dialect_of(head, name, len(data) <= HEAD)
        text = data.decode(dialect.encoding).removeprefix("\ufeff")
    except LogError as problem:
        raise WeatherError(_ours(str(problem))) from None
    except UnicodeDecodeError as problem:
        raise WeatherError(
            f"{name}: byte {problem.start} is no text in {dialect.encoding}. Save the table as CSV UTF-8."
        ) from None
    if not dialect.header_line:
        raise WeatherError(
            f"{name}: has no line of headings. Write one above the first row, such as time,Hs [m],Tp [s],wind [m/s]."
        )
    signs = tuple(c.decode() for c in COMMENTS)
    numbered = [(number, line) for number, line in enumerate(text.splitlines(), start=1) if line.strip()]
    remarks = [(number, line) for number, line in numbered if line.lstrip().startswith(signs)]
    comments = [line.lstrip("#/% \t").strip() for number, line in remarks if number != dialect.header_line]
    below = [row for row in numbered if row[0] >= dialect.first_line and not row[1].lstrip().startswith(signs)]
    rows, numbers_of_lines = csv_rows(name, below, dialect.separator, dialect.fields, WeatherError)
    return _Table(name, dialect, rows, numbers_of_lines.tolist(), tuple(c for c in comments if c))


def _times(
    table: _Table, time_column: str | None, order: str | None
) -> tuple[NDArray[np.datetime64], set[int], list[str]]:
    """Times of the rows, the columns that they are in, and a note on their zone."""
    names = [bare(h)[0] for h in table.dialect.headings]
    if time_column is not None:
        places = [i for i, h in enumerate(table.dialect.headings) if h.strip().lower() == time_column.strip().lower()]
        if len(places) != 1:
            raise WeatherError(
                f"{table.name}: --time {quote(time_column)}: no such column. It"
                f" has {', '.join(table.dialect.headings)}."
            )
    else:
        places = [i for i, n in enumerate(names) if n in _TIMES["stamp"]][:1]
    if not places and (parts := _parts(names)):
        return _from_parts(table, parts), set(parts), ["times taken as UTC"]
    if not places:
        have = ", ".join(map(quote, table.dialect.headings))
        raise WeatherError(f"{table.name}: no column of times among {have}. Name it: --time HEADING.")
    texts = table.column(places[0])
    clock = next((i for i, n in enumerate(names) if n in _TIMES["clock"] and i not in places), None)
    if clock is not None and ":" not in texts[0] and ":" in table.rows[0][clock]:
        texts = [f"{day} {hour}" for day, hour in zip(texts, table.column(clock), strict=True)]
        places = [places[0], clock]
    zoned = any(sign in texts[0][10:].upper() for sign in ("Z", "UTC", "GMT", "+", "-"))
    return (
        read_times(texts, table.lines, table.name, order),
        set(places),
        [] if zoned else ["times taken as UTC: the file names no zone"],
    )


def _parts(names: Sequence[str]) -> list[int]:
    """Places of the columns year, month, day, hour and, if there is one, minute; nothing where one of the first four is
    not there."""
    places = [next((i for i, n in enumerate(names) if n in part), -1) for part in _TIMES["parts"].values()]
    return [] if -1 in places[:4] else [p for p in places if p >= 0]


def _from_parts(table: _Table, parts: Sequence[int]) -> NDArray[np.datetime64]:
    texts = [" ".join(row[p] for p in parts) for row in table.rows]
    try:
        year, month, day, hour, *minute = (
            np.array([int(float(c)) for c in table.column(p)], dtype=np.int64) for p in parts
        )
    except ValueError:
        i = next(i for i, t in enumerate(texts) if not re.fullmatch(r"[0-9. ]+", t))
        raise WeatherError(
            f"{table.name}: line {table.lines[i]}: {quote(texts[i])} is not a date and hour. Correct it."
        ) from None
    year = np.where(year < 70, year + 2000, np.where(year < 100, year + 1900, year))
    second = hour * 3600 + (minute[0] * 60 if minute else 0)
    if np.any((second < 0) | (second > 86400)):
        i = int(np.flatnonzero((second < 0) | (second > 86400))[0])
        raise WeatherError(
            f"{table.name}: line {table.lines[i]}: {quote(texts[i])} is not a date and hour. Correct it."
        )
    return stamped(year, month, day, second, table.lines, table.name, texts)


def _ascending(time: NDArray[np.datetime64], table: _Table) -> None:
    """Refuse times that come twice or go back, with the lines."""
    wrong = np.flatnonzero(np.diff(time) <= np.timedelta64(0, "s"))
    if len(wrong) == 0:
        return
    i = int(wrong[0])
    stamp = np.datetime_as_string(time[i + 1], unit="m")
    if time[i] == time[i + 1]:
        raise WeatherError(
            f"{table.name}: line {table.lines[i + 1]}: the time {stamp} comes twice, first in line {table.lines[i]}."
            " Remove one of them; local time in autumn does this: export in UTC."
        )
    raise WeatherError(
        f"{table.name}: line {table.lines[i + 1]}: the time {stamp} is before that of line {table.lines[i]}. Sort the"
        " rows by time, oldest first; if day and month were taken for each other, say --date-order."
    )


_WIND = (("wind", ("WSPD",)), ("wind_from", ("WDIR", "WD")))


def _read_ndbc(path: Path, step: float | None = None) -> Weather:
    """Heights, periods, wave and wind directions (both coming from, by NDBC's manual) and wind speed. Errors: SeaError
    of one line."""
    sea = read_sea(path)
    periods = {name: np.where(T > 0.0, T, np.nan) for name, T in (("T_p", sea.T_p), ("T_m02", sea.T_m02))}  # 0: a calm
    values: dict[str, FloatArray] = {"H_m0": sea.H_m0, **periods}
    if isinstance(sea, SpectrumSeries):
        if sea.directional is not None:
            values["come_from"] = np.asarray(sea.come_from)
    else:
        values["come_from"] = sea.come_from
        values |= _wind(path)
    return Weather(sea.time, values, step_of(sea.time, step, sea.source), sea.source, sea.notes)


def _wind(path: Path) -> dict[str, FloatArray]:
    records = read_records(path)
    table = ndbc_numbers(records, slice(None), len(records.header))
    wind: dict[str, FloatArray] = {}
    for name, words in _WIND:
        for word in words:
            if word in records.header:
                x = table[:, records.header.index(word)]
                wind[name] = np.radians(x) if name == "wind_from" else np.where(x == SHORT_FILL, np.nan, x)
    return wind
