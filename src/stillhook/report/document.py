"""A report as data: sections of text, tables, figures and verdicts, which `terminal`, `html` and `pdf` render."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum

from stillhook._version import __version__

LONGEST_WORD = 20
"""Characters of the longest cell in a column whose lines are not folded."""
MOST_LETTERS = 4
"""Of a longer cell that is still a number, such as "56.2 % (39.3 % to 71.8 %)"."""
NUMBER_TEXT = re.compile(r"[<>±+-]? ?\d|from \d|-?$|any$|open$|unknown$")
"""Start of a cell that belongs to a column of numbers."""


@dataclass(frozen=True, slots=True)
class Text:
    """A paragraph."""

    text: str


@dataclass(frozen=True, slots=True)
class Bullets:
    """Sentences, one below the other."""

    lines: Sequence[str]


@dataclass(frozen=True, slots=True)
class Verdict:
    """An outcome, as a box or as a cell of a table."""

    word: str
    passed: bool | None = None  # None: neither passed nor failed
    text: Sequence[str] = ()  # paragraphs below the word


class Column(StrEnum):
    """Content of a column, which sets alignment and folding."""

    NUMBER = "number"  # right-aligned, never folded
    WORD = "word"  # left-aligned, not folded
    TEXT = "text"  # left-aligned, folded
    CODE = "code"  # in letters of equal width, folded


class Grey(str):
    """A cell with a number that does not count."""

    __slots__ = ()


Cell = str | Verdict
"""Of a table; lines after the first are notes."""


@dataclass(frozen=True, slots=True)
class Table:
    """A table; one without a header holds `facts`."""

    header: Sequence[str]  # may hold line breaks
    rows: Sequence[Sequence[Cell]]
    title: str = ""
    columns: Sequence[Column] = ()  # by their cells unless stated
    bold_rows: Sequence[int] = ()
    bold_columns: Sequence[int] = ()

    @property
    def kinds(self) -> tuple[Column, ...]:
        """Content of each column."""
        if self.columns:
            return tuple(self.columns)
        width = len(self.header) or max((len(row) for row in self.rows), default=0)
        return tuple(_kind(i, [row[i] for row in self.rows]) for i in range(width))

    def heads(self) -> list[str]:
        """Heads of the columns on one line each."""
        return [head.replace("-\n", "").replace("\n", " ") for head in self.header]


def facts(rows: Sequence[Sequence[Cell]], title: str = "") -> Table:
    """Names with their values."""
    return Table((), rows, title)


@dataclass(frozen=True, slots=True)
class Figure:
    """A picture with its caption."""

    png: bytes
    caption: str
    height: float = 118.0  # at most, on paper [mm]
    svg: str = ""  # the same as lines, for a page on a screen
    cuts: Sequence[float] = ()  # where the end of a page may part it, each a share of its height from the top


@dataclass(frozen=True, slots=True)
class Columns:
    """Parts side by side where the page is wide enough."""

    parts: Sequence[Part]
    widths: Sequence[float]  # relative to each other


@dataclass(frozen=True, slots=True)
class Section:
    """Parts under a title; a section among them is a subsection."""

    title: str
    parts: Sequence[Part]


Part = Text | Bullets | Table | Figure | Verdict | Section | Columns


@dataclass(frozen=True, slots=True)
class Document:
    """A report."""

    title: str
    sections: Sequence[Section] = ()
    front: Sequence[Part] = ()  # first page: the outcome and what it rests on
    name: str = ""  # subject, next to the title
    subtitle: str = ""
    purpose: str = ""  # line above the title
    marks: Sequence[str] = ()  # warnings that stand on every page
    watermark: str = ""
    signatures: Sequence[str] = ()  # captions of lines to sign on
    number: str = ""
    revision: str = ""  # of the number
    dense: bool = False  # the first page is one sheet of 9 pt
    date: str = "1970-01-01"  # ISO 8601
    made_by: str = f"Stillhook {__version__}"

    @property
    def heading(self) -> str:
        """Title and subject in one line."""
        return f"{self.title}: {self.name}" if self.name else self.title

    @property
    def parts(self) -> Iterator[Part]:
        """Everything in order, subsections before their parts."""
        return walk((*self.front, *self.sections))

    def section(self, title: str) -> Section:
        """The section or subsection with this title, or whose title ends with it."""
        return next(part for part in self.parts if isinstance(part, Section) and part.title.endswith(title))


def walk(parts: Sequence[Part]) -> Iterator[Part]:
    """Parts, each section followed by its own."""
    for part in parts:
        yield part
        if isinstance(part, Section | Columns):
            yield from walk(part.parts)


def words(cell: Cell) -> str:
    """Text of a cell."""
    return cell.word if isinstance(cell, Verdict) else cell


def _kind(place: int, cells: Sequence[Cell]) -> Column:
    """Content of the column at a place; the first holds names."""
    if place > 0 and all(isinstance(cell, str) and _is_number(cell) for cell in cells):
        return Column.NUMBER
    longest = max((len(line) for cell in cells for line in words(cell).split("\n")), default=0)
    return Column.TEXT if longest > LONGEST_WORD else Column.WORD


def _is_number(text: str) -> bool:
    """Whether a cell holds a number with its unit, or an interval, rather than words."""
    short = len(text) <= LONGEST_WORD or sum(map(str.isalpha, text)) <= MOST_LETTERS
    return short and NUMBER_TEXT.match(text) is not None
