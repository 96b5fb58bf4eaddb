"""The winch types there are: modules of `stillhook.winches.types` and of the user, each checked once."""

from __future__ import annotations

import functools
import operator
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from types import ModuleType
from typing import Any

from stillhook.base import contract
from stillhook.base.extensions import extensions, modules_in
from stillhook.base.variable import Row, Variable
from stillhook.control.interface import SPEED
from stillhook.control.registry import Mode, default_of, modes_of, usual_of
from stillhook.control.sensor_errors import RING
from stillhook.units import show
from stillhook.winches import types
from stillhook.winches.checks import check_module, check_params, check_result
from stillhook.winches.interface import Cause, Undeclared


@dataclass(frozen=True)
class WinchType:
    """A winch type as its module declares it; see `stillhook.winches.interface`."""

    name: str
    title: str
    module: ModuleType
    tables: Mapping[str, Any]  # tables of the crane file that it needs, with the model of those that are its own
    file: Path
    shipped: bool
    causes: Mapping[str, str]  # limit -> word in a run's status
    rows: tuple[Variable, ...]  # of its own signals
    numbers: tuple[Variable, ...]  # of its own numbers of a run

    def __getattr__(self, name: str) -> Any:
        """What its module declares, or what holds where it does not. What a function of the user gives is checked."""
        declared = getattr(self.module, name, None)
        value = getattr(Undeclared, name) if declared is None else declared
        checked = callable(value) and not self.shipped
        return functools.partial(check_result, self.module, name, value) if checked else value

    def pack(self, crane: Any, case: Any, parts: Any) -> Any:
        """Params of a run. Errors: SpecError where a module of the user gives something else, or no `Stiffness`."""
        params = self.module.pack(crane, case, parts)
        if not self.shipped:
            check_params(self.module, params)
        return params

    @property
    def control(self) -> str:
        """Kind of drive that controllers command."""
        return str(self.CONTROL)

    @property
    def modes(self) -> tuple[Mode, ...]:
        """Controllers that it takes."""
        return modes_of(self.control)

    @property
    def tuned(self) -> Mapping[str, tuple[float, float]]:
        """Settings of its drive that may be tuned: path in a crane file -> ends of the search [SI]."""
        declared: Mapping[str, tuple[float, float]] = self.TUNED
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
        return hasattr(self.module, "steady")

    @property
    def shown(self) -> Mapping[str, str]:
        """Its own numbers in a table of runs, with the head of each column."""
        declared: Mapping[str, str] | None = self.SHOWN
        return {row.name: row.name.replace("_", "\n", 1) for row in self.numbers} if declared is None else declared

    def dead_times(self, crane: Any) -> dict[str, float]:
        """Dead times of the displacement controls of a crane [s], by the command that each follows."""
        return {u: operator.attrgetter(path)(crane).dead_time or 0.0 for u, (path, _) in self.SERVOS.items()}

    def dead_time_refusal(self, crane: Any) -> str:
        """Reason why a dead time cannot be as long; "" where all can."""
        cycle, computing = crane.control.t_cycle, crane.control.computing
        for u, time in self.dead_times(crane).items():
            if time > 0.0 and time + computing > RING * cycle * (1.0 + 1e-12):
                return (
                    f"{self.SERVOS[u][0]}.dead_time {show(time, 'time')} is more than {RING} PLC cycles less the"
                    f" computing time, {show(RING * cycle - computing, 'time')}. Give a shorter one."
                )
        return ""

    def run_numbers(self, stats: Any, t_cycle: float) -> dict[str, float]:
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


def _type(module: ModuleType, shipped: bool) -> WinchType:
    """A module as a winch type. Errors: SpecError of one line with file and attribute."""
    if not shipped:
        check_module(module)
    rows = contract.marks_of(module.Signals, Row)
    extremes, limits = contract.marks_of(module.Extremes, Row), contract.marks_of(module.Limits, Cause)
    tables = module.TABLES
    return WinchType(
        name=module.NAME,
        title=module.TITLE,
        module=module,
        tables=dict.fromkeys(tables) if isinstance(tables, tuple) else dict(tables),
        file=contract.file_of(module),
        shipped=shipped,
        causes={name: cause.status for name, cause in limits.items()},
        rows=tuple(row.named(name) for name, row in rows.items()),
        numbers=tuple(mark.named(name) for part in (extremes, limits) for name, mark in part.items()),
    )


def _all() -> dict[str, WinchType]:
    every = [_type(module, True) for module in modules_in(types)]
    every += [_type(module, False) for module in extensions() if hasattr(module, "rates")]
    return contract.by_name(every, "winch type")


WINCH_TYPES: Mapping[str, WinchType] = _all()
"""Every winch type by its name."""


class Plant(StrEnum):
    """Name of a winch type; there is one for each module."""

    vars().update({name.upper().replace("-", "_"): name for name in WINCH_TYPES})

    @property
    def type(self) -> WinchType:
        """The winch type itself."""
        return WINCH_TYPES[self.value]


def winch_rows(common: Collection[str]) -> tuple[list[Variable], list[Variable]]:
    """Rows of the own signals, and of the own numbers of a run, of all winch types; each name once.

    common: names of what every winch has. Errors: SpecError for a type of the user that takes one of these names, or
    uses one of another type for another kind of quantity.
    """
    rows: dict[str, Variable] = {}
    numbers: dict[str, Variable] = {}
    for each in WINCH_TYPES.values():
        for known, declared in ((rows, each.rows), (numbers, each.numbers)):
            for row in declared:
                if not each.shipped and row.name in common:
                    raise contract.fault(each.module, f"{row.name} is a number of every winch", "Rename yours")
                if (kind := known.setdefault(row.name, row).kind) != row.kind:
                    do = f"Give it this kind ({kind!r}), or another name"
                    raise contract.fault(each.module, f"{row.name} is a {row.kind!r}, elsewhere another kind", do)
    return list(rows.values()), list(numbers.values())
