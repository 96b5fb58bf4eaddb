"""Text files of the US National Data Buoy Center (NDBC), plain or gz: their lines, times and missing values, and the
bands of their buoys.

A file has one header, with "#" from 2007 on (a second header line then gives units), and one record a line: year,
month, day, hour, minutes from 2005 on, then numbers. Times are UTC. Years before 1999 have two digits. Real-time files
run backwards; records come out ascending. Missing numbers are 9s (99, 999, 9999) or "MM" and come out as NaN.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.base.gateway.access import refuse_foreign, unpacked
from stillhook.base.gateway.budget import RECORDS
from stillhook.errors import SeaError
from stillhook.formats.table.text import HEAD, numbers_of
from stillhook.units import quote

FILLS = (999.0, 9999.0)
"""What represents a missing number in NDBC's files, besides MM."""
SHORT_FILL = 99.0
"""And in columns whose numbers are smaller: densities, heights and periods; not in directions, of which 99 deg is
one."""
_DATES = ("YY", "YYYY", "yr")


@dataclass(frozen=True, eq=False)
class Records:
    """Header words after those of time; time (n,), ascending, each once; rows (n,) texts of numbers; lines (n,) in the
    file; notes."""

    name: str
    header: list[str]
    time: NDArray[np.datetime64]
    rows: list[list[str]]
    lines: list[int]
    notes: tuple[str, ...]


def read_text(path: str | os.PathLike[str]) -> str:
    """The text of a plain or gz file. Errors: SeaError for what cannot be read, is cut short or is not text."""
    name, data = Path(path).name, unpacked(path, "file of waves", SeaError, RECORDS)
    instead = "Give a text file of NDBC, plain or gz, or say what it is with --format."
    refuse_foreign(name, data[:HEAD], SeaError, instead)
    try:
        text = "\0" if b"\0" in data else data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = "\0"
    if text == "\0":
        raise SeaError(f"{name}: is not a text file. Give a text file of NDBC, plain or gz.")
    return text


def is_ndbc(text: str) -> bool:
    """Whether the first words are those of NDBC's header."""
    first = text[:200].split()
    return bool(first) and first[0].lstrip("#") in _DATES


def read_records(path: str | os.PathLike[str]) -> Records:
    """The records of an NDBC file. Errors: SeaError that names file and line."""
    name, text = Path(path).name, read_text(path)
    if not text.strip():
        raise SeaError(f"{name}: is empty. Give a text file of NDBC, plain or gz.")
    if not is_ndbc(text):
        begin = quote(text.split()[0])
        raise SeaError(f"{name}: begins with {begin}, not with YY, YYYY or #YY. Give a text file of NDBC, plain or gz.")
    header: list[str] = []
    times: list[str] = []
    rows: list[list[str]] = []
    places: list[int] = []
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split()
        if not words:
            continue
        if not header:
            header = [words[0].lstrip("#"), *words[1:]]
            stamp = 5 if len(header) > 4 and header[4] == "mm" else 4
        elif words[0].startswith("#") or words[0] in _DATES:
            if words[0].lstrip("#") in _DATES[:2] and words[1:] != header[1:]:
                raise SeaError(f"{name}: line {number}: another header than line 1. Split the file there.")
        else:
            times.append(_time(words[:stamp], f"{name}: line {number}"))
            rows.append(words[stamp:])
            places.append(number)
    if not rows:
        raise SeaError(f"{name}: has a header and no records. Give a file with records.")
    return _in_order(name, header[stamp:], np.array(times, dtype="datetime64[s]"), rows, places)


def _time(words: list[str], where: str) -> str:
    """UTC of a record as ISO text."""
    try:
        year, month, day, hour, minute = (int(w) for w in (*words, "0")[:5])
        year += 0 if year > 99 else 1900 if year >= 70 else 2000
        return datetime(year, month, day, hour, minute).isoformat()
    except (ValueError, OverflowError):
        stamp = quote(" ".join(words))
        raise SeaError(f"{where}: {stamp} is not a date and hour. Correct or remove the line.") from None


