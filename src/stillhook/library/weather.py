"""Weather of the library: synthetic hindcasts of our own, made by weather_data/make.py. No place on earth has them."""

from __future__ import annotations

import functools
from os.path import isfile
from pathlib import Path

from stillhook.base.nearest import nearest
from stillhook.errors import WeatherError
from stillhook.units import quote

_WEATHER_FOLDER = Path(__file__).resolve().parent / "data" / "weather"
_END = ".csv.gz"


@functools.cache
def weathers() -> tuple[str, ...]:
    """Names of the library's weather."""
    return tuple(sorted(file.name.removesuffix(_END) for file in _WEATHER_FOLDER.glob(f"*{_END}")))


def weather_file(name_or_path: str) -> Path:
    """The file of library weather, or a path of one's own as it is.

    Errors: WeatherError of one line that names what there is, for what is neither a name nor a file.
    """
    if name_or_path in weathers():
        return _WEATHER_FOLDER / f"{name_or_path}{_END}"
    path = Path(name_or_path)
    if not isfile(path):
        raise WeatherError(
            f"{quote(name_or_path)}: no such file, and no weather of the library, which has"
            f" {', '.join(weathers()) or 'none'}{nearest(name_or_path, weathers())}"
        )
    return path
