"""A description of a weather file: one TOML that names it and says what the file itself leaves open."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import Field, ValidationInfo, field_validator

from stillhook import units as u
from stillhook.base.choice import nearest
from stillhook.errors import WeatherError
from stillhook.formats.weather.columns import SENSES
from stillhook.formats.weather.file import read_weather
from stillhook.formats.weather.times import ORDERS
from stillhook.library.toml.file import TomlTable, read_toml_raising
from stillhook.library.toml.kinds import FileKind
from stillhook.tables.sheet import is_table
from stillhook.tables.table import Spec, Text
from stillhook.weather.limit_text import mapped
from stillhook.weather.series import Weather


class WeatherTable(Spec):
    """What is said of a weather file, here and in the table [weather] of a plan."""

    file: Text = Field(description="weather of the library, or the path of a file")
    sense: Text | None = Field(default=None, description="meaning of the file's directions")
    columns: Mapping[str, Any] = Field(default_factory=dict, description="names of the file's columns")
    time: Text | None = Field(default=None, description="column of the times")
    date_order: Text | None = Field(default=None, description="order of a date")
    time_zone: Text | None = Field(default=None, description="zone of the times where the file does not say")

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


def weather_of_file(name: str) -> Weather:
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

    Every line but the first may be left out. Errors: WeatherError of one line.
    """
    if not name.endswith(".toml"):
        return read_weather(name)
    return read_toml_raising(WeatherError, name, FileKind.WEATHER, _weather, start='Start it with file = "site.csv".')


def _weather(table: TomlTable) -> Weather:
    said = table.read(Description)
    neighbour = Path(table.path.parent, said.file)
    return read_weather(
        neighbour if is_table(neighbour) else said.file,
        sense=None if said.sense is None else SENSES[said.sense],
        columns_as=mapped(said.columns, "columns"),
        time_column=said.time,
        date_order=said.date_order,
        time_zone=said.time_zone,
        step=said.step,
    )
