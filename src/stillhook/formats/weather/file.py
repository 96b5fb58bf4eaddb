"""Reads weather over time: tables of a spreadsheet, a hindcast or a forecast (Excel; CSV and its kin, gz too), NetCDF
of one place, files of NDBC.

Separators ; tab | , and blanks, decimal comma, comments (#), lines before the header, a row of units: see
`stillhook.formats.table.dialect`; times: see `stillhook.formats.weather.times`; columns and units: see
`stillhook.formats.weather.columns`. Records must ascend in time, each time once; gaps are kept as gaps.

**Directions.** A file that does not say what its directions mean is read without them, and a note says so: `sense` must
be given. A heading such as wave_from_direction says it, a line "# wave direction: coming from, clockwise from north"
does, and NDBC's files do by their manual. Wind comes from where it is said to come from, as everywhere in meteorology,
unless the heading says "to".
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.base.gateway.access import refuse_foreign, unpacked
from stillhook.base.gateway.budget import RECORDS
from stillhook.base.gateway.guard import reader
from stillhook.errors import SeaError, WeatherError
from stillhook.formats.table.dialect import COMMENTS
from stillhook.formats.table.read import workbook_text
from stillhook.formats.table.text import HEAD, TextTable, find_table
from stillhook.formats.waves.ndbc import SHORT_FILL, is_ndbc, read_records
from stillhook.formats.waves.ndbc import numbers as ndbc_numbers
from stillhook.formats.waves.wavespectra import read_sea
from stillhook.formats.weather.columns import HEADINGS, SENSES, bare, numbers, weather_of
from stillhook.formats.weather.netcdf import is_netcdf, read_netcdf
from stillhook.formats.weather.times import (
    ORDERS,
    WHERE,
    Zone,
    calendar_of,
    counted,
    parse_zone,
    read_times,
    stamped,
    step_of,
    zone_in,
    zone_of_remarks,
)
from stillhook.library.catalogue import weather_file
from stillhook.library.toml.kinds import toml_instead
from stillhook.sea.spectra.directions import DirectionSense
from stillhook.sea.spectra.measured import SpectrumSeries
from stillhook.tables.sheet import ENDINGS, sheet_of
from stillhook.units import quote
from stillhook.weather.series import Weather

__all__ = ["SENSES", "read_weather"]

_TIMES = HEADINGS["times"]
_BLANK_IN_TIME = re.compile(rb"(\d) (\d{1,2}:\d\d)")
START = "Write one above the first row, such as time,Hs [m],Tp [s],wind [m/s]."


@reader(WeatherError)
def read_weather(
    source: str | os.PathLike[str],
    *,
    sense: DirectionSense | None = None,
    columns_as: Mapping[str, Any] | None = None,
    time_column: str | None = None,
    date_order: str | None = None,
    time_zone: str | None = None,
    step: float | None = None,
) -> Weather:
    """Weather of the library by name, or of a file.

    sense: what wave directions mean, needed where the file does not say; columns_as: name of `sea.weather.COLUMNS` ->
    heading of the file, with a unit in brackets if it has none; time_column: heading of the times; date_order: "mdy" or
    "dmy" where the file leaves it open; time_zone: that of the times, such as "UTC+3", where the file does not say;
    step [s]: what a record represents, where it is not the usual spacing.
    Errors: WeatherError of one line that names file and line.
    """
    path = weather_file(os.fspath(source))
    if line := toml_instead(path, "a table of weather"):
        raise WeatherError(line)
    if is_netcdf(path):
        zone = None if time_zone is None else parse_zone(time_zone, "time_zone")
        return read_netcdf(path, sense, columns_as or {}, time_column, zone, step)
    if sheet_of(path)[0].suffix.lower() in ENDINGS:
        data = workbook_text(path, WeatherError, START)
    else:
        data = unpacked(path, "file of weather", WeatherError, RECORDS)
        refuse_foreign(path.name, data[:HEAD], WeatherError, "Export the place as CSV.")
    in_blanks = not _has_separators(data[:HEAD])
    if in_blanks and is_ndbc(data[:HEAD].decode("latin-1")):
        try:
            return _read_ndbc(path, step)
        except SeaError as problem:
            raise WeatherError(str(problem)) from None
    if date_order is not None and date_order not in ORDERS:
        raise WeatherError(f"date_order = {quote(date_order)}: is not one of {', '.join(ORDERS)}.")
    head = data[:HEAD] if in_blanks else _BLANK_IN_TIME.sub(rb"\1T\2", data[:HEAD])  # a blank in a time is none
    table = find_table(path.name, data, WeatherError, "table", START, head)
    time, used, notes = _times(table, time_column, date_order, time_zone)
    _ascending(time, table)
    headings = ["" if i in used else h for i, h in enumerate(table.headings)]
    read = partial(numbers, table)
    more = {"comments": table.comments, "notes": notes}
    weather = weather_of(path.name, time, headings, table.units, read, columns_as or {}, sense, step, **more)
    stamps = " + ".join(table.headings[i] for i in sorted(used))
    return replace(weather, headings={"time": stamps, **weather.headings})


def _has_separators(head: bytes) -> bool:
    """Whether the line above the first row has a separator other than blanks."""
    above = b""
    for line in head.splitlines():
        if line.strip()[:1].isdigit():
            break
        above = line if line.strip() and not line.lstrip().startswith(COMMENTS) else above
    return any(sign in above for sign in (b",", b";", b"\t", b"|"))


def _times(
    table: TextTable, time_column: str | None, order: str | None, time_zone: str | None
) -> tuple[NDArray[np.datetime64], set[int], list[str]]:
    """Times of the rows [UTC], the columns that they are in, and notes on how they were read."""
    names = [bare(h)[0] for h in table.headings]
    if time_column is not None:
        places = [i for i, h in enumerate(table.headings) if h.strip().lower() == time_column.strip().lower()]
        if len(places) != 1:
            have = ", ".join(table.headings)
            raise WeatherError(f"{table.name}: time = {quote(time_column)}: no such column. It has {have}.")
    else:
        plain = [re.sub(r"_(utc|gmt|cet|cest)(_?\d{1,2})?$", "", n) for n in names]
        places = [i for i, n in enumerate(names) if {n, plain[i]} & set(_TIMES["stamp"])][:1]
    if not places and (parts := _parts(names)):
        zone, note = _zone(table, list(parts.values()), time_zone)
        return _from_parts(table, parts) - zone, set(parts.values()), [note]
    if not places:
        have = ", ".join(map(quote, table.headings))
        raise WeatherError(f"{table.name}: no column of times among {have}. Name it: time = HEADING {WHERE}.")
    texts = table.column(places[0])
    if (result := counted(texts)) is not None:
        time, how = result
        if how.endswith("since 1970"):
            return time, set(places), [f"times are {how} (UTC)"]
        zone, note = _zone(table, places, time_zone)
        return time - zone, set(places), [f"times are {how}", note]
    clock = next((i for i, n in enumerate(names) if n in _TIMES["clock"] and i not in places), None)
    if clock is not None and ":" not in texts[0] and ":" in table.rows[0][clock]:
        texts = [f"{day} {hour}" for day, hour in zip(texts, table.column(clock), strict=True)]
        places = [places[0], clock]
    time = read_times(texts, table.lines, table.name, order)
    signed = re.search(r"\d\s*(Z|[+-]\d{2}:?\d{2})$", texts[0])  # read with the stamps
    stamps = zone_in(texts[0][10:]) or (None if signed is None else Zone(0.0, signed[1]))
    zone, note = _zone(table, places, time_zone, stamps)
    return time - zone, set(places), [note] if note else []


def _zone(
    table: TextTable, places: Sequence[int], time_zone: str | None, stamps: Zone | None = None
) -> tuple[np.timedelta64, str]:
    """What the times of a table are ahead of UTC, and a note on it. The zone is in the stamps, which were read with
    it (nothing is ahead then), in the names or units of their columns, or in the remarks above; stated by the user
    where the file says nothing. Errors: WeatherError where file and user differ, and for local times."""
    headings, units = table.headings, table.units
    texts = [*(headings[i] for i in places), *(units[i] for i in places if i < len(units))]
    stated = next((zone for text in texts if (zone := zone_in(text)) is not None), None)
    stated = stated or zone_of_remarks(table.comments)
    requested = None if time_zone is None else parse_zone(time_zone, "time_zone")
    if stamps is not None:
        if requested is not None:
            raise WeatherError(f"{table.name}: its times name their zone, {stamps.text}. Leave time_zone out.")
        return np.timedelta64(0, "s"), ""
    if stated is not None and stated.ahead is None and requested is None:
        raise WeatherError(
            f"{table.name}: its times are {quote(stated.text)}, and the file does not say how far that is from UTC. Say"
            ' it: time_zone = "UTC+1"; local time with a change in spring and autumn must be exported in UTC.'
        )
    if stated is not None and requested is not None and stated.ahead not in (None, requested.ahead):
        both = f"the file says that its times are {stated.text}, time_zone says {quote(str(time_zone))}"
        raise WeatherError(f"{table.name}: {both}. Leave time_zone out, or correct the file.")
    zone = requested or stated
    if zone is None or zone.ahead is None:
        return np.timedelta64(0, "s"), "times taken as UTC: the file names no zone"
    if zone.ahead == 0.0:
        return np.timedelta64(0, "s"), "times are UTC" if requested is None else "times taken as UTC, as stated"
    whose = "stated" if requested is not None else f"the file says ({zone.text})"
    return np.timedelta64(round(zone.ahead * 3600.0), "s"), f"times moved by {-zone.ahead:+g} h to UTC, as {whose}"


def _parts(names: Sequence[str]) -> dict[str, int]:
    """Places of year, month, day, hour and minute, or of year, day of the year and hour; empty where one is missing."""
    result = {part: next((i for i, n in enumerate(names) if n in known), -1) for part, known in _TIMES["parts"].items()}
    of_year = result["day"] >= 0 and names[result["day"]] not in ("day", "dd")
    needed = ("year", "day", "hour") if of_year else ("year", "month", "day", "hour")
    if any(result[part] < 0 for part in needed):
        return {}
    return {part: place for part, place in result.items() if place >= 0 and not (of_year and part == "month")}


def _from_parts(table: TextTable, parts: Mapping[str, int]) -> NDArray[np.datetime64]:
    texts = [" ".join(row[p] for p in parts.values()) for row in table.rows]
    try:
        of = {part: np.array([int(float(c)) for c in table.column(p)], dtype=np.int64) for part, p in parts.items()}
    except ValueError:
        i = next(i for i, t in enumerate(texts) if not re.fullmatch(r"[0-9. ]+", t))
        raise WeatherError(f"{table.at(i)}: {quote(texts[i])} is not a date and hour. Correct it.") from None
    year = np.where(of["year"] < 70, of["year"] + 2000, np.where(of["year"] < 100, of["year"] + 1900, of["year"]))
    second = of["hour"] * 3600 + of.get("minute", np.zeros_like(year)) * 60
    if np.any((second < 0) | (second > 86400)):
        i = int(np.flatnonzero((second < 0) | (second > 86400))[0])
        raise WeatherError(f"{table.at(i)}: {quote(texts[i])} is not a date and hour. Correct it.")
    month, day = of.get("month"), of["day"]
    if month is None:
        dates = [calendar_of(int(y), int(d), table.at(i)) for i, (y, d) in enumerate(zip(year, day, strict=True))]
        month, day = (np.array([date[k] for date in dates], dtype=np.int64) for k in (0, 1))
    return stamped(year, month, day, second, table.lines, table.name, texts)


def _ascending(time: NDArray[np.datetime64], table: TextTable) -> None:
    """Refuse times that are repeated or go back, with the lines."""
    wrong = np.flatnonzero(np.diff(time) <= np.timedelta64(0, "s"))
    if len(wrong) == 0:
        return
    i = int(wrong[0])
    stamp = np.datetime_as_string(time[i + 1], unit="m")
    if time[i] == time[i + 1]:
        do = "Remove one of them; local time in autumn does this: export in UTC."
        raise WeatherError(f"{table.at(i + 1)}: the time {stamp} is given twice, first in line {table.lines[i]}. {do}")
    do = "Sort the rows by time, oldest first; if day and month were taken for each other, say date_order."
    raise WeatherError(f"{table.at(i + 1)}: the time {stamp} is before that of line {table.lines[i]}. {do}")


def _read_ndbc(path: Path, step: float | None = None) -> Weather:
    """Heights, periods, wave and wind directions (both coming from, by NDBC's manual) and wind speed."""
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
    table = dict(zip(records.header, ndbc_numbers(records, slice(None), len(records.header)).T, strict=True))
    wind: dict[str, FloatArray] = {}
    if (speed := table.get("WSPD")) is not None:
        wind["wind"] = np.where(speed == SHORT_FILL, np.nan, speed)
    if (degrees := table.get("WDIR", table.get("WD"))) is not None:
        wind["wind_from"] = np.radians(degrees)
    return wind
