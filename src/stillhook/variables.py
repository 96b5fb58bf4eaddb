"""One row per variable: name, symbol, SI unit, kind (for display), sign, meaning, source.

Results, JSON output and the nomenclature page use it. The rows are in `variables.csv`; those of winch types, of
sensors and of what joins hook and payload are with their modules.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from stillhook.base.variable import Variable as Variable
from stillhook.base.variable import coded, flags
from stillhook.control.registry import CONTROLLERS
from stillhook.control.sensors import sensor_rows
from stillhook.winches.load_path.registry import joint_rows
from stillhook.winches.registry import winch_rows

WINDOW = 30.0
"""Moving window of the peak-to-peak error [s]. Source: Moslatt 2020 paper F table 2."""


def _groups() -> dict[str, tuple[Variable, ...]]:
    """The rows of each group, in the order of the table."""
    groups: dict[str, list[Variable]] = {}
    with Path(__file__).with_suffix(".csv").open(encoding="utf-8", newline="") as table:
        for row in csv.DictReader(table):
            groups.setdefault(row.pop("group"), []).append(Variable(**row))
    return {name: tuple(rows) for name, rows in groups.items()}


_GROUPS = _groups()
_SIGNALS, _NUMBERS = winch_rows({row.name for group in ("series", "summary", "lift") for row in _GROUPS[group]})
SERIES = (*_GROUPS["series"], *_SIGNALS, *sensor_rows())
COMMON_SUMMARY = _GROUPS["summary"]
"""Numbers of a run that every winch type has."""
SUMMARY = (*COMMON_SUMMARY, *_NUMBERS)
QUANTITIES = _GROUPS["quantities"]
LIFT = (*_GROUPS["lift"], *joint_rows())
ANSWERS = _GROUPS["answers"]
PLAN = _GROUPS["plan"]
WEATHER = _GROUPS["weather"]
EXPORTS = _GROUPS["exports"]
"""What models for other programs have besides."""

PHYSICAL: Mapping[str, Variable] = {v.name: v for v in SERIES + SUMMARY + QUANTITIES}
"""What a log may hold under its own name. The names of ANSWERS are everyday words (load, speed, first), which a log may
use for anything."""
VARIABLES: tuple[Variable, ...] = SERIES + SUMMARY + QUANTITIES + LIFT + ANSWERS + PLAN + WEATHER + EXPORTS
BY_NAME: Mapping[str, Variable] = {v.name: v for v in VARIABLES}


CODES: Mapping[str, Iterable[str]] = {"mode": CONTROLLERS, "validated": ("not validated", "validated")}
"""Words of the codes 0, 1, ... whose meaning does not list them."""


def attributes(name: str) -> dict[str, Any]:
    """Unit, meaning, sign and source of a variable, and the words of a code, for a Dataset."""
    v = BY_NAME[name]
    texts = (("units", v.unit), ("long_name", v.meaning), ("sign", v.sign), ("source", v.source))
    words = coded(enumerate(CODES[name])) if name in CODES else flags(v.meaning)
    return {**{k: str(x) for k, x in texts if x}, **words}
