"""A measured map of a motor's torque loss, from a table next to a crane file or of the library, as the fields of a
`loss_model`."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from stillhook.base.choice import nearest
from stillhook.base.gateway.named_files import named_path
from stillhook.errors import SpecError, UnitError
from stillhook.library.toml.kinds import LIBRARY
from stillhook.library.toml.tree import Leaf, Tree, shelf, toml_text
from stillhook.spec.crane import Source
from stillhook.units import KINDS, in_display, parse, quote, show

AXES = {"D_m": ("D_m", "displacement"), "n": ("omega_m", "rotation"), "dp": ("dp_m", "pressure")}
"""Columns of the settings, their fields and kinds of quantity."""
LOSSES = {"T_f": "torque", "eta_hm": ""}
"""Columns that give the loss: itself, or the hydromechanical efficiency."""
EXAMPLES = "examples"
RANGE = ("D_loss_min", "n_loss_max", "dp_loss_max")


def with_map(motor: Tree, place: str, folder: Path | None) -> Tree:
    """The table of a set of motors, whose `loss_model` names a map, with the map's levels and losses, and its range as
    that of the loss; any other as it is.

    place: of the table in messages; folder: from which the file is seen, None where only the library is left.
    Errors: SpecError of one line.
    """
    model = motor.get("loss_model")
    named = model.get("map") if isinstance(model, dict) else None
    if not isinstance(model, dict) or not isinstance(named, Leaf) or "T_f" in model:
        return motor
    where = f"{place}.loss_model.map = {quote(named.value)}"
    file = _file(named.value, where, folder)
    if file is None:
        return motor
    table = read_loss_map(file, where)
    source = Source(text=f"map {file.name}", kind=named.source.kind)
    model = {**model, "map": Leaf(Path(named.value).name, named.source)}
    filled = {name: Leaf([f"{x!r} {KINDS[kind].si}" for x in table[name]], source) for name, kind in FIELDS.items()}
    ends = dict(zip(RANGE, (table["D_m"][0], table["omega_m"][-1], table["dp_m"][-1]), strict=True))
    kinds = dict(zip(RANGE, FIELDS.values(), strict=False))
    known = {name: Leaf(f"{x!r} {KINDS[kinds[name]].si}", source) for name, x in ends.items()}
    return {**motor, **known, "loss_model": {**model, **filled}}


FIELDS = {**dict(AXES.values()), "T_f": "torque"}
"""Fields of a map in a `loss_model` and their kinds of quantity."""


def _file(name: Any, where: str, folder: Path | None) -> Path | None:
    """The table that a name stands for; None for a path where the file that names it has been read before."""
    if isinstance(name, Path):  # seen from the file of a set, where it was checked
        return name
    if not isinstance(name, str):
        raise SpecError(f"{where}: give the path of a CSV file, or a map of the library.")
    if name in shelf(EXAMPLES, ".csv"):
        return LIBRARY / EXAMPLES / f"{name}.csv"
    if not name.endswith(".csv"):
        have = shelf(EXAMPLES, ".csv")
        raise SpecError(f"{where}: no map of the library, which has {', '.join(have)}{nearest(name, have)}")
    return None if folder is None else named_path(folder, name, lambda why: SpecError(f"{where}: {why}"))


def read_loss_map(path: Path, where: str) -> dict[str, list[float]]:
    """Levels D_m [m^3/rad], omega_m [rad/s], dp_m [Pa], and T_f at every combination [N m], the pressure fastest.

    The table has a row for every combination: columns D_m, n, dp, and T_f or eta_hm, units in square brackets;
    `stillhook identify motor` writes such a table of any map. Errors: SpecError of one line.
    """
    try:
        text = toml_text(path)
    except SpecError as problem:
        raise SpecError(f"{where}: {problem}") from None
    lines = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if not lines:
        raise SpecError(f"{where}: empty. Give a row for every combination of levels.")
    mark = ";" if ";" in lines[0][1] else ","
    factors, loss = _columns([cell.strip() for cell in lines[0][1].split(mark)], where)
    cells: dict[tuple[float, float, float], float] = {}
    for number, line in lines[1:]:
        row = _row(line.split(mark), factors, f"{where}: line {number}")
        D, n, dp = (row[name] for name in AXES)
        T_f = row["T_f"] if loss == "T_f" else D * dp * (1.0 - row["eta_hm"])
        if min(D, n, dp, T_f) < 0.0 or D == 0.0:
            raise SpecError(f"{where}: line {number}: a negative number, or no displacement. Leave no such row.")
        if (D, n, dp) in cells:
            raise SpecError(f"{where}: line {number}: this combination is given twice. Leave one of them.")
        cells[D, n, dp] = T_f
    levels = [sorted({key[i] for key in cells}) for i in range(3)]
    grid: list[Any] = list(itertools.product(*levels))
    for at in grid:
        if at not in cells:
            cell = ", ".join(show(x, kind, 4) for x, kind in zip(at, FIELDS.values(), strict=False))
            do = "Give every combination; stillhook identify motor MAP --model map writes such a table"
            raise SpecError(f"{where}: {len(cells)} of {len(grid)} combinations; none for {cell}. {do}.")
    return dict(zip(FIELDS, (*levels, [cells[at] for at in grid]), strict=True))


def _columns(headings: list[str], where: str) -> tuple[dict[str, tuple[int, float]], str]:
    """Column and factor to SI of each quantity, and which of LOSSES there is."""
    found: dict[str, tuple[int, float]] = {}
    for i, heading in enumerate(headings):
        name, _, unit = heading.removesuffix("]").partition("[")
        name = name.strip()
        kind = AXES[name][1] if name in AXES else LOSSES.get(name)
        if kind:
            try:
                found[name] = i, parse(f"1 {unit.strip()}", kind, heading)
            except UnitError as problem:
                raise SpecError(f"{where}: {problem}") from None
        elif kind == "":
            found[name] = i, 0.01 if unit.strip() == "%" else 1.0
    loss = next((name for name in LOSSES if name in found), None)
    missing = [name for name in AXES if name not in found] + ([] if loss else [" or ".join(LOSSES)])
    if missing or loss is None:
        raise SpecError(f"{where}: no column {missing[0]}. Give D_m, n, dp and T_f, units in square brackets.")
    return found, loss


def _row(cells: list[str], columns: Mapping[str, tuple[int, float]], where: str) -> dict[str, float]:
    out = {}
    for name, (i, factor) in columns.items():
        try:
            out[name] = float(cells[i]) * factor
        except (ValueError, IndexError):
            written = quote(cells[i].strip()) if i < len(cells) else "nothing"
            raise SpecError(f"{where}: {name} = {written}: it must be a number.") from None
        if not math.isfinite(out[name]):
            raise SpecError(f"{where}: {name} is not a finite number. Give one.")
    return out


def map_csv(axes: Mapping[str, list[float]], note: str) -> str:
    """The text of such a table from `read_loss_map`'s fields [SI]; note: what it is, one line."""
    grid = itertools.product(axes["D_m"], axes["omega_m"], axes["dp_m"])
    heads = [f"{name} [{KINDS[kind].display}]" for name, kind in zip((*AXES, "T_f"), FIELDS.values(), strict=True)]
    rows = [
        ",".join(f"{in_display(x, kind):.10g}" for x, kind in zip((*at, T), FIELDS.values(), strict=True))
        for at, T in zip(grid, axes["T_f"], strict=True)
    ]
    return "\n".join([f"# {note}", ",".join(heads), *rows]) + "\n"
