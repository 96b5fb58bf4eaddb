"""What may join hook and payload: slings alone, modules of `stillhook.winches.joints.types`, and those of the user."""

from __future__ import annotations

import typing
from collections.abc import Mapping
from typing import Any

from stillhook.base.extensions import extensions, modules_in
from stillhook.base.variable import Variable
from stillhook.errors import ScenarioError, SpecError
from stillhook.units import quote
from stillhook.winches.joints import slings, types
from stillhook.winches.joints.interface import JointUnit

DEFAULT = "gas-spring"
"""Type of a unit that names none."""


def _all() -> dict[str, Any]:
    """Modules of units by name. Errors: SpecError that names the module."""
    by_name: dict[str, Any] = {}
    for module in (*modules_in(types), *(each for each in extensions() if hasattr(each, "pull"))):
        if module.NAME in (*by_name, slings.NAME):
            raise SpecError(f'{module.__file__}: there is a joint "{module.NAME}" already. Change NAME.')
        by_name[module.NAME] = module
    return by_name


UNITS: Mapping[str, Any] = _all()
"""Module of every unit between hook and slings."""
JOINTS: Mapping[str, Any] = {slings.NAME: slings, **UNITS}
"""Module of everything that may join hook and payload."""


def unit_of(table: Mapping[str, Any]) -> JointUnit:
    """A unit as a file describes it, of the type that it names. Errors: ScenarioError, one line."""
    kind = table.get("type", DEFAULT)
    if kind not in UNITS:
        raise ScenarioError(f"type = {quote(kind)}: choose {', '.join(UNITS)}.")
    unit: JointUnit = UNITS[kind].Unit(**table)
    return unit


def joint_of(unit: JointUnit | None) -> str:
    """Name of what joins hook and payload with this unit between them, or without one."""
    return slings.NAME if unit is None else unit.type


def joint_rows() -> list[Variable]:
    """Rows of the signals and numbers of all units, each name once."""
    rows: dict[str, Variable] = {}
    for module in UNITS.values():
        hints = typing.get_type_hints(module.Signals, include_extras=True)
        signals = {name: hint.__metadata__[0] for name, hint in hints.items()}
        for name, row in (*signals.items(), *module.NUMBERS.items()):
            rows.setdefault(name, row.named(name))
    return list(rows.values())
