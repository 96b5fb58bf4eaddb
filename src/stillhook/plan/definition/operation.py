"""Times of an operation: planned, from the issue of the forecast on, and of the part between two safe conditions where
it can be halted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pydantic import Field

from stillhook import units as u
from stillhook.base.choice import nearest
from stillhook.errors import PlanError
from stillhook.library.toml.file import TomlTable
from stillhook.spec.lift.phase import Phase
from stillhook.tables.table import Spec, Text
from stillhook.units import number, quote
from stillhook.weather.alpha import HALTING, short_contingency

ROUNDED = 1e-3
"""Part of a planned time by which it may have been rounded down."""


class OperationTable(Spec):
    """The table [operation]."""

    T_POP: u.Hours | None = Field(
        default=None, description="planned operation period from its start; default the sum of the phases"
    )
    T_C: u.Hours | None = Field(default=None, ge=0, description="contingency")
    lead: u.Hours | None = Field(default=None, ge=0, description="from the issue of the forecast to the start")
    safe_after: tuple[Text, ...] = Field(
        default=(), description="phases after which the operation can be halted in a safe condition"
    )
    time_to_safe: u.Hours | None = Field(
        default=None, ge=0, description="time to reach the safe condition, with safe_after"
    )
    forecast_every: u.Hours | None = Field(
        default=None, gt=0, description="time between two forecasts during the operation, with safe_after"
    )
    forecast_factors: Text | None = Field(default=None, description="table of forecast factors: name or file")


@dataclass(frozen=True)
class Operation:
    """T_POP from the issue of the forecast [s], lead of it before the start [s]; stated: whether the file gives the
    planned time; parts: number of parts that are planned on a forecast each; notes: what was assumed."""

    T_POP: float
    lead: float
    stated: bool
    parts: int
    notes: tuple[str, ...]


def operation_of(operation: OperationTable, table: TomlTable, phases: Sequence[Phase]) -> Operation:
    """Times of a plan's operation. Errors: PlanError of one line."""
    notes: list[str] = []
    planned, parts = _halted(operation, table, phases) if operation.safe_after else (None, 1)
    if planned is None:
        extra = [name for name in ("time_to_safe", "forecast_every") if getattr(operation, name) is not None]
        if extra:
            raise table.wrong("belongs to safe_after. Name the phases after which it can be halted as well.", extra[0])
        planned = _planned(operation, table, phases, notes)
    else:
        notes.append(
            f"operation can be halted: T_POP, windows and waits are those of the longest of {parts} parts between safe"
            f" conditions, each planned on a forecast of its own ({HALTING})"
        )
    lead = operation.lead or 0.0
    if operation.lead is None:
        notes.append("operation.lead is not given: the forecast is taken as issued at the start of the operation")
    T_POP = lead + planned
    short = short_contingency(T_POP, T_POP if operation.T_C is None else operation.T_C)
    return Operation(T_POP, lead, operation.T_POP is not None, parts, (*notes, *([short] if short else [])))


def _planned(operation: OperationTable, table: TomlTable, phases: Sequence[Phase], notes: list[str]) -> float:
    """Planned time from the start [s]."""
    phases_take = sum(phase.counted for phase in phases)
    hours = f"{number(phases_take / 3600.0, 3)} h"
    if operation.T_POP is None:
        notes.append(f"operation.T_POP is not given: the sum of the phases is used, {hours}")
        return phases_take
    if phases_take > operation.T_POP * (1.0 + ROUNDED):
        raise table.wrong(f"the phases alone take {hours}. Give more, or leave it out.", "T_POP")
    return operation.T_POP


def _halted(operation: OperationTable, table: TomlTable, phases: Sequence[Phase]) -> tuple[float, int]:
    """Planned time of the longest part between safe conditions, with the time to reach one [s], and the number of
    parts. A part is never shorter than the time between two forecasts, for only a new one halts the operation."""
    names = [phase.name for phase in phases]
    for name in operation.safe_after:
        if name not in names[:-1]:
            last = " It is the last phase, which ends the operation." if name == names[-1] else ""
            raise table.wrong(
                f"{quote(name)} is not one of {', '.join(names[:-1])}{nearest(name, names[:-1])}{last}", "safe_after"
            )
    if operation.T_POP is not None:
        raise table.wrong(
            "is the time of the complete operation, and safe_after divides it. Give one of them.", "T_POP"
        )
    if operation.time_to_safe is None:
        raise PlanError(
            'operation.safe_after: give time_to_safe, the time to reach the safe condition ("2 h"), as well.'
        )
    parts = [0.0]
    for phase in phases:
        parts[-1] += phase.counted
        parts += [0.0] if phase.name in operation.safe_after else []
    complete = sum(parts)
    planned = max(*parts, operation.forecast_every or 0.0) + operation.time_to_safe
    return min(planned, max(complete, operation.time_to_safe)), len(parts)
