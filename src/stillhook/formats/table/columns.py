"""Columns of a table by a description of each: name, other names, kind of quantity; in SI, with row numbers for
messages."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Protocol

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import StillhookError, UnitError
from stillhook.formats.table.dialect import PURE, STAMPS
from stillhook.formats.table.text import TextTable
from stillhook.units import KINDS, parse, quote


class Mapped(Protocol):
    """What a mapping file says of a column: its heading, its unit where the heading has none, a factor."""

    @property
    def column(self) -> str: ...

    @property
    def unit(self) -> str | None: ...

    @property
    def scale(self) -> float: ...


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


def split_heading(heading: str) -> tuple[str, str | None]:
    """Name in lower case and unit of a heading such as `D_m [cm^3/rev]`; None where it has no unit."""
    name, bracket, rest = heading.partition("[")
    return name.strip().lower(), rest.rpartition("]")[0].strip() if bracket else None


def place_of(table: TextTable, spec: ColumnSpec, chosen: Mapped | None = None) -> int | None:
    """Which column of a table is the described one, None where there is none. Errors: where several are."""
    if chosen is not None:
        matches = [i for i, h in enumerate(table.headings) if h == chosen.column] or [
            i for i, h in enumerate(table.headings) if split_heading(h)[0] == chosen.column.strip().lower()
        ]
        if not matches:
            problem = f"no column {quote(chosen.column)} for {spec.name}; it has {table.shown}"
            raise table.error(f"{table.name}: {problem}. Correct the mapping.")
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
    chosen: Mapped | None = None,
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
    scale = parse(f"1 {unit}", spec.kind, where) if spec.kind else PURE[unit]
    with np.errstate(over="ignore"):
        x = table.numbers(place, missing) * ((1.0 if chosen is None else chosen.scale) * scale)
    if bad := np.flatnonzero(np.isinf(x)).tolist():
        raise table.wrong(bad, place, "a finite number", "Correct it, or empty the cell if it is missing.")
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
