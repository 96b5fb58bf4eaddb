"""The elements of a load path by name: those of `stillhook.winches.load_path`, and units of the user between hook and
slings, each checked once. A path is the names of its elements from the drum down."""

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
from stillhook.base.extensions import extensions
from stillhook.base.variable import Row, Variable
from stillhook.control.registry import source_of
from stillhook.errors import ScenarioError
from stillhook.units import quote
from stillhook.winches.load_path import current, deck, gas_spring, host, payload, slings, wire
from stillhook.winches.load_path.interface import BODY, OF_A_PATH, Joint, JointUnit, LoadPath, Undeclared

DEFAULT = "gas-spring"
"""Type of a unit that names none."""
SHIPPED: Mapping[str, Any] = {
    each.__name__.rpartition(".")[2]: each for each in (host, wire, slings, payload, current, deck)
}
"""Elements that are no units; what a winch names as its PATH needs no name."""
PATH = Contract("A load path", LoadPath, type("Nothing", (), {}), source_of)
CONTRACT = Contract("A unit between hook and slings", Joint, Undeclared, source_of)
RECORDS = {"Link": Record(), "Signals": Record(mark=Row, nested=False), "Stats": Record(nested=False)}


def check_path(path: ModuleType) -> None:
    """A module is a load path. Errors: SpecError."""
    PATH.check(path)
    for name, rule in OF_A_PATH.items():
        check_record(path, name, rule)
    check_values(path, {"SUPPLIED": names_of(path.Powers._fields, "fields of Powers")})


def check_module(module: ModuleType) -> None:
    """A module is a unit between hook and slings. Errors: SpecError."""
    CONTRACT.check(module)
    for name, rule in RECORDS.items():
        check_record(module, name, rule)
    some = [name for name in BODY if hasattr(module, name)]
    if some and len(some) < len(BODY):
        raise fault(module, f"{' and '.join(some)} alone", f"A unit with a body of its own needs {', '.join(BODY)}")
    if not (isinstance(module.Unit, type) and issubclass(module.Unit, JointUnit)):
        raise fault(module, "Unit is not a JointUnit", "Write class Unit(JointUnit)")
    if getattr(module.Unit.model_fields.get("type"), "default", None) != module.NAME:
        do = f'Write type: Literal["{module.NAME}"] = "{module.NAME}" in it'
        raise fault(module, f"Unit.type is not {quote(module.NAME)}", do)
    if open_ := ", ".join(sorted(getattr(module.Unit, "__abstractmethods__", ()))):
        raise fault(module, f"Unit.{open_} is missing", "A unit says what the statics ask of it: see JointUnit")
    numbers = module.NUMBERS
    if not (isinstance(numbers, Mapping) and all(isinstance(row, Row) for row in numbers.values())):
        raise fault(module, "NUMBERS is not a table of Rows", 'Write NUMBERS = {"name": Row(...)}')
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
    blank = module.numbers(module.blank())
    if set(blank) != set(numbers):
        apart = ", ".join(sorted(set(blank) ^ set(numbers)))
        raise fault(module, f"numbers and NUMBERS differ in {apart}", "Give each number of NUMBERS, and no other")


def _all() -> dict[str, Any]:
    """Modules of units by name. Errors: SpecError that names the module."""
    units: dict[str, Any] = {gas_spring.NAME: gas_spring}
    for module in extensions():
        if hasattr(module, "pull"):
            check_module(module)
            if module.NAME in (*units, *SHIPPED):
                raise fault(module, f"NAME = {quote(module.NAME)} is that of another element", "Change NAME")
            units[module.NAME] = module
    return units


UNITS: Mapping[str, Any] = _all()
"""Module of every unit between hook and slings."""
ELEMENTS: Mapping[str, Any] = {**SHIPPED, **UNITS}
"""Module of every element that a path may name."""


def unit_of(table: Mapping[str, Any]) -> JointUnit:
    """A unit as a file describes it, of the type that it names. Errors: ScenarioError, one line."""
    kind = table.get("type", DEFAULT)
    if kind not in UNITS:
        raise ScenarioError(f"type = {quote(kind)}: choose {', '.join(UNITS)}.")
    unit: JointUnit = UNITS[kind].Unit(**table)
    return unit


def joint_of(unit: JointUnit | None) -> Any:
    """Module of what joins hook and payload with this unit between them, or without one."""
    return slings if unit is None else UNITS[unit.type]


def path_of(unit: JointUnit | None, body: str = "payload") -> tuple[str, ...]:
    """The path of a lowering with this unit between hook and slings, or without one, above this body."""
    return "wire", "slings" if unit is None else unit.type, body


def joint_rows() -> list[Variable]:
    """Rows of the signals and numbers of all units and of a deck, each name once."""
    rows: dict[str, Variable] = {}
    for module in (*UNITS.values(), deck):
        for name, row in (*marks_of(module.Signals, Row).items(), *module.NUMBERS.items()):
            rows.setdefault(name, row.named(name))
    return list(rows.values())
