"""Parameters of a crane implied by its logs: every check of step 1 on the parts of the records, and its measures, which
are these parameters less those of the crane file, with the likely cause in words."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from stillhook.library.leakage import point_text
from stillhook.report.formatting import percent
from stillhook.statistics.estimate import Estimate, extremes
from stillhook.units import number, show
from stillhook.validate.criteria.results import Measure
from stillhook.validate.data_set.campaign import Campaign, Kind
from stillhook.validate.data_set.records.record import Record
from stillhook.validate.parameters import flow, hoisting, settings, signals, wire
from stillhook.validate.parameters.hoisting import Friction
from stillhook.validate.parameters.leakage.choice import LeakChoice
from stillhook.validate.parameters.leakage.texts import RANGE, file_point_says, form_says
from stillhook.validate.parameters.segments import LogPart
from stillhook.validate.parameters.signals import Ratio
from stillhook.winches.circuits.tables import ServoVariant

SWAPPED = -0.3
"""Measured friction over the twin's below which the pressure lines are swapped: friction dissipates."""
CELL_BELIEVED = 0.25
"""Error of the load cell from which it is not used for torques [-]."""
STANDS = 0.03
"""Standing torque over that of the load from which it is reported [-]: pressure, setting and cell have a per cent."""
NEGLIGIBLE = 1e-3
"""Error of a calibration that is negligible [-]."""
RATES = {"v_w": "wire speed", "v_tip": "tip speed", "a_tip": "tip acceleration"}


@dataclass(frozen=True)
class ParameterEstimates:
    """Results of every check; empty or None where the log has no data for it."""

    parts: tuple[LogPart, ...]
    ratios: Mapping[str, Ratio]
    clock: signals.Clock
    jump: signals.Jump | None
    radii: tuple[hoisting.EffectiveRadius, ...]
    motor: settings.Offset | None
    pump: settings.PumpSetting | None
    balance: flow.Balance | None
    cells: tuple[hoisting.Cell, ...]
    frictions: tuple[Friction, ...]
    delays: tuple[signals.TipDelay, ...]
    wires: tuple[wire.WireElongation, ...]
    references: tuple[signals.Reference, ...]
    pressures: tuple[flow.Pressures, ...]
    rests: flow.Rests | None

    @property
    def cell_errors(self) -> list[float]:
        """Errors of the load cell in the tests with a load that is heavy enough [-]."""
        return [abs(c.error.value) for c in self.cells if not c.light]


def parameter_estimates(
    parts: Sequence[LogPart], progress: Callable[[float], None], records: Sequence[Record]
) -> ParameterEstimates:
    """Take every check on the parts; the clock first, because lengths over speeds depend on it. records: for rests,
    which may be short."""
    ratios = signals.ratios(parts)
    clock = signals.clock_of(ratios)
    jump = signals.largest_jump(parts, ratios)
    radii = hoisting.effective_radii(parts, clock.error.value if clock.error is not None else 0.0)
    progress(0.25)
    closed = [p for p in parts if "active" in p.crane.circuits]
    motor, pump = settings.motor_offset(closed), settings.pump_setting(closed)
    progress(0.84)
    delays = signals.tip_delays(parts)
    balance, cells, frictions = flow.balance(closed), hoisting.cells(parts), hoisting.frictions(closed)
    progress(0.9)
    return ParameterEstimates(
        parts=tuple(parts),
        ratios=ratios,
        clock=clock,
        jump=jump,
        radii=radii,
        motor=motor,
        pump=pump,
        balance=balance,
        cells=cells,
        frictions=frictions,
        delays=delays,
        wires=wire.wire_elongations(parts, delays),
        references=signals.references(parts),
        pressures=flow.pressures(closed),
        rests=flow.rests(closed[0].crane, records) if closed and records else None,
    )


def measures(campaign: Campaign, estimates: ParameterEstimates) -> tuple[Measure, ...]:
    """Every measure of step 1 in the order of the checks; one without a value says what to log."""
    if "active" in campaign.crane.circuits:
        circuit = (_settings(campaign, estimates), _flow(estimates), _friction(estimates), _pressures(estimates))
    else:
        circuit = ([], [], [], [])
    set_, flows, friction, pressures = circuit
    return (
        *_radii(campaign, estimates),
        *_clock(estimates),
        *set_,
        *flows,
        *_cells(estimates),
        *friction,
        *_delay(campaign, estimates),
        _wire(estimates),
        *_references(estimates),
        *pressures,
    )


def undetermined(*names: str, note: str = "") -> list[Measure]:
    """Measures that the data do not determine."""
    return [Measure.of(name, None, note=note) for name in names]


def rests_on(parts: Iterable[LogPart], tests: Iterable[str], blocks: float = 0) -> str:
    """The data behind a measure in words."""
    names = list(dict.fromkeys(tests))
    seconds = sum(p.segment.duration for p in parts if p.test in names)
    text = f"{len(names)} test{'s' if len(names) != 1 else ''}, {number(seconds, 4)} s"
    return f"{text} in {blocks:g} blocks" if blocks else text


