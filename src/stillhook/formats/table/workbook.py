"""Tables in Excel and Parquet, as cells of text; each is read in a process of its own."""

from __future__ import annotations

import math
from decimal import Decimal
from pathlib import Path
from typing import Any

from stillhook.base.extras import how_to_get, installed
from stillhook.errors import StillhookError, UnreadableError
from stillhook.formats.binary.reader import read_binary, refuse_bomb
from stillhook.formats.table.text import COMMENT, TextTable, table_of

LARGEST_CELLS = 5_000_000
"""What a header may claim, far above every map."""
LARGEST_UNPACKED = 500_000_000
"""Bytes of all parts of an Excel file; the sheet of a million cells takes some 50 MB."""
READERS = {
    ".xlsx": ("openpyxl", "Excel"),
    ".xlsm": ("openpyxl", "Excel"),
    ".parquet": ("polars", "Parquet"),
    ".pq": ("polars", "Parquet"),
}
"""Endings of files, the library that reads them, and what they are."""


def read_workbook(path: Path, error: type[StillhookError], start: str) -> TextTable:
    """The table of a Parquet file, or of the first sheet of an Excel file: lines of remarks that begin with #, a line
    of headings, rows. Errors: one line."""
    library, content = READERS[path.suffix.lower()]
    if not installed(library):
        raise error(
            f"{path.name}: is {content}, which takes the reader {library}: {how_to_get(library)}. Or save it as CSV."
        )
    try:
        cells = read_binary(_parquet_cells if content == "Parquet" else _excel_cells, path)
    except UnreadableError as problem:
        raise error(f"{path.name}: not a readable {content} file ({problem}). Save it again.") from None
    first = 0 if content == "Parquet" else 1  # the headings of Parquet are no row
    numbered = [(number, line) for number, line in enumerate(cells, start=first) if any(line)]
    comments = tuple(line[0] for _, line in numbered if line[0].startswith(COMMENT))
    body = [(number, line) for number, line in numbered if not line[0].startswith(COMMENT)]
    return table_of(path.name, body, error, start, comments=comments, row="row")


def _text(cell: Any) -> str:
    """A cell as text that reads back to the same number, without a decimal sign where it is a number, as that of text
    cells may be a comma; empty where it holds none."""
    if cell is None or (isinstance(cell, float) and not math.isfinite(cell)):
        return ""
    if isinstance(cell, float):
        sign, digits, exponent = Decimal(repr(cell)).as_tuple()
        return f"{'-' * sign}{''.join(map(str, digits))}e{exponent}"
    return str(cell).strip().strip('"').strip()


def _parquet_cells(path: Path) -> list[list[str]]:
    """In the process that reads: headings and rows."""
    import polars as pl

    scan = pl.scan_parquet(path, glob=False)
    _refuse_cells(int(scan.select(pl.len()).collect().item()) * len(scan.collect_schema()))
    frame = scan.collect()
    return [list(frame.columns), *([_text(cell) for cell in row] for row in frame.rows())]


def _excel_cells(path: Path) -> list[list[str]]:
    """In the process that reads: rows of the first sheet."""
    import zipfile

    import openpyxl

    with zipfile.ZipFile(path) as archive:
        refuse_bomb(path, sum(part.file_size for part in archive.infolist()), allowed=LARGEST_UNPACKED)
    book = openpyxl.load_workbook(path, read_only=True, data_only=True)
    lines, count = [], 0
    for row in book.worksheets[0].iter_rows(values_only=True):
        count += max(1, len(row))
        _refuse_cells(count)
        lines.append([_text(cell) for cell in row])
    book.close()
    return lines


def _refuse_cells(count: int) -> None:
    if count > LARGEST_CELLS:
        raise UnreadableError(f"claims {count} cells; up to {LARGEST_CELLS} make a map")
