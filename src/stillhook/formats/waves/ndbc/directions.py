"""Directional spectra of NDBC: the file of densities and its four companions.

Historical: 46042w2019.txt with d (alpha1), i (alpha2), j (r1) and k (r2) in place of w; real-time: 46042.data_spec with
.swdir, .swdir2, .swr1 and .swr2. alpha1 and alpha2 are where waves come from, clockwise from true north [deg]; r1 and
r2 are the lengths of the first two Fourier coefficients, in hundredths in the historical files.
"""

from __future__ import annotations

import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.errors import SeaError
from stillhook.formats.waves.ndbc.spectra import read_spectra, spread_out
from stillhook.formats.waves.ndbc.text import bands, read_records
from stillhook.sea.spectra.directions import Coefficients, DirectionSense, coming_from
from stillhook.sea.spectra.measured import SpectrumSeries

_PARTS = ("alpha1", "alpha2", "r1", "r2")
_LETTERS, _ENDINGS = ("d", "i", "j", "k"), (".swdir", ".swdir2", ".swr1", ".swr2")
_HISTORICAL = re.compile(r"^([0-9A-Za-z]{5})w([0-9]+\.txt(?:\.gz)?)$")


def companions(path: str | os.PathLike[str]) -> tuple[Path, ...]:
    """Where the four companions of a file of densities are: alpha1, alpha2, r1, r2. Errors: SeaError where NDBC names
    no file so."""
    file = Path(path)
    if named := _HISTORICAL.match(file.name):
        return tuple(file.with_name(f"{named[1]}{letter}{named[2]}") for letter in _LETTERS)
    if file.suffix == ".data_spec":
        return tuple(file.with_suffix(ending) for ending in _ENDINGS)
    raise SeaError(
        f"{file.name}: its companions are unknown. Name it as NDBC does: 46042w2019.txt, 46042w2019.txt.gz or"
        " 46042.data_spec."
    )


def has_companions(path: str | os.PathLike[str]) -> bool:
    """Whether all four companions are next to a file."""
    return missing_companions(path) == ()


def missing_companions(path: str | os.PathLike[str]) -> tuple[str, ...] | None:
    """Names of the companions that are not next to a file; None where NDBC names none so."""
    try:
        return tuple(file.name for file in companions(path) if not file.exists())
    except SeaError:
        return None


def read_directional(path: str | os.PathLike[str]) -> SpectrumSeries:
    """The spectra of an NDBC file with their directions from its four companions, shared out over 36 sectors by the
    maximum-entropy method.

    Records are those of the density file; where a record or band has no directions, those of the nearest band of the
    record that has them are taken and reported; a record without any is not valid. Errors: SeaError of one line for
    a file that lacks a companion or does not fit.
    """
    series = read_spectra(path)
    alpha_1, alpha_2, r_1, r_2 = (
        _part(file, name, series) for file, name in zip(companions(path), _PARTS, strict=True)
    )
    theta_1, theta_2 = (coming_from(np.radians(alpha), DirectionSense.FROM_NORTH) for alpha in (alpha_1, alpha_2))
    first = np.asarray(r_1 * np.exp(1j * theta_1), dtype=np.complex128)
    second = np.asarray(r_2 * np.exp(2j * theta_2), dtype=np.complex128)
    measured = np.isfinite(first) & np.isfinite(second)
    valid = series.valid & measured.any(axis=1)
    filled = _fill(first, second, measured, series, valid)
    notes = list(series.notes)
    if without := series.n_valid - int(np.count_nonzero(valid)):
        notes.append(f"{without} records have no directions")
    if filled:
        notes.append(f"{filled} bands with waves have no direction: that of the nearest band was taken")
    S = np.where(valid[:, None], series.S, np.nan)
    return replace(series, S=S, valid=valid, notes=tuple(notes), directional=Coefficients(first, second))


def _part(file: Path, name: str, series: SpectrumSeries) -> FloatArray:
    """One companion at the times and bands of the series (n, m), NaN where unknown."""
    if not file.exists():
        raise SeaError(
            f"{file.name}: missing next to {series.source}: it holds {name}. Put it there, or read heights and periods"
            " only."
        )
    records = read_records(file)
    f, values = spread_out(records)
    if not _same(f, records.name, series):
        raise SeaError(
            f"{records.name}: has other frequencies than {series.source}. Give files of the same buoy and year."
        )
    length = name.startswith("r")
    if length and np.nanmax(values, initial=0.0) > 1.5:
        values = values / 100.0
    low, high = (0.0, 1.05) if length else (0.0, 360.0)
    wrong = (values < low) | (values > high)
    if np.any(wrong):
        i, j = (int(k) for k in np.argwhere(wrong)[0])
        raise SeaError(
            f"{records.name}: line {records.lines[i]}: {name} = {values[i, j]:g} is not between {low:g} and {high:g}."
            " Correct the line."
        )
    part = np.full(series.S.shape, np.nan)
    at = np.searchsorted(records.time, series.time)
    at[at == len(records.time)] = 0
    both = records.time[at] == series.time
    part[both] = values[at[both]]
    return part


def _same(f: FloatArray, name: str, series: SpectrumSeries) -> bool:
    centre = 2.0 * np.pi * bands(f, name)[0]
    return centre.shape == series.omega.shape and bool(np.allclose(centre, series.omega, rtol=0.0, atol=1e-9))


def _fill(
    first: ComplexArray,
    second: ComplexArray,
    measured: NDArray[np.bool_],
    series: SpectrumSeries,
    valid: NDArray[np.bool_],
) -> int:
    """Give a band that has no coefficients those of the nearest one that has; how many of these bands hold waves."""
    m = np.arange(series.S.shape[1])
    count = 0
    for i in np.flatnonzero(valid & ~measured.all(axis=1)):
        have = np.flatnonzero(measured[i])
        nearest = have[np.argmin(np.abs(m[:, None] - have[None, :]), axis=1)]
        first[i], second[i] = first[i, nearest], second[i, nearest]
        count += int(np.count_nonzero(~measured[i] & (series.S[i] > 0.0)))
    return count
