"""Current and wind of a lift file, and their profiles from tables, CSV or XLSX: a row a depth, or a height."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from pydantic import ConfigDict, Field

from stillhook.errors import LiftError
from stillhook.formats.table.columns import ColumnSpec
from stillhook.formats.table.read import read_columns
from stillhook.library.toml.file import TomlTable
from stillhook.sea.steady_flow import Current
from stillhook.tables.table import Spec

SPEED = ColumnSpec("speed", "wind_speed", ("velocity",), "speed [m/s]", required=True)
DIRECTION = ColumnSpec("direction", "angle", ("dir",), "direction [deg]")
LEVELS = {
    "current": ColumnSpec("depth", "length", ("d", "water_depth"), "depth [m]", required=True),
    "wind": ColumnSpec("height", "length", ("z", "elevation"), "height [m]", required=True),
}


def with_profiles(table: TomlTable) -> TomlTable:
    """A lift file with the columns of the files that [environment.current] and [environment.wind] name in their place.
    Errors: StillhookError, one line."""
    environment = table.data.get("environment")
    if not isinstance(environment, Mapping):
        return table
    read = {
        name: _with_columns(table.at("environment", name), environment[name], level)
        for name, level in LEVELS.items()
        if isinstance(environment.get(name), Mapping) and "file" in environment[name]
    }
    return replace(table, data={**table.data, "environment": {**environment, **read}}) if read else table


def _with_columns(table: TomlTable, given: Mapping[str, Any], level: ColumnSpec) -> dict[str, Any]:
    if not isinstance(given["file"], str):
        raise table.wrong(
            f'write the name of a table of {level.name}, speed and direction, such as "flow.csv".', "file"
        )
    specs = (level, SPEED, DIRECTION)
    rest = {key: value for key, value in given.items() if key not in ("file", "columns")}
    read = read_columns(
        table.relative_file(given["file"], "file"), specs, error=LiftError, columns=given.get("columns")
    )
    if twice := next((name for name in read.values if name in rest), None):
        raise table.wrong("given together with file, which has it. Leave one of them out.", twice)
    if "direction" in read.values and "reference" not in rest:
        do = 'write reference = "north" with ship, or reference = "bow": what the directions of its table count from.'
        raise table.error(f"{table.place('reference')}: missing, {do}")
    for name, x in read.values.items():
        if bad := np.flatnonzero(~np.isfinite(x)).tolist():
            do = "Fill the cell, or leave the row out."
            at = read.table.headings.index(read.headings[name])
            raise read.table.wrong(bad, at, "a number", do)
    units = {spec.name: unit for spec, unit in zip(specs, ("m", "m/s", "rad"), strict=True)}
    return rest | {name: [f"{float(v)!r} {units[name]}" for v in x] for name, x in read.values.items()}


class _Environment(Spec):
    model_config = ConfigDict(extra="ignore")
    current: Current | None = None


class _File(Spec):
    model_config = ConfigDict(extra="ignore")
    environment: _Environment = Field(default_factory=_Environment)


def current_of(table: TomlTable) -> Current | None:
    """The current of a lift file, of whose [environment] a plan alone has the rest. Errors: LiftError, UnitError."""
    return table.read(_File).environment.current