def _in_order(
    name: str, header: list[str], time: NDArray[np.datetime64], rows: list[list[str]], lines: list[int]
) -> Records:
    order = np.argsort(time, kind="stable")
    once = np.concatenate(([True], np.diff(time[order]) > np.timedelta64(0, "s")))
    selection = order[once]
    repeated = len(order) - len(selection)
    notes = [f"{repeated} records repeat a time: the first of each is kept"] if repeated else []
    time = time[selection]
    if len(time) > 2:
        steps = np.diff(time).astype(np.int64)
        usual = int(np.median(steps))
        absent = np.maximum(np.rint(steps / usual) - 1.0, 0.0)
        count = f"{absent.sum():.0f} more are absent from the file, in {np.count_nonzero(absent)} gaps"
        notes += [f"{count}: its records are {usual / 60.0:g} min apart"] if absent.any() else []
    return Records(name, header, time, [rows[i] for i in selection], [lines[i] for i in selection], tuple(notes))


def numbers(records: Records, columns: slice, count: int, fills: tuple[float, ...] = FILLS) -> FloatArray:
    """Numbers of some columns of every record (n, k), NaN where one of the fills; count is how many words a record has
    after its time.

    Errors: SeaError for a record with another count of words, and for a word that is not a number.
    """
    for row, line in zip(records.rows, records.lines, strict=True):
        if len(row) != count:
            problem = f"{len(row)} values where the header names {count}"
            raise SeaError(f"{records.name}: line {line}: {problem}. The file is cut or mixed: fetch it again.")
    words = [word for row in records.rows for word in row[columns]]
    values = numbers_of(words)
    for i in np.flatnonzero(~np.isfinite(values)).tolist():
        if words[i] != "MM":
            line = records.lines[i * len(records.rows) // len(words)]
            do = "Correct or remove the line, or write missing values as 999."
            raise SeaError(f"{records.name}: line {line}: {quote(words[i])} is not a finite number. {do}")
    return np.where(np.isin(values, fills), np.nan, values).reshape(len(records.rows), -1)


WPM: FloatArray = np.concatenate(
    (np.arange(0.0325, 0.094, 0.005), np.arange(0.10, 0.355, 0.01), np.arange(0.365, 0.49, 0.02))
).round(4)
"""Centres of the bands of NDBC's Wave Processing Module [Hz]; a band at 0.02 Hz, 0.01 Hz wide, may go before them.

Source: www.ndbc.noaa.gov/faq/wavespectra.shtml.
"""
ROUNDED = 0.0006
"""Real-time files print three digits of a frequency [Hz]."""

SOUND = 0.25
"""Part by which widths of bands that touch may differ from half the way to either neighbour: 0.2 where the width
doubles from one band to the next. Rounded frequencies lead further astray."""


def bands(f: FloatArray, where: str) -> tuple[FloatArray, FloatArray]:
    """Centres and widths of bands (m,) [Hz] with these centres.

    NDBC's own bands are known. Otherwise bands touch each other, starting from two that are as far apart as their
    neighbours; where that leaves none of them a sound width, each reaches half-way to its neighbours. Errors: SeaError
    for frequencies that do not ascend from above 0, or of which one is above 2 Hz.
    """
    if len(f) < 2:
        raise SeaError(f"{where}: one band of frequencies is not a spectrum. Fetch the file again.")
    if f[0] <= 0.0 or np.any(np.diff(f) <= 0.0) or f[-1] > 2.0:
        first = ", ".join(f"{x:g}" for x in f[:3])
        problem = f"{len(f)} frequencies ({first}, ...) do not ascend within 0 to 2 Hz"
        raise SeaError(f"{where}: {problem}. Fetch the file again.")
    low = f[0] < 0.025 and abs(f[1] - WPM[0]) <= ROUNDED
    bands_f = f[1:] if low else f
    if len(bands_f) == len(WPM) and np.all(np.abs(bands_f - WPM) <= ROUNDED):
        width = np.concatenate((np.full(13, 0.005), np.full(26, 0.01), np.full(7, 0.02)))
        return (np.concatenate(([0.0201], WPM)), np.concatenate(([0.01], width))) if low else (WPM.copy(), width)
    return f, _widths(f)


def _widths(f: FloatArray) -> FloatArray:
    step = np.diff(f)
    half = np.concatenate(([step[0]], (step[1:] + step[:-1]) / 2.0, [step[-1]]))
    even = np.flatnonzero(np.abs(np.diff(step)) < 0.01 * step[:-1])
    if len(even) == 0:
        return half
    width = np.zeros_like(f)
    width[even[0]] = step[even[0]]
    for i in range(even[0], len(step)):
        width[i + 1] = 2.0 * step[i] - width[i]
    for i in range(even[0], 0, -1):
        width[i - 1] = 2.0 * step[i - 1] - width[i]
    return width if np.all(np.abs(width - half) < SOUND * half) else half
