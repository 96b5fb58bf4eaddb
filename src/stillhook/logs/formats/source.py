"""What every format of log gives: headings with units, and its columns piece by piece as raw numbers with line
numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Protocol

import numpy as np

from stillhook.base.arrays import FloatArray

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
    """Numbers with those filled in that are words in the file. cells: texts without blanks around them."""
    if not want.words:
        return read
    numbers = {word.lower(): value for word, value in want.words}
    values = np.array([numbers.get(cell.lower(), np.nan) for cell in cells], dtype=np.float64)
    return np.where(np.isnan(read), values, read)
