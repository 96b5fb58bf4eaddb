"""Which column of a log is which signal: read from TOML, or from headings such as "p_a [bar]".

    [signals]
    time = { column = "Time", unit = "s" }
    p_a = { column = "PT101", unit = "bar", range = ["0 bar", "400 bar"] }
    omega_m = { column = "M1 speed", unit = "rev/min", sign = -1 }
    u_p = "Pump command [%]"
    omega_m = "Drehzahl [1/min] down"

A row gives column, unit, sign (1 or -1), scale and offset (applied to the raw number before the unit), clock (column of
other time stamps), range (ends of the sensor), quantity (for names of your own) and words (numbers for cells that are
words, such as { on = 1, off = 0 }). Numbers that are in a unit which Stillhook does not know take
a scale to one that it does: psi is unit = "bar", scale = 0.0689476.
"""

from __future__ import annotations

import difflib
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import Field, field_validator

from stillhook.base.choice import nearest
from stillhook.errors import LogError, UnitError
from stillhook.formats.table.corrections import TABLES, Column, ColumnRow, row_of
from stillhook.formats.table.dialect import PURE, STAMPS, apart, hint, our_unit, table_unit
from stillhook.library.toml.file import TomlTable, read_toml_raising
from stillhook.library.toml.kinds import FileKind
from stillhook.logs.types import Signal
from stillhook.tables.table import Number, pure_number
from stillhook.units import KINDS, parse, quote
from stillhook.variables import PHYSICAL

_HEADING = re.compile(r"(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\))?\s*")


class SignalTable(ColumnRow):
    """A row of the table [signals]."""

    clock: Column | None = Field(default=None, description="column of other time stamps")
    range: Any = Field(default=None, description="ends of the sensor")
    quantity: Any = Field(default=None, description="what a name of your own measures")
    words: Mapping[str, Number] = Field(default_factory=dict, description="numbers for cells that are words")

    @field_validator("scale")
    @classmethod
    def _not_zero(cls, scale: float) -> float:
        if scale <= 0.0:
            raise ValueError("write a number above 0; a flipped signal takes sign = -1.")
        return scale


def read_mapping(path: str | os.PathLike[str]) -> dict[str, Signal]:
    """The mapping in a TOML file with a table `[signals]`. Errors: LogError of one line."""
    return read_toml_raising(LogError, Path(path), FileKind.MAPPING, _mapping, start=f"Write [signals]. {ROWS}")


def _mapping(table: TomlTable) -> dict[str, Signal]:
    rows = next((table.data[name] for name in TABLES if isinstance(table.data.get(name), Mapping)), None)
    if rows is None:
        raise LogError(f"no table [signals]. {ROWS}")
    return mapping_from(rows, table.path.name)


ROWS = 'Write rows such as p_a = { column = "PT101", unit = "bar" } below it.'
APART = ("time", "p_a", "p_b", "omega_m", "u_p", "s_w", "F_w")
"""Signals that cannot be one another: none of them may share a column."""


def mapping_from(table: Mapping[str, Any], where: str) -> dict[str, Signal]:
    """Signals by name from the table `[signals]` of a mapping.

    Errors: LogError of one line that says where, what came, what is allowed. Units are checked against the kind of each
    signal.
    """
    if not isinstance(table, Mapping) or not table:
        raise LogError(
            f'{where}: signals = {quote(table)} names no signal. Write rows such as p_a = {{ column = "PT101", unit ='
            ' "bar" }.'
        )
    rows = {name: _signal(name, row, f"{where}: signals.{name}") for name, row in table.items()}
    columns: dict[str, str] = {}
    for name in (n for n in APART if n in rows):
        column = rows[name].column
        if column in columns:
            raise LogError(
                f"{where}: signals.{name}: column {quote(column)} is that of {columns[column]} already. Map"
                " another one."
            )
        columns[column] = name
    return rows


def _signal(name: str, row: Any, where: str) -> Signal:
    fields = row_of(row, SignalTable, where)
    kind = _kind(name, fields.quantity, where)
    lo, hi = _range(fields.range, kind, where)
    if name == "time" and (fields.clock is not None or lo is not None or fields.sign != 1):
        raise LogError(f"{where}: time takes column, unit, scale and offset only.")
    return Signal(
        name,
        fields.column,
        _unit(name, fields.unit, kind, where),
        fields.sign,
        fields.scale,
        fields.offset,
        fields.clock,
        lo,
        hi,
        kind,
        tuple((word.strip(), value) for word, value in fields.words.items()),
    )


def resolved(signal: Signal, headings: Sequence[str], where: str) -> Signal:
    """A signal whose column is written with its unit, "PT101 [bar]", which is not a heading of the file as it is."""
    column, unit = apart(signal.column, signal.unit, headings)
    return replace(signal, column=column, unit=_unit(signal.name, unit, signal.quantity, f"{where}: {signal.name}"))


def _kind(name: str, quantity: Any, where: str) -> str:
    """The kind of a signal: that of the variable of this name, or the one that is given."""
    quantity_of_name = "time" if name == "time" else PHYSICAL[name].kind if name in PHYSICAL else None
    if quantity is None:
        if quantity_of_name is None:
            near = nearest(name, ("time", *PHYSICAL))
            raise LogError(
                f"{where}: {quote(name)} is not a signal of Stillhook{near} For another name give what "
                f'it measures, such as quantity = "pressure" (one of {", ".join(KINDS)}, or "" for a pure number).'
            )
        return quantity_of_name
    if quantity != "" and quantity not in KINDS:
        raise LogError(
            f'{where}.quantity = {quote(quantity)} is not one of {", ".join(KINDS)}, or "" for a pure number.'
        )
    if quantity_of_name is not None and quantity != quantity_of_name:
        raise LogError(
            f"{where}.quantity = {quote(quantity)}: {name} measures {quote(quantity_of_name or 'a pure number')}. Leave"
            " quantity out."
        )
    return str(quantity)


