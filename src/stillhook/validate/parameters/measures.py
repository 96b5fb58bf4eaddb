"""Measures of step 1: what a log implies less what the crane file says, with the likely cause in words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from stillhook.library.leakage import point_text
from stillhook.spec.circuits import ServoVariant
from stillhook.statistics.jackknife_regression import Estimate, by_case
from stillhook.units import number, show
from stillhook.validate.criteria.names import MEASURES
from stillhook.validate.criteria.results import Measure
from stillhook.validate.data_set.campaign import Campaign, Kind
from stillhook.validate.parameters.circuit.flow import Balance
from stillhook.validate.parameters.circuit.leakage import form_says
from stillhook.validate.parameters.estimates import Implied
from stillhook.validate.parameters.hoisting import friction as implied_friction
from stillhook.validate.parameters.hoisting.friction import Friction
from stillhook.validate.parameters.hoisting.load import CLOSE, cell_says
from stillhook.validate.parameters.hoisting.transmission import diagnosis
from stillhook.validate.parameters.segments import Part
from stillhook.validate.parameters.signals import delay as implied_delay
from stillhook.validate.parameters.signals.clock import Ratio, jump_says

SWAPPED = -0.3
"""Measured friction over the twin's below which the pressure lines are swapped: friction takes, it does not give."""
CELL_BELIEVED = 0.25
"""Error of the load cell from which no torque is drawn from it [-]."""
STANDS = 0.03
"""Standing torque, as a part of the load, from which it is worth a word [-]: gas pressure, setting and cell are known
to a per cent."""
UNTOLD = 1e-3
"""Error of a calibration that is none [-]."""
RATES = {"v_w": "wire speed", "v_tip": "tip speed", "a_tip": "tip acceleration"}


def measures(campaign: Campaign, found: Implied) -> tuple[Measure, ...]:
    """Every measure of step 1 in the order of the checks; one without a value says what to log."""
    return (
        *_levers(campaign, found),
        *_clock(found),
        *_settings(campaign, found),
        *_flow(found),
        *_cells(found),
        *_friction(found),
        *_delay(campaign, found),
        *_references(found),
        *_pressures(found),
    )


def measure(name: str, e: Estimate | None, *, test: str = "", data: str = "", note: str = "") -> Measure:
    """A measure of step 1 from an estimate; None: the data cannot tell."""
    quantity = MEASURES[name].quantity
    if e is None:
        return Measure(name, None, quantity, test=test, data=data, note=note)
    bounded = np.isfinite(e.half) and e.half > 0.0
    return Measure(
        name, e.value, quantity, e.low if bounded else None, e.high if bounded else None, test, data, note, e.structural
    )


def rests_on(parts: Iterable[Part], tests: Iterable[str], blocks: int = 0) -> str:
    """The data behind a measure in words."""
    names = list(dict.fromkeys(tests))
    seconds = sum(p.segment.duration for p in parts if p.test in names)
    what = f"{len(names)} test{'s' if len(names) != 1 else ''}, {number(seconds, 4)} s"
    return f"{what} in {blocks} blocks" if blocks else what


def _levers(campaign: Campaign, found: Implied) -> list[Measure]:
    if not found.levers:
        return [
            measure("lever_error", None, note="log the motor speed omega_m beside v_w or s_w, with the winch moving")
        ]
    note = diagnosis(campaign.crane, found.levers)
    return [
        measure(
            "lever_error",
            x.error,
            test=f"test {x.test}",
            data=rests_on(found.parts, [x.test], x.error.blocks),
            note=note,
        )
        for x in found.levers
    ]


def _clock(found: Implied) -> list[Measure]:
    tests = [t for r in found.ratios.values() for t in r.tests]
    clock = found.clock.error
    out = [measure("clock_error", clock, data=rests_on(found.parts, tests) if clock else "", note=found.clock.note)]
    for name, key in (("v_w_error", "v_w"), ("v_tip_error", "v_tip"), ("a_tip_error", "a_tip")):
        if key in found.clock.calibration:
            e = found.clock.calibration[key]
            out.append(
                measure(
                    name,
                    e,
                    data=rests_on(found.parts, found.ratios[key].tests),
                    note=_calibration(found.ratios[key], e),
                )
            )
        else:
            out.append(measure(name, None, note=f"log {key} with what it is the rate of, and move"))
    if found.jump is None:
        out.append(measure("length_jump", None, note="log v_w beside s_w"))
    else:
        out.append(
            measure(
                "length_jump",
                Estimate(found.jump.size, 0.0),
                data=rests_on(found.parts, tests),
                note=jump_says(found.jump),
            )
        )
    return out


