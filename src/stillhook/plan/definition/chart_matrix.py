"""Load charts that are written as a matrix: radii down, and a column of SWL for each wave height, "SWL Hs 1,5 m (t)",
or for each sector of slewing, "SWL 90 deg (t)"; or wave heights down and a column for each radius, "SWL 15 m [t]".

They are read as the same chart in long form, one row a point.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import NamedTuple

from stillhook.errors import PlanError
from stillhook.formats.table.columns import ColumnChoice, ColumnSpec, place_of, split_heading, unit_in
from stillhook.formats.table.text import TextTable
from stillhook.units import KINDS, quote

_SWL = re.compile(r"\b(swl|wll|capacity|safe[ _]working[ _]load|rated[ _](capacity|load)|tragf\w+|traglast)\b")
_HEIGHT = re.compile(r"\b(?:hs|h_s|hm0)\b\D{0,12}?(\d+(?:[.,]\d+)?)\s*m\b")
_SECTOR = re.compile(r"(\d+(?:[.,]\d+)?)\s*(?:deg\b|°)|\b(?:over|slew|sector)\b")
_RADIUS = re.compile(r"(\d+(?:[.,]\d+)?)\s*m\b")
_STILL = re.compile(r"\b(harbou?r|hafen|havn|inshore|onboard|on board|internal|in air, calm|static)\b")


class Cells(NamedTuple):
    """A column of a matrix: its place, and the number of its heading as it is written; "" of a sector."""

    place: int
    value: str


def long_form(
    table: TextTable, specs: Mapping[str, ColumnSpec], chosen: Mapping[str, ColumnChoice]
) -> tuple[TextTable, tuple[str, ...]]:
    """A chart in long form, and what was left out or made of a matrix; any other chart as it is.

    Errors: PlanError of one line for a matrix whose headings do not say what their numbers are for.
    """
    down = next((n for n in ("radius", "Hs") if place_of(table, specs[n], chosen.get(n)) is not None), None)
    if down is None or "SWL" in chosen or place_of(table, specs["SWL"]) is not None:
        return table, ()
    first = place_of(table, specs[down], chosen.get(down))
    assert first is not None
    loads = {i: split_heading(h)[0] for i, h in enumerate(table.headings) if i != first and _is_load(table, i)}
    if not loads:
        return table, ()
    still = [i for i, name in loads.items() if _STILL.search(name)]
    rest = {i: name for i, name in loads.items() if i not in still}
    notes = [f"not read, without waves: {', '.join(quote(table.headings[i]) for i in still)}"] if still else []
    pattern, across = (_HEIGHT, "Hs") if down == "radius" else (_RADIUS, "radius")
    cells = [Cells(i, m[1]) for i, name in rest.items() if (m := pattern.search(name))]
    if len(cells) == len(rest) and cells:
        units = {unit_in(table, c.place, "mass") for c in cells}
        if len(units) > 1:
            raise PlanError(f"{table.header}: columns of SWL in {_listed(units)}. Write one unit in all of them.")
        heading = f"SWL [{units.pop() or ''}]".replace(" []", "")
        numbered = [
            ([row[first], c.value, row[c.place]], line)
            for c in cells
            for row, line in zip(table.rows, table.lines, strict=True)
            if row[c.place].strip()
        ]
        notes.append(f"matrix of {len(table.rows)} {_PLURAL[down]} and {len(cells)} {_PLURAL[across]}")
        return _with(table, (table.headings[first], f"{across} [m]", heading), numbered), tuple(notes)
    sectors = [i for i, name in rest.items() if _SECTOR.search(name)]
    if down == "radius" and sectors and len(sectors) == len(rest):
        return _least(table, first, sectors, notes)
    odd = next(table.headings[i] for i in rest if i not in {c.place for c in cells})
    example = "SWL Hs 1.5 m (t)" if down == "radius" else "SWL 15 m (t)"
    raise PlanError(
        f"{table.header}: column {quote(odd)}: does not say for which {_ONE[across]} it is. Write the headings of"
        f" a matrix as {quote(example)}, or one row a point with {quote('SWL [t]')}."
    )


_PLURAL = {"radius": "radii", "Hs": "wave heights"}
_ONE = {"radius": "radius", "Hs": "wave height"}


def _is_load(table: TextTable, place: int) -> bool:
    name, unit = split_heading(table.headings[place])[0], unit_in(table, place, "mass")
    return bool(_SWL.search(name)) or unit in KINDS["mass"].allowed


def _least(table: TextTable, first: int, sectors: list[int], notes: list[str]) -> tuple[TextTable, tuple[str, ...]]:
    """A chart by sector of slewing as one of its least SWL at each radius."""
    units = {unit_in(table, i, "mass") for i in sectors}
    if len(units) > 1:
        raise PlanError(f"{table.header}: columns of SWL in {_listed(units)}. Write one unit in all of them.")
    numbered = []
    for k, (row, line) in enumerate(zip(table.rows, table.lines, strict=True)):
        try:
            least = min((row[i] for i in sectors if row[i].strip()), key=lambda cell: float(cell.replace(",", ".")))
        except ValueError:
            bad = next((i for i in sectors if not re.fullmatch(r"[-+]?[\d.,]+", row[i])), sectors[0])
            raise table.wrong([k], bad, "a number") from None
        numbered.append(([row[first], least], line))
    notes.append(
        f"the least SWL of {len(sectors)} sectors counts at each radius: {_listed(table.headings[i] for i in sectors)}"
    )
    return _with(table, (table.headings[first], f"SWL [{units.pop()}]"), numbered), tuple(notes)


def _with(table: TextTable, headings: tuple[str, ...], numbered: list[tuple[list[str], int]]) -> TextTable:
    rows, lines = [row for row, _ in numbered], [line for _, line in numbered]
    return replace(table, headings=headings, rows=rows, lines=lines, units=())


def _listed(parts: Iterable[str | None]) -> str:
    return ", ".join(quote(part or "no unit") for part in parts)