def _unit(name: str, unit: Any, kind: str, where: str) -> str | None:
    if unit is None:
        return None
    if not isinstance(unit, str):
        raise UnitError(f"{where}.unit = {quote(unit)}: write it as text (allowed: {allowed(name, kind)}).")
    if name == "time" and ("%" in unit or unit == STAMPS):
        return unit
    if table_unit(unit, kind) is None:
        raise UnitError(f"{where}.unit = {quote(unit)} is not one of {allowed(name, kind)}.{hint(unit, kind)}")
    return our_unit(unit, kind) or unit


def allowed(name: str, kind: str) -> str:
    """The units that a signal may be in, as text."""
    stamps = (
        f', {STAMPS} (ISO 8601 stamps), a pattern of stamps such as "%d.%m.%Y %H:%M:%S%.f"' if name == "time" else ""
    )
    return ", ".join(KINDS[kind].allowed if kind else PURE) + stamps


def factors(signal: Signal, unit: str) -> tuple[float, float]:
    """Factor and offset with value [SI] = factor * raw + offset."""
    if not signal.quantity:
        factor, zero = PURE[unit], 0.0
    elif our_unit(unit, signal.quantity) is None and (known := table_unit(unit, signal.quantity)) is not None:
        factor, zero = known[1], 0.0  # a load cell's tonnes
    else:
        zero = parse(f"0 {unit}", signal.quantity)
        factor = parse(f"1 {unit}", signal.quantity) - zero if zero else parse(f"1 {unit}", signal.quantity)
    return signal.sign * factor * signal.scale, signal.sign * (factor * signal.offset + zero)


def _range(ends: Any, kind: str, where: str) -> tuple[float | None, float | None]:
    if ends is None:
        return None, None
    if not isinstance(ends, Sequence) or isinstance(ends, str) or len(ends) != 2:
        example = f'["0 {KINDS[kind].display}", "400 {KINDS[kind].display}"]' if kind else "[-1, 1]"
        raise LogError(f"{where}.range = {quote(ends)}: write the two ends of the sensor, such as {example}.")
    lo, hi = (_end(end, kind, f"{where}.range") for end in ends)
    if lo >= hi:
        raise LogError(f"{where}.range = {quote(ends)}: the first end must be below the second.")
    return lo, hi


def _end(end: Any, kind: str, where: str) -> float:
    if kind:
        return parse(end, kind, where)
    try:
        return pure_number(end)
    except ValueError as problem:
        raise LogError(f"{where}: {quote(end)}: {problem}") from None


def split_heading(heading: str) -> tuple[str, str]:
    """Name and unit of a heading such as "p_a [bar]" or "Pos(in)"; the unit is "" where there is none."""
    match = _HEADING.fullmatch(heading)
    if match is None:
        return heading.strip(), ""
    return match[1].strip(), (match[2] or match[3] or "").strip()


def mapping_from_headings(headings: Sequence[str], source: str) -> dict[str, Signal]:
    """The mapping that a file carries in its headings, where they are names of Stillhook: "p_a [bar]". Others are left
    alone."""
    mapping: dict[str, Signal] = {}
    for heading in headings:
        name, _ = split_heading(heading)
        if name != "time" and name not in PHYSICAL:
            continue
        if name in mapping:
            raise LogError(
                f"{source}: two columns {quote(name)}: {quote(mapping[name].column)} and {quote(heading)}."
                " Rename one, or"
                " give a mapping."
            )
        mapping[name] = Signal(name, heading, quantity="time" if name == "time" else PHYSICAL[name].kind)
    return mapping


def place_of(column: str, headings: Sequence[str], where: str) -> int:
    """Index of the column that a mapping names: by its complete heading, by the heading without its unit, or by its
    place.

    Errors: LogError that lists the nearest headings.
    """
    for match in (
        lambda h: h.strip() == column,
        lambda h: split_heading(h)[0] == column,
        lambda h: h.strip().lower() == column.lower(),
        lambda h: split_heading(h)[0].lower() == column.lower(),
    ):
        matches = [i for i, heading in enumerate(headings) if match(heading)]
        if len(matches) > 1:
            places = ", ".join(str(i + 1) for i in matches)
            raise LogError(
                f"{where}: {len(matches)} columns {quote(column)} (places {places}). Give the place of one, such"
                " as column"
                f" = {matches[0] + 1}."
            )
        if matches:
            return matches[0]
    if column.isdecimal() and 1 <= int(column) <= len(headings):
        return int(column) - 1
    near = difflib.get_close_matches(column, list(dict.fromkeys(h.strip() for h in headings)), n=3, cutoff=0.4)
    names = ", ".join(quote(h) for h in near or headings[:12])
    more = f" and {len(headings) - 12} more" if not near and len(headings) > 12 else ""
    raise LogError(
        f"{where}: no column {quote(column)} in the file. {'The nearest are' if near else 'It has'} {names}{more}."
    )
