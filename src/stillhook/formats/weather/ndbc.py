"""Weather from files of the US National Data Buoy Center: its standard meteorology with wind, and its spectra."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.formats.waves.ndbc.text import SHORT_FILL, numbers, read_records
from stillhook.formats.waves.wavespectra import read_sea
from stillhook.formats.weather.times import step_of
from stillhook.sea.spectra.measured import SpectrumSeries
from stillhook.weather.series import Weather

_WIND = (("wind", ("WSPD",)), ("wind_from", ("WDIR", "WD")))


def read_ndbc_weather(path: Path, step: float | None = None) -> Weather:
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
    table = numbers(records, slice(None), len(records.header))
    wind: dict[str, FloatArray] = {}
    for name, words in _WIND:
        for word in words:
            if word in records.header:
                x = table[:, records.header.index(word)]
                wind[name] = np.radians(x) if name == "wind_from" else np.where(x == SHORT_FILL, np.nan, x)
    return wind
