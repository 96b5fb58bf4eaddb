"""Directional spectra in NetCDF whose attributes say what directions and densities are, and the format of any file of
spectra, by its content.

Attributes that say nothing leave wavespectra's convention: m^2/Hz/deg over directions that waves come from, clockwise
from north; a note says so. What they say is used: directions that waves go to, densities for each radian, frequencies
in rad/s. Units that are not known are refused.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from stillhook.base.gateway.access import first_bytes
from stillhook.errors import SeaError, UnreadableError
from stillhook.formats.binary import MAGIC, read_dataset

if TYPE_CHECKING:
    import xarray

NATIVE = "wavespectra"
VARIABLES: tuple[tuple[frozenset[str], str], ...] = (
    (frozenset({"d2fd"}), "era5"),
    (frozenset({"spectral_wave_density"}), "ndbc"),
    (frozenset({"density", "frequency", "direction"}), "ncswan"),
    (frozenset({"efth", "station", "frequency", "direction"}), "ww3"),
    (frozenset({"efth", "freq", "dir"}), NATIVE),
    (frozenset({"efth"}), NATIVE),
)
"""Variables and dimensions of a NetCDF file that tell its format, the first that are all there."""
TEXTS: tuple[tuple[re.Pattern[bytes], str], ...] = (
    (re.compile(rb"\s*SWAN\s"), "swan"),
    (re.compile(rb"\s*TRIAXYS", re.IGNORECASE), "triaxys"),
    (re.compile(rb"[^\n]*\n\s*nfreqs?\s*,", re.IGNORECASE), "octopus"),
    (re.compile(rb"\s*\{.*\"(spotterId|frequencyData|varianceDensity)\"", re.DOTALL), "spotter"),
)
"""Beginnings of text files, and their format."""
HEAD = 4096
SPECTRUM = "sea_surface_wave_directional_variance_spectral_density"
NAMES: Mapping[str, tuple[str, ...]] = {
    "freq": ("freq", "frequency", "f", "wave_frequency"),
    "dir": ("dir", "direction", "directions", "theta", "wave_direction"),
}
PER_DEGREE = ("m2 s degree-1", "m2/hz/degree", "m2/hz/deg", "m2 s/deg", "m2 s deg-1", "m2/(hz deg)", "m2 hz-1 degree-1")
PER_RADIAN = ("m2 s rad-1", "m2/hz/rad", "m2 s/rad", "m2/(hz rad)", "m2 hz-1 rad-1", "m2 s radian-1", "m2/hz/radian")
_GOING_TO = re.compile(r"to_direction|\bgo(es|ing)?[ -]to\b|\btowards?\b|oceanographic", re.IGNORECASE)
_COMING_FROM = re.compile(r"from_direction|com(e|es|ing)[ -]from\b|meteorological|nautical", re.IGNORECASE)


def form_of(path: Path) -> str | None:
    """The format of a file of spectra by its content, None for NDBC's texts and others. Errors: SeaError."""
    if not path.is_file():
        return None
    try:
        _, head = first_bytes(path, HEAD, "file of spectra", SeaError)
        if head[:4] not in MAGIC:
            return next((form for pattern, form in TEXTS if pattern.match(head)), None)
        data = read_dataset(path)
    except UnreadableError as problem:
        raise SeaError(f"{path.name}: cannot be read as NetCDF ({problem}). Fetch it again.") from None
    there = {*map(str, data.variables), *map(str, data.dims)}
    for names, form in VARIABLES:
        if names <= there:
            return form
    if any(str(v.attrs.get("standard_name", "")) == SPECTRUM for v in data.data_vars.values()):
        return NATIVE
    have = ", ".join(map(str, data.data_vars))
    do = "Give a file with efth over freq and dir, or weather of one place to a command of weather."
    raise SeaError(f"{path.name}: no directional spectra among {have}. {do}")


def read_native(path: Path) -> tuple[xarray.Dataset, list[str]]:
    """A Dataset of efth [m^2/Hz/deg] over freq [Hz] and dir [deg that waves come from, clockwise from north], by the
    file's own attributes, and notes on what they say.

    Errors: SeaError for units that are not known and attributes that contradict each other; UnreadableError.
    """
    notes: list[str] = []
    data = read_dataset(path)
    spectra = [n for n, v in data.data_vars.items() if n == "efth" or v.attrs.get("standard_name") == SPECTRUM]
    renamed = {str(spectra[0]): "efth"} if spectra else {}
    for ours, theirs in NAMES.items():
        renamed |= dict.fromkeys([n for n in theirs if n in data.dims][:1], ours)
    data = data.rename({theirs: ours for theirs, ours in renamed.items() if theirs != ours})
    if "efth" not in data or not {"freq", "dir"} <= set(data["efth"].dims):
        return data, notes
    unit = _tidy(data["efth"].attrs.get("units", ""))
    if unit in PER_RADIAN:
        data = data.assign(efth=data["efth"] * math.pi / 180.0)
        notes.append("densities for each radian, as the file says")
    elif unit and unit not in PER_DEGREE:
        raise SeaError(f'{path.name}: efth in "{unit}" is not known. Convert it to m2 s degree-1 or m2 s rad-1.')
    data = _in_degrees(data, path.name, notes)
    return _in_hertz(data, path.name, notes), notes


def _tidy(unit: object) -> str:
    return " ".join(str(unit).lower().replace("^", "").replace("**", "").replace("·", " ").split())


def _in_degrees(data: xarray.Dataset, name: str, notes: list[str]) -> xarray.Dataset:
    """The directions in degrees, coming from."""
    attrs = data["dir"].attrs
    unit, said = _tidy(attrs.get("units", "")), " ".join(str(x) for x in attrs.values())
    degrees = np.asarray(data["dir"].values, dtype=np.float64)
    if unit.startswith("rad"):
        degrees = np.degrees(degrees)
    elif unit and not unit.startswith(("deg", "°")):
        raise SeaError(f'{name}: dir in "{unit}" is not known. Convert it to degrees.')
    if _GOING_TO.search(said) and _COMING_FROM.search(said):
        raise SeaError(f"{name}: dir is both going to and coming from by its attributes ({said}). Correct one of them.")
    if _GOING_TO.search(said):
        degrees = (degrees + 180.0) % 360.0
        notes.append("directions are those that waves go to, as the file says")
    elif not _COMING_FROM.search(said):
        notes.append("the file does not say what its directions mean: taken as those that waves come from")
    return data.assign_coords(dir=degrees).sortby("dir")


def _in_hertz(data: xarray.Dataset, name: str, notes: list[str]) -> xarray.Dataset:
    unit = _tidy(data["freq"].attrs.get("units", ""))
    if unit in ("rad/s", "rad s-1", "radian s-1"):
        notes.append("frequencies in rad/s, as the file says")
        scaled = data.assign(efth=data["efth"] * (2.0 * math.pi))
        return scaled.assign_coords(freq=np.asarray(data["freq"].values, dtype=np.float64) / (2.0 * math.pi))
    if unit and unit not in ("hz", "s-1", "1/s", "hertz"):
        raise SeaError(f'{name}: freq in "{unit}" is not known. Convert it to Hz.')
    return data
