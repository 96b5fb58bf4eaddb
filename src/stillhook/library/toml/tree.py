"""TOML files to trees of leaves, each leaf a value with its source.

A leaf is written ``{ value = "96 mm", kind = "published", source = "paper E table 1" }`` or, in a user's own file,
plainly ``"96 mm"`` (kind "user"). Trees of one file are laid over those of another: tables merge, leaves replace.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stillhook.base.choice import nearest
from stillhook.base.gateway.access import read_text
from stillhook.base.gateway.budget import TOML
from stillhook.base.gateway.parse import from_toml
from stillhook.errors import SpecError, UnreadableError
from stillhook.library.toml.kinds import LIBRARY, FileKind, kind_of_text, refuse_other
from stillhook.spec.crane import Source, SourceKind
from stillhook.units import quote

LABELS = frozenset({"name", "title"})  # texts that need no source
EVIDENCE = "evidence"  # table of a parameter set: how well it is known
LONGEST_KEY = 100  # characters; the longest field has 15

_LEAF_KEYS = frozenset({"value", "kind", "source"})
_ONE_VALUE = (str, int, float, bool, Path)


@dataclass(frozen=True, slots=True)
class Leaf:
    """A value as written, and where it is from."""

    value: Any
    source: Source


Tree = dict[str, "Leaf | Tree"]


@functools.cache
def shelf(name: str, ending: str = ".toml") -> tuple[str, ...]:
    """Names of the files on one shelf of the library, in order."""
    return tuple(sorted(_files(name, ending)))


@functools.cache
def _files(name: str, ending: str) -> Mapping[str, Path]:
    """Files on a shelf and in its folders, by name."""
    return {file.name.removesuffix(ending): file for file in (LIBRARY / name).rglob(f"*{ending}")}


def library_tree(shelf_name: str, name: str, where: str) -> Tree:
    """One file of the library less its evidence; SpecError that names ``where`` if there is none of this name."""
    _refuse_unknown(shelf_name, name, where)
    copy: Tree = _fresh(_tree(shelf_name, name))
    return copy


def library_table(shelf_name: str, name: str, where: str) -> dict[str, Any]:
    """One file of the library as it is parsed; SpecError that names ``where`` if there is none of this name."""
    _refuse_unknown(shelf_name, name, where)
    copy: dict[str, Any] = _fresh(_table(shelf_name, name))
    return copy


def _refuse_unknown(shelf_name: str, name: str, where: str) -> None:
    if name not in shelf(shelf_name):
        have = f"{', '.join(shelf(shelf_name))}{nearest(name, shelf(shelf_name))}"
        raise SpecError(f"{where} = {quote(name)}: not in the library, which has {have}")


@functools.cache
def _tree(shelf_name: str, name: str) -> Tree:
    table = {key: value for key, value in _table(shelf_name, name).items() if key != EVIDENCE}
    return tree(table, f"{name}.toml", user=False)


@functools.cache
def _table(shelf_name: str, name: str) -> dict[str, Any]:
    text = _files(shelf_name, ".toml")[name].read_text(encoding="utf-8")
    return parsed(text, f"{name}.toml")


def _fresh(node: Any) -> Any:
    """Tables and lists that a caller may change."""
    if isinstance(node, dict):
        return {key: _fresh(item) for key, item in node.items()}
    return [_fresh(item) for item in node] if isinstance(node, list) else node


def file_tree(path: Path) -> Tree:
    """A user's own file; SpecError of one line if it cannot be read as TOML."""
    return tree(parsed(toml_text(path), path.name, FileKind.CRANE), path.name, user=True)


def toml_text(path: Path) -> str:
    """The text of a TOML file of a sensible size; SpecError of one line if there is none."""
    return read_text(path, "TOML file", SpecError, TOML)


START_CRANE = 'Start it with base = "nov-250t", or copy a crane of the library.'


def parsed(text: str, name: str, *kinds: FileKind, start: str = START_CRANE) -> dict[str, Any]:
    """The tables of a TOML text of one of these kinds (none for the library's own); SpecError of one line, naming the
    file, if it is empty (start says what to do then), not TOML, or known to be of another kind."""
    if not text.strip():
        raise SpecError(f"{name}: empty. {start}")
    try:
        table = from_toml(text)
    except UnreadableError as problem:
        if other := kind_of_text(text):
            raise SpecError(f"{name}: {other}.") from None
        raise SpecError(f"{name}: not valid TOML: {problem}. Correct that line.") from None
    refuse_other(table, name, *kinds)
    return table


