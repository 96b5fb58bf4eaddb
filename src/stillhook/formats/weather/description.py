"""A description of a weather file: one TOML that names it and says what the file itself leaves open."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

from pydantic import Field, ValidationInfo, field_validator

from stillhook import units as u
from stillhook.base.choice import nearest
from stillhook.base.gateway.named_files import named_path
from stillhook.errors import SpecError, WeatherError
from stillhook.formats.table.corrections import ColumnRow, row_of
from stillhook.formats.table.understood import ReadColumn, Understood, ends
from stillhook.formats.weather.columns import SENSES
from stillhook.formats.weather.file import read_weather
from stillhook.formats.weather.times import ORDERS
from stillhook.library.catalogue import weathers
from stillhook.library.toml.file import TomlTable, named, read_toml_raising
from stillhook.library.toml.kinds import FileKind
from stillhook.library.toml.tree import parsed, toml_text
from stillhook.library.write import toml_value
from stillhook.tables.table import Spec, Text
from stillhook.units import quote
from stillhook.weather.limit_text import KIND, NAMED, SPELT, mapped
from stillhook.weather.persistence import stamp
from stillhook.weather.series import Weather


class WeatherTable(Spec):
    """What is stated of a weather file, here and in the table [weather] of a plan."""

    file: Text = Field(description="weather of the library, or the path of a file")
    sense: Text | None = Field(default=None, description="meaning of the file's directions")
    columns: Mapping[str, Any] = Field(default_factory=dict, description="names of the file's columns")
    time: Text | None = Field(default=None, description="column of the times")
    date_order: Text | None = Field(default=None, description="order of a date")
    time_zone: Text | None = Field(default=None, description="zone of the times where the file does not say")

    def with_times(self) -> Self:
        """The same, with a row `time` of the columns as the column of the times."""
        if "time" not in self.columns:
            return self
        row = row_of(self.columns["time"], ColumnRow, "columns.time", WeatherError)
        columns = {name: heading for name, heading in self.columns.items() if name != "time"}
        return self.model_copy(update={"time": row.column, "columns": columns})

    @field_validator("sense", "date_order")
    @classmethod
    def _one_of(cls, value: str | None, info: ValidationInfo) -> str | None:
        allowed = tuple(SENSES) if info.field_name == "sense" else ORDERS
        if value is not None and value not in allowed:
            raise ValueError(f"is not one of {', '.join(allowed)}{nearest(value, allowed)}")
        return value


class Description(WeatherTable):
    """A description of a weather file."""

    step: u.Hours | None = Field(default=None, gt=0, description="what a record represents, if not the usual spacing")


class MappingFile(Description):
    """What a mapping file says of weather."""

    file: Text | None = Field(default=None, description="weather that it was written for")  # type: ignore[assignment]


def weather_of_file(
    name: str, mapping: str | os.PathLike[str] | None = None, columns: Mapping[str, Any] | None = None
) -> Weather:
    """Weather of the library, of a file, or as a description (TOML) says it::

        file = "site.csv"             # seen from this file
        sense = "coming-from"         # what wave directions mean: going-to, cartesian, cartesian-from
        time = "Date"                 # heading of the times
        date_order = "dmy"            # or mdy, ymd
        time_zone = "UTC+3"
        step = "1 h"                  # what a record represents
        [columns]
        Hs = "waveheight (cm)"        # heading of the file, with a unit if it has none
        wind = "ws (kn)"

    Every line but the first may be left out. mapping: the same, without the first line, for the file `name`; columns:
    rows of [columns] that win, "time" among them. Errors: WeatherError of one line.
    """
    file = name
    options: dict[str, Any] = {}
    if name.endswith(".toml"):
        file, stated = described(name)
        options = _options(stated)
    if mapping is not None:
        options |= _mapped(mapping)
    rows = dict(options.pop("columns", {})) | dict(columns or {})
    if "time" in rows:
        options["time_column"] = row_of(rows.pop("time"), ColumnRow, "columns.time", WeatherError).column
    return read_weather(file, columns_as=mapped(rows, "columns"), **options)


def described(path: str | Path) -> tuple[str, Description]:
    """The file that a description names, seen from it, and what it says. Errors: WeatherError, one line."""
    start = 'Start it with file = "site.csv".'
    description = read_toml_raising(
        WeatherError, path, FileKind.WEATHER, lambda table: table.read(Description), start=start
    )
    label = Path(path).name
    wrong = lambda why: WeatherError(f"{label}: file = {quote(description.file)}: {why}")
    neighbour = named_path(Path(path).parent, description.file, wrong)
    return description.file if description.file in weathers() else str(neighbour), description.with_times()


def _mapped(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Options of `read_weather` in a mapping file. Errors: WeatherError, one line."""
    file = Path(path)
    try:
        data = parsed(toml_text(file), file.name, FileKind.MAPPING, FileKind.WEATHER, start="Write [columns].")
    except SpecError as problem:
        raise WeatherError(str(problem)) from None
    return _options(named(TomlTable(file, data, WeatherError), lambda table: table.read(MappingFile)).with_times())


def _options(table: WeatherTable) -> dict[str, Any]:
    options = {
        "sense": None if table.sense is None else SENSES[table.sense],
        "time_column": table.time,
        "date_order": table.date_order,
        "time_zone": table.time_zone,
        "step": getattr(table, "step", None),
    }
    return {name: value for name, value in options.items() if value is not None} | {"columns": table.columns}


def understood_weather(
    name: str, mapping: str | os.PathLike[str] | None = None, columns: Mapping[str, Any] | None = None
) -> Understood:
    """What a file of weather holds. Errors: WeatherError, one line."""
    weather = weather_of_file(name, mapping, columns)
    stamps = weather.headings.get("time", "")
    rows = [ReadColumn("time", stamps, "", remark=_span(weather))] if stamps and " + " not in stamps else []
    for key, heading in weather.headings.items():
        if key == "time":
            continue
        low, high = ends(weather.columns[key]) if key in weather.columns else (math.nan, math.nan)
        remark = "" if key in weather.columns else "not read: say what directions mean by sense"
        rows.append(ReadColumn(WRITTEN.get(key, key), heading, "", 1, KIND[key], low, high, remark))
    unread = next((note for note in weather.notes if note.startswith("not read: ")), "not read: ")
    unused = tuple(h for h in unread.removeprefix("not read: ").split(", ") if h)
    notes = tuple(note for note in weather.notes if note is not unread)
    asked = any(row.remark.startswith("not read") for row in rows)
    senses = f'# sense = "coming-from"  # what directions mean: {", ".join(SENSES)}'
    head = (f"file = {toml_value(str(name))}", *([senses] if asked else []))
    return Understood(weather.source, "table of weather", tuple(rows), unused, notes, head, fixed=not weather.headings)


WRITTEN = {SPELT[name.lower()]: name for name in NAMED}
"""Names of columns as users write them."""


def _span(weather: Weather) -> str:
    first, last = (stamp(weather.time[i])[:10] for i in (0, -1))
    return f"{len(weather)} records every {weather.step / 3600:g} h, {first} to {last}"
