"""Measured waves of the US National Data Buoy Center: spectra (historical and real-time) and the table of standard
meteorology.

Every file is plain text or gz; see `stillhook.formats.waves.ndbc.text`. Directions:
`stillhook.formats.waves.ndbc.directions`.
"""

from __future__ import annotations

import os
import re

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.errors import SeaError
from stillhook.formats.waves.ndbc.text import FILLS, SHORT_FILL, Records, bands, numbers, read_records
from stillhook.sea.spectra.directions import DirectionSense, coming_from
from stillhook.sea.spectra.measured import SeaStates, SpectrumSeries
from stillhook.sea.spectra.parametric import HIGHEST

_FREQUENCY = re.compile(r"[0-9]*\.[0-9]+")
_COMPANION = {"d": "alpha1", "i": "alpha2", "j": "r1", "k": "r2"}
_REAL_TIME = {"swdir": "alpha1", "swdir2": "alpha2", "swr1": "r1", "swr2": "r2"}
_HEADER = re.compile(r"^(alpha1|alpha2|r1|r2)_1$")
_NAME = re.compile(r"^[0-9A-Za-z]{5}([a-z])([0-9]{4}|[0-9]{5,6})\.txt(\.gz)?$")
_OLD_NAMES = {"WD": "WDIR"}


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
        notes.append(
            f"{missing} of {len(S)} records are missing" + (f", {part} of them in some bands only" if part else "")
        )
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
        raise SeaError(
            f"{records.name}: holds no spectra: after the time its header has"
            f" {' '.join(records.header[:3]) or 'nothing'}. Give a file of spectral wave density (such as"
            " 46042w1996.txt)."
        )
    if (companion := _companion(records)) is not None:
        name, density = companion
        raise SeaError(
            f"{records.name}: holds the directions {name} of a spectrum, not its wave density. "
            f"Give the density file {density} with this one next to it."
        )
    return spread_out(records, (*FILLS, SHORT_FILL))


def _companion(records: Records) -> tuple[str, str] | None:
    """What a file of directions holds and which file has its density; None for any other file. Recognised by name, or
    by a real-time header."""
    if (named := _NAME.match(records.name)) and named[1] in _COMPANION:
        at = named.start(1)
        return _COMPANION[named[1]], f"{records.name[:at]}w{records.name[at + 1 :]}"
    plain = records.name.removesuffix(".gz")
    stem, _, ending = plain.rpartition(".")
    of_name, of_header = _REAL_TIME.get(ending.lower()), _HEADER.match(records.header[0])
    if of_name is None and of_header is None:
        return None
    density = f"{stem or plain}.data_spec{records.name[len(plain) :]}" if of_name else ".data_spec of the same buoy"
    return of_header[1] if of_header else str(of_name), density


def spread_out(records: Records, fills: tuple[float, ...] = FILLS) -> tuple[FloatArray, FloatArray]:
    """Frequencies (m,) [Hz] and numbers (n, m) of either layout: frequencies in the header, or in brackets after each
    number."""
    if _FREQUENCY.fullmatch(records.header[0]):
        words = records.header
        if not all(_FREQUENCY.fullmatch(w) for w in words):
            raise SeaError(f"{records.name}: line 1: one of the frequencies is not a number. Fetch the file again.")
        return np.array(words, dtype=np.float64), numbers(records, slice(None), len(words), fills)
    first = 1 if records.header[0] == "Sep_Freq" else 0
    count = len(records.rows[0])
    if (count - first) % 2 or count - first < 4:
        raise SeaError(
            f"{records.name}: line {records.lines[0]}: not pairs of a number and its frequency. Fetch the file again."
        )
    values = numbers(records, slice(first, None, 2), count, fills)
    rows = [[w.strip("()") for w in row[first + 1 :: 2]] for row in records.rows]
    other = next((i for i, row in enumerate(rows) if row != rows[0]), None)
    if other is not None:
        raise SeaError(
            f"{records.name}: line {records.lines[other]}: other frequencies than line {records.lines[0]}. Split the"
            " file there."
        )
    if not all(_FREQUENCY.fullmatch(w) for w in rows[0]):
        raise SeaError(
            f"{records.name}: line {records.lines[0]}: not pairs of a number and its frequency. Fetch the file again."
        )
    return np.array(rows[0], dtype=np.float64), values


def _check(records: Records, f: FloatArray, S: FloatArray, width: FloatArray, complete: NDArray[np.bool_]) -> None:
    if np.any(S < 0.0):
        i, j = (int(k) for k in np.argwhere(S < 0.0)[0])
        raise SeaError(
            f"{records.name}: line {records.lines[i]}: negative energy {S[i, j]:g} m^2/Hz at {f[j]:g} Hz. Correct or"
            " remove the line."
        )
    H = 4.0 * np.sqrt(np.where(complete, S @ width, 0.0))
    if H.max() > HIGHEST:
        i = int(np.argmax(H))
        raise SeaError(
            f"{records.name}: line {records.lines[i]}: Hm0 of {H[i]:.4g} m is higher than any sea ({HIGHEST:g} m). "
            "Densities must be in m^2/Hz and frequencies in Hz."
        )


def read_states(path: str | os.PathLike[str] | Records) -> SeaStates:
    """Wave heights, periods and directions of an NDBC file of standard meteorology (WVHT, DPD, APD, MWD), plain or gz.

    WVHT is H_m0, DPD the period of the highest band, APD T_m02, MWD where waves of that band come from, clockwise from
    true north. A record without WVHT is not valid. Errors: SeaError of one line.
    """
    records = path if isinstance(path, Records) else read_records(path)
    header = [_OLD_NAMES.get(word, word) for word in records.header]
    if "WVHT" not in header:
        raise SeaError(
            f"{records.name}: has no column WVHT: after the time its header has {' '.join(header[:3]) or 'nothing'}. "
            "Give a file of standard meteorology or of spectral wave density."
        )
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
            raise SeaError(
                f"{records.name}: line {records.lines[i]}: {name} = {column[name][i]:g} is not between 0 and {most:g}."
                " Correct the line."
            )
    come_from = coming_from(np.radians(column["MWD"]), DirectionSense.FROM_NORTH)
    valid = np.isfinite(H)
    notes = [f"{missing} of {len(H)} records have no wave height"] if (missing := int(np.count_nonzero(~valid))) else []
    notes += records.notes
    return SeaStates(records.time, valid, H, column["DPD"], column["APD"], come_from, records.name, tuple(notes))