def _calibration(ratio: Ratio, e: Estimate) -> str:
    lag = (
        f", {in_ms(abs(ratio.lag))} ms {'ahead of' if ratio.lag > 0.0 else 'behind'} it"
        if abs(ratio.lag) > 0.005
        else ""
    )
    if abs(e.value) < UNTOLD:
        return f"the {RATES[ratio.name]} is calibrated{lag}"
    much = f"{100.0 * abs(e.value):.2f} % too {'much' if e.value > 0.0 else 'little'}"
    return f"the {RATES[ratio.name]} reads {much} against the change of what it is the rate of{lag}"


def _settings(campaign: Campaign, found: Implied) -> list[Measure]:
    out, motor = [], found.motor
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
        e = Estimate(motor.offset.value - expected, motor.offset.half, motor.offset.blocks)
        wide = f", hysteresis {100.0 * motor.hysteresis.value:.1f} %" if motor.hysteresis is not None else ""
        note = (
            f"the motors stand {100.0 * motor.offset.value:.1f} % above their command, {100.0 * expected:.1f} % in the"
            f" twin{wide}"
        )
        out.append(
            measure("motor_offset_error", e, data=f"{number(motor.seconds, 3)} s with reduced motors", note=note)
        )
    if found.pump is None:
        return [*out, measure("pump_gain_error", None, note="log the pumps' command u_p and setting alpha_p")]
    zero = f"zero of the setting at {100.0 * found.pump.offset.value:.2f} %"
    return [
        *out,
        measure(
            "pump_gain_error", found.pump.gain, data=rests_on(found.parts, [p.test for p in found.parts]), note=zero
        ),
    ]


def _expected_offset(campaign: Campaign) -> float:
    """The twin's own offset of the motors' setting [-]."""
    motor = campaign.crane.active.motor
    return 0.0 if motor.variant is ServoVariant.CLOSED_LOOP else motor.offset


def _flow(found: Implied) -> list[Measure]:
    b = found.balance
    if b is None:
        note = "log p_a, p_b, the motor speed, alpha_m (or u_m) and alpha_p (or u_p), with pressure in one line"
        return [
            measure(name, None, note=note)
            for name in ("displacement_ratio_error", "leakage_error", "leakage_here_error")
        ]
    data = rests_on(found.parts, b.tests, b.ratio.blocks)
    return [
        measure("displacement_ratio_error", b.ratio, data=data, note=_ratio_says(b)),
        measure("leakage_error", b.leak.judged, data=data, note=_leak_says(b)),
        measure(
            "leakage_here_error",
            b.leakage,
            data=data,
            note=f"at {point_text(b.leak.at)}, where the leakage of these data flows",
        ),
    ]


def _ratio_says(b: Balance) -> str:
    faster = "faster" if b.ratio.value > 0.0 else "slower"
    text = f"with full pumps the winch is {100.0 * abs(b.ratio.value):.2f} % {faster} than the twin, leakage apart"
    assumed = [name for name, seen in (("u_m", b.measured_motors), ("u_p", b.measured_pumps)) if not seen]
    return text + (
        f"; from {' and '.join(assumed)} through the servo, so offsets of the settings are in it" if assumed else ""
    )


def _leak_says(b: Balance) -> str:
    leak = b.leak
    implied, ours = (show(x, "leakage", 3) for x in (b.twin_leakage * (1.0 + b.leakage.value), b.twin_leakage))
    text = f"{implied} implied, {ours} in the twin at the working point of these data ({point_text(leak.at)})"
    if leak.refuted:
        text += f"; {form_says(leak)}"
    elif len(leak.left) > 1:
        text += f", form as in the crane file; the data do not tell these forms apart: {', '.join(leak.left)}"
    return text


def _cells(found: Implied) -> list[Measure]:
    heavy = [c for c in found.cells if not c.light]
    if not heavy:
        return [measure("load_cell_error", None, note="log the load cell F_w in a test whose load is stated")]
    note = cell_says(found.cells, found.parts)
    data = {c.test: rests_on(found.parts, [c.test], c.error.blocks) for c in heavy}
    return [measure("load_cell_error", c.error, test=f"test {c.test}", data=data[c.test], note=note) for c in heavy]


def _cell_wrong(found: Implied) -> bool:
    return any(abs(c.error.value) > CELL_BELIEVED for c in found.cells if not c.light)


def _friction(found: Implied) -> list[Measure]:
    if _cell_wrong(found):
        return [
            measure(
                "friction_error",
                None,
                note="the load cell is wrong, so the torques at the shaft do not add up: mend it first",
            )
        ]
    kinds = {p.test: p.kind for p in found.parts}
    mine = [f for f in found.frictions if kinds[f.test] is Kind.AHC] or list(found.frictions)
    scale = implied_friction.overall(mine)
    if scale is None:
        lacks = dict.fromkeys(name for p in found.parts for name in implied_friction.missing(p))
        note = (
            f"log {', '.join(lacks)} for a torque balance at the motors" if lacks else "the winch does not move enough"
        )
        return [measure("friction_error", None, note=note)]
    data = rests_on(found.parts, [f.test for f in mine], scale.blocks)
    return [measure("friction_error", scale, data=data, note=_friction_says(found, mine, scale))]


