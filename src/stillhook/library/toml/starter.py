"""Starter files: a file that is complete as it is, with what its models say of every field: meaning, units, bounds,
choices and default.

Fields that the example leaves out follow as remarks, ready to be uncommented.
"""

from __future__ import annotations

import datetime
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Literal, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from stillhook.library.write import file_value, quantity_of, toml_value
from stillhook.tables.plausible import ranges_of
from stillhook.tables.table import model_in
from stillhook.units import KINDS, number, show

_BOUNDS = ((Gt, "gt", ">"), (Ge, "ge", ">="), (Lt, "lt", "<"), (Le, "le", "<="))
_LEAF = {"value", "kind"}
"""Keys of a value that is written with its source."""
COLUMN = 44
"""Column at which remarks begin, where what is left of them ends before it."""

Flat = Callable[[type[BaseModel], Mapping[str, Any]], Sequence[type[BaseModel]]]
"""Models whose fields a table has in addition to those of its own model."""


@dataclass(frozen=True)
class Starter:
    """How an example becomes a starter file.

    hidden: fields that are left out, by name, or as "Model.name" of one model; off: whether the example's values are
    remarks too; on: top fields that are not; remark: what is added to the remark of a value, by its dotted place;
    flat: see `Flat`.
    """

    hidden: frozenset[str] = frozenset()
    off: bool = False
    on: frozenset[str] = frozenset()
    remark: Mapping[str, str] = field(default_factory=dict)
    flat: Flat = lambda model, data: ()

    def text(self, model: type[BaseModel], data: Mapping[str, Any], head: Sequence[str]) -> str:
        """The file: remarks on top, the fields of the example, and those that it leaves out as remarks."""
        lines = [f"# {line}" for line in head]
        return "\n".join([*lines, *self._table(model, data, "", "", explained=True)]).replace("\n\n\n", "\n\n") + "\n"

    def _table(
        self, model: type[BaseModel], data: Mapping[str, Any] | None, path: str, head: str, *, explained: bool
    ) -> Iterator[str]:
        """Lines of a table, values first; data None: a table that the example leaves out."""
        stated, absent = data or {}, data is None
        models = (model, *self.flat(model, stated))
        fields = {name: (of.model_fields[name], of) for of in models for name in of.model_fields}
        tables: list[tuple[str, FieldInfo, Any]] = []
        if head:
            yield f"# {head}" if absent else head
        for name, (info, of) in fields.items():
            value = stated.get(name)
            if {name, f"{of.__name__}.{name}"} & self.hidden or (name not in stated and not explained):
                continue
            if _is_table(value, info):
                tables.append((name, info, value))
                continue
            place = f"{path}{name}"
            off = absent or name not in stated or (self.off and place not in self.on)
            row = f"{'# ' if off else ''}{name} = {_written(value) if name in stated else _blank(info)}"
            note = remark(name, info, of) if explained else ""
            if name not in stated:
                note += "; required" if absent and info.is_required() else "; optional"
            note = "; ".join(part for part in (note.removeprefix("; "), self.remark.get(place, "")) if part)
            yield f"{row:<{COLUMN}}  # {note}" if note else row
        for name, info, value in tables:
            yield from self._below(name, info, value, path, explained=explained and not absent)

    def _below(self, name: str, info: FieldInfo, value: Any, path: str, *, explained: bool) -> Iterator[str]:
        """A table, a list of tables, or tables by name."""
        model, place = model_in(info.annotation), f"{path}{name}"
        rows = value if isinstance(value, list | tuple) else None
        if model is None and "." in path:
            yield f"{name} = {toml_value(value)}"
        elif model is None:
            yield from ("", f"[{place}]", *(f"{key} = {toml_value(each)}" for key, each in value.items()))
        elif rows is not None:
            for i, row in enumerate(rows):
                yield ""
                yield from self._table(model, row, f"{place}.", f"[[{place}]]", explained=explained and not i)
        elif isinstance(value, Mapping) and not set(value) <= _names(model):
            for i, (key, row) in enumerate(value.items()):
                yield ""
                yield from self._table(model, row, f"{place}.{key}.", f"[{place}.{key}]", explained=explained and not i)
        elif value is not None or explained:
            yield ""
            yield from self._table(model, value, f"{place}.", f"[{place}]", explained=True)


def _names(model: type[BaseModel]) -> set[str]:
    return set(model.model_fields) | {"shape"}


def _is_table(value: Any, info: FieldInfo) -> bool:
    if isinstance(value, Mapping):
        return not _LEAF <= value.keys()
    if isinstance(value, list | tuple):
        return bool(value) and all(isinstance(row, Mapping) for row in value)
    return value is None and model_in(info.annotation) is not None and get_origin(info.annotation) is not tuple


def _written(value: Any) -> str:
    return value.isoformat() if isinstance(value, datetime.date) else toml_value(value)


def _blank(info: FieldInfo) -> str:
    """The default of a field as a file has it; an empty text where it has none."""
    default = info.get_default(call_default_factory=False)
    if default is None or default is PydanticUndefined or isinstance(default, BaseModel):
        return '""'
    if isinstance(default, float) and not math.isfinite(default):
        return '""'
    value = file_value(default, quantity_of(info) if isinstance(default, float | tuple) else None)
    value = list(value) if isinstance(value, tuple) else value
    return toml_value(str(value) if isinstance(value, StrEnum) else value)


def remark(name: str, info: FieldInfo, model: type[BaseModel]) -> str:
    """What a model says of a field: meaning, choices, units, bounds, and what was ever built."""
    kind = quantity_of(info)
    parts = [info.description or "", " | ".join(_choices(info.annotation))]
    if kind is not None:
        parts.append(", ".join(dict.fromkeys(KINDS[kind].allowed)))
    parts.append(", ".join(_bounds(info, kind)))
    if ranges := ranges_of(model, name):
        low, high = (ranges[0].text(end) for end in (ranges[0].low, ranges[0].high))
        parts.append(f"built: {low.removesuffix(high.partition(' ')[2]).strip()} to {high}")
    return "; ".join(part for part in parts if part)


def _choices(annotation: Any) -> tuple[str, ...]:
    if isinstance(annotation, type) and issubclass(annotation, StrEnum):
        return tuple(member.value for member in annotation)
    if get_origin(annotation) is Literal:
        return tuple(map(str, get_args(annotation)))
    return next((found for part in get_args(annotation) if (found := _choices(part))), ())


def _bounds(info: FieldInfo, kind: str | None) -> Iterator[str]:
    marks = [*info.metadata, *getattr(info.annotation, "__metadata__", ())]
    for inner in get_args(info.annotation):
        for mark in getattr(inner, "__metadata__", ()):
            marks += getattr(mark, "metadata", [mark])
    for of, attribute, word in _BOUNDS:
        for mark in marks:
            if isinstance(mark, of) and abs(end := float(getattr(mark, attribute))) < math.inf:
                yield f"{word} {show(end, kind) if kind and end else number(end)}"