def _radii(campaign: Campaign, estimates: ParameterEstimates) -> list[Measure]:
    if not estimates.radii:
        return undetermined("lever_error")
    note = hoisting.diagnosis(campaign.crane, estimates.radii)
    return [_of_test("lever_error", x.error, x.test, estimates, note) for x in estimates.radii]


def _of_test(name: str, e: Estimate, test: str, estimates: ParameterEstimates, note: str) -> Measure:
    """The measure of one test."""
    return Measure.of(name, e, test=f"test {test}", data=rests_on(estimates.parts, [test], e.n), note=note)


def _clock(estimates: ParameterEstimates) -> list[Measure]:
    clock, jump = estimates.clock, estimates.jump
    data = rests_on(estimates.parts, [t for r in estimates.ratios.values() for t in r.tests])
    out = [Measure.of("clock_error", clock.error, data=data if clock.error else "", note=clock.note)]
    for rate in RATES:
        name, e = f"{rate}_error", clock.calibration.get(rate)
        if e is None:
            out += undetermined(name)
            continue
        ratio = estimates.ratios[rate]
        out.append(Measure.of(name, e, data=rests_on(estimates.parts, ratio.tests), note=_calibration(ratio, e)))
    if jump is None:
        return out + undetermined("length_jump")
    return [*out, Measure.of("length_jump", jump.size, data=data, note=signals.jump_says(jump))]


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
    pump = estimates.pump
    out = _motor_offset(campaign, estimates.motor)
    if pump is None:
        return out + undetermined("pump_gain_error")
    zero = f"zero of the setting at {100.0 * pump.offset.value:.2f} %"
    data = rests_on(estimates.parts, [p.test for p in estimates.parts])
    return [*out, Measure.of("pump_gain_error", pump.gain, data=data, note=zero)]


def _motor_offset(campaign: Campaign, setting: settings.Offset | None) -> list[Measure]:
    """Offset of the motors' setting less the twin's own, which a closed loop does not have."""
    name, motor = "motor_offset_error", campaign.crane.active.motor
    if setting is None:
        return undetermined(name)
    if setting.offset is None:
        note = (
            f"the command leaves full displacement for {number(setting.seconds, 2)} s only: test a mode or a speed with"
            " reduced motors"
        )
        return undetermined(name, note=note)
    expected = 0.0 if motor.variant is ServoVariant.CLOSED_LOOP else motor.offset
    e = Estimate.around(setting.offset.value - expected, setting.offset.half, setting.offset.n)
    wide = f", hysteresis {100.0 * setting.hysteresis.value:.1f} %" if setting.hysteresis is not None else ""
    note = (
        f"the motors are {100.0 * setting.offset.value:.1f} % above their command, {100.0 * expected:.1f} % in the"
        f" twin{wide}"
    )
    return [Measure.of(name, e, data=f"{number(setting.seconds, 3)} s with reduced motors", note=note)]


def _flow(estimates: ParameterEstimates) -> list[Measure]:
    b = estimates.balance
    if b is None:
        return undetermined("displacement_ratio_error", "leakage_error", "leakage_file_error")
    data = rests_on(estimates.parts, b.tests, b.ratio.n)
    return [
        Measure.of("displacement_ratio_error", b.ratio, data=data, note=_ratio_says(b)),
        Measure.of("leakage_error", b.leakage, data=data, note=_leak_says(b)),
        at_file_point(b.leak, data),
    ]


def at_file_point(leak: LeakChoice, data: str) -> Measure:
    """Leakage at the crane file's point; no value where the data do not reach its pressure."""
    name, note = "leakage_file_error", file_point_says(leak)
    if leak.beyond_pressure != 0.0:
        return Measure.of(name, None, data=data, note=f"{note}; at that pressure nothing was measured")
    return Measure.of(name, leak.at_file_point, data=data, note=note)


def _ratio_says(b: flow.Balance) -> str:
    faster = "faster" if b.ratio.value > 0.0 else "slower"
    text = f"with full pumps the winch is {100.0 * abs(b.ratio.value):.2f} % {faster} than the twin, leakage apart"
    assumed = [name for name, measured in (("u_m", b.measured_motors), ("u_p", b.measured_pumps)) if not measured]
    return text + (
        f"; from {' and '.join(assumed)} through the servo, so it includes offsets of the settings" if assumed else ""
    )


def _leak_says(b: flow.Balance) -> str:
    leak = b.leak
    implied, ours = (show(x, "leakage", 3) for x in (b.twin_leakage * (1.0 + b.leakage.value), b.twin_leakage))
    text = f"{implied} implied, {ours} in the twin at the working point of these data ({point_text(leak.at)})"
    text += f"; {file_point_says(leak)}; {RANGE}"
    if leak.refuted:
        text += f"; {form_says(leak)}"
    elif len(leak.remaining_forms) > 1:
        forms = ", ".join(leak.remaining_forms)
        text += f"; form as in the crane file; the data do not distinguish these forms: {forms}"
    return text


