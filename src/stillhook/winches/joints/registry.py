"""What may join hook and payload: slings alone, modules of `stillhook.winches.joints.types`, and those of the user."""

from __future__ import annotations

from collections.abc import Mapping
from types import ModuleType
from typing import Any

from stillhook.base.contract import (
    NAME,
    TEXT,
    Contract,
    Record,
    check_record,
    check_values,
    fault,
    marks_of,
    names_of,
    one_of,
)
from stillhook.base.extensions import extensions, modules_in
from stillhook.base.variable import Row, Variable
from stillhook.control.registry import source_of
from stillhook.errors import ScenarioError
from stillhook.units import quote
from stillhook.winches.joints import slings, types
from stillhook.winches.joints.interface import BODY, Joint, JointUnit, Undeclared

DEFAULT = "gas-spring"
"""Type of a unit that names none."""


CONTRACT = Contract("A unit between hook and slings", Joint, Undeclared, source_of)
RECORDS = {"Link": Record(), "Signals": Record(mark=Row, nested=False), "Stats": Record(nested=False)}


def check_module(module: ModuleType) -> None:
    """A module is a unit between hook and slings. Errors: SpecError."""
    CONTRACT.check(module)
    for name, rule in RECORDS.items():
        check_record(module, name, rule)
    some = [name for name in BODY if hasattr(module, name)]
    if some and len(some) < len(BODY):
        raise fault(module, f"{' and '.join(some)} alone", f"A unit with a body of its own needs {', '.join(BODY)}")
    if not (isinstance(module.Unit, type) and issubclass(module.Unit, JointUnit)):
        raise fault(module, "Unit is no JointUnit", "Write class Unit(JointUnit)")
    if getattr(module.Unit.model_fields.get("type"), "default", None) != module.NAME:
        do = f'Write type: Literal["{module.NAME}"] = "{module.NAME}" in it'
        raise fault(module, f"Unit.type is not {quote(module.NAME)}", do)
    if open_ := ", ".join(sorted(getattr(module.Unit, "__abstractmethods__", ()))):
        raise fault(module, f"Unit.{open_} is missing", "A unit says what the statics ask of it: see JointUnit")
    numbers = module.NUMBERS
    if not (isinstance(numbers, Mapping) and all(isinstance(row, Row) for row in numbers.values())):
        raise fault(module, "NUMBERS is no table of Rows", 'Write NUMBERS = {"name": Row(...)}')
    stats = module.Stats._fields
    check_values(
        module,
        {
            "NAME": NAME,
            "TITLE": TEXT,
            "LIMIT": TEXT,
            "EXTENSION": one_of(*module.Signals._fields),
            "STOPS": names_of(numbers, "names of NUMBERS"),
            "SUMMED": names_of(stats, "fields of Stats"),
            "LOWEST": names_of(stats, "fields of Stats"),
        },
    )
    given = module.numbers(module.blank())
    if set(given) != set(numbers):
        apart = ", ".join(sorted(set(given) ^ set(numbers)))
        raise fault(module, f"numbers and NUMBERS differ in {apart}", "Give each number of NUMBERS, and no other")


def _all() -> dict[str, Any]:
    """Modules of units by name. Errors: SpecError that names the module."""
    by_name: dict[str, Any] = dict.fromkeys([slings.NAME])
    of_user = [each for each in extensions() if hasattr(each, "pull")]
    for module in of_user:
        check_module(module)
    for module in (*modules_in(types), *of_user):
        if module.NAME in by_name:
            raise fault(module, f"NAME = {quote(module.NAME)} is that of another unit", "Change NAME")
        by_name[module.NAME] = module
    return {name: module for name, module in by_name.items() if module is not None}


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
        for name, row in (*marks_of(module.Signals, Row).items(), *module.NUMBERS.items()):
            rows.setdefault(name, row.named(name))
    return list(rows.values())
