"""Directional spectra of hindcasts and buoys by way of the library wavespectra (extra `sea`).

wavespectra gives densities in m^2/Hz/deg over directions that waves come from, clockwise from north, however the file
meant; here they become a `SpectrumSeries` with its shares of direction.

Opens a file of measured waves by its content.
"""

from __future__ import annotations

import os
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.gateway.guard import reader
from stillhook.errors import SeaError, UnreadableError
from stillhook.formats.binary import read_binary, refuse_bomb, refuse_other_files
from stillhook.formats.waves.buoys import companions, is_spectra, read_directional, read_spectra, read_states
from stillhook.formats.waves.ndbc import bands, read_records
from stillhook.formats.waves.netcdf import NATIVE, form_of, read_native
from stillhook.library.toml.kinds import toml_instead
from stillhook.sea.spectra.directions import FULL, Directional, DirectionSense, coming_from
from stillhook.sea.spectra.measured import SeaStates, SpectrumSeries
from stillhook.sea.spectra.parametric import HIGHEST
from stillhook.units import quote

if TYPE_CHECKING:
    import xarray


FORMATS = ("era5", "ww3", "swan", "ncswan", "ndbc", "spotter", "octopus", "triaxys", "wavespectra")
"""Formats that can be requested; wavespectra's reader of each is read_ and its name."""
EVEN = 1e-3
"""Part of their spacing by which directions may be off an even circle, and within which two directions are the same
one."""
PRINTED = 1e-2
"""Part of the largest density by which two printings of one direction may differ without a note."""


@reader(SeaError)
def read_wavespectra(path: str | os.PathLike[str], form: str, point: int | None = None) -> SpectrumSeries:
    """Spectra of a file in one of `FORMATS` at one point of it (from 0; may be left out where there is only one).

    Errors: SeaError of one line where wavespectra is not installed, cannot read the file, or the file holds no
    directional spectra.
    """
    file = Path(path)
    if form not in FORMATS:
        raise SeaError(f"--format {quote(form)}: is not one of {', '.join(FORMATS)}. Leave it out for files of NDBC.")
    if not file.exists():
        raise SeaError(f"{quote(str(file))}: no such file. Check the path.")
    notes: list[str] = []
    try:
        if form == NATIVE:
            data, notes = read_native(file)
        elif find_spec("wavespectra") is None:
            do = 'Install it: pip install "stillhook[sea]".'
            raise SeaError(f"{file.name}: reading {form} needs the library wavespectra. {do}")
        else:
            data = read_binary(_dataset, file, f"read_{form}")
    except UnreadableError as problem:
        raise SeaError(f"{file.name}: cannot be read as {form} ({problem}). Check the format.") from None
    series = from_wavespectra(data, file.name, point)
    return replace(series, notes=(*notes, *series.notes))


def _dataset(path: Path, reader: str) -> xarray.Dataset:
    """In the process that reads."""
    import h5py  # type: ignore[import-untyped]
    import wavespectra

    if h5py.is_hdf5(path):
        with h5py.File(path) as file:
            refuse_other_files(file)
    data: xarray.Dataset = getattr(wavespectra, reader)(str(path))
    refuse_bomb(path, data.nbytes)
    return data.load()


def from_wavespectra(data: xarray.Dataset, source: str = "wavespectra", point: int | None = None) -> SpectrumSeries:
    """The series of a Dataset of wavespectra (variable efth over time, freq and dir [m^2/Hz/deg]) at one of its points.

    A direction that is given twice, such as 0 and 360 deg, is one direction with the mean of both densities, which
    keeps the integral over the closed circle. A record with missing numbers is not valid. Errors: SeaError.
    """
    if "efth" not in data or not {"freq", "dir"} <= set(data["efth"].dims):
        raise SeaError(f"{source}: holds no directional spectra (efth over freq and dir). Give another file.")
    efth = data["efth"] if "time" in data["efth"].dims else data["efth"].expand_dims("time")
    if "time" not in efth.coords:
        raise SeaError(f"{source}: its spectra have no time. Give a file with times.")
    efth = _at(efth, source, point).transpose("time", "freq", "dir").sortby(["time", "freq"])
    f = efth["freq"].values.astype(np.float64)
    density = efth.values.astype(np.float64)
    if np.any(density < 0.0):
        count = int(np.sum(np.any(density < 0.0, axis=(1, 2))))
        raise SeaError(f"{source}: negative energy in {count} records. Correct the file.")
    theta = coming_from(np.radians(efth["dir"].values.astype(np.float64)), DirectionSense.FROM_NORTH)
    theta, density, notes = _each_once(theta, density)
    step = FULL / len(theta)
    if len(theta) < 4 or np.max(np.abs(np.diff(theta) - step)) > EVEN * step:
        problem = f"{len(theta)} directions that are not even over the full circle"
        raise SeaError(f"{source}: {problem}. Give the complete directional spectrum.")
    if len(f) > 2 and f[0] == 0.0 and not np.any(density[:, 0] > 0.0):  # an empty row at 0 Hz, as TRIAXYS writes it
        f, density = f[1:], density[:, 1:]
    return _series(source, f, theta, density * np.degrees(step), efth["time"].values.astype("datetime64[s]"), notes)


