"""Sets of rows by key that a file builds on a base: criteria and rules. What a file leaves out keeps its value."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol, TypeVar

from pydantic import Field

from stillhook.base.nearest import nearest
from stillhook.library.toml.file import TomlTable
from stillhook.tables.table import Spec, Text
from stillhook.units import quote


class SetFile(Spec):
    """The top of a file with a set."""

    base: Text | None = Field(default=None, description="set that this one changes; default: every row is stated")
    name: Text | None = Field(default=None, description="name of the set; default that of the file")
    version: Text = Field(description="version of the set")
    source: Text | None = Field(default=None, description="where the set is from")
    drop: tuple[Text, ...] = Field(default=(), description="keys of the base that are left out")


class RowTable(Spec):
    """A row of a file with a set."""

    key: Text = Field(description="its name in the set")


class Keyed(Protocol):
    """A row of a set."""

    @property
    def key(self) -> str: ...


Listed = TypeVar("Listed", bound=RowTable)
Row = TypeVar("Row", bound=Keyed)


def base_name(file: SetFile, table: TomlTable, sets: Sequence[str]) -> str | None:
    """Name of the base; None where there is none. Errors: that of the file for an unknown one."""
    if file.base is not None and file.base not in sets:
        raise table.wrong(f"Stillhook has {', '.join(sets)}{nearest(file.base, sets)}", "base")
    return file.base


def rows_on_base(
    file: SetFile,
    table: TomlTable,
    name: str,
    listed: Sequence[Listed],
    base: Sequence[Row],
    row_of: Callable[[Listed, Row | None, TomlTable], Row],
) -> tuple[Row, ...]:
    """The rows of a set: those of the base in their order, changed by `row_of` or dropped, then new ones.

    Parameters: name of the list of tables; listed its tables; row_of: makes a row of one, the base's row with its key
    (None: it has none) and its place. Errors: that of the file.
    """
    rows = {row.key: row for row in base}
    if not listed and not rows:
        raise table.error(f"{name}: none. Write one table [[{name}]] for each.")
    for key in file.drop:
        if key not in rows:
            raise table.error(f"drop: the base has no {name} {quote(key)}{nearest(key, rows)}")
    keys = [row.key for row in listed]
    for i, row in enumerate(listed):
        place = table.at(name, i)
        if row.key in keys[:i] or row.key in file.drop:
            problem = "comes twice" if row.key in keys[:i] else "is dropped as well"
            raise place.wrong(f"{problem}. Write it once.")
        rows[row.key] = row_of(row, rows.get(row.key), place)
    return tuple(row for row in rows.values() if row.key not in file.drop)


def numbers_on_base(
    table: TomlTable,
    name: str,
    stated: Mapping[str, Any],
    known: Mapping[str, tuple[str, str]],
    base: Mapping[str, float],
    example: str,
) -> dict[str, float]:
    """The numbers of a set [SI]: those of its table `name` on top of those of the base, all above 0.

    Parameters: stated: that table; known: kind of quantity and meaning by name; example: a base that has all of them.
    Errors: that of the file; UnitError.
    """
    out = dict(base)
    for key in stated:
        if key not in known:
            raise table.error(
                f"{table.place(name, key)}: unknown field{nearest(key, known)} Allowed: {', '.join(known)}."
            )
        out[key], _ = table.quantity(known[key][0], name, key)
        if not out[key] > 0.0:
            raise table.wrong("must be more than zero.", name, key)
    for key, (_, meaning) in known.items():
        if key not in out:
            raise table.error(
                f'{table.place(name, key)}: missing ({meaning}). Add it, or start the file with base = "{example}".'
            )
    return {key: out[key] for key in known}
