"""Columns of a table by a description of each: name, other names, kind of quantity; in SI, with row numbers for
messages."""

from __future__ import annotations

import re
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import StillhookError, UnitError
from stillhook.formats.table.dialect import PURE, STAMPS, apart, hint, is_unit, our_unit, table_unit
from stillhook.formats.table.stamps import is_stamp, stamps_to_seconds
from stillhook.formats.table.text import TextTable
from stillhook.units import KINDS, parse, quote


@dataclass(frozen=True)
class ColumnSpec:
    """A column that may be read: our name, other names for it (lower case), kind of quantity ("" for a ratio), an
    example; whether a table must have it."""

    name: str
    kind: str
    aliases: tuple[str, ...]
    example: str
    required: bool = False
    word: str = ""
    """A word that names it in any heading, such as that of "MRU_Heave_m"."""

    @property
    def units(self) -> tuple[str, ...]:
        """Units that its numbers may be in."""
        return (*(KINDS[self.kind].allowed if self.kind else PURE), *((STAMPS,) if self.kind == "time" else ()))


@dataclass(frozen=True)
class ColumnChoice:
    """A column as its user describes it: heading or place from 1, unit (None: as the file says); the value is sign *
    (scale * number + offset)."""

    column: str
    unit: str | None = None
    sign: int = 1
    scale: float = 1.0
    offset: float = 0.0


_IN_BRACKETS = re.compile(r"(.*?)\s*\(([^()]*)\)\s*")


def split_heading(heading: str) -> tuple[str, str | None]:
    """Name in lower case and unit of a heading such as `D_m [cm^3/rev]` or `Radius (m)`; None where it has no unit."""
    name, bracket, rest = heading.partition("[")
    if bracket:
        return name.strip().lower(), rest.rpartition("]")[0].strip()
    if (match := _IN_BRACKETS.fullmatch(heading)) and (match[2] in PURE or is_unit(match[2])):
        return match[1].strip().lower(), match[2].strip()
    return name.strip().lower(), None


def place_of(table: TextTable, spec: ColumnSpec, chosen: ColumnChoice | None = None) -> int | None:
    """Which column of a table is the described one, None where there is none. Errors: where several are."""
    if chosen is not None:
        wanted = apart(chosen.column, chosen.unit, table.headings)[0]
        for text in (lambda h: h, lambda h: h.lower(), lambda h: split_heading(h)[0]):
            if matches := [i for i, h in enumerate(table.headings) if text(h) in (wanted, wanted.lower())]:
                break
        if not matches and wanted.isdecimal() and 1 <= int(wanted) <= len(table.headings):
            matches = [int(wanted) - 1]
        if not matches:
            problem = f"no column {quote(chosen.column)} for {spec.name}; it has {table.shown}"
            raise table.error(f"{table.name}: {problem}. Correct the mapping.")
    else:
        names = {spec.name.lower(), *spec.aliases}
        matches = [i for i, h in enumerate(table.headings) if split_heading(h)[0].replace(" ", "_") in names]
        plain = [i for i in matches if table.headings[i].endswith("]")]  # others have words behind their unit
        matches = plain if len(plain) == 1 else matches
        if not matches and spec.word:
            matches = [i for i, h in enumerate(table.headings) if spec.word in _words(h)]
    if len(matches) > 1:
        both = " and ".join(quote(table.headings[i]) for i in matches)
        choose = f'Keep one, or choose: --column "{spec.name}={table.headings[matches[0]]}".'
        raise table.error(f"{table.header}: columns {both} both read as {spec.name}. {choose}")
    return matches[0] if matches else None


def _words(heading: str) -> list[str]:
    return re.split(r"[^a-z0-9]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", heading).lower())


def unit_in(table: TextTable, place: int, kind: str) -> str | None:
    """The unit that a table gives a column: in its heading, in a row of units, or as the last word of the heading
    (MRU_Heave_m). None where it gives none."""
    heading = table.headings[place]
    unit = split_heading(heading)[1]
    if unit is None and place < len(table.units) and table.units[place]:
        unit = table.units[place]
    if unit is None and kind and "_" in heading and our_unit(last := heading.rpartition("_")[2], kind):
        unit = last
    return unit


def missing_column(table: TextTable, spec: ColumnSpec, do: str) -> StillhookError:
    """What to raise for a table that lacks a column."""
    return table.error(f"{table.header}: no column {quote(spec.example)} among {table.shown}. {do}")


def si_values(
    table: TextTable,
    spec: ColumnSpec,
    place: int,
    missing: Collection[str] = (),
    chosen: ColumnChoice | None = None,
) -> FloatArray:
    """A column (n,) in SI; missing: marks of missing numbers, which are NaN. Errors: UnitError where the heading has no
    unit of the kind, and as `TextTable.numbers`."""
    heading = table.headings[place]
    where = f"{table.header}: column {quote(heading)}"
    unit = None if chosen is None else apart(chosen.column, chosen.unit, table.headings)[1]
    unit = unit_in(table, place, spec.kind) if unit is None else unit
    if unit is None and STAMPS in spec.units and table.rows and is_stamp(table.rows[0][place]):
        unit = STAMPS
    if unit is None:
        example = f"{quote(spec.example)} (allowed: {', '.join(spec.units)})."
        own = f'--column "{spec.name}={heading} [{spec.units[0]}]"'
        raise UnitError(f"{where} has no unit. Write it as {example} Or say {own}.")
    if unit == STAMPS and STAMPS in spec.units:
        return _stamps(table, place)
    if (known := table_unit(str(unit), spec.kind)) is None:
        raise UnitError(f"{where}: unit {quote(unit)} is not one of {', '.join(spec.units)}.{hint(unit, spec.kind)}")
    scale = known[1] * (parse(f"1 {known[0]}", spec.kind, where) if spec.kind else PURE[known[0]])
    x = table.numbers(place, missing)
    with np.errstate(over="ignore"):
        x = x * scale if chosen is None else chosen.sign * scale * (chosen.scale * x + chosen.offset)
    if bad := np.flatnonzero(np.isinf(x)).tolist():
        raise table.wrong(bad, place, "a finite number", "Correct it, or empty the cell if it is missing.")
    return x


def _stamps(table: TextTable, place: int) -> FloatArray:
    """A column of stamps as seconds since 1970; a stamp without a zone is UTC, as the header says."""
    cells = table.column(place)
    t = stamps_to_seconds(cells, STAMPS)
    for i in np.flatnonzero(np.isnan(t)).tolist():  # written otherwise than the others
        with suppress(ValueError):
            stamp = datetime.fromisoformat(cells[i])
            t[i] = (stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)).timestamp()
    if bad := np.flatnonzero(np.isnan(t)).tolist():
        raise table.wrong(bad, place, "an ISO 8601 stamp such as 2014-08-01T00:00:00.95Z")
    return t
