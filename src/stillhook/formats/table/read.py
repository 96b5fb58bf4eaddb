"""Tables of named columns: a CSV, Parquet or Excel file with a line of headings, read in SI.

A heading carries its unit, `D_m [cm^3/rev]`, or a mapping file says which column is what:

    [columns]
    D_m = { column = "Vg", unit = "cm^3/rev" }
    eta_hm = { column = "hm. efficiency", unit = "%", scale = 1.0 }

A unit is never guessed. CSV: separator comma, semicolon or tab; decimal comma with the latter two, or in quotes;
comments begin with #; a byte-order mark, CRLF and quotes do no harm.
Tables in Excel and Parquet become cells of text; each is read in a process of its own.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from decimal import Decimal
from pathlib import Path
from typing import Any

from stillhook.base.arrays import FloatArray
from stillhook.base.choice import nearest
from stillhook.base.extras import how_to_get, installed
from stillhook.base.gateway.access import unpacked
from stillhook.base.gateway.budget import TABLE
from stillhook.errors import LogError, StillhookError, UnitError, UnreadableError, all_of
from stillhook.formats.binary import read_binary, refuse_bomb
from stillhook.formats.table import parquet
from stillhook.formats.table.columns import ColumnChoice, ColumnSpec, missing_column, place_of, si_values
from stillhook.formats.table.corrections import ColumnRow, read_corrections, row_of
from stillhook.formats.table.dialect import MISSING, table_unit
from stillhook.formats.table.text import COMMENT, TextTable, decoded, headed_table, table_of
from stillhook.formats.table.workbook import no_sheet
from stillhook.library.toml.kinds import toml_instead
from stillhook.tables.sheet import sheet_of
from stillhook.units import quote

LARGEST_CELLS = 5_000_000
"""What a header may claim, far above every map."""
LARGEST_UNPACKED = 500_000_000
"""Bytes of all parts of an Excel file; the sheet of a million cells takes some 50 MB."""
READERS = {
    ".xlsx": ("openpyxl", "Excel"),
    ".xlsm": ("openpyxl", "Excel"),
    ".parquet": ("duckdb", "Parquet"),
    ".pq": ("duckdb", "Parquet"),
}
"""Endings of files, the library that reads them, and what they are."""


def read_workbook(path: Path, error: type[StillhookError], start: str) -> TextTable:
    """The table of a Parquet file, or of a sheet of Excel (`stillhook.tables.sheet`): lines of remarks that begin with
    #, a line of headings, rows. Errors: one line."""
    path, sheet = sheet_of(path)
    library, content = READERS[path.suffix.lower()]
    if not installed(library):
        do = f"{how_to_get(library)}. Or save it as CSV."
        raise error(f"{path.name}: is {content}, which takes the reader {library}: {do}")
    try:
        if content == "Parquet":
            cells = read_binary(_parquet_cells, path)
        else:
            cells, names = read_binary(_excel_cells, path, sheet)
            if names:
                raise error(no_sheet(path, sheet, names))
    except UnreadableError as problem:
        raise error(f"{path.name}: not a readable {content} file ({problem}). Save it again.") from None
    first = 0 if content == "Parquet" else 1  # the headings of Parquet are not a row
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
    if isinstance(cell, datetime):  # Excel's clock is off by some microseconds
        ms = round(cell.microsecond / 1000.0)
        return (cell.replace(microsecond=0) + timedelta(milliseconds=ms)).isoformat(sep=" ")
    return str(cell).strip().strip('"').strip()


def workbook_text(path: Path, error: type[StillhookError], start: str) -> bytes:
    """A sheet of an Excel file as a table in text, with tabs. Errors: as `read_workbook`."""
    table = read_workbook(path, error, start)
    rows = [table.headings, *table.rows]
    lines = [*table.comments, *("\t".join(" ".join(cell.split()) for cell in row) for row in rows)]
    return "\n".join([*lines, ""]).encode()


def _parquet_cells(path: Path) -> list[list[str]]:
    """In the process that reads: headings and rows."""
    table = parquet.open_table(path)
    _refuse_cells(table.rows * len(table.headings))
    columns = [table.column(place, 0, table.rows) for place in range(len(table.headings))]
    values = [(c.astype("M8[us]") if c.dtype.kind == "M" else c).tolist() for c in columns]
    return [list(table.headings), *([_text(cell) for cell in row] for row in zip(*values, strict=True))]


def _excel_cells(path: Path, sheet: str) -> tuple[list[list[str]], list[str]]:
    """In the process that reads: rows of a sheet, "" for the first; of one that is not there, the names of all."""
    import zipfile

    import openpyxl

    with zipfile.ZipFile(path) as archive:
        refuse_bomb(path, sum(part.file_size for part in archive.infolist()), allowed=LARGEST_UNPACKED)
    book = openpyxl.load_workbook(path, read_only=True, data_only=True)
    names = [each.title for each in book.worksheets]
    if sheet and sheet not in names:
        book.close()
        return [], names
    lines, count = [], 0
    for row in book.worksheets[names.index(sheet) if sheet else 0].iter_rows(values_only=True):
        count += max(1, len(row))
        _refuse_cells(count)
        lines.append([_text(cell) for cell in row])
    book.close()
    return lines, []


def _refuse_cells(count: int) -> None:
    if count > LARGEST_CELLS:
        raise UnreadableError(f"claims {count} cells; up to {LARGEST_CELLS} make a map")


START = "Give a table with a line of headings and one row a measured point."
_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2}(,[0-9]{3})+")


