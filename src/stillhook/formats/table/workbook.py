"""Tables for Excel: sheets with a line of headings, written as .xlsx or .csv."""

from __future__ import annotations

import csv
import math
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from stillhook.base.atomic import atomic_file
from stillhook.base.extras import need
from stillhook.errors import StillhookError
from stillhook.formats.table.cells import cell_of, remark_of
from stillhook.units import quote

WRITTEN = (".xlsx", ".csv")
"""Endings of files that sheets are written to."""
LONGEST_NAME = 31
"""Letters in the name of a sheet."""
MOST_ROWS = 1_048_575
"""Rows that Excel takes below a line of headings."""
WIDEST = 60
"""Width of a column at most, in letters."""


class Sheet(NamedTuple):
    """A table with a line of headings, and remarks above it."""

    name: str
    headings: Sequence[str]
    rows: Sequence[Sequence[Any]]
    remarks: Sequence[str] = ()


def write_sheets(sheets: Sequence[Sheet], file: Path, error: type[StillhookError]) -> Path:
    """Write sheets as .xlsx, or the first of them as .csv. Errors: `error`, one line, for another ending and where
    openpyxl is missing."""
    if file.suffix.lower() not in WRITTEN:
        raise error(f"{file}: a table is written as {' or '.join(WRITTEN)}. Give a name that ends so.")
    if file.suffix.lower() == ".csv":
        with atomic_file(file) as part, part.open("w", encoding="utf-8", newline="") as stream:
            stream.writelines(f"# {remark_of(remark)}\n" for remark in sheets[0].remarks)
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(map(cell_of, sheets[0].headings))
            writer.writerows([cell_of(_plain(cell)) for cell in row] for row in sheets[0].rows)
        return file
    need("openpyxl", file.name, error)
    if long := next((sheet for sheet in sheets if len(sheet.rows) > MOST_ROWS), None):
        raise error(f"{file.name}: {len(long.rows):,} rows, and a sheet holds {MOST_ROWS:,}. Write it as .csv.")
    with _in_one_line(file, error):
        _write_book(sheets, file)
    return file


@contextmanager
def _in_one_line(file: Path, error: type[StillhookError]) -> Iterator[None]:
    """openpyxl puts each sheet in a temporary file, which lxml writes where it is installed."""
    try:
        yield
    except Exception as problem:
        if not isinstance(problem, (OSError, getattr(sys.modules.get("lxml.etree"), "LxmlError", OSError))):
            raise
        reason, folder = getattr(problem, "strerror", None) or problem, tempfile.gettempdir()
        raise error(
            f"{file}: cannot be written ({reason}). Free space in the temporary folder {folder}, or set TMPDIR."
        ) from None


def _write_book(sheets: Sequence[Sheet], file: Path) -> None:
    from openpyxl import Workbook
    from openpyxl.cell import WriteOnlyCell
    from openpyxl.styles import Font
    from openpyxl.utils import get_column_letter

    book = Workbook(write_only=True)
    for name, headings, rows, remarks in sheets:
        sheet = book.create_sheet(name[:LONGEST_NAME])
        sheet.freeze_panes = f"A{len(remarks) + 2}"
        written = [[_plain(cell) for cell in row] for row in rows]
        for i, heading in enumerate(headings):
            longest = max((len(str(row[i])) for row in written[:1000]), default=0)
            sheet.column_dimensions[get_column_letter(i + 1)].width = min(max(longest, len(heading)) + 2, WIDEST)

        def cell(value: Any, bold: bool = False, of: Any = sheet) -> Any:
            result = WriteOnlyCell(of, value=value)
            if isinstance(value, str):
                result.data_type = "s"  # a text that begins with = is not a formula
                result.quotePrefix = cell_of(value) != value  # nor becomes one where the cell is edited
            if bold:
                result.font = Font(bold=True)
            return result

        for remark in remarks:
            sheet.append([cell(f"# {remark}")])
        sheet.append([cell(heading, bold=True) for heading in headings])
        for row in written:
            sheet.append([cell(value) for value in row])
    with atomic_file(file) as part, part.open("wb") as whole:
        book.save(whole)


def _plain(cell: Any) -> Any:
    """A value as a cell holds it: numbers that are none are empty."""
    if isinstance(cell, float) and not math.isfinite(cell):
        return ""
    return cell.item() if hasattr(cell, "item") else cell


def no_sheet(file: Path, sheet: str, names: Sequence[str]) -> str:
    """A line on a sheet that is not there."""
    return f"{file.name}: no sheet {quote(sheet)}. It has {', '.join(map(quote, names))}."
