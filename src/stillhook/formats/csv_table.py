"""Tables in text: comments, one line of headings, rows of cells, each with its line number.

Separators are comma, semicolon and tab; comments begin with #; blank lines, a byte-order mark, CRLF and quotes do no
harm. Motion, vessels, maps and weather are read from here; logs, which are longer than memory, are read in pieces.
"""

from __future__ import annotations

import io
from dataclasses import dataclass, field, replace

import numpy as np
import polars as pl
from numpy.typing import NDArray

from stillhook.errors import StillhookError
from stillhook.formats.csv_dialect import split_row

COMMENT = "#"
SEPARATORS = (";", "\t", ",")
DECIMAL_COMMA = ' A decimal comma needs ";" or a tab between columns.'


@dataclass(frozen=True)
class CsvTable:
    """A table as text."""

    name: str  # of the file
    comments: tuple[str, ...]
    header_line: int
    headings: tuple[str, ...]
    separator: str
    cells: pl.DataFrame = field(default_factory=pl.DataFrame, repr=False)  # texts without blanks and quotes around them
    lines: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64), repr=False)  # number of each row's

    def column(self, place: int) -> pl.Series:
        """The cells of a column."""
        return self.cells.to_series(place)


def csv_text(name: str, data: bytes, error: type[StillhookError]) -> str:
    """The text of a file with "\\n" at the end of each line. Errors: one line that names the line which is no UTF-8."""
    try:
        text = data.decode("utf-16" if data.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig")
    except UnicodeDecodeError as problem:
        line = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n").count(b"\n", 0, problem.start) + 1
        raise error(f"{name}: line {line}: is not UTF-8 text. Save the file as CSV UTF-8.") from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def csv_lines(text: str) -> pl.DataFrame:
    """The lines of a text by number."""
    return pl.DataFrame({"line": [text]}).select(pl.col("line").str.split("\n").explode()).with_row_index("number", 1)


def csv_table(name: str, text: str, error: type[StillhookError], *, start: str, pad_last: bool = False) -> CsvTable:
    """The table of a text; start: what a file without a header must begin with; pad_last as in `csv_cells`. Errors: one
    line with file and line."""
    table = csv_head(name, text, error, start=start)
    lines = csv_lines(text)
    remark = pl.col("line").str.strip_chars_start().str.starts_with(COMMENT)
    below = lines.filter(~remark & (pl.col("number") > table.header_line))
    cells, numbers = csv_cells(name, below, table.separator, len(table.headings), error, pad_last=pad_last)
    if not len(cells):
        raise error(f"{name}: has a header (line {table.header_line}) and no data below it.")
    comments = tuple(lines.filter(remark)["line"].to_list())
    return replace(table, comments=comments, cells=cells, lines=numbers)


def csv_head(name: str, text: str, error: type[StillhookError], *, start: str) -> CsvTable:
    """The header of a table without its rows."""
    for number, line in enumerate(io.StringIO(text), start=1):
        if line.strip() and not line.lstrip().startswith(COMMENT):
            separator = _separator(line)
            headings = [" ".join(cell.split()) for cell in split_row(line, separator)]
            while len(headings) > 1 and not headings[-1]:
                headings.pop()
            return CsvTable(name, (), number, tuple(headings), separator)
    raise error(f"{name}: {'has no header' if text.strip() else 'is empty'}. {start}")


def csv_cells(
    name: str, lines: pl.DataFrame, separator: str, width: int, error: type[StillhookError], *, pad_last: bool = False
) -> tuple[pl.DataFrame, NDArray[np.int64]]:
    """Cells of the lines that are not blank, `width` to each, and the numbers of these lines.

    Parameters: lines as `csv_lines` has them; pad_last: empty cells for those that the last line lacks.
    """
    lines = lines.filter(pl.col("line").str.strip_chars(f' \t"{separator}') != "")
    text, numbers = lines["line"], lines["number"].to_numpy().astype(np.int64)
    names = [f"c{i}" for i in range(width)]
    simple = separator != " " and bool((text.str.count_matches(separator, literal=True) == width - 1).all())
    if simple and not text.str.contains('"', literal=True).any():
        cells = text.str.split_exact(separator, width - 1).struct.rename_fields(names).struct.unnest()
        return cells.select(pl.all().str.strip_chars()), numbers
    rows = [split_row(line, separator) for line in text]
    for i, (number, row) in enumerate(zip(numbers, rows, strict=True)):
        last = i == len(rows) - 1
        if len(row) < width and last and pad_last:
            row += [""] * (width - len(row))
        elif len(row) < width or any(row[width:]):
            hint = DECIMAL_COMMA if separator == "," and len(row) > width else ""
            hint = " The file seems cut off there." if last and len(row) < width else hint
            counts = f"{len(row)} fields where the header has {width}"
            raise error(f"{name}: line {number}: {counts}.{hint} Correct the line.")
    schema = dict.fromkeys(names, pl.String)
    return pl.DataFrame([row[:width] for row in rows], schema=schema, orient="row"), numbers


def _separator(header: str) -> str:
    """The separator of a line of headings; signs inside quotes and brackets do not count."""
    bare, quoted, depth = "", False, 0
    for sign in header:
        quoted ^= sign == '"'
        depth += (sign == "[") - (sign == "]")
        bare += "" if quoted or depth > 0 else sign
    return next((sign for sign in SEPARATORS if sign in bare), ",")
