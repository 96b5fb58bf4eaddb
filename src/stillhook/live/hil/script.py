"""A script of what happens to a PLC's inputs: values, ramps and faults, between the bus and the controller.

    [[input]]
    name = "v_tip"
    at = "20 s"
    until = "20.1 s"
    lost = true

Rows act one after another in the order of the file, so that noise may be added to what a row before made.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field

from stillhook.base.arrays import FloatArray
from stillhook.control.registry import Mode, code_of
from stillhook.errors import LiveError
from stillhook.library.toml.file import TomlTable, read_toml_raising
from stillhook.library.toml.kinds import FileKind
from stillhook.live.hil.controller import INPUTS, SIGNALS
from stillhook.tables.table import Flag, Spec, Text
from stillhook.units import Time, text_at
from stillhook.variables import BY_NAME

RESET = "reset"
AT = {name: i for i, name in enumerate(INPUTS)}
N = len(SIGNALS)
SEED = 748
"""Of the noise: a script does the same each time. The line of the thesis that requires it."""
ACTIONS = ("value", "points", "offset", "noise", "stuck", "lost")


class InputRow(Spec):
    """A row [[input]]."""

    name: Text = Field(description="input of the controller, or reset")
    at: Annotated[Time, Field(ge=0.0)] = Field(description="when it begins, in the PLC's time")
    until: Annotated[Time, Field(ge=0.0)] | None = Field(default=None, description="when it ends; default never")
    value: Any = Field(default=None, description="value in place of what came; a controller's name for mode")
    points: Any = Field(default=None, description='values with straight lines between, [["0 s", "0 m/s"], ...]')
    offset: Any = Field(default=None, description="added to what came")
    noise: Any = Field(default=None, description="standard deviation of what is added")
    stuck: Flag | None = Field(default=None, description="true: the value of the begin is held")
    lost: Flag | None = Field(default=None, description="true: no number, and bad quality")


class ScriptFile(Spec):
    """A script."""

    rows: Annotated[tuple[InputRow, ...], Field(alias="input", min_length=1)] = Field(description="rows")


Act = Callable[[float, float], float]
"""What an input becomes: of the time since the begin of its row [s], and what came [SI]."""


class Manipulation(NamedTuple):
    """A row: place of the input, begin and end [s], what it does (None: no number), and whether it is to be held."""

    place: int
    at: float
    until: float
    act: Act | None
    stuck: bool


class Script:
    """Rows that change inputs cycle by cycle. A speed v_op that is changed takes its integral s_op with it, unless a
    row changes that as well."""

    def __init__(self, rows: tuple[Manipulation, ...] = ()) -> None:
        self._rows = rows
        self._held: dict[int, float] = {}
        self._integrates = any(r.place == AT["v_op"] for r in rows) and all(r.place != AT["s_op"] for r in rows)
        self._before = self._shift = 0.0
        self._time = 0.0

    @property
    def empty(self) -> bool:
        """Whether it changes nothing."""
        return not self._rows

    def apply(self, time: float, inputs: FloatArray) -> FloatArray:
        """Numbers of `INPUTS` [SI] as the script leaves them at a time [s], called once a cycle; a copy."""
        out = inputs.copy()
        for i, row in enumerate(self._rows):
            if not row.at <= time < row.until:
                continue
            if row.stuck:
                out[row.place] = self._held.setdefault(i, float(out[row.place]))
            elif row.act is None:
                out[row.place], out[N + row.place] = math.nan, 0.0
            else:
                out[row.place] = row.act(time - row.at, float(out[row.place]))
        if self._integrates:
            more = float(out[AT["v_op"]] - inputs[AT["v_op"]])
            more = more if math.isfinite(more) else 0.0
            self._shift += 0.5 * (self._before + more) * (time - self._time)
            self._before, self._time = more, time
            out[AT["s_op"]] += self._shift
        return out


def read_script(path: str | Path) -> Script:
    """The script in a TOML file. Errors: LiveError, UnitError of one line."""
    return read_toml_raising(LiveError, path, FileKind.SCRIPT, _script, start="Write rows [[input]] with name and at.")


def _script(table: TomlTable) -> Script:
    file = table.read(ScriptFile)
    return Script(tuple(_row(row, table.at("input", i), i) for i, row in enumerate(file.rows)))


def _row(row: InputRow, place: TomlTable, i: int) -> Manipulation:
    if row.name not in (*SIGNALS, RESET):
        raise place.wrong(f"no input of a controller. Choose one of {', '.join((*SIGNALS, RESET))}.", "name")
    until = math.inf if row.until is None else row.until
    if until <= row.at:
        raise place.wrong("ends before it begins. Give a later time than at.", "until")
    actions = [name for name in ACTIONS if getattr(row, name) not in (None, False)]
    if len(actions) != 1:
        raise place.error(f"{place.place()}: give one of {', '.join(ACTIONS)}; it has {', '.join(actions) or 'none'}.")
    if row.lost and row.name == RESET:
        raise place.wrong("reset has no quality. Give value.", "lost")
    return Manipulation(AT[row.name], row.at, until, _act(row, place, actions[0], i), bool(row.stuck))


def _act(row: InputRow, place: TomlTable, action: str, i: int) -> Act | None:
    """What a row does."""
    if action == "points":
        points = row.points
        if (
            not isinstance(points, list)
            or len(points) < 2
            or any(not isinstance(p, list) or len(p) != 2 for p in points)
        ):
            raise place.wrong('give two or more pairs, such as [["0 s", "0 m/s"], ["5 s", "0.3 m/s"]].', "points")
        times = [place.quantity("time", "points", k, 0)[0] for k in range(len(points))]
        if any(b <= a for a, b in pairwise(times)):
            raise place.wrong("times must increase.", "points")
        values = [_number(row.name, place, "points", k, 1) for k in range(len(points))]
        return lambda t, value: float(np.interp(t, times, values))
    if action in ("stuck", "lost"):
        return None
    number = _number(row.name, place, action)
    if action == "value":
        return lambda t, value: number
    if action == "offset":
        return lambda t, value: value + number
    if number < 0.0:
        raise place.wrong("a standard deviation is not negative.", "noise")
    rng = np.random.default_rng([SEED, i])
    return lambda t, value: value + number * float(rng.standard_normal())


def _number(name: str, place: TomlTable, *loc: int | str) -> float:
    """A value of an input [SI]: with its unit, or a controller's name."""
    value = text_at(place.data, (*place.loc, *loc), None)
    if name == "mode" and isinstance(value, str):
        if value not in [mode.value for mode in Mode]:
            raise place.wrong(f"choose one of {', '.join(mode.value for mode in Mode)}, or a number.", *loc)
        return code_of(value)
    return place.quantity(kind_of_input(name), *loc)[0]


def kind_of_input(name: str) -> str:
    """Kind of quantity of an input or output, "" for a pure number."""
    of = BY_NAME.get(name, BY_NAME.get(f"sensed_{name}"))
    return of.kind or "" if of is not None else ""
