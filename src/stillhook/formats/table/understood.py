"""What a reader understood of a file: which column is what, in which unit, counted which way; and the mapping file that
says so, to be corrected and given again."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import StillhookError, all_of, printed
from stillhook.formats.table.columns import ColumnChoice, ColumnSpec, place_of, si_values, split_heading, unit_in
from stillhook.formats.table.dialect import MISSING, STAMPS, apart, our_unit
from stillhook.formats.table.text import TextTable
from stillhook.library.write import toml_value
from stillhook.units import number, show

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")


@dataclass(frozen=True)
class ReadColumn:
    """A column that was understood. unit: as the file or its user states it, "" for none; quantity: its kind; low, high
    of its values [SI], NaN where they were not read; remark: what was assumed, or what to check."""

    name: str
    heading: str
    unit: str
    sign: int = 1
    quantity: str = ""
    low: float = math.nan
    high: float = math.nan
    remark: str = ""
    scale: float = 1.0
    offset: float = 0.0

    @property
    def range(self) -> str:
        """Least and largest value, in words."""
        if math.isnan(self.low):
            return ""
        ends = [show(x, self.quantity, 4) if self.quantity else number(x, 4) for x in (self.low, self.high)]
        return " to ".join(ends)

    @property
    def text(self) -> str:
        """The heading with its unit, and "down" where it counts the other way."""
        plain = self.heading.replace("\n", " ")
        stated = split_heading(plain)[1]
        same = stated is not None and our_unit(stated, self.quantity) == our_unit(self.unit, self.quantity)
        unit = "" if same or not self.unit else f" [{self.unit}]"
        name = plain[: plain.index("[")].strip() if unit and "[" in plain else plain
        return f"{name}{unit}{' down' if self.sign < 0 else ''}"

    @property
    def row(self) -> str:
        """The row of a mapping file."""
        if self.scale == 1.0 and self.offset == 0.0:
            return toml_value(self.text)
        parts = [f"column = {toml_value(self.heading)}"]
        parts += [f"unit = {toml_value(self.unit)}"] if self.unit else []
        parts += [f"sign = {self.sign}"] if self.sign != 1 else []
        parts += [f"scale = {self.scale!r}"] if self.scale != 1.0 else []
        parts += [f"offset = {self.offset!r}"] if self.offset else []
        return f"{{ {', '.join(parts)} }}"


@dataclass(frozen=True)
class Understood:
    """What a file holds. noun: what it was read as; rows: its columns; unused: headings that are not read; notes: in
    words; head: lines at the top of a mapping file of it, such as sense = "coming-from"."""

    source: str
    noun: str
    rows: tuple[ReadColumn, ...] = ()
    unused: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    head: tuple[str, ...] = ()
    problem: str = ""
    """Why a command would refuse the file as it is; "" where none would."""
    fixed: bool = False
    """Whether no mapping file can describe it: a matrix, or a format that names its own columns."""

    def facts(self) -> dict[str, Any]:
        """By name, for JSON."""
        rows = [
            {
                "name": r.name,
                "column": r.heading,
                "unit": r.unit,
                "sign": r.sign,
                "low": r.low,
                "high": r.high,
                "remark": r.remark,
            }
            for r in self.rows
        ]
        return {
            "file": self.source,
            "read_as": self.noun,
            "columns": rows,
            "not_read": list(self.unused),
            "notes": list(self.notes),
            "problem": self.problem,
        }


def understood_columns(
    table: TextTable,
    specs: Sequence[ColumnSpec],
    chosen: Mapping[str, ColumnChoice],
    assumed: Mapping[str, str] | None = None,
) -> list[ReadColumn]:
    """The described columns that a table has; assumed: units by name where the file states none."""
    rows: list[ReadColumn] = []
    problems: list[StillhookError] = []
    for spec in specs:
        row = chosen.get(spec.name)
        if (place := place_of(table, spec, row)) is None:
            continue
        stated = None if row is None else apart(row.column, row.unit, table.headings)[1]
        unit = stated if stated is not None else unit_in(table, place, spec.kind)
        remark = ""
        if unit is None and assumed and spec.name in assumed:
            unit, remark = assumed[spec.name], "no unit in the file: assumed"
            row = replace(row or ColumnChoice(table.headings[place]), unit=unit)
        try:
            low, high = ends(si_values(table, spec, place, MISSING, row))
        except StillhookError as problem:
            problems.append(problem)
            continue
        sign, scale, offset = (1, 1.0, 0.0) if row is None else (row.sign, row.scale, row.offset)
        stamps = unit is None
        rows.append(
            ReadColumn(
                spec.name,
                table.headings[place],
                STAMPS if stamps else str(unit),
                sign,
                spec.kind,
                math.nan if stamps or unit == STAMPS else low,
                math.nan if stamps or unit == STAMPS else high,
                remark,
                scale,
                offset,
            )
        )
    if problems:
        raise all_of(problems)
    return rows


def ends(x: FloatArray) -> tuple[float, float]:
    """Least and largest of the known values, NaN where none is."""
    known = x[np.isfinite(x)]
    return (float(known.min()), float(known.max())) if len(known) else (math.nan, math.nan)


def mapping_text(found: Understood) -> str:
    """The mapping file of what was understood, with remarks."""
    read = f"# What Stillhook reads of {printed(found.source)} as a {found.noun}."
    lines = [
        f"{read} Correct a row, and give this file by --mapping.",
        '# A row: heading, unit in brackets, and "down" where the file counts the other way.',
        *found.head,
        "",
        "[columns]",
    ]
    width = max((len(r.name) for r in found.rows), default=0)
    for row in found.rows:
        remark = "; ".join(part for part in (row.range, row.remark) if part)
        name = row.name if _BARE_KEY.fullmatch(row.name) else toml_value(row.name)
        lines.append(f"{name:<{width}} = {row.row}" + (f"  # {printed(remark)}" if remark else ""))
    if found.unused:
        lines += ["", "# Not read:", *(f"#   {printed(' '.join(heading.split()))}" for heading in found.unused)]
    return "\n".join(lines) + "\n"
