"""Measures of step 1: parameters implied by a log less those of the crane file, with the likely cause in words.

The table of step 1: parameter, crane file, value from the log, difference, load cases.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from stillhook.library.leakage import point_text
from stillhook.report.document import Table
from stillhook.statistics.estimate import Estimate, extremes
from stillhook.units import KINDS, in_display, number, show
from stillhook.validate.criteria.names import MEASURES
from stillhook.validate.criteria.results import Measure
from stillhook.validate.data_set.campaign import Campaign, Kind
from stillhook.validate.parameters import hoisting as implied_friction
from stillhook.validate.parameters import signals as implied_delay
from stillhook.validate.parameters.circuit.flow import Balance
from stillhook.validate.parameters.circuit.leakage import form_says
from stillhook.validate.parameters.estimates import ParameterEstimates
from stillhook.validate.parameters.hoisting import CLOSE, Friction, cell_says, diagnosis
from stillhook.validate.parameters.segments import LogPart
from stillhook.validate.parameters.signals import Ratio, jump_says
from stillhook.winches.circuits.tables import ServoVariant

SWAPPED = -0.3
"""Measured friction over the twin's below which the pressure lines are swapped: friction dissipates."""
CELL_BELIEVED = 0.25
"""Error of the load cell from which it is not used for torques [-]."""
STANDS = 0.03
"""Standing torque, as a part of the load, from which it is reported [-]: gas pressure, setting and cell are known
to a per cent."""
NEGLIGIBLE = 1e-3
"""Error of a calibration that is negligible [-]."""
RATES = {"v_w": "wire speed", "v_tip": "tip speed", "a_tip": "tip acceleration"}


def measures(campaign: Campaign, estimates: ParameterEstimates) -> tuple[Measure, ...]:
    """Every measure of step 1 in the order of the checks; one without a value says what to log."""
    return (
        *_radii(campaign, estimates),
        *_clock(estimates),
        *_settings(campaign, estimates),
        *_flow(estimates),
        *_cells(estimates),
        *_friction(estimates),
        *_delay(campaign, estimates),
        *_references(estimates),
        *_pressures(estimates),
    )


def measure(name: str, e: Estimate | None, *, test: str = "", data: str = "", note: str = "") -> Measure:
    """A measure of step 1 from an estimate; None: not determined by the data."""
    quantity = MEASURES[name].quantity
    if e is None:
        return Measure(name, None, quantity, test=test, data=data, note=note)
    bounded = np.isfinite(e.half) and e.half > 0.0
    return Measure(
        name, e.value, quantity, e.low if bounded else None, e.high if bounded else None, test, data, note, e.structural
    )


def rests_on(parts: Iterable[LogPart], tests: Iterable[str], blocks: float = 0) -> str:
    """The data behind a measure in words."""
    names = list(dict.fromkeys(tests))
    seconds = sum(p.segment.duration for p in parts if p.test in names)
    text = f"{len(names)} test{'s' if len(names) != 1 else ''}, {number(seconds, 4)} s"
    return f"{text} in {blocks:g} blocks" if blocks else text


def _radii(campaign: Campaign, estimates: ParameterEstimates) -> list[Measure]:
    if not estimates.radii:
        return [
            measure(
                "lever_error",
                None,
                note=("log the motor speed omega_m together with v_w or s_w, with the winch moving"),
            )
        ]
    note = diagnosis(campaign.crane, estimates.radii)
    return [
        measure(
            "lever_error",
            x.error,
            test=f"test {x.test}",
            data=rests_on(estimates.parts, [x.test], x.error.n),
            note=note,
        )
        for x in estimates.radii
    ]


def _clock(estimates: ParameterEstimates) -> list[Measure]:
    tests = [t for r in estimates.ratios.values() for t in r.tests]
    clock = estimates.clock.error
    out = [
        measure("clock_error", clock, data=rests_on(estimates.parts, tests) if clock else "", note=estimates.clock.note)
    ]
    for name, key in (("v_w_error", "v_w"), ("v_tip_error", "v_tip"), ("a_tip_error", "a_tip")):
        if key in estimates.clock.calibration:
            e = estimates.clock.calibration[key]
            out.append(
                measure(
                    name,
                    e,
                    data=rests_on(estimates.parts, estimates.ratios[key].tests),
                    note=_calibration(estimates.ratios[key], e),
                )
            )
        else:
            out.append(measure(name, None, note=f"log {key} together with the quantity it is the rate of, in motion"))
    if estimates.jump is None:
        out.append(measure("length_jump", None, note="log v_w together with s_w"))
    else:
        out.append(
            measure(
                "length_jump",
                Estimate.around(estimates.jump.size, 0.0),
                data=rests_on(estimates.parts, tests),
                note=jump_says(estimates.jump),
            )
        )
    return out


