"""A table of leakage over displacement, speed and pressure, of a motor or a pump: read, and brought to one flow."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.gateway.guard import reader
from stillhook.errors import LogError
from stillhook.formats.table.columns import ColumnSpec
from stillhook.formats.table.read import Columns, read_columns
from stillhook.identify.motor.map import SETTINGS as MOTOR_SETTINGS
from stillhook.identify.motor.map import SYNTHETIC, in_range, without
from stillhook.units import quote, show

FEWEST_ROWS = 3
MOST_LEFT_OUT = 0.5
"""Part of the rows: a table that loses more than half of them to bad values was misread."""


class Unit(StrEnum):
    """Which way a unit's leakage counts: a pump delivers less than its displacement, a motor takes more."""

    MOTOR = "motor"
    PUMP = "pump"


SETTINGS = tuple(replace(spec, required=spec.name != "dp_m") for spec in MOTOR_SETTINGS)
LEAKS = (
    ColumnSpec("C_leak", "leakage", ("c", "c_pleak", "leak_conductance"), "C_leak [L/min/bar]"),
    ColumnSpec("Q_leak", "flow", ("leak", "leakage", "leak_flow", "loss"), "Q_leak [L/min]"),
    ColumnSpec("Q", "flow", ("flow", "q_out", "q_in", "delivery"), "Q [L/min]"),
    ColumnSpec("eta_v", "", ("eta_vol", "volumetric_efficiency"), "eta_v [%]"),
)
CASE = ColumnSpec("Q_case", "flow", ("case", "case_drain", "drain", "q_drain"), "Q_case [L/min]")


@dataclass(frozen=True)
class LeakData:
    """Measured points (n,): D [m^3/rad], omega [rad/s], dp [Pa] (None: conductances alone), leak flow [m^3/s] or,
    without dp, conductance [m^3/s/Pa]; case-drain flow [m^3/s] where it was measured; D_max [m^3/rad]."""

    unit: Unit
    D: FloatArray
    omega: FloatArray
    dp: FloatArray | None
    leak: FloatArray
    case: FloatArray | None
    D_max: float
    source: str
    findings: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.leak)

    @property
    def head(self) -> FloatArray:
        """What a conductance is multiplied by [Pa], 1 where the table has conductances."""
        return np.ones(len(self)) if self.dp is None else self.dp

    @property
    def settings(self) -> dict[str, tuple[FloatArray, str]]:
        """Settings by name, with the kind of quantity of each."""
        axes = {"displacement": (self.D, "displacement"), "speed": (self.omega, "rotation")}
        return axes if self.dp is None else axes | {"pressure": (self.dp, "pressure")}


@reader(LogError)
def read_leaks(
    path: str | os.PathLike[str],
    unit: Unit,
    *,
    mapping: str | os.PathLike[str] | None = None,
    D_max: float | None = None,
    columns: Mapping[str, Any] | None = None,
) -> LeakData:
    """A table of leakage in long form, a row a measured point, from CSV, Parquet or Excel.

    Columns: D_m (full or part displacement), omega_m (or n), dp_m (or dp), and one of C_leak, Q_leak, Q (what a pump
    delivers, what a motor takes) or eta_v; Q_case where the case drain was measured. Rows that cannot be a leak (empty
    cells, standstill, no pressure, a negative leak) are left out and reported.
    Errors: LogError, UnitError of one line with file, row and column.
    """
    table = read_columns(path, (*SETTINGS, *LEAKS, CASE), mapping, columns=columns)
    values, notes = dict(table.values), list[str]()
    in_range(table, f"a {unit}")
    D, omega = values["D_m"], np.abs(values["omega_m"])
    leak, dp = _leak(table, unit, notes)
    case = values.get("Q_case")
    empty = ~np.isfinite(D + omega + leak + (0.0 if dp is None else dp))
    reasons = [(empty, "an empty cell"), (omega == 0.0, "standstill"), (leak < 0.0, "a negative leak")]
    keep = without(table, reasons if dp is None else [*reasons, (dp <= 0.0, "no pressure")], notes)
    if keep.sum() < max(FEWEST_ROWS, MOST_LEFT_OUT * len(keep)):
        why = f" ({notes[-1]})" if not keep.all() and notes else ""
        raise LogError(
            f"{table.source}: {int(keep.sum())} of {len(keep)} rows hold a leak{why}; at least {FEWEST_ROWS}, and"
            " half of them, are needed. Check columns and units."
        )
    full = float(D[keep].max()) if D_max is None else D_max
    if full < D[keep].max() * 0.99:
        raise LogError(
            f"{table.source}: displacement {show(float(D[keep].max()), 'displacement')} is beyond D_max"
            f" {show(full, 'displacement')}. Check the unit in the heading, and component.D_max."
        )
    if table.unused:
        notes.append("columns not used: " + ", ".join(quote(h) for h in table.unused))
    if SYNTHETIC in " ".join((table.source, *table.table.comments)).lower():
        notes.insert(0, "SYNTHETIC table: made by a formula, measured on no unit")
    dp, case = (None if x is None else x[keep] for x in (dp, case))
    return LeakData(unit, D[keep], omega[keep], dp, leak[keep], case, full, table.source, tuple(notes))


def _leak(table: Columns, unit: Unit, notes: list[str]) -> tuple[FloatArray, FloatArray | None]:
    """Leak flow of every row and its pressure, or conductance and None, of the first of `LEAKS` that the table has."""
    values = table.values
    available = [spec.name for spec in LEAKS if spec.name in values]
    if not available:
        examples = ", ".join(f'"{spec.example}"' for spec in LEAKS)
        raise LogError(f"{table.source}: no column with the leak. Choose one of {examples}, or map it with --mapping.")
    name = available[0]
    x, dp, swept = values[name], values.get("dp_m"), values["D_m"] * np.abs(values["omega_m"])
    if name != "C_leak" and dp is None:
        raise LogError(
            f'{table.source}: column {quote(table.headings[name])} is a flow, and no column "dp [bar]" says at what'
            " pressure. Add it, or give conductances as C_leak [L/min/bar]."
        )
    if name == "eta_v" and (bad := (x > 1.0) | (x <= 0.0)).any():
        i = int(np.argmax(bad))
        raise LogError(
            f"{table.source}: row {table.numbers[i]}: volumetric efficiency {100.0 * x[i]:.4g} %; it is above 0 and at"
            " most 100 %. Check the unit."
        )
    pump = unit is Unit.PUMP
    notes += [f"column {quote(table.headings[other])} not used" for other in available[1:]]
    if name == "C_leak":
        return (x if dp is None else x * dp), dp
    if name == "Q_leak":
        return x, dp
    flow = x if name == "Q" else swept * x if pump else swept / x
    return (swept - flow if pump else flow - swept), dp
