"""From a table or a log to a component: `identify_component`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from stillhook.base.choice import choice
from stillhook.base.progress import Progress
from stillhook.formats.table.corrections import TABLES, corrections_of
from stillhook.identify.component.leak_table import Unit, read_leaks
from stillhook.identify.component.leakage import motor_leakage, pump_leakage
from stillhook.identify.component.lines import line_restrictions
from stillhook.identify.component.result import TABLE, Component, Kind, component_settings
from stillhook.identify.component.servo import servo, swash_log
from stillhook.library.toml.kinds import FileKind
from stillhook.library.toml.tree import parsed, toml_text
from stillhook.logs.log import read_log
from stillhook.logs.understood import signals_of

FINEST = "1 ms"
"""Bins of a log: no wider than its samples are apart."""


def identify_component(
    component: str,
    path: str | os.PathLike[str],
    *,
    mapping: str | os.PathLike[str] | None = None,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
) -> Component:
    """Identify a component from a supplier's table or from a log.

    Parameters
    ----------
    component : {"motor-leakage", "pump-leakage", "servo", "lines"}
        What is identified: C_1 and C_2 of a motor (Moslatt 2020 eq. 2.18), the leak table of a pump (tables 2.5 and
        2.6), the displacement control of a pump or a motor, the restrictions R_1 and R_2 between pumps and motors.
    path : str or path-like
        Table (CSV, Parquet, Excel) of a leakage, log (CSV, Parquet, MDF4, TDMS, MAT) of the other two.
    mapping : str or path-like, optional
        Mapping file with columns or signals, and a table [component].
    columns : sequence of str, optional
        Columns such as "Q_leak=Lekkasje [L/min]", which win over those of the mapping.
    progress : callable, optional
        Called with the share of a log that is read, 0 to 1.

    Returns
    -------
    Component
        Parameters with 95 % intervals, held-out errors, and what a crane file takes.

    Raises
    ------
    IdentifyError, LogError, UnitError
        One line.
    """
    kind, file = choice(Kind, component, "component"), None if mapping is None else Path(mapping)
    settings = component_settings(file)
    if kind in (Kind.MOTOR_LEAKAGE, Kind.PUMP_LEAKAGE):
        unit = Unit(kind.value.partition("-")[0])
        data = read_leaks(
            path, unit, mapping=_with_columns(file), D_max=settings.D_max, columns=corrections_of(columns or ())
        )
        return (motor_leakage if unit is Unit.MOTOR else pump_leakage)(data, settings)
    signals = signals_of(Path(path), file if _with_columns(file) else None, columns)
    log = read_log(path, signals, every=FINEST, progress=progress)
    return line_restrictions(log, settings) if kind is Kind.LINES else servo(swash_log(log), settings)


def _with_columns(mapping: Path | None) -> Path | None:
    """A mapping file that describes columns; None where it has the table [component] alone."""
    if mapping is None:
        return None
    table = parsed(toml_text(mapping), mapping.name, FileKind.MAPPING)
    return mapping if TABLE not in table or any(name in table for name in TABLES) else None
