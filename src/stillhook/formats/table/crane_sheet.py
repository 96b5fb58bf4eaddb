"""The sheet of a crane as a table of Excel or CSV (field, value, kind, source, meaning), and a crane file out of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from stillhook.base.gateway.parse import from_toml
from stillhook.errors import SpecError, UnreadableError
from stillhook.formats.table.read import open_table
from stillhook.formats.table.workbook import Sheet
from stillhook.library import crane_from_toml
from stillhook.library.toml.tree import LABELS
from stillhook.library.write import file_value, items, joined, toml_value
from stillhook.spec.crane import Crane, SourceKind
from stillhook.units import quote

HEADINGS = ("field", "value", "kind", "source", "meaning")
NEEDED = HEADINGS[:2]
LIST = ";"
"""Between the values of a list, and behind the only one of a list."""


def crane_sheet(crane: Crane) -> Sheet:
    """Every value of a crane with its kind and source, as its file has them: text with a unit, numbers, lists."""
    rows = []
    for item in items(crane):
        value = file_value(item.value, item.quantity)
        written = _cell(value)
        rows.append((item.path, written, item.source.kind.value, item.source.text, item.meaning))
    return Sheet("crane", HEADINGS, rows)


def crane_file_of_sheet(path: Path) -> str:
    """The text of a complete crane file from such a table; a row without a value is left out, one without kind and
    source counts as yours.

    Errors: SpecError, UnitError of one line that name file and row, or the field as a crane file does.
    """
    table = open_table(path, SpecError)
    places = {heading.strip().lower(): i for i, heading in enumerate(table.headings)}
    if missing := [name for name in NEEDED if name not in places]:
        raise SpecError(f"{table.header}: no column {quote(missing[0])}. A sheet of a crane has {', '.join(HEADINGS)}.")
    tables: dict[str, list[str]] = {"": []}
    seen: dict[str, int] = {}
    for i, row in enumerate(table.rows):
        field, value, kind, source = (row[places[name]] if name in places else "" for name in HEADINGS[:4])
        if not field or not value:
            continue
        if field in seen:
            raise SpecError(f"{table.at(i)}: {quote(field)} is given twice, first in row {seen[field]}. Write it once.")
        if not all(part.isidentifier() for part in field.split(".")):
            raise SpecError(f"{table.at(i)}: field {quote(field)}: write its dotted name, such as active.motor.D_max.")
        if kind and kind not in set(SourceKind):
            raise SpecError(f"{table.at(i)}: kind {quote(kind)}: choose {', '.join(SourceKind)}.")
        seen[field] = table.lines[i]
        where, _, name = field.rpartition(".")
        written = toml_value(_value(value))
        if field not in LABELS and source:
            origin = f"kind = {toml_value(kind or SourceKind.USER.value)}, source = {toml_value(source)}"
            written = f"{{ value = {written}, {origin} }}"
        tables.setdefault(where, []).append(f"{name} = {written}")
    text = joined(tables)
    crane_from_toml(text, path.name)
    return text


def _cell(value: Any) -> Any:
    """A value as a cell: a list as text."""
    if isinstance(value, list):
        return f"{LIST} ".join(map(str, value)) + (LIST if len(value) == 1 else "")
    return str(value).lower() if isinstance(value, bool) else value


def _value(cell: str) -> Any:
    """A cell as a value of TOML: a number or a list where it is one, else a text."""
    if LIST in cell:
        return [_value(part.strip()) for part in cell.split(LIST) if part.strip()]
    try:
        return from_toml(f"x = {cell}")["x"]
    except UnreadableError:
        return cell
