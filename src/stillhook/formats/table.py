"""Long-form tables (a supplier's map: one row a cell) from CSV, Parquet and Excel: named columns in SI, with row
numbers for messages.

A heading carries its unit, `D_m [cm^3/rev]`, or a mapping file says which column is what:

    [columns]
    D_m = { column = "Vg", unit = "cm^3/rev" }
    eta_hm = { column = "hm. efficiency", unit = "%", scale = 1.0 }

A unit is never guessed. CSV: separator comma, semicolon or tab; decimal comma with the latter two, or in quotes;
comments begin with #; a byte-order mark, CRLF and quotes do no harm.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from stillhook.base.arrays import FloatArray
from stillhook.base.choice import nearest
from stillhook.base.extras import how_to_get, installed
from stillhook.errors import LogError, SpecError, UnitError, UnreadableError
from stillhook.formats.binary.reader import read_binary, refuse_bomb
from stillhook.formats.csv_table import csv_table, csv_text
from stillhook.library.toml.file import TomlTable, read_toml
from stillhook.library.toml.kinds import FileKind, toml_instead
from stillhook.tables.table import Number, Spec, Text
from stillhook.units import KINDS, parse, quote

LARGEST_TABLE = 50_000_000
"""Bytes; a million cells. Logs are read elsewhere, streamed."""
LARGEST_CELLS = 5_000_000
"""What a header may claim, far above every map."""
LARGEST_UNPACKED = 500_000_000
"""Bytes of all parts of an Excel file; the sheet of a million cells takes some 50 MB."""
EMPTY = frozenset({"", "-", "--", "nan", "na", "n/a", "null", "none", "#n/a"})
"""What suppliers write where there is no value, in lower case."""
_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2}(,[0-9]{3})+")
RATIO = {"1": 1.0, "%": 0.01}
"""Units of a pure number."""


@dataclass(frozen=True)
class ColumnSpec:
    """A column that may be read: our name, other names for it (lower case), kind of quantity ("" for a ratio), an
    example."""

    name: str
    kind: str
    aliases: tuple[str, ...]
    example: str

    @property
    def units(self) -> tuple[str, ...]:
        return KINDS[self.kind].allowed if self.kind else tuple(RATIO)


class ColumnTable(Spec):
    """One row of a mapping file."""

    column: Text = Field(description="heading in the table")
    unit: Text | None = Field(default=None, description="unit of its numbers")
    scale: Number = Field(default=1.0, description="factor on its numbers")

    @field_validator("scale")
    @classmethod
    def _not_zero(cls, scale: float) -> float:
        if scale == 0.0:
            raise ValueError("give a number that is not 0.")
        return scale


class ColumnsFile(Spec):
    """A mapping file."""

    columns: Mapping[str, ColumnTable] = Field(min_length=1, description="table [columns] with one row for each column")


@dataclass(frozen=True)
class Raw:
    """A table as it was written: headings, cells (texts, numbers or None), the number of each row in the file,
    comments."""

    name: str
    headings: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]
    numbers: tuple[int, ...]
    comments: tuple[str, ...] = ()
    comma: bool = False
    """Whether a decimal comma is to be expected: columns are not separated by commas."""


@dataclass(frozen=True)
class Columns:
    """Columns in SI, NaN where a cell is empty, and the number of each row in the file."""

    source: str
    values: Mapping[str, FloatArray]
    headings: Mapping[str, str]
    numbers: NDArray[np.int64]
    comments: tuple[str, ...]
    unused: tuple[str, ...]


def read_columns(
    path: str | os.PathLike[str], specs: Sequence[ColumnSpec], mapping: str | os.PathLike[str] | None = None
) -> Columns:
    """The requested columns that a table has, in SI.

    Parameters: path .csv, .txt, .tsv, .parquet or .xlsx; wanted what may be there; mapping a TOML file with a table
    [columns].
    Errors: LogError, UnitError of one line with file, row, column, what came and what is allowed.
    """
    if line := toml_instead(path, "a table of numbers"):
        raise LogError(line)
    chosen = _mapping(Path(mapping), specs) if mapping is not None else {}
    raw = _raw(Path(path))
    if not raw.rows:
        raise LogError(f"{raw.name}: has headings and no rows below them. Give a table with one row a measured point.")
    places = {w.name: place for w in specs if (place := _place(raw, w, chosen.get(w.name))) is not None}
    _one_decimal_sign(raw, sorted(places.values()))
    values = {w.name: _values(raw, w, places[w.name], chosen.get(w.name)) for w in specs if w.name in places}
    unused = tuple(h for i, h in enumerate(raw.headings) if i not in places.values() and h)
    headings = {name: raw.headings[i] for name, i in places.items()}
    return Columns(raw.name, values, headings, np.array(raw.numbers), raw.comments, unused)


def _raw(path: Path) -> Raw:
    try:
        if not path.is_file():
            reason = "a folder" if path.is_dir() else "no such file"
            raise LogError(f"{quote(str(path))}: {reason}. Give the path of a CSV, Parquet or Excel file.")
        if path.stat().st_size > LARGEST_TABLE:
            raise LogError(
                f"{path.name}: larger than {LARGEST_TABLE // 1_000_000} MB, so it is not a map. Give the map alone."
            )
        kind = path.suffix.lower()
        if kind in (".xlsx", ".xlsm"):
            return _excel(path)
        if kind in (".parquet", ".pq"):
            return _parquet(path)
        if kind in (".xls", ".ods"):
            raise LogError(f"{path.name}: {kind} is not read. Save it as .xlsx or .csv.")
        return _csv(path.name, path.read_bytes())
    except (OSError, ValueError) as e:
        raise LogError(
            f"{quote(str(path))}: cannot be read ({getattr(e, 'strerror', None) or e}). Check the path."
        ) from None


def _parquet(path: Path) -> Raw:
    _need("polars", "Parquet", path)
    try:
        headings, rows = read_binary(_parquet_cells, path)
    except UnreadableError as problem:
        raise LogError(f"{path.name}: not a Parquet file ({problem}). Write it again.") from None
    return Raw(path.name, headings, rows, tuple(range(1, len(rows) + 1)))


def _parquet_cells(path: Path) -> tuple[tuple[str, ...], tuple[tuple[Any, ...], ...]]:
    """In the process that reads: headings and rows."""
    import polars as pl

    scan = pl.scan_parquet(path, glob=False)
    _refuse_cells(int(scan.select(pl.len()).collect().item()) * len(scan.collect_schema()))
    frame = scan.collect()
    return tuple(frame.columns), tuple(frame.rows())


def _refuse_cells(count: int) -> None:
    if count > LARGEST_CELLS:
        raise UnreadableError(f"claims {count} cells; up to {LARGEST_CELLS} make a map")


def _need(reader: str, content: str, path: Path) -> None:
    if not installed(reader):
        raise LogError(
            f"{path.name}: is {content}, which takes the reader {reader}: {how_to_get(reader)}. Or save it as CSV."
        )


def _excel(path: Path) -> Raw:
    _need("openpyxl", "Excel", path)
    try:
        lines = read_binary(_excel_cells, path)
    except UnreadableError as problem:
        raise LogError(f"{path.name}: not an Excel file ({problem}). Save it again as .xlsx.") from None
    return _headed(path.name, list(enumerate(lines, start=1)))


def _excel_cells(path: Path) -> list[tuple[Any, ...]]:
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
        lines.append(tuple(row))
    book.close()
    return lines


def _csv(name: str, data: bytes) -> Raw:
    start = "Give a table with a line of headings and one row a measured point."
    table = csv_table(name, csv_text(name, data, LogError), LogError, start=start)
    comments = tuple(line.lstrip().lstrip("# ") for line in table.comments)
    rows, numbers = tuple(map(tuple, table.rows)), tuple(int(n) for n in table.lines)
    return Raw(name, table.headings, rows, numbers, comments, comma=table.separator != ",")


def _headed(name: str, lines: Sequence[tuple[int, tuple[Any, ...]]]) -> Raw:
    """Comments, the line of headings and the rows below it."""
    comments, body = [], []
    for number, cells in lines:
        first = str(cells[0]).strip() if cells and cells[0] is not None else ""
        if first.startswith("#"):
            comments.append(first.lstrip("# "))
        elif any(_is_text(c) for c in cells):
            body.append((number, cells))
    if not body:
        raise LogError(f"{name}: empty. Give a table with a line of headings and one row a measured point.")
    (at, top), rows = body[0], body[1:]
    headings = tuple("" if h is None else " ".join(str(h).split()) for h in top)
    while headings and not headings[-1]:
        headings = headings[:-1]
    wide = len(headings)
    for number, cells in rows:
        if len(cells) < wide or any(_is_text(c) for c in cells[wide:]):
            hint = ' A decimal comma needs ";" or a tab between columns.' if len(cells) > wide else ""
            raise LogError(
                f"{name}: row {number}: {len(cells)} cells where row {at} has {wide} headings.{hint} Correct the row."
            )
    return Raw(name, headings, tuple(r[:wide] for _, r in rows), tuple(n for n, _ in rows), tuple(comments))


def _is_text(cell: Any) -> bool:
    return cell is not None and str(cell).strip() != ""


def _mapping(path: Path, specs: Sequence[ColumnSpec]) -> Mapping[str, ColumnTable]:
    """The table [columns] of a mapping file."""
    rows = f"A mapping has one table [columns] with rows such as {_example(specs[0])}."
    try:
        return read_toml(path, FileKind.COLUMNS, LogError, lambda table: _columns(table, specs), start=rows)
    except SpecError as problem:
        raise LogError(str(problem)) from None


def _columns(table: TomlTable, specs: Sequence[ColumnSpec]) -> Mapping[str, ColumnTable]:
    columns, by_name = table.read(ColumnsFile).columns, {spec.name: spec for spec in specs}
    for name, row in columns.items():
        if name not in by_name:
            near = nearest(name, by_name)
            raise LogError(f"{table.place('columns', name)}: unknown column{near} Allowed: {', '.join(by_name)}.")
        units = by_name[name].units
        if row.unit is not None and row.unit not in units:
            place = table.place("columns", name, "unit")
            raise UnitError(f"{place} = {quote(row.unit)}: not one of {', '.join(units)}.")
    return columns


def _example(w: ColumnSpec) -> str:
    return f'{w.name} = {{ column = "my heading", unit = "{w.units[-1]}" }}'


def split_heading(heading: str) -> tuple[str, str | None]:
    """Name in lower case and unit of a heading such as `D_m [cm^3/rev]`."""
    name, bracket, rest = heading.partition("[")
    return name.strip().lower(), rest.rpartition("]")[0].strip() if bracket else None


def _place(raw: Raw, spec: ColumnSpec, chosen: ColumnTable | None) -> int | None:
    """Which column of the table is the requested one."""
    if chosen is not None:
        matches = [i for i, h in enumerate(raw.headings) if h == chosen.column] or [
            i for i, h in enumerate(raw.headings) if split_heading(h)[0] == chosen.column.strip().lower()
        ]
        if not matches:
            have = ", ".join(quote(h) for h in raw.headings)
            raise LogError(
                f"{raw.name}: no column {quote(chosen.column)} for {spec.name}; it has {have}. Correct the mapping."
            )
    else:
        names = {spec.name.lower(), *spec.aliases}
        matches = [i for i, h in enumerate(raw.headings) if split_heading(h)[0].replace(" ", "_") in names]
    if len(matches) > 1:
        both = " and ".join(quote(raw.headings[i]) for i in matches)
        raise LogError(
            f"{raw.name}: columns {both} both read as {spec.name}. Keep one, or choose one in a mapping file."
        )
    return matches[0] if matches else None


def _values(raw: Raw, spec: ColumnSpec, place: int, chosen: ColumnTable | None) -> FloatArray:
    heading = raw.headings[place]
    where = f"{raw.name}: column {quote(heading)}"
    unit = chosen.unit if chosen is not None and chosen.unit is not None else split_heading(heading)[1]
    if unit is None:
        raise UnitError(
            f'{where}: no unit. Write the heading as "{spec.example}" (allowed: {", ".join(spec.units)}), or map it.'
        )
    if unit not in spec.units:
        raise UnitError(f"{where}: unit {quote(unit)} is not one of {', '.join(spec.units)}.")
    cells = [row[place] for row in raw.rows]
    numbers = np.array([_number(cell, raw, i, heading) for i, cell in enumerate(cells)], dtype=np.float64)
    scale = 1.0 if chosen is None else chosen.scale
    with np.errstate(over="ignore"):
        values = numbers * (scale * (parse(f"1 {unit}", spec.kind, where) if spec.kind else RATIO[unit]))
    if np.isinf(values).any():
        i = int(np.flatnonzero(np.isinf(values))[0])
        raise LogError(
            f"{raw.name}: row {raw.numbers[i]}: column {quote(heading)} = {cells[i]}: too large. Correct or empty the"
            " cell."
        )
    return values


def _one_decimal_sign(raw: Raw, places: Sequence[int]) -> None:
    """Refuse numbers that may mean two things: commas here and points there, or "1,500" which may be fifteen
    hundred."""
    texts = [(raw.headings[i], cell.strip()) for i in places for row in raw.rows if isinstance(cell := row[i], str)]
    comma, point = (next(((h, c) for h, c in texts if sign in c), None) for sign in ",.")
    if comma is not None and point is not None:
        raise LogError(
            f"{raw.name}: {quote(comma[1])} in column {quote(comma[0])} has a comma and {quote(point[1])} in column"
            f" {quote(point[0])} a point. Write one decimal sign and no thousands sign."
        )
    for heading in () if raw.comma else dict.fromkeys(h for h, c in texts if "," in c):
        with_comma = [c for h, c in texts if h == heading and "," in c]
        if all(_THOUSANDS.fullmatch(c) for c in with_comma):
            raise LogError(
                f"{raw.name}: column {quote(heading)}: {quote(with_comma[0])} may be a thousand or a decimal comma. "
                "Write numbers without a thousands sign, with a decimal point."
            )


def _number(cell: Any, raw: Raw, row: int, heading: str) -> float:
    """A cell as a number; NaN where it is empty."""
    if cell is None:
        return math.nan
    if isinstance(cell, int | float) and not isinstance(cell, bool):
        return float(cell) if math.isfinite(cell) else math.nan
    text = str(cell).strip().strip('"').strip()
    if text.lower() in EMPTY:
        return math.nan
    try:
        number = float(text.replace(",", "."))
    except ValueError:
        number = math.nan
    if not math.isfinite(number) or "_" in text:
        raise LogError(
            f"{raw.name}: row {raw.numbers[row]}: column {quote(heading)} = {quote(text)}: no number. Correct or"
            " empty the"
            " cell."
        )
    return number
