"""Weather as a table of Excel or CSV, with headings that `read_weather` reads again as the same series."""

from __future__ import annotations

import numpy as np

from stillhook.formats.table.workbook import Sheet
from stillhook.weather.series import Weather

HEADINGS = {
    "H_m0": "Hs [m]",
    "T_p": "Tp [s]",
    "T_m02": "Tz [s]",
    "come_from": "wave_from_direction [deg]",
    "wind": "wind_speed [m/s]",
    "wind_from": "wind_from_direction [deg]",
    "current": "current_speed [m/s]",
    "H_m0_wind_sea": "Hs_wind_sea [m]",
    "T_p_wind_sea": "Tp_wind_sea [s]",
    "come_from_wind_sea": "wind_sea_from_direction [deg]",
    "H_m0_swell": "Hs_swell [m]",
    "T_p_swell": "Tp_swell [s]",
    "come_from_swell": "swell_from_direction [deg]",
}
"""Heading of each column of `stillhook.weather.series.COLUMNS`."""
DIGITS = 6
"""Decimals that are written."""


def weather_sheet(weather: Weather) -> Sheet:
    """A row for each record: time [UTC], heights [m], periods [s], directions from which waves and wind come [deg],
    speeds [m/s]; unknown values are empty."""
    names = [name for name in HEADINGS if name in weather.columns]
    angles = {name for name in names if "from" in name}
    columns = [np.degrees(weather.columns[n]) if n in angles else weather.columns[n] for n in names]
    stamps = weather.time.astype("datetime64[s]").tolist()
    values = np.round(np.column_stack(columns), DIGITS).tolist()
    rows = [(stamp, *row) for stamp, row in zip(stamps, values, strict=True)]
    return Sheet("weather", ("time_utc", *(HEADINGS[name] for name in names)), rows, weather.notes)