def _each_once(theta: FloatArray, density: FloatArray) -> tuple[FloatArray, FloatArray, list[str]]:
    """Directions (k,) ascending within the circle, each once, their densities (n, m, k), and a note on doubles."""
    order = np.argsort(theta, kind="stable")
    theta, density = theta[order], density[..., order]
    near = EVEN * FULL / max(len(theta), 1)
    if len(theta) > 1 and theta[-1] > theta[0] + FULL - near:  # just below the full circle: the same as just above 0
        closing = theta > theta[0] + FULL - near
        theta = np.roll(np.where(closing, theta - FULL, theta), closing.sum())
        density = np.roll(density, closing.sum(), axis=2)
    first = np.flatnonzero(np.concatenate(([True], np.diff(theta) > near)))
    if len(first) == len(theta):
        return theta, density, []
    count = np.diff(np.append(first, len(theta)))
    mean = np.add.reduceat(density, first, axis=2) / count
    apart = np.abs(density - np.repeat(mean, count, axis=2)).max(axis=(1, 2), initial=0.0, where=np.isfinite(density))
    unequal = int(np.sum(apart > PRINTED * density.max(axis=(1, 2), initial=0.0, where=np.isfinite(density))))
    several = f"{len(theta) - len(first)} of {len(theta)} directions repeat another (such as 0 and 360 deg)"
    differ = f", with the mean of densities that differ in {unequal} records" if unequal else ""
    return theta[first], mean, [f"{several}: each is counted once{differ}"]


def _at(efth: xarray.DataArray, source: str, point: int | None) -> xarray.DataArray:
    """The spectra of one point; time, freq and dir are left."""
    places = [d for d in efth.dims if d not in ("time", "freq", "dir")]
    if not places:
        return efth
    stacked = efth.stack(point=places)
    count = stacked.sizes["point"]
    if point is None and count > 1:
        raise SeaError(f"{source}: holds {count} points. Choose one with --point 0 to {count - 1}.")
    if point is not None and not 0 <= point < count:
        raise SeaError(f"{source}: --point {point}: is not between 0 and {count - 1}. Choose one of these.")
    return stacked.isel(point=point or 0, drop=True)


def _series(source: str, f: Any, theta: Any, E: Any, time: Any, notes: list[str]) -> SpectrumSeries:
    """E (n, m, k) is energy per sector [m^2/Hz]."""
    centre, width = bands(f, source)
    S = E.sum(axis=2)
    valid = np.isfinite(S).all(axis=1)
    H = 4.0 * np.sqrt(np.where(valid, S @ width, 0.0))
    if H.max(initial=0.0) > HIGHEST:
        raise SeaError(f"{source}: Hm0 of {H.max():.4g} m is higher than any sea ({HIGHEST:g} m). Check the format.")
    even = np.full_like(E, 1.0 / len(theta))
    share = np.divide(E, S[..., None], out=even, where=S[..., None] > 0.0)
    share[~valid] = np.nan
    notes = [*notes, *([f"{int((~valid).sum())} of {len(valid)} records are missing"] if not valid.all() else [])]
    S = np.where(valid[:, None], S, np.nan) / (2.0 * np.pi)
    directional = Directional(theta, share)
    return SpectrumSeries(2.0 * np.pi * centre, 2.0 * np.pi * width, S, time, valid, source, tuple(notes), directional)


@reader(SeaError)
def read_sea(
    path: str | os.PathLike[str], form: str | None = None, point: int | None = None
) -> SpectrumSeries | SeaStates:
    """Spectra where the file holds them, with directions if its four companions are next to it; else heights, periods
    and directions.

    Reads texts of NDBC (`stillhook.formats.waves.ndbc`) and the formats of `FORMATS`, at one point of the file; form:
    one of these, by default that which the content shows (`stillhook.formats.waves.netcdf.form_of`). Errors: SeaError
    of one line.
    """
    if line := toml_instead(path, "a file of measured waves"):
        raise SeaError(line)
    form = form_of(Path(path)) if form is None else form
    if form is not None:
        return read_wavespectra(path, form, point)
    if point is not None:
        raise SeaError("--point: leave it out for texts of NDBC, which hold one place.")
    files = companions(path)
    missing = [file.name for file in files if not file.exists()]
    if files and not missing:
        return read_directional(path)
    records = read_records(path)
    if not is_spectra(records.header):
        return read_states(records)
    series = read_spectra(records)
    if 0 < len(missing) < len(files):
        note = f"no directions: {' and '.join(missing)} are missing next to the others"
        series = replace(series, notes=(*series.notes, note))
    return series
