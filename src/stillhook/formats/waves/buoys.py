"""Measured waves of the US National Data Buoy Center: spectra (historical and real-time), their directions, and the
table of standard meteorology. Every file is plain text or gz (`stillhook.formats.waves.ndbc`).

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
from stillhook.base.gateway.guard import reader
from stillhook.errors import SeaError
from stillhook.formats.waves.ndbc import FILLS, SHORT_FILL, Records, bands, numbers, read_records
from stillhook.sea.spectra.directions import Coefficients, DirectionSense, coming_from
from stillhook.sea.spectra.measured import SeaStates, SpectrumSeries
from stillhook.sea.spectra.parametric import HIGHEST

_FREQUENCY = re.compile(r"[0-9]*\.[0-9]+")
PARTS = {"alpha1": ("d", ".swdir"), "alpha2": ("i", ".swdir2"), "r1": ("j", ".swr1"), "r2": ("k", ".swr2")}
"""Numbers of direction; letter and ending of the files that hold them, historical and real-time."""
_HEADER = re.compile(r"^(alpha1|alpha2|r1|r2)_1$")
_NAME = re.compile(r"^[0-9A-Za-z]{5}([a-z])([0-9]{4}|[0-9]{5,6})\.txt(\.gz)?$")
_OLD_NAMES = {"WD": "WDIR"}
_HISTORICAL = re.compile(r"^([0-9A-Za-z]{5})w([0-9]+\.txt(?:\.gz)?)$")


def read_spectra(path: str | os.PathLike[str] | Records) -> SpectrumSeries:
    """The spectra of an NDBC file: historical (YY MM DD hh .030 ...; #YY MM DD hh mm .0200 ...) or real-time
    (.data_spec), plain or gz.

    Densities in the file are m^2/Hz over Hz. A record in which any band is missing is not valid as a whole; it is
    counted, never used.
    Errors: SeaError of one line that names file and line for files that are cut or mixed, for negative energy, and for
    waves above 40 m.
    """
    records = path if isinstance(path, Records) else read_records(path)
    f, S = densities(records)
    f, width = bands(f, records.name)
    complete = np.all(np.isfinite(S), axis=1)
    _check(records, f, S, width, complete)
    notes = []
    if missing := int(np.count_nonzero(~complete)):
        part = int(np.count_nonzero(~complete & np.any(np.isfinite(S), axis=1)))
        of_bands = f", {part} of them in some bands only" if part else ""
        notes.append(f"{missing} of {len(S)} records are missing{of_bands}")
    notes += records.notes
    S = np.where(complete[:, None], S, np.nan) / (2.0 * np.pi)
    return SpectrumSeries(2.0 * np.pi * f, 2.0 * np.pi * width, S, records.time, complete, records.name, tuple(notes))


def is_spectra(header: list[str]) -> bool:
    """Whether the header of an NDBC file is one of spectra, in words after those of time."""
    return bool(header) and (
        header[0] == "Sep_Freq" or "(freq_1)" in header or _FREQUENCY.fullmatch(header[0]) is not None
    )


def densities(records: Records) -> tuple[FloatArray, FloatArray]:
    """Frequencies (m,) [Hz] and numbers (n, m) of a file of spectra, of density or of what its companions hold."""
    if not is_spectra(records.header):
        have = " ".join(records.header[:3]) or "nothing"
        do = "Give a file of spectral wave density (such as 46042w1996.txt)."
        raise SeaError(f"{records.name}: holds no spectra: after the time its header has {have}. {do}")
    if (companion := _companion(records)) is not None:
        problem = f"holds the directions {companion[0]} of a spectrum, not its wave density"
        do = f"Give the density file {companion[1]} with this one next to it."
        raise SeaError(f"{records.name}: {problem}. {do}")
    return spread_out(records, (*FILLS, SHORT_FILL))


def _companion(records: Records) -> tuple[str, str] | None:
    """What a file of directions holds, by its name or header, and which file has its density; None for any other."""
    letters, endings = ({files[i]: part for part, files in PARTS.items()} for i in (0, 1))
    if (named := _NAME.match(records.name)) and named[1] in letters:
        at = named.start(1)
        return letters[named[1]], f"{records.name[:at]}w{records.name[at + 1 :]}"
    plain = Path(records.name.removesuffix(".gz"))
    of_name, of_header = endings.get(plain.suffix.lower()), _HEADER.match(records.header[0])
    if of_name is None and of_header is None:
        return None
    gz = records.name[len(plain.name) :]
    density = f"{plain.stem}.data_spec{gz}" if of_name else ".data_spec of the same buoy"
    return of_header[1] if of_header else str(of_name), density


def spread_out(records: Records, fills: tuple[float, ...] = FILLS) -> tuple[FloatArray, FloatArray]:
    """Frequencies (m,) [Hz] and numbers (n, m): frequencies in the header, or in brackets after each number."""
    if _FREQUENCY.fullmatch(records.header[0]):
        words = records.header
        if not all(_FREQUENCY.fullmatch(w) for w in words):
            raise SeaError(f"{records.name}: line 1: a frequency cannot be read as a number. Fetch the file again.")
        return np.array(words, dtype=np.float64), numbers(records, slice(None), len(words), fills)
    first = 1 if records.header[0] == "Sep_Freq" else 0
    count = len(records.rows[0])
    no_pairs = f"line {records.lines[0]}: not pairs of a number and its frequency. Fetch the file again."
    if (count - first) % 2 or count - first < 4:
        raise SeaError(f"{records.name}: {no_pairs}")
    values = numbers(records, slice(first, None, 2), count, fills)
    rows = [[w.strip("()") for w in row[first + 1 :: 2]] for row in records.rows]
    other = next((i for i, row in enumerate(rows) if row != rows[0]), None)
    if other is not None:
        problem = f"line {records.lines[other]}: other frequencies than line {records.lines[0]}"
        raise SeaError(f"{records.name}: {problem}. Split the file there.")
    if not all(_FREQUENCY.fullmatch(w) for w in rows[0]):
        raise SeaError(f"{records.name}: {no_pairs}")
    return np.array(rows[0], dtype=np.float64), values


def _check(records: Records, f: FloatArray, S: FloatArray, width: FloatArray, complete: NDArray[np.bool_]) -> None:
    if np.any(S < 0.0):
        i, j = (int(k) for k in np.argwhere(S < 0.0)[0])
        problem = f"line {records.lines[i]}: negative energy {S[i, j]:g} m^2/Hz at {f[j]:g} Hz"
        raise SeaError(f"{records.name}: {problem}. Correct or remove the line.")
    H = 4.0 * np.sqrt(np.where(complete, S @ width, 0.0))
    if H.max() > HIGHEST:
        i = int(np.argmax(H))
        problem = f"line {records.lines[i]}: Hm0 of {H[i]:.4g} m is higher than any sea ({HIGHEST:g} m)"
        raise SeaError(f"{records.name}: {problem}. Densities must be in m^2/Hz and frequencies in Hz.")


def read_states(path: str | os.PathLike[str] | Records) -> SeaStates:
    """Wave heights, periods and directions of an NDBC file of standard meteorology (WVHT, DPD, APD, MWD), plain or gz.

    WVHT is H_m0, DPD the period of the highest band, APD T_m02, MWD where waves of that band come from, clockwise from
    true north. A record without WVHT is not valid. Errors: SeaError of one line.
    """
    records = path if isinstance(path, Records) else read_records(path)
    header = [_OLD_NAMES.get(word, word) for word in records.header]
    if "WVHT" not in header:
        problem = f"has no column WVHT: after the time its header has {' '.join(header[:3]) or 'nothing'}"
        raise SeaError(f"{records.name}: {problem}. Give a file of standard meteorology or of spectral wave density.")
    table = numbers(records, slice(None), len(header))
    column = {
        name: table[:, header.index(name)] if name in header else np.full(len(table), np.nan)
        for name in ("WVHT", "DPD", "APD", "MWD")
    }
    for name in ("WVHT", "DPD", "APD"):
        column[name] = np.where(column[name] == SHORT_FILL, np.nan, column[name])
    H = column["WVHT"]
    for name, most in (("WVHT", HIGHEST), ("DPD", 60.0), ("APD", 60.0), ("MWD", 360.0)):
        wrong = (column[name] < 0.0) | (column[name] > most)
        if np.any(wrong):
            i = int(np.flatnonzero(wrong)[0])
            problem = f"line {records.lines[i]}: {name} = {column[name][i]:g} is not between 0 and {most:g}"
            raise SeaError(f"{records.name}: {problem}. Correct the line.")
    come_from = coming_from(np.radians(column["MWD"]), DirectionSense.FROM_NORTH)
    valid = np.isfinite(H)
    notes = [f"{missing} of {len(H)} records have no wave height"] if (missing := int(np.count_nonzero(~valid))) else []
    notes += records.notes
    return SeaStates(records.time, valid, H, column["DPD"], column["APD"], come_from, records.name, tuple(notes))


def companions(path: str | os.PathLike[str]) -> tuple[Path, ...]:
    """Where the four companions of a file of densities are, as in `PARTS`; none where NDBC names no file so."""
    file = Path(path)
    if named := _HISTORICAL.match(file.name):
        return tuple(file.with_name(f"{named[1]}{letter}{named[2]}") for letter, _ in PARTS.values())
    return tuple(file.with_suffix(end) for _, end in PARTS.values()) if file.suffix == ".data_spec" else ()


@reader(SeaError)
def read_directional(path: str | os.PathLike[str]) -> SpectrumSeries:
    """The spectra of an NDBC file with their directions from its four companions, shared out over 36 sectors by the
    maximum-entropy method.

    Records are those of the density file; where a record or band has no directions, those of the nearest band of the
    record that has them are taken and reported; a record without any is not valid. Errors: SeaError of one line for
    a file that lacks a companion or does not fit.
    """
    files = companions(path)
    if not files:
        raise SeaError(
            f"{Path(path).name}: its companions are unknown. Name it as NDBC does: 46042w2019.txt, 46042w2019.txt.gz or"
            " 46042.data_spec."
        )
    series = read_spectra(path)
    alpha_1, alpha_2, r_1, r_2 = (_part(file, name, series) for file, name in zip(files, PARTS, strict=True))
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
        do = "Put it there, or read heights and periods only."
        raise SeaError(f"{file.name}: missing next to {series.source}: it holds {name}. {do}")
    records = read_records(file)
    f, values = spread_out(records)
    centre = 2.0 * np.pi * bands(f, records.name)[0]
    if centre.shape != series.omega.shape or not np.allclose(centre, series.omega, rtol=0.0, atol=1e-9):
        do = "Give files of the same buoy and year."
        raise SeaError(f"{records.name}: has other frequencies than {series.source}. {do}")
    length = name.startswith("r")
    if length and np.nanmax(values, initial=0.0) > 1.5:
        values = values / 100.0
    low, high = (0.0, 1.05) if length else (0.0, 360.0)
    wrong = (values < low) | (values > high)
    if np.any(wrong):
        i, j = (int(k) for k in np.argwhere(wrong)[0])
        problem = f"line {records.lines[i]}: {name} = {values[i, j]:g} is not between {low:g} and {high:g}"
        raise SeaError(f"{records.name}: {problem}. Correct the line.")
    part = np.full(series.S.shape, np.nan)
    at = np.searchsorted(records.time, series.time)
    at[at == len(records.time)] = 0
    both = records.time[at] == series.time
    part[both] = values[at[both]]
    return part


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
