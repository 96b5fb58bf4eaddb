"""A table of rigging as a planner's sheet has it, CSV or XLSX: a row an item, with its WLL, or its MBL and factor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from stillhook.base.gateway.guard import reader
from stillhook.errors import PlanError, ScenarioError, all_of
from stillhook.formats.table.columns import ColumnSpec, missing_column, place_of, si_values, unit_in
from stillhook.formats.table.dialect import MISSING, table_unit
from stillhook.formats.table.read import open_table
from stillhook.formats.table.text import TextTable
from stillhook.physics.scalar import G
from stillhook.spec.lift.rigging import ItemKind, RiggingItem
from stillhook.units import quote

NAME = ColumnSpec("item", "", ("name", "description", "component", "part"), "item", required=True)
KIND = ColumnSpec("kind", "", ("type",), "kind")
NUMBERS = (
    ColumnSpec("WLL", "force", ("swl", "working_load_limit"), "WLL [t]"),
    ColumnSpec("MBL", "force", ("mbf", "minimum_breaking_load", "breaking_load"), "MBL [t]"),
    ColumnSpec("factor", "", ("safety_factor", "sf"), "factor [1]"),
    ColumnSpec("dynamic", "", ("dynamic_factor",), "dynamic [1]"),
)
ALSO = {"padeye": "lift-point", "trunnion": "lift-point", "grommet": "sling", "ring": "master-link"}
"""Other words of planners' sheets for kinds of items."""
SOURCE = ColumnSpec("source", "", ("certificate", "reference", "drawing"), "source")


@reader(PlanError)
def read_items(path: Path) -> tuple[RiggingItem, ...]:
    """The items of a table, in its order. Errors: PlanError, UnitError of one line that names file and row: a column
    that is missing or has no unit, a kind that is none, an item without a rated load."""
    table = replace(open_table(path, PlanError), row="row")
    table = replace(table, comma=True)
    names = _texts(table, NAME)
    if names is None:
        raise missing_column(table, NAME, "Name the column so.")
    if all(place_of(table, spec) is None for spec in NUMBERS[:2]):
        raise missing_column(table, NUMBERS[0], "Add WLL, or MBL and factor.")
    columns: dict[str, Any] = {spec.name: _numbers(table, spec) for spec in NUMBERS}
    kinds, sources = _texts(table, KIND), _texts(table, SOURCE)
    items, problems = [], []
    for i, name in enumerate(names):
        row = {key: float(x[i]) for key, x in columns.items() if x is not None and np.isfinite(x[i])}
        try:
            items.append(_item(table, i, name, row, kinds, sources))
        except PlanError as problem:
            problems.append(problem)
    if problems:
        raise all_of(problems)
    return tuple(items)


def _item(
    table: TextTable, i: int, name: str, row: Mapping[str, float], kinds: list[str] | None, sources: list[str] | None
) -> RiggingItem:
    text = "sling" if kinds is None else "-".join(kinds[i].lower().split()) or "sling"
    known = {kind.value: kind for kind in ItemKind}
    words = [ALSO.get(word, word) for word in (text, text.removesuffix("s"))]
    kind = next((known[word] for word in words if word in known), None)
    if kind is None:
        raise PlanError(f"{table.at(i)}: kind {quote(kinds[i] if kinds else text)} is not one of {', '.join(known)}.")
    data: dict[str, Any] = {key: f"{value!r} N" if key in ("WLL", "MBL") else value for key, value in row.items()}
    try:
        source = "" if sources is None else sources[i]
        return RiggingItem(name=name or f"item {i + 1}", kind=kind, source=source, **data)
    except ScenarioError as problem:
        raise PlanError(f"{table.at(i)}: {str(problem).removeprefix('RiggingItem: ')}") from None


def _texts(table: TextTable, spec: ColumnSpec) -> list[str] | None:
    place = place_of(table, spec)
    return None if place is None else table.column(place)


def _numbers(table: TextTable, spec: ColumnSpec) -> Any:
    """A column in SI, loads as forces; None where the table has none, NaN in an empty cell."""
    place = place_of(table, spec)
    if place is None:
        return None
    if not spec.kind:
        return si_values(table, spec, place, MISSING)
    unit = unit_in(table, place, "mass")
    if unit is not None and table_unit(unit, "mass") is not None:
        return si_values(table, replace(spec, kind="mass"), place, MISSING) * G
    return si_values(table, spec, place, MISSING)
