"""A crane back to a complete crane file, sources included."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any, NamedTuple, get_args

from pydantic.fields import FieldInfo

from stillhook.crane import Crane, Source, SourceKind, Spec
from stillhook.library.files import Leaf, Tree
from stillhook.units import KINDS, Quantity, parse, show

_UNSTATED = Source(text="not stated", kind=SourceKind.USER)
_DIGITS = 12  # significant digits tried in display units before SI with all digits


class Item(NamedTuple):
    """One value of a crane: dotted path, meaning, SI value, kind of quantity (None for ratios and texts), source."""

    path: str
    meaning: str
    value: Any
    quantity: str | None
    source: Source


def items(crane: Crane) -> Iterator[Item]:
    """Every value of a crane, depth first; absent options are left out."""
    for path, name, field, value in _walk(crane, ""):
        yield Item(path, field.description or name, value, _quantity(field), crane.sources.get(path, _UNSTATED))


def _walk(spec: Spec, path: str) -> Iterator[tuple[str, str, FieldInfo, Any]]:
    for name, field in type(spec).model_fields.items():
        value = getattr(spec, name)
        place = f"{path}.{name}" if path else name
        if isinstance(value, Spec):
            yield from _walk(value, place)
        elif value is not None and name != "sources":
            yield place, name, field, str(value) if isinstance(value, str) else value


def _quantity(field: FieldInfo) -> str | None:
    """Kind of quantity of a field, also of an optional one or of a list."""
    marks = list(field.metadata)
    for inner in get_args(field.annotation):
        marks += getattr(inner, "__metadata__", ())
    return next((mark.kind for mark in marks if isinstance(mark, Quantity)), None)


def _written(value: Any, quantity: str | None) -> Any:
    """A value as a file has it: in display units where that loses nothing, else in SI with all digits."""
    if isinstance(value, tuple):
        return [_written(v, quantity) for v in value]
    if quantity is None:
        return value
    text = show(value, quantity, _DIGITS)
    return text if parse(text, quantity) == value else f"{value!r} {KINDS[quantity].si}"


def crane_tree(crane: Crane) -> Tree:
    """A crane as a tree of leaves, as read from a file."""
    out: Tree = {}
    for item in items(crane):
        *tables, name = item.path.split(".")
        here = out
        for table in tables:
            below = here.setdefault(table, {})
            assert isinstance(below, dict)
            here = below
        here[name] = Leaf(_written(item.value, item.quantity), item.source)
    return out


def crane_toml(crane: Crane) -> str:
    """A crane as a complete crane file: ``load_crane`` reads the same crane from it, sources included."""
    tables: dict[str, list[str]] = {"": []}
    for item in items(crane):
        table, _, name = item.path.rpartition(".")
        value = _toml(_written(item.value, item.quantity))
        if item.path not in {"name", "title"}:
            kind, source = _toml(item.source.kind.value), _toml(item.source.text)
            value = f"{{ value = {value}, kind = {kind}, source = {source} }}"
        tables.setdefault(table, []).append(f"{name} = {value}")
    return "\n\n".join("\n".join([f"[{t}]", *lines] if t else lines) for t, lines in tables.items()) + "\n"


def _toml(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(_toml(v) for v in value)}]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
    return repr(value)