def _cells(estimates: ParameterEstimates) -> list[Measure]:
    heavy = [c for c in estimates.cells if not c.light]
    if not heavy:
        return undetermined("load_cell_error")
    note = hoisting.cell_says(estimates.cells, estimates.parts)
    return [_of_test("load_cell_error", c.error, c.test, estimates, note) for c in heavy]


def _friction(estimates: ParameterEstimates) -> list[Measure]:
    name = "friction_error"
    if any(error > CELL_BELIEVED for error in estimates.cell_errors):
        note = "the load cell is wrong, so the torque balance is not closed: correct it first"
        return undetermined(name, note=note)
    kinds = {p.test: p.kind for p in estimates.parts}
    judged = [f for f in estimates.frictions if kinds[f.test] is Kind.AHC] or list(estimates.frictions)
    scale = hoisting.overall(judged)
    if scale is None:
        return undetermined(name, note=lacking_for_torque(estimates.parts))
    data = rests_on(estimates.parts, [f.test for f in judged], scale.n)
    return [Measure.of(name, scale, data=data, note=_friction_says(estimates, judged, scale))]


def lacking_for_torque(parts: Sequence[LogPart]) -> str:
    """Which signals to log for a torque balance at the motors; "" where all were logged."""
    lacks = dict.fromkeys(name for p in parts for name in hoisting.missing(p))
    return f"log {', '.join(lacks)} for a torque balance at the motors" if lacks else ""


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
    name = "tip_delay_error"
    total = signals.overall(estimates.delays)
    if total is None:
        return undetermined(name)
    if any(error > hoisting.CLOSE for error in estimates.cell_errors):
        return undetermined(name, note="the load cell is wrong: correct it first")
    each = extremes({d.test: d.delay.value for d in estimates.delays}, lambda x: f"{in_ms(x)} ms")
    text = f"{in_ms(total.value)} ms estimated{f', {each} by test' if each else ''}, {in_ms(campaign.delay)} ms stated"
    e = Estimate.around(total.value - campaign.delay, total.half, total.n)
    data = rests_on(estimates.parts, [d.test for d in estimates.delays], total.n)
    if total.half > signals.WIDEST and abs(e.value) < total.half:
        note = (
            f"{text}, +- {in_ms(total.half)} ms: load, motion or load cell are too weak; test a heavy load with little"
            " wire out"
        )
        return [Measure.of(name, e, data=data, note=note, undetectable=True)]
    return [Measure.of(name, e, data=data, note=f"{text}, from the force of the hook's motion")]


def _wire(estimates: ParameterEstimates) -> Measure:
    """Elongation of the wire; one that the data do not detect is marked so."""
    name, total = "wire_elongation_error", wire.overall(estimates.wires)
    if not estimates.delays:
        return Measure.of(name, None)
    if any(error > hoisting.CLOSE for error in estimates.cell_errors):
        return Measure.of(name, None, note="the load cell is wrong: correct it first")
    weak = "load, motion or load cell are too weak, or the wire is too short"
    advice = "these data do not detect a wire 30 % softer (+43 %): {}; test a heavier load in short waves"
    if total is None:
        return Measure.of(name, None, note=advice.format(weak), undetectable=True)
    open_ = wire.open_to_mass(estimates.wires, total.value)
    if open_ > wire.WIDEST:
        weak = f"the wire's own mass may be part of the stated load, which leaves up to {percent(open_)} more open"
    each = extremes({x.test: x.error.value for x in estimates.wires}, percent)
    note = f"from the force of the hook's motion{f', {each} by test' if each else ''}"
    data = rests_on(estimates.parts, [x.test for x in estimates.wires], total.n)
    if wire.detected(total):
        return Measure.of(name, total, data=data, note=note)
    return Measure.of(name, total, data=data, note=f"{note}; {advice.format(weak)}", undetectable=True)


def _references(estimates: ParameterEstimates) -> list[Measure]:
    if not estimates.references:
        return undetermined("reference_lag", "reference_spread")
    out = []
    for r in estimates.references:
        late = "later" if r.lag.value > 0.0 else "earlier"
        note = f"the PLC's tip is {in_ms(abs(r.lag.value))} ms {late} than the logged one"
        lag = _of_test("reference_lag", r.lag, r.test, estimates, note)
        out += [lag, Measure.of("reference_spread", r.spread, test=lag.test, data=lag.data)]
    return out


def _pressures(estimates: ParameterEstimates) -> list[Measure]:
    if not estimates.pressures:
        return undetermined("boost_error", "p_max_over_relief")
    out = []
    for p in estimates.pressures:
        if p.low is not None:
            data, note = rests_on(estimates.parts, [p.test]), f"lowest pressure {show(p.least, 'pressure', 3)}"
            out.append(Measure.of("boost_error", p.low, test=f"test {p.test}", data=data, note=note))
    high = max(estimates.pressures, key=lambda p: p.high)
    data = rests_on(estimates.parts, [high.test])
    return [
        *(out or undetermined("boost_error", note="the lines never differ")),
        Measure.of("p_max_over_relief", high.high, test=f"test {high.test}", data=data),
    ]


def in_ms(seconds: float) -> str:
    """A time in whole milliseconds, without the unit."""
    return f"{1e3 * seconds + 0.0:.0f}"