def _friction_says(found: Implied, mine: list[Friction], scale: Estimate) -> str:
    if 1.0 + scale.value < SWAPPED:
        return "friction drives the winch: p_a and p_b are swapped, or the speed is counted the wrong way"
    each = by_case({f.test: 1.0 + f.scale.value for f in mine}, lambda x: number(x, 3))
    text = f"{number(1.0 + scale.value, 3)} times the twin's{f', {each}' if each else ''}"
    others = [f"{number(1.0 + f.scale.value, 3)} in {f.test}" for f in found.frictions if f not in mine]
    text += f"; not judged, for it is no heave compensation: {', '.join(others)}" if others else ""
    part = {p.test: p for p in found.parts}
    standing = max(mine, key=lambda f: abs(f.standing_force) / max(part[f.test].weight, 1.0))
    if abs(standing.standing_force) > STANDS * max(part[standing.test].weight, 1.0):
        force = show(standing.standing_force, "force", 3)
        text += f"; apart from it {force} in the wire of {standing.test} are not explained: load cell, p_hp or alpha_pm"
    return text


def _delay(campaign: Campaign, found: Implied) -> list[Measure]:
    if not found.delays:
        return [
            measure(
                "tip_delay_error",
                None,
                note="log the load cell F_w beside s_tip and s_w, compensating a tip that moves",
            )
        ]
    if any(abs(c.error.value) > CLOSE for c in found.cells if not c.light):
        return [measure("tip_delay_error", None, note="the load cell is wrong: mend it first")]
    total = implied_delay.overall(found.delays)
    assert total is not None
    each = by_case({d.test: d.delay.value for d in found.delays}, lambda x: f"{in_ms(x)} ms")
    told = f"{in_ms(total.value)} ms found{f', {each}' if each else ''}, {in_ms(campaign.delay)} ms stated"
    if total.half > implied_delay.TOLD and abs(total.value - campaign.delay) < total.half:
        note = (
            f"{told}, +- {in_ms(total.half)} ms: load, motion or load cell are too weak; test a heavy load with little"
            " wire out"
        )
        return [measure("tip_delay_error", None, note=note)]
    e = Estimate(total.value - campaign.delay, total.half, total.blocks)
    data = rests_on(found.parts, [d.test for d in found.delays], total.blocks)
    return [measure("tip_delay_error", e, data=data, note=f"{told}, from the force that moves the hook")]


def _references(found: Implied) -> list[Measure]:
    if not found.references:
        note = "log the PLC's own error e_c_measured beside s_w and s_tip"
        return [measure(name, None, note=note) for name in ("reference_lag", "reference_spread")]
    out = []
    for r in found.references:
        where, data = f"test {r.test}", rests_on(found.parts, [r.test], r.lag.blocks)
        late = "later" if r.lag.value > 0.0 else "earlier"
        note = f"the PLC's tip comes {in_ms(abs(r.lag.value))} ms {late} than the logged one"
        out.append(measure("reference_lag", r.lag, test=where, data=data, note=note))
        out.append(measure("reference_spread", Estimate(r.spread, 0.0), test=where, data=data))
    return out


def _pressures(found: Implied) -> list[Measure]:
    if not found.pressures:
        return [measure(name, None, note="log p_a and p_b") for name in ("boost_error", "p_max_over_relief")]
    lows = [p for p in found.pressures if p.low is not None]
    data = {p.test: rests_on(found.parts, [p.test]) for p in found.pressures}
    out = [
        measure("boost_error", p.low, test=f"test {p.test}", data=data[p.test], note=_low_says(p.least)) for p in lows
    ]
    if not lows:
        out = [measure("boost_error", None, note="the lines are never apart")]
    high = max(found.pressures, key=lambda p: p.high)
    return [
        *out,
        measure("p_max_over_relief", Estimate(high.high, 0.0), test=f"test {high.test}", data=data[high.test]),
    ]


def _low_says(least: float) -> str:
    return f"lowest pressure {show(least, 'pressure', 3)}"


def in_ms(seconds: float) -> str:
    """A time in whole milliseconds, without the unit."""
    return f"{1e3 * seconds + 0.0:.0f}"


def by_name(found: Iterable[Measure]) -> Mapping[str, list[Measure]]:
    """Measures by name, in their order."""
    out: dict[str, list[Measure]] = {}
    for m in found:
        out.setdefault(m.name, []).append(m)
    return out
