"""Texts in tables that a spreadsheet opens: a text that it would take for a formula is written so that it stays a text.

Excel and LibreOffice compute a cell of a CSV file that begins with = + - or @, in any width of these signs, also after
spaces or quotes that they drop; a name such as `=cmd|'/c calc'!A1` then starts a program. Such a text is written with
an apostrophe before it, as Excel marks a text, and `text_of` takes it away again. Numbers are left as they are, also
those in a text.
"""

from __future__ import annotations

import csv
import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

MARK = "'"
_SIGNS = "=+\\-@\uff1d\uff0b\uff0d\uff20"
_FORMULA = re.compile(rf"[\s\x00-\x1f\"']*[{_SIGNS}]|[\t\r\n]")
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?")


def cell_of(value: Any) -> Any:
    """A value as a cell of CSV holds it: a text that would be a formula with an apostrophe before it, all else as it
    is."""
    if isinstance(value, str) and _FORMULA.match(value) and not _NUMBER.fullmatch(value):
        return MARK + value
    return value


def remark_of(text: str) -> str:
    """A remark above a table, in one line: a spreadsheet cuts it at commas and semicolons, so each part is written as a
    cell."""
    parts = re.split("([,;])", " ".join(text.split()))
    return "".join(part if _NUMBER.fullmatch(part.strip()) else str(cell_of(part)) for part in parts)


def text_of(cell: str) -> str:
    """The text that such a cell of CSV stands for."""
    bare = cell.removeprefix(MARK)
    return bare if bare != cell and cell_of(bare) == cell else cell


def csv_of(table: pd.DataFrame, **options: Any) -> str:
    """A table as CSV, without its index; options as those of `DataFrame.to_csv`. Texts of cells and headings alike."""
    columns = {
        i: column.map(cell_of) for i, (_, column) in enumerate(table.items()) if column.dtype.kind not in "biufc"
    }
    written = table.copy(deep=False)
    for i, column in columns.items():
        written.isetitem(i, column)
    written.columns = [cell_of(str(name)) for name in table.columns]
    texts = [*written.columns, *(text for column in columns.values() for text in column)]
    if any(isinstance(text, str) and "\r" in text for text in texts):  # Python quotes it from 3.13 on
        options = {"quoting": csv.QUOTE_NONNUMERIC} | options
    return str(written.to_csv(index=False, lineterminator="\n", **options))
