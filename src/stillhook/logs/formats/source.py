"""What every format of log gives: headings with units, and its columns piece by piece as raw numbers with line
numbers."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Protocol

import numpy as np
import polars as pl

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

    @property
    def headings(self) -> tuple[str, ...]:
        """Names of the columns."""
        ...

    @property
    def units(self) -> tuple[str, ...]:
        """Units that the file gives next to its headings, "" where none."""
        ...

    def base(self, place: int) -> int:
        """The time base that a column belongs to, or that `master` represents."""
        ...

    def sample(self, place: int) -> str:
        """The first cell of a column, as text."""
        ...

    def chunks(self, wants: Sequence[Want], size: int) -> Iterator[Chunk]:
        """The requested columns in pieces of about `size` bytes."""
        ...


def with_words(read: FloatArray, cells: pl.Series, want: Want) -> FloatArray:
    """Numbers with those filled in that stand in the file as words."""
    if not want.words:
        return read
    tidy = cells.cast(pl.String).fill_null("").str.strip_chars(' \t"').str.to_lowercase()
    numbers_of_words = {word.lower(): value for word, value in want.words}
    values = tidy.replace_strict(
        list(numbers_of_words), list(numbers_of_words.values()), default=None, return_dtype=pl.Float64
    )
    return np.where(np.isnan(read), values.fill_null(np.nan).to_numpy(), read)


_STAMP = re.compile(
    r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d.*|\d{1,2}\.\d{1,2}\.\d{4}[T ]\d\d:\d\d.*|\d{4}/\d\d/\d\d[T ]\d\d:\d\d.*"
)
_ISO_ZONE = r"[+-]\d\d:?\d\d$"
_PATTERNS = ("%Y-%m-%dT%H:%M:%S%.f", "%d.%m.%YT%H:%M:%S%.f", "%Y/%m/%dT%H:%M:%S%.f", "%Y%m%dT%H%M%S%.f")
NANO = 1e-9


def is_stamp(cell: str) -> bool:
    """Whether a cell is a stamp that "UTC" reads."""
    return bool(_STAMP.fullmatch(cell.strip()))


def stamps_to_seconds(text: pl.Series, pattern: str) -> FloatArray:
    """Stamps as seconds since 1970, NaN where a cell is none; a stamp without a zone is UTC."""
    tidy = text.str.strip_chars(' \t"')
    if pattern != "UTC":
        return _seconds(_parsed(tidy, pattern))
    tidy = tidy.str.replace(r"^(\S+) +(\d)", "${1}T${2}").str.replace(",", ".", literal=True).str.strip_suffix("Z")
    first = next((cell for cell in tidy if cell), "")
    zone = "%z" if pl.Series([first]).str.contains(_ISO_ZONE)[0] else ""
    for candidate in _PATTERNS:
        read = _parsed(tidy, candidate + zone)
        if read.null_count() < len(read):
            return _seconds(read)
    return np.full(len(text), np.nan)


def _parsed(text: pl.Series, pattern: str) -> pl.Series:
    try:
        if "%Y" not in pattern and "%y" not in pattern:  # a time of day
            return text.str.to_time(pattern, strict=False).cast(pl.Int64)
        return text.str.to_datetime(pattern, time_unit="ns", strict=False).cast(pl.Int64)
    except pl.exceptions.PolarsError as problem:
        raise LogError(
            f"time: unit = {quote(pattern)} is not a pattern of stamps ({quote(str(problem).splitlines()[0])})."
        ) from None


def _seconds(nanoseconds: pl.Series) -> FloatArray:
    return nanoseconds.cast(pl.Float64).to_numpy().astype(np.float64, copy=False) * NANO