def tree(table: Mapping[str, Any], name: str, *, user: bool, path: str = "") -> Tree:
    """Tables and leaves of a parsed file; plain values are allowed in a user's file only."""
    out: Tree = {}
    for key, value in table.items():
        if not isinstance(key, str) or not key.isprintable() or len(key) > LONGEST_KEY:
            raise SpecError(f"{name}: {path or 'top'}: key {quote(key)} is not a field. Write the name of a field.")
        place = f"{path}.{key}" if path else key
        if isinstance(value, Mapping) and "value" not in value:
            out[key] = tree(value, name, user=user, path=place)
        elif isinstance(value, Mapping):
            out[key] = _leaf(value, name, place, user=user)
        elif user or place in LABELS:
            out[key] = Leaf(_plain(value, name, place), Source(text=f"given in {name}", kind=SourceKind.USER))
        else:
            problem = "a number of the library needs its kind and source"
            raise SpecError(f"{name}: {place}: {problem}. Write them next to its value.")
    return out


def _leaf(table: Mapping[str, Any], name: str, place: str, *, user: bool) -> Leaf:
    for key in table:
        if key not in _LEAF_KEYS:
            raise SpecError(f"{name}: {place}.{key}: a value has only value, kind and source{nearest(key, _LEAF_KEYS)}")
    kind, text = table.get("kind"), table.get("source")
    if kind is None and text is None and user:
        kind, text = SourceKind.USER.value, f"given in {name}"
    kinds = [k.value for k in SourceKind]
    if kind not in kinds:
        raise SpecError(f"{name}: {place}.kind = {quote(kind)}: not one of {', '.join(kinds)}.")
    if not isinstance(text, str) or not text.strip():
        raise SpecError(f"{name}: {place}.source = {quote(text)}: must state the source of the number, as text.")
    return Leaf(_plain(table["value"], name, place), Source(text=text, kind=SourceKind(kind)))


def _plain(value: Any, name: str, place: str) -> Any:
    """A value itself, or a list of values; anything else is refused here, where it can be named."""
    if isinstance(value, _ONE_VALUE):
        return value
    if isinstance(value, (list, tuple)):
        for i, item in enumerate(value):
            if not isinstance(item, _ONE_VALUE):
                raise SpecError(f"{name}: {place}[{i}] = {quote(item)}: a list holds numbers or texts only.")
        return list(value)
    raise SpecError(f"{name}: {place} = {quote(value)}: neither a number, a text nor a list of them.")


def overlay(below: Tree, above: Tree, name: str, path: str = "") -> Tree:
    """``above`` laid over ``below``. A table cannot replace a value, nor a value a table."""
    out = dict(below)
    for key, new in above.items():
        place = f"{path}.{key}" if path else key
        old = below.get(key)
        if isinstance(old, dict) and isinstance(new, dict):
            out[key] = overlay(old, new, name, place)
        elif isinstance(old, dict) and isinstance(new, Leaf):
            raise SpecError(f"{name}: {place} = {quote(new.value)}: must be a table, with {', '.join(old)}.")
        elif isinstance(old, Leaf) and isinstance(new, dict):
            raise SpecError(f"{name}: {place}: must be one value, not a table. Write {key} = {quote(old.value)}.")
        else:
            out[key] = new
    return out


def nested(values: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    """Tables in tables, as a crane file has them, from dotted paths with their values."""
    out: dict[str, Any] = {}
    for path, value in values:
        *tables, name = path.split(".")
        functools.reduce(lambda at, key: at.setdefault(key, {}), tables, out)[name] = value
    return out


def values(node: Tree) -> dict[str, Any]:
    """The tree without its sources, for the models to validate."""
    return {key: item.value if isinstance(item, Leaf) else values(item) for key, item in node.items()}


def sources(node: Tree, path: str = "") -> Iterator[tuple[str, Source]]:
    """Dotted path and source of every leaf."""
    for key, item in node.items():
        place = f"{path}.{key}" if path else key
        if isinstance(item, Leaf):
            yield place, item.source
        else:
            yield from sources(item, place)