@dataclass(frozen=True)
class Columns:
    """Columns in SI, NaN where a cell is empty, and the table that they are from."""

    table: TextTable
    values: Mapping[str, FloatArray]
    headings: Mapping[str, str]
    unused: tuple[str, ...]

    @property
    def source(self) -> str:
        """Name of the file."""
        return self.table.name

    @property
    def numbers(self) -> Sequence[int]:
        """The number of each row in the file."""
        return self.table.lines


def read_columns(
    path: str | os.PathLike[str],
    specs: Sequence[ColumnSpec],
    mapping: str | os.PathLike[str] | None = None,
    error: type[StillhookError] = LogError,
    columns: Mapping[str, Any] | None = None,
) -> Columns:
    """The requested columns that a table has, in SI.

    Parameters: path .csv, .txt, .tsv, .parquet or .xlsx; specs what may be there; mapping a TOML file with a table
    [columns]; error: what is raised; columns: rows by name that win over those of the mapping.
    Errors: `error`, UnitError of one line with file, row, column, what came and what is allowed.
    """
    table = open_table(path, error)
    where = "columns" if mapping is None else f"{Path(mapping).name}: columns"
    rows = ({} if mapping is None else read_corrections(mapping)) | dict(columns or {})
    return columns_of(table, specs, chosen_rows(rows, specs, where))


def open_table(path: str | os.PathLike[str], error: type[StillhookError]) -> TextTable:
    """The table of a CSV, Parquet or Excel file. Errors: `error`, one line."""
    if line := toml_instead(path, "a table of numbers"):
        raise error(line)
    return _table(Path(path), error)


def columns_of(table: TextTable, specs: Sequence[ColumnSpec], chosen: Mapping[str, ColumnChoice]) -> Columns:
    """The described columns of a table, in SI. Errors: as `read_columns`."""
    places = {spec.name: place for spec in specs if (place := place_of(table, spec, chosen.get(spec.name))) is not None}
    missing = [spec for spec in specs if spec.required and spec.name not in places]
    if missing:
        do = 'Name it so, or say --column "{}=HEADING [{}]".'
        raise all_of([missing_column(table, spec, do.format(spec.name, spec.units[0])) for spec in missing])
    _one_decimal_sign(table, sorted(places.values()))
    table = replace(table, comma=True, row="row")
    read = [spec for spec in specs if spec.name in places]
    values, problems = {}, []
    for spec in read:
        try:
            values[spec.name] = si_values(table, spec, places[spec.name], MISSING, chosen.get(spec.name))
        except StillhookError as problem:
            problems.append(problem)
    if problems:
        raise all_of(problems)
    unused = tuple(h for i, h in enumerate(table.headings) if i not in places.values() and h)
    return Columns(table, values, {name: table.headings[i] for name, i in places.items()}, unused)


def _table(path: Path, error: type[StillhookError]) -> TextTable:
    path, sheet = sheet_of(path)
    kind = path.suffix.lower()
    if kind in (".xls", ".ods"):
        raise error(f"{path.name}: {kind} is not read. Save it as .xlsx or .csv.")
    data = unpacked(path, "table in CSV, Parquet or Excel", error, TABLE)
    if kind in READERS:
        return read_workbook(path.with_name(f"{path.name}#{sheet}") if sheet else path, error, START)
    return headed_table(path.name, decoded(path.name, data, error), error, START)


def chosen_rows(rows: Mapping[str, Any], specs: Sequence[ColumnSpec], where: str) -> dict[str, ColumnChoice]:
    """Rows of a mapping by the name of the column that they describe. Errors: LogError, UnitError of one line."""
    by_name, in_any_case = {spec.name: spec for spec in specs}, {spec.name.lower(): spec.name for spec in specs}
    chosen = {}
    for written, row in rows.items():
        name = in_any_case.get(written.lower(), written)
        if name not in by_name:
            near = nearest(name, by_name)
            raise LogError(f"{where}.{name}: unknown column{near} Allowed: {', '.join(by_name)}.")
        chosen[name] = row_of(row, ColumnRow, f"{where}.{name}").choice
        unit, spec = chosen[name].unit, by_name[name]
        if unit is not None and unit not in spec.units and table_unit(str(unit), spec.kind) is None:
            raise UnitError(f"{where}.{name}.unit = {quote(unit)}: not one of {', '.join(spec.units)}.")
    return chosen


def _one_decimal_sign(table: TextTable, places: Sequence[int]) -> None:
    """Refuse numbers that may mean two things: commas here and points there, or "1,500"."""
    texts = [(table.headings[i], cell) for i in places for cell in table.column(i)]
    comma, point = (next(((h, c) for h, c in texts if sign in c), None) for sign in ",.")
    if comma is not None and point is not None:
        both = " and ".join(f"{quote(cell)} in column {quote(heading)}" for heading, cell in (comma, point))
        problem = f"{both} have a decimal comma and a point"
        raise table.error(f"{table.name}: {problem}. Write one decimal sign and no thousands sign.")
    for heading in () if table.comma else dict.fromkeys(h for h, c in texts if "," in c):
        with_comma = [c for h, c in texts if h == heading and "," in c]
        if all(_THOUSANDS.fullmatch(c) for c in with_comma):
            problem = f"column {quote(heading)}: {quote(with_comma[0])} may be a thousand or a decimal comma"
            do = "Write numbers without a thousands sign, with a decimal point."
            raise table.error(f"{table.name}: {problem}. {do}")
