"""Columns of a history: the name, unit and meaning of each value of a row."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence

from stillhook.base.variable import Variable
from stillhook.errors import LiveError
from stillhook.units import quote
from stillhook.variables import BY_NAME

ROW, TIME, STATUS = "row", "time [s]", "status"
"""Headings of what every row has: its number, UTC since 1970, and its status."""
MOST_COLUMNS = 2000
_NAME = re.compile(r"[A-Za-z]\w{0,63}", re.ASCII)
_UNIT = re.compile(r'[^\[\]"\n]{1,40}')


def columns_of(columns: Sequence[str | Variable], place: str) -> tuple[Variable, ...]:
    """The row of the table of variables of each column; a name of one's own comes as a `Variable` with its unit.

    Errors: LiveError for a name that is unknown, taken, or two of which differ in capitals alone (DuckDB takes them for
    one), and for a unit that is missing or not that of the table.
    """
    variables = [_column(column, place) for column in columns]
    if not 1 <= len(variables) <= MOST_COLUMNS:
        raise LiveError(f"{place}: {len(variables)} columns: give 1 to {MOST_COLUMNS}.")
    seen: dict[str, str] = {}
    for variable in variables:
        other = seen.setdefault(variable.name.lower(), variable.name)
        if other != variable.name:
            raise LiveError(f"{place}: {other} and {variable.name} differ in capitals alone. Rename one of them.")
    if len(seen) < len(variables):
        names = [variable.name for variable in variables]
        twice = next(name for name in names if names.count(name) > 1)
        raise LiveError(f"{place}: {twice} is given twice. Give every column its own name.")
    return tuple(variables)


def _column(column: str | Variable, place: str) -> Variable:
    if isinstance(column, str):
        row = BY_NAME.get(column)
        if row is None:
            raise LiveError(
                f"{place}: column {quote(column)} is not a variable of Stillhook. Choose one of the nomenclature, or"
                " give a Variable with its unit."
            )
    elif isinstance(column, Variable):
        row, own = column, BY_NAME.get(column.name)
        if own is not None and own.unit != row.unit:
            raise LiveError(
                f"{place}: {row.name} is in {own.unit or 'no unit'}, and was given in {quote(row.unit)}. Give it in SI."
            )
    else:
        raise LiveError(f"{place}: column {quote(column)}: give a name, or a Variable.")
    if not _NAME.fullmatch(row.name) or row.name.lower() in (ROW, "time", STATUS):
        raise LiveError(
            f"{place}: column {quote(row.name)}: a name is a letter, then letters, digits and _, at most 64, and not"
            " row, time or status."
        )
    if not _UNIT.fullmatch(row.unit):
        raise LiveError(f"{place}: {row.name} has no unit that can be stored. Give one in SI, 1 for a pure number.")
    return row


def heading(variable: Variable) -> str:
    """Name and unit, as Stillhook's log reader takes them."""
    return f"{variable.name} [{variable.unit}]"


def to_text(columns: Sequence[Variable]) -> str:
    """Columns as they are stored, equal texts for equal columns."""
    return json.dumps([list(column) for column in columns])


def from_text(text: str) -> tuple[Variable, ...]:
    """Columns as they were stored."""
    return tuple(Variable(*row) for row in json.loads(text))
