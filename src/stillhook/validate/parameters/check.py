"""Step 1: do the crane file's parameters agree with those implied by the logs? By balances, without simulating the twin
where possible.

Source: Moslatt 2020 paper F, "(1) System variables and parameters": correct sizes of pumps, motors, leakage terms,
controller parameters. The paper states no numbers for this step; every limit is Stillhook's own and is given in the
criteria file with its reason.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from stillhook.base.progress import Progress
from stillhook.report.document import Table
from stillhook.statistics.estimate import Estimate
from stillhook.units import KINDS, in_display, number
from stillhook.validate.criteria.needs import lacks
from stillhook.validate.criteria.results import Measure, Step, StepNumber
from stillhook.validate.data_set.campaign import Campaign, Kind
from stillhook.validate.data_set.records.record import Record
from stillhook.validate.parameters.flow import rest_measure
from stillhook.validate.parameters.measures import ParameterEstimates, in_ms, measures, parameter_estimates
from stillhook.validate.parameters.segments import parts_of


def check_parameters(campaign: Campaign, records: tuple[Record, ...], progress: Progress) -> Step[ParameterEstimates]:
    """Parameters implied by the logs: transmission, displacements, leakage, settings, clock, load cell, friction and
    tip delay, against the crane.

    Parameters: campaign with the twin under test; records as read; progress is called with the share done. Nothing is
    refused here: a check whose signals were not logged gives a measure without a value that states what to log.
    """
    e = parameter_estimates(parts_of(campaign, records), progress, records)
    without = lacks(campaign.crane)
    found = (*measures(campaign, e), rest_measure(campaign.crane, e.rests, records))
    results = tuple(m for m in found if m.name not in without)
    data = {
        "radii": e.radii,
        "frictions": e.frictions,
        "delays": e.delays,
        "cells": e.cells,
        "rests": e.rests,
        "balance": e.balance,
    }
    return Step(StepNumber.PARAMETERS, results, (), (_table(campaign, e, results),), data, e)


HEADER = ("parameter", "crane\nfile", "log\nsays", "95 %", "differ-\nence", "tests")
TITLE = "Parameters that the logs imply, against the crane file"

Row = tuple[str, str, str, str, str, str]


def _table(campaign: Campaign, estimates: ParameterEstimates, results: Sequence[Measure]) -> Table:
    """One row a parameter, those of the drum and the load cell one a test."""
    rows = [
        *_drum(estimates),
        *_hydraulics(estimates, results),
        *_forces(estimates),
        *_at_rest(estimates),
        *_times(campaign, estimates, results),
    ]
    return Table(HEADER, tuple(rows), TITLE)


def row(
    name: str, twin: float, e: Estimate, quantity: str, tests: Iterable[str], difference: float, *, digits: int = 4
) -> Row:
    """Row of a parameter [SI] with its unit after its name; difference relative, or of a pure number."""
    unit = KINDS[quantity].display if quantity else ""
    cells = [number(in_display(x, quantity) if quantity else x, digits) for x in (twin, e.value, e.low, e.high)]
    percent = f"{100.0 * difference:+.2f} %" if abs(difference) < 1.0 else f"{100.0 * difference:+.3g} %"
    name = f"{name} [{unit}]" if unit else name
    return (name, cells[0], cells[1], f"{cells[2]} to {cells[3]}", percent, _tests(tests))


def error_row(name: str, twin: float, error: Estimate, quantity: str, tests: Iterable[str], *, digits: int = 4) -> Row:
    """Row of a parameter [SI] from the twin's value and the relative error."""
    e = Estimate.around(twin * (1.0 + error.value), twin * error.half)
    return row(name, twin, e, quantity, tests, error.value, digits=digits)


def _drum(estimates: ParameterEstimates) -> list[Row]:
    return [error_row("wire centre", x.d, x.error, "length", [x.test], digits=5) for x in estimates.radii]


def _hydraulics(estimates: ParameterEstimates, results: Sequence[Measure]) -> list[Row]:
    rows, b, motor = [], estimates.balance, estimates.motor
    moved, driven = ([p.test for p in estimates.parts if p.has(name)] for name in ("u_m", "u_p"))
    if b is not None:
        rows.append(error_row("motor flow over pump flow", 1.0, b.ratio, "", b.tests))
        rows.append(error_row("leakage", b.twin_leakage, b.leakage, "leakage", b.tests, digits=3))
    error = next((m.value for m in results if m.name == "motor_offset_error"), None)
    if motor is not None and motor.offset is not None and error is not None:
        twin = motor.offset.value - error
        rows.append(row("offset of the motors", twin, motor.offset, "", moved, error, digits=2))
    if motor is not None and motor.hysteresis is not None:
        width = 2.0 * float(estimates.parts[0].params.active.control.half_width)
        error = motor.hysteresis.value - width
        rows.append(row("hysteresis of the motors", width, motor.hysteresis, "", moved, error, digits=2))
    if estimates.pump is not None:
        rows.append(error_row("gain of the pumps' setting", 1.0, estimates.pump.gain, "", driven))
    return rows


def _forces(estimates: ParameterEstimates) -> list[Row]:
    rows = [row("load cell", c.weight, c.force, "force", [c.test], c.error.value) for c in estimates.cells]
    kinds = {p.test: p.kind for p in estimates.parts}
    judged = any(kinds[f.test] is Kind.AHC for f in estimates.frictions)
    for f in estimates.frictions:
        name = "friction at the motors" + (", not judged" if judged and kinds[f.test] is not Kind.AHC else "")
        rows.append(error_row(name, f.mean, f.scale, "torque", [f.test]))
    return rows


def _at_rest(estimates: ParameterEstimates) -> list[Row]:
    if estimates.rests is None:
        return []
    dp, bar = estimates.rests.dp, KINDS["pressure"].display
    value, low, high = (number(in_display(x, "pressure"), 2) for x in (dp.value, dp.low, dp.high))
    tests = _tests(r.test for r in estimates.rests.rests)
    return [(f"line A less B at rest [{bar}]", "0", value, f"{low} to {high}", f"{value} {bar}", tests)]


def _times(campaign: Campaign, estimates: ParameterEstimates, results: Sequence[Measure]) -> list[Row]:
    rows, clock = [], estimates.clock
    if clock.error is not None:
        tests = [t for r in estimates.ratios.values() for t in r.tests]
        rows.append(error_row("clock of the log", 1.0, clock.error, "", tests, digits=5))
    for name, e in clock.calibration.items():
        rows.append(error_row(f"scale of {name}", 1.0, e, "", estimates.ratios[name].tests, digits=5))
    for m in results:
        if m.name == "tip_delay_error" and m.value is not None and m.low is not None and m.high is not None:
            stated, low, high, late = (in_ms(campaign.delay + x) for x in (0.0, m.low, m.high, m.value))
            of = _tests(d.test for d in estimates.delays)
            rows.append(("delay of the tip [ms]", stated, late, f"{low} to {high}", f"{in_ms(m.value)} ms", of))
    return rows


def _tests(names: Iterable[str]) -> str:
    return ", ".join(dict.fromkeys(names))
