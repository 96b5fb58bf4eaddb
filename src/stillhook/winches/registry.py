"""The winch types there are: modules of `stillhook.winches.types` and of the user, each checked once."""

from __future__ import annotations

import re
import typing
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from types import ModuleType
from typing import Any

from stillhook.base.extensions import extensions, modules_in
from stillhook.base.variable import Row, Variable
from stillhook.control.interface import DISPLACEMENT, SPEED
from stillhook.control.registry import Mode, default_of, modes_of, usual_of
from stillhook.errors import SpecError
from stillhook.winches import types
from stillhook.winches.interface import Cause, OtherMotors, Parts, PartSpeed, Stroke

RECORDS = ("Params", "State", "Command", "Circuit", "Signals", "Extremes", "Limits", "Powers")
FUNCTIONS = (
    "geometry",
    "wire_speed",
    "circuit",
    "rates",
    "start",
    "settle",
    "sense",
    "actuate",
    "signals",
    "limits",
    "powers",
    "stored_energy",
    "fold_extremes",
)
ON_CRANE = ("pack", "motors", "full_speed", "stiffness")
NEEDED = ("NAME", "TITLE", "TABLES", "PATH", "SUPPLIED", "BLANK", *RECORDS, *FUNCTIONS, *ON_CRANE)
STEADY = ("steady", "carried", "mean_pressure")
"""Functions of a type that has steady operating points."""


