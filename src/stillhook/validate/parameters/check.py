"""Step 1: do the crane file's parameters agree with those implied by the logs? By balances, without simulating the twin
where possible.

Source: Moslatt 2020 paper F, "(1) System variables and parameters": correct sizes of pumps, motors, leakage terms,
controller parameters. The paper states no numbers for this step; every limit is Stillhook's own and is given in the
criteria file with its reason.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from stillhook.base.progress import Progress
from stillhook.report.document import Table
from stillhook.statistics.estimate import Estimate
from stillhook.units import KINDS, in_display, number, show
from stillhook.validate.criteria.results import Measure, Step, StepNumber, lacks
from stillhook.validate.data_set.campaign import Campaign, Kind
from stillhook.validate.data_set.record import Record
from stillhook.validate.parameters.measures import ParameterEstimates, measures, parameter_estimates
from stillhook.validate.parameters.segments import parts_of

Row = tuple[str, str, str, str, str, str]


def check_parameters(campaign: Campaign, records: tuple[Record, ...], progress: Progress) -> Step[ParameterEstimates]:
    """Parameters implied by the logs: transmission, displacements, leakage, settings, clock, load cell, friction and
    tip delay, against the crane.

    Parameters: campaign with the twin under test; records as read; progress is called with the share done. Nothing is
    refused here: a check whose signals were not logged gives a measure without a value that states what to log.
    """
    e = parameter_estimates(parts_of(campaign, records), progress, records)
    without = lacks(campaign.crane)
    results = tuple(m for m in measures(campaign, e, records) if m.name not in without)
    data = {name: getattr(e, name) for name in ("radii", "frictions", "delays", "cells", "rests", "balance")}
    rows = [*_rows(e, results), *_rest_row(e), *_times(campaign, e, results)]
    title = "Parameters that the logs imply, against the crane file"
    return Step(StepNumber.PARAMETERS, results, (), (parameter_table(rows, title),), data, e)


def parameter_table(rows: Sequence[Row], title: str) -> Table:
    """One row a parameter, of what differs between the tests one a test."""
    return Table(("parameter", "crane\nfile", "log\nsays", "95 %", "differ-\nence", "tests"), tuple(rows), title)


def row(
    name: str, twin: float, e: Estimate, quantity: str, tests: Iterable[str], difference: float, *, digits: int = 4
) -> Row:
    """Row of a parameter [SI] with its unit after its name; difference relative, or of a pure number."""
    cells = [number(in_display(x, quantity) if quantity else x, digits) for x in (twin, e.value, e.low, e.high)]
    percent = f"{100.0 * difference:+.2f} %" if abs(difference) < 1.0 else f"{100.0 * difference:+.3g} %"
    name = f"{name} [{KINDS[quantity].display}]" if quantity else name
    return (name, cells[0], cells[1], f"{cells[2]} to {cells[3]}", percent, ", ".join(dict.fromkeys(tests)))


def error_row(name: str, twin: float, error: Estimate, quantity: str, tests: Iterable[str], digits: int = 4) -> Row:
    """Row of a parameter [SI] from the twin's value and the relative error."""
    e = Estimate.around(twin * (1.0 + error.value), twin * error.half)
    return row(name, twin, e, quantity, tests, error.value, digits=digits)


def _rows(e: ParameterEstimates, results: Sequence[Measure]) -> Iterator[Row]:
    """Drum, hydraulics, load cell, friction."""
    b, motor, kinds = e.balance, e.motor, {p.test: p.kind for p in e.parts}
    moved, driven = ([p.test for p in e.parts if p.has(name)] for name in ("u_m", "u_p"))
    yield from (error_row("wire centre", x.d, x.error, "length", [x.test], 5) for x in e.radii)
    if b is not None:
        yield error_row("motor flow over pump flow", 1.0, b.ratio, "", b.tests)
        yield error_row("leakage", b.leak.twin, b.leak.value, "leakage", b.tests, 3)
    error = next((m.value for m in results if m.name == "motor_offset_error"), None)
    if motor is not None and motor.offset is not None and error is not None:
        yield row("offset of the motors", motor.offset.value - error, motor.offset, "", moved, error, digits=2)
    if motor is not None and motor.hysteresis is not None:
        width = 2.0 * float(e.parts[0].params.active.control.half_width)
        wider = motor.hysteresis.value - width
        yield row("hysteresis of the motors", width, motor.hysteresis, "", moved, wider, digits=2)
    if e.pump is not None:
        yield error_row("gain of the pumps' setting", 1.0, e.pump.gain, "", driven)
    yield from (row("load cell", c.weight, c.force, "force", [c.test], c.error.value) for c in e.cells)
    judged = any(kinds[f.test] is Kind.AHC for f in e.frictions)
    for f in e.frictions:
        name = "friction at the motors" + (", not judged" if judged and kinds[f.test] is not Kind.AHC else "")
        yield error_row(name, f.mean, f.scale, "torque", [f.test])


def _rest_row(e: ParameterEstimates) -> Iterator[Row]:
    if e.rests is not None:
        dp, bar = e.rests.dp, KINDS["pressure"].display
        value, low, high = (number(in_display(x, "pressure"), 2) for x in (dp.value, dp.low, dp.high))
        tests = ", ".join(dict.fromkeys(r.test for r in e.rests.rests))
        yield f"line A less B at rest [{bar}]", "0", value, f"{low} to {high}", show(dp.value, "pressure", 2), tests


def _times(campaign: Campaign, e: ParameterEstimates, results: Sequence[Measure]) -> Iterator[Row]:
    """Clock, scales of the speeds, delay of the tip."""
    if e.clock.error is not None:
        tests = [t for r in e.ratios.values() for t in r.tests]
        yield error_row("clock of the log", 1.0, e.clock.error, "", tests, 5)
    for name, scale in e.clock.calibration.items():
        yield error_row(f"scale of {name}", 1.0, scale, "", e.ratios[name].tests, 5)
    for m in results:
        if m.name == "tip_delay_error" and m.value is not None and m.low is not None and m.high is not None:
            ms = [f"{1e3 * (campaign.delay + x) + 0.0:.0f}" for x in (0.0, m.value, m.low, m.high)]
            of = ", ".join(e.delays.tests if e.delays is not None else ())
            yield "delay of the tip [ms]", ms[0], ms[1], f"{ms[2]} to {ms[3]}", f"{1e3 * m.value + 0.0:.0f} ms", of
