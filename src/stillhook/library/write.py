"""A crane back to a complete crane file, sources included."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple, get_args

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from stillhook.library.toml.tree import LABELS, Leaf, Tree
from stillhook.spec.crane import Crane, Source, SourceKind, Spec
from stillhook.units import KINDS, Quantity, parse, show

_UNSTATED = Source(text="not stated", kind=SourceKind.USER)
COMPANIONS = ("sources", "certified")
"""Fields of a crane that are no values of it."""
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
    return leaves(crane, crane.sources)


def leaves(spec: Spec, sources: Mapping[str, Source]) -> Iterator[Item]:
    """Every value of a table of a crane file, depth first, with its source out of those of the table; absent options
    are left out."""
    for path, name, field, value in _walk(spec, ""):
        yield Item(path, field.description or name, value, _quantity(field), sources.get(path, _UNSTATED))


def _walk(spec: Spec, path: str) -> Iterator[tuple[str, str, FieldInfo, Any]]:
    for name, field in type(spec).model_fields.items():
        value = spec.__dict__.get(name)
        place = f"{path}.{name}" if path else name
        if isinstance(value, Spec):
            yield from _walk(value, place)
        elif value is not None and name not in COMPANIONS:
            yield place, name, field, str(value) if isinstance(value, str) else value


def _quantity(field: FieldInfo) -> str | None:
    """Kind of quantity of a field, also of an optional one or of a list."""
    marks = list(field.metadata)
    for inner in get_args(field.annotation):
        marks += getattr(inner, "__metadata__", ())
    return next((mark.kind for mark in marks if isinstance(mark, Quantity)), None)


def file_value(value: Any, quantity: str | None) -> Any:
    """A value as a file has it: in display units where that loses nothing, else in SI with all digits."""
    if isinstance(value, tuple):
        return [file_value(v, quantity) for v in value]
    if quantity is None:
        return value
    text = show(value, quantity, _DIGITS)
    return text if parse(text, quantity) == value else f"{value!r} {KINDS[quantity].si}"


def crane_tree(crane: Crane) -> Tree:
    """A crane as a tree of leaves, as read from a file."""
    out = leaf_tree(crane, crane.sources)
    return out if crane.certified is None else {**out, "certified": Leaf(crane.certified, _UNSTATED)}


def leaf_tree(spec: Spec, sources: Mapping[str, Source]) -> Tree:
    """A table of a crane file as a tree of leaves."""
    out: Tree = {}
    for item in leaves(spec, sources):
        *tables, name = item.path.split(".")
        branch = out
        for table in tables:
            below = branch.setdefault(table, {})
            assert isinstance(below, dict)
            branch = below
        branch[name] = Leaf(file_value(item.value, item.quantity), item.source)
    return out


def crane_toml(crane: Crane) -> str:
    """A crane as a complete crane file: ``load_crane`` reads the same crane from it, sources and the record of its
    certificate included."""
    tables = leaf_tables(crane, crane.sources)
    return joined(tables if crane.certified is None else tables | record_tables(crane.certified, "certified"))


def certified_crane_toml(crane: Crane, certificate: str = "certificate.json") -> str:
    """A crane as a complete crane file that names its certificate, a path seen from that file; it is self-contained
    next to it."""
    tables = leaf_tables(crane, crane.sources)
    tables[""].insert(0, f"certificate = {toml_value(certificate)}")
    return joined(tables)


def record_tables(record: BaseModel, name: str) -> dict[str, list[str]]:
    """The lines of a record without sources, by their table: quantities as texts, records and mappings within as tables
    of their own."""
    tables: dict[str, list[str]] = {name: []}
    for key, field in type(record).model_fields.items():
        value = getattr(record, key)
        if isinstance(value, BaseModel):
            tables |= record_tables(value, f"{name}.{key}")
        elif isinstance(value, Mapping):
            tables[f"{name}.{key}"] = [f"{toml_value(k)} = {toml_value(v)}" for k, v in value.items()]
        elif value is not None:
            tables[name].append(f"{key} = {toml_value(file_value(value, _quantity(field)))}")
    return tables


def leaf_tables(spec: Spec, sources: Mapping[str, Source]) -> dict[str, list[str]]:
    """The lines of a file by their table ("": top), every value with kind and source."""
    tables: dict[str, list[str]] = {"": []}
    for item in leaves(spec, sources):
        table, _, name = item.path.rpartition(".")
        value = toml_value(file_value(item.value, item.quantity))
        if item.path not in LABELS:
            kind, source = toml_value(item.source.kind.value), toml_value(item.source.text)
            value = f"{{ value = {value}, kind = {kind}, source = {source} }}"
        tables.setdefault(table, []).append(f"{name} = {value}")
    return tables


def joined(tables: Mapping[str, list[str]]) -> str:
    """The text of a file from the lines of its tables."""
    return "\n\n".join("\n".join([f"[{t}]", *lines] if t else lines) for t, lines in tables.items()) + "\n"


def toml_value(value: Any) -> str:
    """A text, a number or a list of them as TOML writes it."""
    if isinstance(value, list):
        return f"[{', '.join(toml_value(v) for v in value)}]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
    return repr(value)
