"""What every format of log gives: headings with units, and its columns piece by piece as raw numbers with line
numbers."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Protocol

import numpy as np
import pandas as pd

from stillhook.base.arrays import FloatArray
from stillhook.errors import LogError
from stillhook.units import quote

EXAMPLES = 3  # cells that are not numbers, quoted in a finding


@dataclass(frozen=True)
class Want:
    """A column that is needed: its place among the headings (two places: stamps of date and time), and how its cells
    read."""

    places: tuple[int, ...]
    stamps: str | None = None
    """None: numbers. "UTC" or a pattern: stamps, which come as seconds since 1970."""
    words: tuple[tuple[str, float], ...] = ()
    """Cells that represent numbers."""


@dataclass(frozen=True)
class Chunk:
    """Some rows of a log."""

    base: int
    """Which time base of the file (0 where it has one table)."""
    values: Mapping[Want, FloatArray]
    """Raw numbers as in the file, NaN where a cell is empty or no number."""
    line_of: Callable[[int], int]
    """Line (or sample) number in the file of a row, from 1."""
    done: float
    """Share of the file read so far."""
    texts: Mapping[Want, tuple[str, ...]] = field(default_factory=dict)
    """Examples of cells that are not numbers ("" an empty one)."""
    broken: tuple[tuple[int, str], ...] = ()
    """Lines left out because their fields do not match the header: line number, what is wrong."""


def master(base: int) -> int:
    """The place that represents a time base which the format carries itself (MDF4, TDMS): -1, -2, ..."""
    return -1 - base


def from_sample(begin: int) -> Callable[[int], int]:
    """Numbers of samples from 1, for a piece that begins at sample `begin` counted from 0."""
    return partial(_from_sample, begin)


def _from_sample(begin: int, row: int) -> int:
    return begin + row + 1


class Source(Protocol):
    """An open log."""

    name: str
    row: str
    """What a row is called in messages: "line" or "sample"."""
    time_base: bool
    """Whether the format carries the time itself, so that a mapping needs no row `time`."""

    headings: tuple[str, ...]
    units: tuple[str, ...]
    """Units that the file gives next to its headings, "" where none."""

    def base(self, place: int) -> int:
        """The time base that a column belongs to, or that `master` represents."""
        ...

    def sample(self, place: int) -> str:
        """The first cell of a column, as text."""
        ...

    def chunks(self, wants: Sequence[Want], size: int) -> Iterator[Chunk]:
        """The requested columns in pieces of about `size` bytes."""
        ...


def joined(columns: Sequence[list[str]]) -> list[str]:
    """Stamps of one column, or of two (date and time), empty where either is."""
    if len(columns) == 1:
        return columns[0]
    return [f"{day} {time}" if day and time else "" for day, time in zip(*columns, strict=True)]


def with_words(read: FloatArray, cells: Sequence[str], want: Want) -> FloatArray:
    """Numbers with those filled in that stand in the file as words. cells: texts without blanks around them."""
    if not want.words:
        return read
    numbers = {word.lower(): value for word, value in want.words}
    values = np.array([numbers.get(cell.lower(), np.nan) for cell in cells], dtype=np.float64)
    return np.where(np.isnan(read), values, read)


_STAMP = re.compile(
    r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d.*|\d{1,2}\.\d{1,2}\.\d{4}[T ]\d\d:\d\d.*|\d{4}/\d\d/\d\d[T ]\d\d:\d\d.*"
)
_ISO_ZONE = re.compile(r"[+-]\d\d:?\d\d$")
_BLANK = re.compile(r"^(\S+) +(?=\d)")
_ISO = "%Y-%m-%dT%H:%M:%S%.f"
_TO_ISO = (
    (re.compile(r"^(\d{4}-)"), r"\1"),
    (re.compile(r"^(\d{1,2})\.(\d{1,2})\.(\d{4})T"), r"\3-\2-\1T"),
    (re.compile(r"^(\d{4})/(\d{1,2})/(\d{1,2})T"), r"\1-\2-\3T"),
    (re.compile(r"^(\d{4})(\d\d)(\d\d)T(\d\d)(\d\d)(\d\d)"), r"\1-\2-\3T\4:\5:\6"),
)
"""Ways to write a date with a time, and the same as ISO 8601, which pandas reads some thirty times as fast."""
_FRACTION = re.compile(r"%\.[369]?f")
_SHORT = {"%F": "%Y-%m-%d", "%D": "%m/%d/%y", "%T": "%H:%M:%S", "%R": "%H:%M"}
NANO = 1e-9


def is_stamp(cell: str) -> bool:
    """Whether a cell is a stamp that "UTC" reads."""
    return bool(_STAMP.fullmatch(cell.strip()))


def stamps_to_seconds(text: Sequence[str], pattern: str) -> FloatArray:
    """Stamps as seconds since 1970, NaN where a cell is none; a stamp without a zone is UTC."""
    tidy = [cell.strip(' \t"') for cell in text]
    if pattern != "UTC":
        return _parsed(tidy, pattern)
    tidy = [_BLANK.sub(r"\1T", cell).replace(",", ".", 1).removesuffix("Z") for cell in tidy]
    first = next((cell for cell in tidy if cell), "")
    zone = "%z" if _ISO_ZONE.search(first) else ""
    for written, iso in _TO_ISO:
        if any(written.match(cell) for cell in tidy):
            return _parsed([written.sub(iso, cell) if written.match(cell) else "" for cell in tidy], _ISO + zone)
    return np.full(len(tidy), np.nan)


def _parsed(text: Sequence[str], pattern: str) -> FloatArray:
    """Seconds since 1970, or since midnight where the pattern holds no year. %.f is a fraction that may be missing."""
    for short, spelt in _SHORT.items():
        pattern = pattern.replace(short, spelt)
    if not _FRACTION.search(pattern):
        return _seconds(text, pattern)
    seconds = _seconds(text, _FRACTION.sub(".%f", pattern))
    missing = np.flatnonzero(np.isnan(seconds))
    if len(missing):
        seconds[missing] = _seconds([text[i] for i in missing.tolist()], _FRACTION.sub("", pattern))
    return seconds


def _seconds(text: Sequence[str], pattern: str) -> FloatArray:
    try:
        stamps = pd.to_datetime(pd.Series(text, dtype=object), format=pattern, errors="coerce", utc=True)
    except ValueError as problem:
        raise LogError(
            f"time: unit = {quote(pattern)} is not a pattern of stamps ({quote(str(problem).splitlines()[0])})."
        ) from None
    read = stamps.to_numpy(dtype="datetime64[ns]")
    origin = "1970-01-01" if "%Y" in pattern or "%y" in pattern else "1900-01-01"  # where strptime puts a time of day
    since = (read - np.datetime64(origin, "ns")).astype(np.int64)
    return np.where(np.isnat(read), np.nan, since.astype(np.float64)) * NANO
