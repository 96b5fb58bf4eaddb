"""Columns of a table by a description of each: name, other names, kind of quantity; in SI, with row numbers for
messages.

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
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from pydantic import Field, field_validator

from stillhook.base.arrays import FloatArray
from stillhook.base.choice import nearest
from stillhook.errors import LogError, SpecError, StillhookError, UnitError
from stillhook.formats.table.dialect import MISSING
from stillhook.formats.table.file import unpacked
from stillhook.formats.table.text import TextTable, decoded, headed_table
from stillhook.formats.table.units import PURE, STAMPS
from stillhook.formats.table.workbook import READERS, read_workbook
from stillhook.library.toml.file import TomlTable, read_toml
from stillhook.library.toml.kinds import FileKind, toml_instead
from stillhook.tables.table import Number, Spec, Text
from stillhook.units import KINDS, parse, quote

LARGEST_TABLE = 50_000_000
"""Bytes; a million cells. Logs are read elsewhere, streamed."""
START = "Give a table with a line of headings and one row a measured point."
_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2}(,[0-9]{3})+")


@dataclass(frozen=True)
class ColumnSpec:
    """A column that may be read: our name, other names for it (lower case), kind of quantity ("" for a ratio), an
    example; whether a table must have it."""

    name: str
    kind: str
    aliases: tuple[str, ...]
    example: str
    required: bool = False

    @property
    def units(self) -> tuple[str, ...]:
        """Units that its numbers may be in."""
        return (*(KINDS[self.kind].allowed if self.kind else PURE), *((STAMPS,) if self.kind == "time" else ()))


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
) -> Columns:
    """The requested columns that a table has, in SI.

    Parameters: path .csv, .txt, .tsv, .parquet or .xlsx; specs what may be there; mapping a TOML file with a table
    [columns]; error: what is raised.
    Errors: `error`, UnitError of one line with file, row, column, what came and what is allowed.
    """
    if line := toml_instead(path, "a table of numbers"):
        raise error(line)
    chosen = _mapping(Path(mapping), specs) if mapping is not None else {}
    table = _table(Path(path), error)
    places = {spec.name: place for spec in specs if (place := place_of(table, spec, chosen.get(spec.name))) is not None}
    for spec in specs:
        if spec.required and spec.name not in places:
            raise missing_column(table, spec, "Name it so, or map it in a mapping file.")
    _one_decimal_sign(table, sorted(places.values()))
    table = replace(table, comma=True, row="row")
    values = {
        spec.name: si_values(table, spec, places[spec.name], MISSING, chosen.get(spec.name))
        for spec in specs
        if spec.name in places
    }
    unused = tuple(h for i, h in enumerate(table.headings) if i not in places.values() and h)
    return Columns(table, values, {name: table.headings[i] for name, i in places.items()}, unused)


def _table(path: Path, error: type[StillhookError]) -> TextTable:
    kind = path.suffix.lower()
    if kind in (".xls", ".ods"):
        raise error(f"{path.name}: {kind} is not read. Save it as .xlsx or .csv.")
    data = unpacked(path, "table in CSV, Parquet or Excel", error, LARGEST_TABLE)
    if kind in READERS:
        return read_workbook(path, error, START)
    return headed_table(path.name, decoded(path.name, data, error), error, START)


def _mapping(path: Path, specs: Sequence[ColumnSpec]) -> Mapping[str, ColumnTable]:
    """The table [columns] of a mapping file."""
    example = f'{specs[0].name} = {{ column = "my heading", unit = "{specs[0].units[-1]}" }}'
    rows = f"A mapping has one table [columns] with rows such as {example}."
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


def split_heading(heading: str) -> tuple[str, str | None]:
    """Name in lower case and unit of a heading such as `D_m [cm^3/rev]`; None where it has no unit."""
    name, bracket, rest = heading.partition("[")
    return name.strip().lower(), rest.rpartition("]")[0].strip() if bracket else None


def place_of(table: TextTable, spec: ColumnSpec, chosen: ColumnTable | None = None) -> int | None:
    """Which column of a table is the described one, None where there is none. Errors: where several are."""
    if chosen is not None:
        matches = [i for i, h in enumerate(table.headings) if h == chosen.column] or [
            i for i, h in enumerate(table.headings) if split_heading(h)[0] == chosen.column.strip().lower()
        ]
        if not matches:
            raise table.error(
                f"{table.name}: no column {quote(chosen.column)} for {spec.name}; it has {table.shown}. Correct the"
                " mapping."
            )
    else:
        names = {spec.name.lower(), *spec.aliases}
        matches = [i for i, h in enumerate(table.headings) if split_heading(h)[0].replace(" ", "_") in names]
        plain = [i for i in matches if table.headings[i].endswith("]")]  # others have words behind their unit
        matches = plain if len(plain) == 1 else matches
    if len(matches) > 1:
        both = " and ".join(quote(table.headings[i]) for i in matches)
        raise table.error(f"{table.header}: columns {both} both read as {spec.name}. Keep or map one.")
    return matches[0] if matches else None


def missing_column(table: TextTable, spec: ColumnSpec, do: str) -> StillhookError:
    """What to raise for a table that lacks a column."""
    return table.error(f"{table.header}: no column {quote(spec.example)} among {table.shown}. {do}")


def si_values(
    table: TextTable,
    spec: ColumnSpec,
    place: int,
    missing: Collection[str] = (),
    chosen: ColumnTable | None = None,
) -> FloatArray:
    """A column (n,) in SI; missing: marks of missing numbers, which are NaN. Errors: UnitError where the heading has no
    unit of the kind, and as `TextTable.numbers`."""
    heading = table.headings[place]
    where = f"{table.header}: column {quote(heading)}"
    unit = chosen.unit if chosen is not None and chosen.unit is not None else split_heading(heading)[1]
    if unit is None:
        raise UnitError(f"{where} has no unit. Write it as {quote(spec.example)} (allowed: {', '.join(spec.units)}).")
    if unit not in spec.units:
        raise UnitError(f"{where}: unit {quote(unit)} is not one of {', '.join(spec.units)}.")
    if unit == STAMPS:
        return _stamps(table, place)
    scale = 1.0 if chosen is None else chosen.scale
    with np.errstate(over="ignore"):
        x = table.numbers(place, missing) * (
            scale * (parse(f"1 {unit}", spec.kind, where) if spec.kind else PURE[unit])
        )
    if np.isinf(x).any():
        raise table.wrong(
            np.flatnonzero(np.isinf(x)).tolist(),
            place,
            "a finite number",
            "Correct it, or empty the cell if it is missing.",
        )
    return x


def _stamps(table: TextTable, place: int) -> FloatArray:
    """A column of ISO 8601 stamps as seconds since 1970; a stamp without a zone is UTC, as the header says."""

    def seconds(stamp: str) -> float:
        try:
            read = datetime.fromisoformat(stamp)
        except ValueError:
            return math.nan
        return (read if read.tzinfo else read.replace(tzinfo=UTC)).timestamp()

    t = np.array([seconds(stamp) for stamp in table.column(place)])
    if bad := np.flatnonzero(np.isnan(t)).tolist():
        raise table.wrong(bad, place, "an ISO 8601 stamp such as 2014-08-01T00:00:00.95Z")
    return t


def _one_decimal_sign(table: TextTable, places: Sequence[int]) -> None:
    """Refuse numbers that may mean two things: commas here and points there, or "1,500" which may be fifteen
    hundred."""
    texts = [(table.headings[i], cell) for i in places for cell in table.column(i)]
    comma, point = (next(((h, c) for h, c in texts if sign in c), None) for sign in ",.")
    if comma is not None and point is not None:
        raise table.error(
            f"{table.name}: {quote(comma[1])} in column {quote(comma[0])} has a comma and {quote(point[1])} in column"
            f" {quote(point[0])} a point. Write one decimal sign and no thousands sign."
        )
    for heading in () if table.comma else dict.fromkeys(h for h, c in texts if "," in c):
        with_comma = [c for h, c in texts if h == heading and "," in c]
        if all(_THOUSANDS.fullmatch(c) for c in with_comma):
            raise table.error(
                f"{table.name}: column {quote(heading)}: {quote(with_comma[0])} may be a thousand or a decimal comma. "
                "Write numbers without a thousands sign, with a decimal point."
            )
