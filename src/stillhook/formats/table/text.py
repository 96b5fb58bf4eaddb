"""Tables in text, read at once: rows of cells with their line numbers, and columns of numbers out of them.

`headed_table`: the first line besides comments holds the headings, and every row has a cell for each of them.
`find_table`: the table is looked for, below other lines, in any dialect (`stillhook.formats.table.dialect`).
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.gateway.budget import in_time
from stillhook.errors import StillhookError
from stillhook.formats.table.cells import MARK, text_of
from stillhook.formats.table.dialect import COMMENTS, dialect_of, one_newline, split_row
from stillhook.units import quote

HEAD = 1 << 16  # bytes from which a dialect is found
COMMENT = "#"
SEPARATORS = (";", "\t", ",")
"""Of tables that begin with their header."""
_SIGNS = tuple(sign.decode() for sign in COMMENTS)


@dataclass(frozen=True)
class TextTable:
    """Cells without blanks and quotes around them. lines: number of each row, which messages call `row`; comments as
    they are written; units: those of a row below the headings; comma: cells may have a decimal comma."""

    name: str  # of the file
    error: type[StillhookError]
    headings: tuple[str, ...]
    header_line: int
    rows: Sequence[Sequence[str]] = field(repr=False)
    lines: Sequence[int] = field(repr=False)
    comments: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    comma: bool = False
    row: str = "line"

    def column(self, place: int) -> list[str]:
        """The cells of a column."""
        return [row[place] for row in self.rows]

    def at(self, i: int) -> str:
        """File and line of row i."""
        return f"{self.name}: {self.row} {self.lines[i]}"

    @property
    def header(self) -> str:
        """File and line of the headings."""
        return f"{self.name}: {self.row} {self.header_line}"

    @property
    def shown(self) -> str:
        """The headings, for messages."""
        return ", ".join(quote(heading) for heading in self.headings if heading)

    def numbers(self, place: int, missing: Collection[str] = ()) -> FloatArray:
        """A column of numbers (n,): every cell a finite one, or, where there are marks of `missing` ones (in lower
        case), NaN for these and infinite where the file says so."""
        cells = self.column(place)
        x = numbers_of([cell.replace(",", ".") for cell in cells] if self.comma else cells)
        odd = np.flatnonzero(~np.isfinite(x)).tolist()
        bad = [i for i in odd if not missing or not (cells[i].lower() in missing or _reads(cells[i]))]
        if bad:
            do = "Correct it, or empty the cell if it is missing." if missing else "Correct or remove the line."
            raise self.wrong(bad, place, "a finite number", do)
        return x

    def wrong(
        self, bad: Sequence[int], place: int, expected: str, do: str = "Correct or remove the line."
    ) -> StillhookError:
        """What to raise for cells of a column in the rows `bad` that are not what is expected."""
        more = f" ({len(bad)} such values)" if len(bad) > 1 else ""
        lines = [self._wrong(i, place, f"{expected}.", do) for i in bad]
        return self.error(self._wrong(bad[0], place, f"{expected}{more}.", do)).with_lines(lines)

    def _wrong(self, i: int, place: int, expected: str, do: str) -> str:
        cell = self.rows[i][place]
        cut = " The file seems cut off there." if not cell and i == len(self.rows) - 1 else ""
        return f"{self.at(i)}: {self.headings[place]} = {quote(cell)} is not {expected}{cut} {do}"


def numbers_of(cells: Sequence[str]) -> FloatArray:
    """Cells as numbers with a decimal point, NaN where a cell is not a number."""
    try:
        if not any("_" in cell for cell in cells):
            return np.array([float(cell) for cell in cells])
    except ValueError:
        pass
    return np.array([float(cell) if _reads(cell) else math.nan for cell in cells], dtype=np.float64)


def _reads(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell


def decoded(name: str, data: bytes, error: type[StillhookError]) -> str:
    """A text with "\\n" at the end of each line. Errors: one line that names the line which is not UTF-8."""
    try:
        text = data.decode("utf-16" if data.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig")
    except UnicodeDecodeError as problem:
        line = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n").count(b"\n", 0, problem.start) + 1
        raise error(f"{name}: line {line}: is not UTF-8 text. Save the file as CSV UTF-8.") from None
    return one_newline(text)


def headed_table(name: str, text: str, error: type[StillhookError], start: str, *, pad_last: bool = False) -> TextTable:
    """The table of a text whose first line besides comments holds the headings, separated by ; tab or comma; with the
    first two numbers may have a decimal comma.

    start: what a file without a header must begin with; pad_last: the last row may lack cells, which are then empty.
    Errors: one line with file and line.
    """
    lines = [(number, line) for number, line in enumerate(text.split("\n"), start=1) if line.strip()]
    comments = tuple(line for _, line in lines if line.lstrip().startswith(COMMENT))
    lines = [(number, line) for number, line in lines if not line.lstrip().startswith(COMMENT)]
    separator = _separator(lines[0][1]) if lines else ""
    cells = [(number, split_row(line, separator)) for number, line in in_time(lines, len(text), name, error)]
    return table_of(name, cells, error, start, comments=comments, separator=separator, pad_last=pad_last)


def table_of(
    name: str,
    cells: Sequence[tuple[int, list[str]]],
    error: type[StillhookError],
    start: str,
    *,
    comments: tuple[str, ...] = (),
    separator: str = "",
    row: str = "line",
    pad_last: bool = False,
) -> TextTable:
    """The table of numbered lines of cells, the first of which are the headings; as `headed_table`."""
    if not cells:
        raise error(f"{name}: {'has no header' if comments else 'is empty'}. {start}")
    at, headings = cells[0][0], [" ".join(cell.split()) for cell in cells[0][1]]
    while len(headings) > 1 and not headings[-1]:
        headings.pop()
    rows, lines = fitted(name, cells[1:], len(headings), error, separator, row, pad_last=pad_last)
    headings = [text_of(heading) for heading in headings]
    rows = [[text_of(cell) if cell[:1] == MARK else cell for cell in cells] for cells in rows]
    if not rows:
        raise error(f"{name}: has a header ({row} {at}) and no data below it.")
    comma = separator not in ("", ",")
    return TextTable(name, error, tuple(headings), at, rows, lines, comments, comma=comma, row=row)


def fitted(
    name: str,
    cells: Iterable[tuple[int, list[str]]],
    width: int,
    error: type[StillhookError],
    separator: str,
    row: str = "line",
    *,
    pad_last: bool = False,
) -> tuple[list[list[str]], list[int]]:
    """Lines of cells that are not all empty, `width` to each, and their numbers."""
    filled = [(number, line) for number, line in cells if any(line)]
    wrong: list[StillhookError] = []
    for i, (number, line) in enumerate(filled):
        last = i == len(filled) - 1
        if len(line) < width and last and pad_last:
            line += [""] * (width - len(line))
        elif len(line) < width or any(line[width:]):
            hint = ' A decimal comma needs ";" or a tab between columns.' if separator == "," else ""
            hint = "" if len(line) < width else hint
            hint = " The file seems cut off there." if last and len(line) < width else hint
            problem = f"{len(line)} fields where the header has {width}"
            wrong.append(error(f"{name}: {row} {number}: {problem}.{hint} Correct the {row}."))
    if wrong:
        raise wrong[0].with_lines([str(each) for each in wrong])
    return [line[:width] for _, line in filled], [number for number, _ in filled]


def find_table(
    name: str, data: bytes, error: type[StillhookError], noun: str, start: str, head: bytes | None = None
) -> TextTable:
    """The table in a file, in any dialect, with the lines of remarks above it as comments.

    noun: what the file should be; start: what to write where it has no headings; head: the first HEAD bytes, where
    their dialect is not to be looked for in them as they are. Errors: one line.
    """
    dialect = dialect_of(data[:HEAD] if head is None else head, name, len(data) <= HEAD, noun, error)
    try:
        text = data.decode(dialect.encoding).removeprefix("\ufeff")
    except UnicodeDecodeError as problem:
        where = f"byte {problem.start} is not text in {dialect.encoding}"
        raise error(f"{name}: {where}. Save the {noun} as CSV UTF-8.") from None
    if not dialect.header_line:
        raise error(f"{name}: has no line of headings. {start}")
    comments: list[str] = []
    below: list[tuple[int, list[str]]] = []
    for number, line in enumerate(in_time(text.splitlines(), len(text), name, error), start=1):
        remark = line.lstrip().startswith(_SIGNS)
        if number != dialect.header_line and (remark or number < dialect.header_line):
            comments.append(line.lstrip("#/% \t").rstrip(";,\t| ").strip())
        elif number >= dialect.first_line:
            below.append((number, split_row(line, dialect.separator)))
    rows, lines = fitted(name, below, dialect.fields, error, dialect.separator)
    return TextTable(
        name,
        error,
        dialect.headings,
        dialect.header_line,
        rows,
        lines,
        tuple(comment for comment in comments if comment),
        dialect.units,
        comma=dialect.decimal == ",",
    )


_ENCLOSED = re.compile(r'"[^"]*"?|\[[^\]]*\]?')


def _separator(header: str) -> str:
    """The separator of a line of headings; signs inside quotes and brackets do not count."""
    bare = _ENCLOSED.sub("", header)
    return next((sign for sign in SEPARATORS if sign in bare), ",")
