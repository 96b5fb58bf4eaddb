"""Headings of a weather file that a user names: "Hs" = "my height (cm)"."""

from __future__ import annotations

from collections.abc import Mapping

from stillhook.base.nearest import nearest
from stillhook.errors import WeatherError
from stillhook.units import quote
from stillhook.weather.limit_text import BETA, SPELT

NAMED = ("Hs", "Tp", "Tz", "wind", "come_from", "wind_from", "current")


def mapped(headings: Mapping[str, str], where: str) -> dict[str, str]:
    """Names as users write them -> headings, as `stillhook.formats.weather.file.read_weather` wants them. Errors:
    WeatherError."""
    columns = {}
    for name, heading in headings.items():
        key = SPELT.get(name.strip().lower())
        if key is None or key == BETA:
            raise WeatherError(f"{where} {quote(name)}: is not one of {', '.join(NAMED)}{nearest(name, NAMED)}")
        if not isinstance(heading, str) or not heading.strip():
            raise WeatherError(
                f"{where} {name} = {quote(heading)}: write a heading of the file, with its unit in brackets if it has"
                " none."
            )
        columns[key] = heading.strip()
    return columns