def _calibration(ratio: Ratio, e: Estimate) -> str:
    lag = (
        f", {in_ms(abs(ratio.lag))} ms {'ahead of' if ratio.lag > 0.0 else 'behind'} it"
        if abs(ratio.lag) > 0.005
        else ""
    )
    if abs(e.value) < NEGLIGIBLE:
        return f"the {RATES[ratio.name]} is calibrated{lag}"
    much = f"{100.0 * abs(e.value):.2f} % too {'much' if e.value > 0.0 else 'little'}"
    return f"the {RATES[ratio.name]} reads {much} against the change of the corresponding quantity{lag}"


def _settings(campaign: Campaign, estimates: ParameterEstimates) -> list[Measure]:
    out, motor = [], estimates.motor
    if motor is None:
        out.append(measure("motor_offset_error", None, note="log the motors' command u_m and setting alpha_m"))
    elif motor.offset is None:
        note = (
            f"the command leaves full displacement for {number(motor.seconds, 2)} s only: test a mode or a speed with"
            " reduced motors"
        )
        out.append(measure("motor_offset_error", None, note=note))
    else:
        expected = _expected_offset(campaign)
        e = Estimate.around(motor.offset.value - expected, motor.offset.half, motor.offset.n)
        wide = f", hysteresis {100.0 * motor.hysteresis.value:.1f} %" if motor.hysteresis is not None else ""
        note = (
            f"the motors are {100.0 * motor.offset.value:.1f} % above their command, {100.0 * expected:.1f} % in the"
            f" twin{wide}"
        )
        out.append(
            measure("motor_offset_error", e, data=f"{number(motor.seconds, 3)} s with reduced motors", note=note)
        )
    if estimates.pump is None:
        return [*out, measure("pump_gain_error", None, note="log the pumps' command u_p and setting alpha_p")]
    zero = f"zero of the setting at {100.0 * estimates.pump.offset.value:.2f} %"
    return [
        *out,
        measure(
            "pump_gain_error",
            estimates.pump.gain,
            data=rests_on(estimates.parts, [p.test for p in estimates.parts]),
            note=zero,
        ),
    ]


def _expected_offset(campaign: Campaign) -> float:
    """The twin's own offset of the motors' setting [-]."""
    motor = campaign.crane.active.motor
    return 0.0 if motor.variant is ServoVariant.CLOSED_LOOP else motor.offset


def _flow(estimates: ParameterEstimates) -> list[Measure]:
    b = estimates.balance
    if b is None:
        note = "log p_a, p_b, the motor speed, alpha_m (or u_m) and alpha_p (or u_p), with pressure in one line"
        return [
            measure(name, None, note=note)
            for name in ("displacement_ratio_error", "leakage_error", "leakage_here_error")
        ]
    data = rests_on(estimates.parts, b.tests, b.ratio.n)
    return [
        measure("displacement_ratio_error", b.ratio, data=data, note=_ratio_says(b)),
        measure("leakage_error", b.leak.judged, data=data, note=_leak_says(b)),
        measure(
            "leakage_here_error",
            b.leakage,
            data=data,
            note=f"at {point_text(b.leak.at)}, the working point of the leakage in these data",
        ),
    ]


def _ratio_says(b: Balance) -> str:
    faster = "faster" if b.ratio.value > 0.0 else "slower"
    text = f"with full pumps the winch is {100.0 * abs(b.ratio.value):.2f} % {faster} than the twin, leakage apart"
    assumed = [name for name, seen in (("u_m", b.measured_motors), ("u_p", b.measured_pumps)) if not seen]
    return text + (
        f"; from {' and '.join(assumed)} through the servo, so it includes offsets of the settings" if assumed else ""
    )


def _leak_says(b: Balance) -> str:
    leak = b.leak
    implied, ours = (show(x, "leakage", 3) for x in (b.twin_leakage * (1.0 + b.leakage.value), b.twin_leakage))
    text = f"{implied} implied, {ours} in the twin at the working point of these data ({point_text(leak.at)})"
    if leak.refuted:
        text += f"; {form_says(leak)}"
    elif len(leak.remaining_forms) > 1:
        forms = ", ".join(leak.remaining_forms)
        text += f", form as in the crane file; the data do not distinguish these forms: {forms}"
    return text


def _cells(estimates: ParameterEstimates) -> list[Measure]:
    heavy = [c for c in estimates.cells if not c.light]
    if not heavy:
        return [measure("load_cell_error", None, note="log the load cell F_w in a test whose load is stated")]
    note = cell_says(estimates.cells, estimates.parts)
    data = {c.test: rests_on(estimates.parts, [c.test], c.error.n) for c in heavy}
    return [measure("load_cell_error", c.error, test=f"test {c.test}", data=data[c.test], note=note) for c in heavy]


def _cell_wrong(estimates: ParameterEstimates) -> bool:
    return any(abs(c.error.value) > CELL_BELIEVED for c in estimates.cells if not c.light)


