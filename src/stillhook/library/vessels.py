"""Vessels of the library: motion transfer functions of two ships of our own design, computed by hulls/make.py."""

from __future__ import annotations

import functools
from pathlib import Path

from stillhook.base.nearest import nearest
from stillhook.errors import SeaError
from stillhook.units import quote

_VESSEL_FOLDER = Path(__file__).resolve().parent / "data" / "vessels"


@functools.cache
def vessels() -> tuple[str, ...]:
    """Names of the library's vessels."""
    return tuple(sorted(file.stem for file in _VESSEL_FOLDER.glob("*.csv")))


def vessel_file(name: str) -> Path:
    """The file of a library vessel, for `stillhook.formats.vessel.open.read_vessel`.

    Errors: SeaError of one line that names the vessels there are.
    """
    if name not in vessels():
        raise SeaError(f"No vessel {quote(name)}: the library has {', '.join(vessels())}{nearest(name, vessels())}")
    return _VESSEL_FOLDER / f"{name}.csv"