class Unspecific:
    """What a winch type says that declares no function for it."""

    @staticmethod
    def lag(crane: Any) -> float:
        return 0.0

    @staticmethod
    def full_wire_speed(crane: Any) -> float | None:
        return None

    @staticmethod
    def least_displacement(crane: Any) -> float:
        return 1.0

    @staticmethod
    def pump_units(crane: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
        return (), ()

    @staticmethod
    def pump_flows(crane: Any) -> tuple[float, float]:
        return 0.0, 0.0

    @staticmethod
    def pump_speed(crane: Any) -> float | None:
        return float(crane.active.pump.omega_p) if crane.circuits else None

    @staticmethod
    def charge(crane: Any) -> float:
        return 0.0

    @staticmethod
    def other_motors(crane: Any, W: float, d: float) -> list[OtherMotors]:
        return []

    @staticmethod
    def refusal(crane: Any, case: Any) -> str:
        return ""

    @staticmethod
    def notes(crane: Any, held: Any, parts: Parts) -> list[str]:
        return []

    @staticmethod
    def part_speeds(crane: Any) -> list[PartSpeed]:
        return []

    @staticmethod
    def stroke(crane: Any, F: float) -> Stroke | None:
        return None


@dataclass(frozen=True)
class WinchType:
    """A winch type as its module declares it; see `stillhook.winches.interface`."""

    name: str
    title: str
    module: ModuleType
    tables: Mapping[str, Any]  # tables of the crane file that it needs, with the model of those that are its own
    file: Path
    causes: Mapping[str, str]  # limit -> word in a run's status
    rows: tuple[Variable, ...]  # of its own signals
    numbers: tuple[Variable, ...]  # of its own numbers of a run

    def __getattr__(self, name: str) -> Any:
        """A function on a crane of its module, or what holds where it declares none."""
        found = getattr(self.module, name, None)
        return getattr(Unspecific, name) if found is None else found

    @property
    def control(self) -> str:
        """Kind of drive that controllers command."""
        kind: str = getattr(self.module, "CONTROL", DISPLACEMENT)
        return kind

    @property
    def modes(self) -> tuple[Mode, ...]:
        """Controllers that it takes."""
        return modes_of(self.control)

    @property
    def tuned(self) -> Mapping[str, tuple[float, float]]:
        """Settings of its drive that may be tuned: path in a crane file -> ends of the search [SI]."""
        declared: Mapping[str, tuple[float, float]] = getattr(self.module, "TUNED", {})
        return declared

    @property
    def usual_modes(self) -> tuple[Mode, ...]:
        """Those that are compared where a user names none."""
        return usual_of(self.control)

    @property
    def default_mode(self) -> Mode:
        """The controller where a user names none."""
        return default_of(self.control)

    def mode_refusal(self, mode: str) -> str:
        """Reason why it does not take a controller; "" where it does."""
        if Mode(mode) in self.modes:
            return ""
        has = (
            "takes a speed command alone" if self.control == SPEED else "is a closed circuit, whose motors are set too"
        )
        return (
            f'"{mode}" is for another kind of drive: winch type "{self.name}" {has}. Choose'
            f" {', '.join(m.value for m in self.modes)}."
        )

    @property
    def steady_operation(self) -> bool:
        """Whether the type declares steady operating points."""
        return all(hasattr(self.module, name) for name in STEADY)

    @property
    def shown(self) -> Mapping[str, str]:
        """Its own numbers in a table of runs, with the head of each column."""
        declared: Mapping[str, str] | None = getattr(self.module, "SHOWN", None)
        return {row.name: row.name.replace("_", "\n", 1) for row in self.numbers} if declared is None else declared

    def own_numbers(self, stats: Any, t_cycle: float) -> dict[str, float]:
        """Its own numbers of a run, from the statistics."""
        limits = {f"{name}_time": cycles * t_cycle for name, cycles in stats.limits._asdict().items()}
        return {**stats.extremes._asdict(), **limits}

    def limits_passed(self, stats: Any) -> list[str]:
        """Words for the limits that were passed in a run."""
        return [self.causes[name] for name, cycles in stats.limits._asdict().items() if cycles > 0.0]

    def energies(self, power: Any) -> tuple[float, float]:
        """What went in and what went out of summed powers."""
        supplied = (*self.module.SUPPLIED, *self.module.PATH.SUPPLIED)
        into, out = 0.0, 0.0
        for name, value in power._asdict().items():
            into, out = (into + value, out) if name in supplied else (into, out + value)
        return into, out


def _annotations(record: Any, kind: type) -> Iterator[tuple[str, Any]]:
    """Fields of a record that are annotated so."""
    for name, hint in typing.get_type_hints(record, include_extras=True).items():
        for mark in getattr(hint, "__metadata__", ()):
            if isinstance(mark, kind):
                yield name, mark


def _type(module: ModuleType) -> WinchType:
    """A module as a winch type. Errors: SpecError that names the module and what it lacks."""
    file = Path(str(module.__file__))
    for attribute in NEEDED:
        if not hasattr(module, attribute):
            raise SpecError(f"{file.name}: {attribute} is missing. A winch module needs {', '.join(NEEDED)}.")
    if not isinstance(module.NAME, str) or not re.fullmatch(r"[a-z][a-z0-9]*(-[a-z0-9]+)*", module.NAME):
        raise SpecError(
            f"{file.name}: NAME = {module.NAME!r}. Use lower-case letters, digits and hyphens, such as pure-active."
        )
    for record, kind in ((module.Signals, Row), (module.Extremes, Row), (module.Limits, Cause)):
        marked = dict(_annotations(record, kind))
        for name in record._fields:
            if name not in marked:
                raise SpecError(
                    f"{file.name}: {record.__name__}.{name}: annotate it as Annotated[float, {kind.__name__}(...)]."
                )
    if getattr(module, "CONTROL", DISPLACEMENT) not in (DISPLACEMENT, SPEED):
        raise SpecError(f"{file.name}: CONTROL = {module.CONTROL!r}. Choose {DISPLACEMENT} or {SPEED}.")
    limits = dict(_annotations(module.Limits, Cause))
    return WinchType(
        name=module.NAME,
        title=module.TITLE,
        module=module,
        tables=dict.fromkeys(module.TABLES) if isinstance(module.TABLES, tuple) else dict(module.TABLES),
        file=file,
        causes={name: cause.status for name, cause in limits.items()},
        rows=tuple(row.named(name) for name, row in _annotations(module.Signals, Row)),
        numbers=(
            *(row.named(name) for name, row in _annotations(module.Extremes, Row)),
            *(cause.named(name) for name, cause in limits.items()),
        ),
    )


def _all() -> dict[str, WinchType]:
    by_name: dict[str, WinchType] = {}
    for module in (*modules_in(types), *(each for each in extensions() if hasattr(each, "rates"))):
        found = _type(module)
        if found.name in by_name:
            raise SpecError(
                f'{found.file.name}: the winch type "{found.name}" is that of {by_name[found.name].file.name}. Change'
                " NAME."
            )
        by_name[found.name] = found
    return by_name


WINCH_TYPES: Mapping[str, WinchType] = _all()
"""Every winch type by its name."""


class Plant(StrEnum):
    """Name of a winch type; there is one for each module."""

    vars().update({name.upper().replace("-", "_"): name for name in WINCH_TYPES})

    @property
    def type(self) -> WinchType:
        """The winch type itself."""
        return WINCH_TYPES[self.value]


def own_rows() -> tuple[list[Variable], list[Variable]]:
    """Rows of the own signals, and of the own numbers of a run, of all winch types; each name once."""
    rows: dict[str, Variable] = {}
    numbers: dict[str, Variable] = {}
    for each in WINCH_TYPES.values():
        rows |= {row.name: row for row in each.rows if row.name not in rows}
        numbers |= {row.name: row for row in each.numbers if row.name not in numbers}
    return list(rows.values()), list(numbers.values())