def _friction(estimates: ParameterEstimates) -> list[Measure]:
    if _cell_wrong(estimates):
        return [
            measure(
                "friction_error",
                None,
                note="the load cell is wrong, so the torque balance is not closed: correct it first",
            )
        ]
    kinds = {p.test: p.kind for p in estimates.parts}
    judged = [f for f in estimates.frictions if kinds[f.test] is Kind.AHC] or list(estimates.frictions)
    scale = implied_friction.overall(judged)
    if scale is None:
        lacks = dict.fromkeys(name for p in estimates.parts for name in implied_friction.missing(p))
        note = (
            f"log {', '.join(lacks)} for a torque balance at the motors" if lacks else "the winch does not move enough"
        )
        return [measure("friction_error", None, note=note)]
    data = rests_on(estimates.parts, [f.test for f in judged], scale.n)
    return [measure("friction_error", scale, data=data, note=_friction_says(estimates, judged, scale))]


def _friction_says(estimates: ParameterEstimates, judged: list[Friction], scale: Estimate) -> str:
    if 1.0 + scale.value < SWAPPED:
        return "friction drives the winch: p_a and p_b are swapped, or the sign of the speed is wrong"
    each = extremes({f.test: 1.0 + f.scale.value for f in judged}, lambda x: number(x, 3))
    text = f"{number(1.0 + scale.value, 3)} times the twin's{f', {each} by test' if each else ''}"
    others = [f"{number(1.0 + f.scale.value, 3)} in {f.test}" for f in estimates.frictions if f not in judged]
    text += f"; not judged because it is not heave compensation: {', '.join(others)}" if others else ""
    part = {p.test: p for p in estimates.parts}
    standing = max(judged, key=lambda f: abs(f.standing_force) / max(part[f.test].weight, 1.0))
    if abs(standing.standing_force) > STANDS * max(part[standing.test].weight, 1.0):
        force = show(standing.standing_force, "force", 3)
        text += f"; in addition {force} in the wire of {standing.test} are not explained: load cell, p_hp or alpha_pm"
    return text


def _delay(campaign: Campaign, estimates: ParameterEstimates) -> list[Measure]:
    if not estimates.delays:
        return [
            measure(
                "tip_delay_error",
                None,
                note="log the load cell F_w together with s_tip and s_w, in heave compensation with tip motion",
            )
        ]
    if any(abs(c.error.value) > CLOSE for c in estimates.cells if not c.light):
        return [measure("tip_delay_error", None, note="the load cell is wrong: correct it first")]
    total = implied_delay.overall(estimates.delays)
    assert total is not None
    each = extremes({d.test: d.delay.value for d in estimates.delays}, lambda x: f"{in_ms(x)} ms")
    text = f"{in_ms(total.value)} ms estimated{f', {each} by test' if each else ''}, {in_ms(campaign.delay)} ms stated"
    if total.half > implied_delay.WIDEST and abs(total.value - campaign.delay) < total.half:
        note = (
            f"{text}, +- {in_ms(total.half)} ms: load, motion or load cell are too weak; test a heavy load with little"
            " wire out"
        )
        return [measure("tip_delay_error", None, note=note)]
    e = Estimate.around(total.value - campaign.delay, total.half, total.n)
    data = rests_on(estimates.parts, [d.test for d in estimates.delays], total.n)
    return [measure("tip_delay_error", e, data=data, note=f"{text}, from the force of the hook's motion")]


def _references(estimates: ParameterEstimates) -> list[Measure]:
    if not estimates.references:
        note = "log the PLC's own error e_c_measured together with s_w and s_tip"
        return [measure(name, None, note=note) for name in ("reference_lag", "reference_spread")]
    out = []
    for r in estimates.references:
        where, data = f"test {r.test}", rests_on(estimates.parts, [r.test], r.lag.n)
        late = "later" if r.lag.value > 0.0 else "earlier"
        note = f"the PLC's tip is {in_ms(abs(r.lag.value))} ms {late} than the logged one"
        out.append(measure("reference_lag", r.lag, test=where, data=data, note=note))
        out.append(measure("reference_spread", Estimate.around(r.spread, 0.0), test=where, data=data))
    return out


def _pressures(estimates: ParameterEstimates) -> list[Measure]:
    if not estimates.pressures:
        return [measure(name, None, note="log p_a and p_b") for name in ("boost_error", "p_max_over_relief")]
    lows = [p for p in estimates.pressures if p.low is not None]
    data = {p.test: rests_on(estimates.parts, [p.test]) for p in estimates.pressures}
    out = [
        measure("boost_error", p.low, test=f"test {p.test}", data=data[p.test], note=_low_says(p.least)) for p in lows
    ]
    if not lows:
        out = [measure("boost_error", None, note="the lines never differ")]
    high = max(estimates.pressures, key=lambda p: p.high)
    return [
        *out,
        measure("p_max_over_relief", Estimate.around(high.high, 0.0), test=f"test {high.test}", data=data[high.test]),
    ]


def _low_says(least: float) -> str:
    return f"lowest pressure {show(least, 'pressure', 3)}"


def in_ms(seconds: float) -> str:
    """A time in whole milliseconds, without the unit."""
    return f"{1e3 * seconds + 0.0:.0f}"


def by_name(items: Iterable[Measure]) -> Mapping[str, list[Measure]]:
    """Measures by name, in their order."""
    out: dict[str, list[Measure]] = {}
    for m in items:
        out.setdefault(m.name, []).append(m)
    return out


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
