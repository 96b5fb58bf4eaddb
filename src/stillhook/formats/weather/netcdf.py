"""Weather from NetCDF: hindcasts and forecasts of one place, as ERA5, NORA3 or a wave model give them (variables over
time)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.gateway.access import first_bytes
from stillhook.errors import UnreadableError, WeatherError
from stillhook.formats.binary import MAGIC, read_dataset
from stillhook.formats.weather.columns import Column, in_si, weather_of
from stillhook.formats.weather.times import WHERE, Zone
from stillhook.sea.spectra.directions import DirectionSense
from stillhook.weather.series import Weather

if TYPE_CHECKING:
    import xarray

_TIMES = ("time", "valid_time", "datetime")


def is_netcdf(path: Path) -> bool:
    """Whether a file begins as NetCDF does."""
    return path.is_file() and first_bytes(path, 4, "file of weather", WeatherError)[1] in MAGIC


def read_netcdf(
    path: Path,
    sense: DirectionSense | None,
    columns_as: Mapping[str, Any],
    time_column: str | None,
    zone: Zone | None,
    step: float | None,
) -> Weather:
    """Weather of a NetCDF file that holds one place. Variables are known by name, or by standard name, which says what
    directions mean.

    Errors: WeatherError of one line for files of several places, times that do not ascend and numbers that no weather
    has.
    """
    try:
        data = read_dataset(path).squeeze()
    except UnreadableError as problem:
        raise WeatherError(f"{path.name}: cannot be read as NetCDF ({problem}). Fetch it again.") from None
    when = next((name for name in ((time_column,) if time_column else _TIMES) if name in data.variables), None)
    if when is None or not np.issubdtype(data[when].dtype, np.datetime64) or data[when].ndim != 1:
        have = ", ".join(map(str, data.variables))
        raise WeatherError(f"{path.name}: no series of times among {have}. Name it: time = NAME {WHERE}.")
    time = data[when].values.astype("datetime64[s]")
    if np.any(np.diff(time) <= np.timedelta64(0, "s")):
        i = int(np.flatnonzero(np.diff(time) <= np.timedelta64(0, "s"))[0]) + 1
        line = f"record {i}: the time {time[i]} is not after the one before. Sort the records, each time once."
        raise WeatherError(f"{path.name}: {line}")
    names = [str(name) for name in data.data_vars if data[name].dtype.kind in "fiu"]
    headings = [_heading(data, name, columns_as) for name in names]
    if zone is not None and zone.ahead:
        time = time - np.timedelta64(round(zone.ahead * 3600.0), "s")
        note = f"times moved by {-zone.ahead:+g} h to UTC, as stated"
    else:
        note = "times taken as UTC"
    return weather_of(
        path.name,
        time,
        headings,
        [str(data[name].attrs.get("units", "")) for name in names],
        lambda column, signed=False: _read(data, names[column.place], column, when, path.name, signed),
        columns_as,
        sense,
        step,
        names=names,
        notes=[note],
    )


STANDARD = ("sea_surface_wave_", "sea_surface_wind_wave_", "sea_surface_swell_wave_", "wind_")
"""Beginnings of standard names of waves, of wind sea and swell apart, and of the wind."""


def _heading(data: xarray.Dataset, name: str, columns_as: Mapping[str, Any]) -> str:
    """The name of a variable as it is requested, else its standard name where only it has a wave's or the wind's."""
    standard = str(data[name].attrs.get("standard_name", ""))
    alone = sum(str(v.attrs.get("standard_name", "")) == standard for v in data.data_vars.values()) == 1
    return standard if alone and name not in columns_as.values() and standard.startswith(STANDARD) else name


def _read(
    data: xarray.Dataset, name: str, column: Column, when: str, where: str, signed: bool
) -> tuple[FloatArray, str]:
    variable = data[name]
    if variable.dims != data[when].dims:
        other = ", ".join(f"{d} ({data.sizes[d]})" for d in variable.dims if d not in data[when].dims)
        raise WeatherError(
            f"{where}: {name} is over {other or 'no time'} as well. Cut out one place, over time alone, first."
        )
    x = np.array(variable.values, dtype=np.float64)
    return in_si(x, column, lambda i: f"{where}: record {i}", signed=signed)
