"""The table of step 1: parameter, crane file, value from the log, difference, load cases."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from stillhook.report.document import Table
from stillhook.statistics.estimate import Estimate
from stillhook.units import KINDS, in_display, number
from stillhook.validate.criteria.results import Measure
from stillhook.validate.data_set.campaign import Campaign, Kind
from stillhook.validate.parameters.estimates import ParameterEstimates
from stillhook.validate.parameters.measures import by_name, in_ms

HEADER = ("parameter", "crane\nfile", "log\nsays", "95 %", "differ-\nence", "tests")
TITLE = "Parameters that the logs imply, against the crane file"

Row = tuple[str, str, str, str, str, str]


def table(campaign: Campaign, estimates: ParameterEstimates, results: Sequence[Measure]) -> Table:
    """One row a parameter, those of the drum and the load cell one a test."""
    rows = [
        *_drum(estimates),
        *_hydraulics(estimates, results),
        *_forces(estimates),
        *_at_rest(estimates),
        *_times(campaign, estimates, results),
    ]
    return Table(HEADER, tuple(rows), TITLE)


def _drum(estimates: ParameterEstimates) -> list[Row]:
    rows = []
    for x in estimates.radii:
        low, high = (x.d * (1.0 + e) for e in (x.error.low, x.error.high))
        rows.append(
            _row(
                "wire centre",
                x.d,
                Estimate.around(x.d_implied, 0.5 * (high - low)),
                "length",
                x.error.value,
                x.test,
                digits=5,
            )
        )
    return rows


def _row(name: str, twin: float, e: Estimate, quantity: str, difference: float, tests: str, *, digits: int = 4) -> Row:
    """A parameter [SI] with its unit after its name, the difference in per cent."""
    unit = KINDS[quantity].display if quantity else ""
    twin_, value, low, high = (
        number(in_display(v, quantity) if quantity else v, digits) for v in (twin, e.value, e.low, e.high)
    )
    return (f"{name} [{unit}]" if unit else name, twin_, value, f"{low} to {high}", _percent(difference), tests)


def _percent(x: float) -> str:
    return f"{100.0 * x:+.2f} %" if abs(x) < 1.0 else f"{100.0 * x:+.3g} %"


def _hydraulics(estimates: ParameterEstimates, results: Sequence[Measure]) -> list[Row]:
    rows, b, motor = [], estimates.balance, estimates.motor
    moved, driven = (_tests([p.test for p in estimates.parts if p.has(name)]) for name in ("u_m", "u_p"))
    if b is not None:
        one = Estimate.around(1.0 + b.ratio.value, b.ratio.half)
        rows.append(_row("motor flow over pump flow", 1.0, one, "", b.ratio.value, _tests(b.tests)))
        leak = Estimate.around(b.twin_leakage * (1.0 + b.leakage.value), b.twin_leakage * b.leakage.half)
        rows.append(_row("leakage", b.twin_leakage, leak, "leakage", b.leakage.value, _tests(b.tests), digits=3))
    error = next((m.value for m in results if m.name == "motor_offset_error"), None)
    if motor is not None and motor.offset is not None and error is not None:
        rows.append(_row("offset of the motors", motor.offset.value - error, motor.offset, "", error, moved, digits=2))
    if motor is not None and motor.hysteresis is not None:
        width = _hysteresis(estimates)
        rows.append(
            _row(
                "hysteresis of the motors", width, motor.hysteresis, "", motor.hysteresis.value - width, moved, digits=2
            )
        )
    if estimates.pump is not None:
        gain = Estimate.around(1.0 + estimates.pump.gain.value, estimates.pump.gain.half)
        rows.append(_row("gain of the pumps' setting", 1.0, gain, "", estimates.pump.gain.value, driven))
    return rows


def _hysteresis(estimates: ParameterEstimates) -> float:
    """Full width that the twin's motors have [-]."""
    return 2.0 * float(estimates.parts[0].params.active.control.half_width)


def _forces(estimates: ParameterEstimates) -> list[Row]:
    rows = [_row("load cell", c.weight, c.force, "force", c.error.value, c.test) for c in estimates.cells]
    kinds = {p.test: p.kind for p in estimates.parts}
    judged = any(kinds[f.test] is Kind.AHC for f in estimates.frictions)
    for f in estimates.frictions:
        aside = ", not judged" if judged and kinds[f.test] is not Kind.AHC else ""
        scaled = Estimate.around(f.mean * (1.0 + f.scale.value), f.mean * f.scale.half)
        rows.append(_row(f"friction at the motors{aside}", f.mean, scaled, "torque", f.scale.value, f.test))
    return rows


def _at_rest(estimates: ParameterEstimates) -> list[Row]:
    if estimates.rests is None:
        return []
    dp, bar = estimates.rests.dp, KINDS["pressure"].display
    value, low, high = (number(in_display(x, "pressure"), 2) for x in (dp.value, dp.low, dp.high))
    tests = _tests([r.test for r in estimates.rests.rests])
    return [(f"line A less B at rest [{bar}]", "0", value, f"{low} to {high}", f"{value} {bar}", tests)]


def _times(campaign: Campaign, estimates: ParameterEstimates, results: Sequence[Measure]) -> list[Row]:
    rows = []
    clock = estimates.clock.error
    if clock is not None:
        one = Estimate.around(1.0 + clock.value, clock.half)
        tests = _tests([t for r in estimates.ratios.values() for t in r.tests])
        rows.append(_row("clock of the log", 1.0, one, "", clock.value, tests, digits=5))
    for name, e in estimates.clock.calibration.items():
        one = Estimate.around(1.0 + e.value, e.half)
        rows.append(_row(f"scale of {name}", 1.0, one, "", e.value, _tests(estimates.ratios[name].tests), digits=5))
    for m in by_name(results).get("tip_delay_error", []):
        if m.value is not None and m.low is not None and m.high is not None:
            low, high, late = (in_ms(campaign.delay + x) for x in (m.low, m.high, m.value))
            tests = _tests([d.test for d in estimates.delays])
            rows.append(
                (
                    "delay of the tip [ms]",
                    in_ms(campaign.delay),
                    late,
                    f"{low} to {high}",
                    f"{in_ms(m.value)} ms",
                    tests,
                )
            )
    return rows


def _tests(names: Iterable[str]) -> str:
    return ", ".join(dict.fromkeys(names))
