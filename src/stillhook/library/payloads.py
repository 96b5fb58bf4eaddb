"""Payloads by their name in the library, or from a file of your own; every number of the library with its kind and
source."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from stillhook.base.nearest import nearest
from stillhook.errors import LiftError, StillhookError
from stillhook.library.toml.kinds import FileKind, other_kind
from stillhook.library.toml.tree import LABELS, library_table, parsed, shelf, sources, toml_text, tree, values
from stillhook.spec.crane import Source
from stillhook.spec.lift.payload import Payload
from stillhook.units import quote

SHELF = "payloads"


def payloads() -> tuple[str, ...]:
    """Names of the library's payloads."""
    return shelf(SHELF)


def read_payload(name_or_path: str | Path) -> Payload:
    """A payload of the library by name, or one described in a TOML file: name, mass, and levels or a shape with its
    dimensions.

    Parts of an assembly are tables [parts.NAME], levels a list of tables. Errors: LiftError of one line that names the
    file.

    >>> import stillhook
    >>> stillhook.read_payload("template-120t").mass
    120000.0
    """
    name = str(name_or_path)
    if name in payloads():
        return _payload(library_table(SHELF, name, "payload"), f"{name}.toml", user=False)
    path = Path(name)
    if path.suffix != ".toml":
        have = ", ".join(payloads())
        other = other_kind(name, FileKind.PAYLOAD)
        raise LiftError(
            f"No payload {quote(name)}: the library has {have}{nearest(name, payloads())} A file's name ends in"
            f" .toml.{other}"
        )
    try:
        text = toml_text(path)
        if not text.strip():
            raise LiftError(f"{path.name}: empty. Give name, mass and a shape with its dimensions.")
        return _payload(parsed(text, path.name, FileKind.PAYLOAD), path.name, user=True)
    except StillhookError as problem:
        raise LiftError(str(problem)) from None


def _payload(table: Mapping[str, Any], label: str, *, user: bool) -> Payload:
    fields = tree(_without_lists(table), label, user=user)
    plain_values = values(fields)
    stated_source = plain_values.get("source")
    plain, text = (
        (f"given in {label}", stated_source)
        if user and isinstance(stated_source, str) and stated_source.strip()
        else ("", "")
    )
    stated = {
        path: Source(text=text, kind=source.kind) if plain and source.text == plain else source
        for path, source in sources(fields)
        if path not in LABELS and path != "source"
    }
    try:
        return Payload(**{"name": Path(label).stem, **plain_values, "sources": stated})
    except StillhookError as problem:
        raise LiftError(f"{label}: {problem}") from None


def _without_lists(table: Mapping[str, Any]) -> dict[str, Any]:
    """Lists of tables as tables of tables, numbered from 1, so that each of their values can have a source."""
    out: dict[str, Any] = {}
    for key, item in table.items():
        if isinstance(item, list) and item and all(isinstance(row, Mapping) for row in item):
            item = {str(i): row for i, row in enumerate(item, 1)}
        out[key] = _without_lists(item) if isinstance(item, Mapping) else item
    return out
