"""Step 1: do the crane file's parameters agree with those implied by the logs? By balances, without simulating the twin
where possible.

Source: Moslatt 2020 paper F, "(1) System variables and parameters": correct sizes of pumps, motors, leakage terms,
controller parameters. The paper states no numbers for this step; every limit is Stillhook's own and is given in the
criteria file with its reason.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from stillhook.base.progress import Progress
from stillhook.library.leakage import point_text
from stillhook.report.document import Table
from stillhook.spec.crane import Crane
from stillhook.statistics.estimate import Estimate
from stillhook.units import KINDS, in_display, number, show
from stillhook.validate.criteria.results import Measure, Note, Step, StepNumber, lacks
from stillhook.validate.data_set.campaign import Campaign, Kind
from stillhook.validate.data_set.record import Record
from stillhook.validate.parameters import flow, hoisting, settings, signals, wire
from stillhook.validate.parameters.leak_laws import RISE, SLIP_PRESSURE
from stillhook.validate.parameters.leakage import LeakChoice, file_point, form_refuted
from stillhook.validate.parameters.segments import ByTest, LogPart, parts_of
from stillhook.winches.circuits.tables import ServoVariant

SWAPPED = -0.3
"""Measured friction over the twin's below which the pressure lines are swapped: friction dissipates."""
CELL_BELIEVED = 0.25
"""Error of the load cell from which it is not used for torques [-]."""
STANDS = 0.03
"""Standing torque over that of the load from which it is reported [-]: pressure, setting and cell have a per cent."""
NEGLIGIBLE = 1e-3
"""Error of a calibration that is negligible [-]."""
LEAST_LAG = 0.005
"""Lag of a rate that is reported [s]."""
RATES = {"v_w": "wire speed", "v_tip": "tip speed", "a_tip": "tip acceleration"}


@dataclass(frozen=True)
class ParameterEstimates:
    """Results of every check; empty or None where the log has no data for it."""

    parts: tuple[LogPart, ...]
    ratios: Mapping[str, signals.Ratio]
    clock: signals.Clock
    jump: signals.Jump | None
    radii: tuple[hoisting.EffectiveRadius, ...]
    motor: settings.Offset | None
    pump: settings.PumpSetting | None
    balance: flow.Balance | None
    cells: tuple[hoisting.Cell, ...]
    frictions: tuple[hoisting.Friction, ...]
    delays: ByTest | None
    wires: wire.WireElongation | None
    references: tuple[signals.Reference, ...]
    pressures: tuple[flow.Pressures, ...]
    rests: flow.Rests | None

    @property
    def cell_error(self) -> float:
        """Largest error of the load cell in the tests with a load that is heavy enough [-]."""
        return max((abs(c.error.value) for c in self.cells if not c.light), default=0.0)


def parameter_estimates(parts: Sequence[LogPart], progress: Progress, records: Sequence[Record]) -> ParameterEstimates:
    """Take every check on the parts; the clock first: lengths over speeds depend on it. records: for rests, which may
    be short."""
    ratios = signals.ratios(parts)
    clock = signals.clock_of(ratios)
    radii = hoisting.effective_radii(parts, clock.error.value if clock.error is not None else 0.0)
    progress(0.25)
    closed = [p for p in parts if "active" in p.crane.circuits]
    motor, pump = settings.motor_offset(closed), settings.pump_setting(closed)
    progress(0.84)
    delays = signals.tip_delays(parts)
    return ParameterEstimates(
        parts=tuple(parts),
        ratios=ratios,
        clock=clock,
        jump=signals.largest_jump(parts, ratios),
        radii=radii,
        motor=motor,
        pump=pump,
        balance=flow.balance(closed),
        cells=hoisting.cells(parts),
        frictions=hoisting.frictions(closed),
        delays=delays,
        wires=wire.wire_elongations(parts, delays),
        references=signals.references(parts),
        pressures=flow.pressures(closed),
        rests=flow.rests(closed[0].crane, records) if closed and records else None,
    )


def measures(campaign: Campaign, e: ParameterEstimates, records: Sequence[Record]) -> tuple[Measure, ...]:
    """Every measure of step 1 in the order of the checks; one without a value says what to log."""
    closed = "active" in campaign.crane.circuits
    return (
        *_radii(campaign, e),
        *_clock(e),
        *(_settings(campaign, e) + _flow(e) if closed else ()),
        *_cells(e),
        *([_friction(e)] if closed else ()),
        _delay(campaign, e),
        _wire(e),
        *_references(e),
        *_pressures(e),
        flow.rest_measure(campaign.crane, e.rests, records),
    )


def undetermined(*names: str, note: str = "") -> list[Measure]:
    """Measures that the data do not determine."""
    return [Measure.of(name, None, note) for name in names]


def rests_on(parts: Iterable[LogPart], tests: Iterable[str], blocks: float = 0) -> str:
    """The data behind a measure."""
    names = list(dict.fromkeys(tests))
    seconds = sum(p.segment.duration for p in parts if p.test in names)
    text = f"{len(names)} test{'s' if len(names) != 1 else ''}, {number(seconds, 4)} s"
    return f"{text} in {blocks:g} blocks" if blocks else text


def by_test(tests: Mapping[str, Estimate | float], form: str) -> str:
    """Smallest and largest of several tests, in a form of `notes`; nothing of one."""
    return Note("by-test", each=tests, form=form) if len(tests) > 1 else ""


def _of_test(name: str, x: Estimate, test: str, e: ParameterEstimates, *notes: str) -> Measure:
    """The measure of one test."""
    return Measure.of(name, x, *notes, test=f"test {test}", data=rests_on(e.parts, [test], x.n))


def _radii(campaign: Campaign, e: ParameterEstimates) -> list[Measure]:
    causes, name = hoisting.diagnosis(campaign.crane, e.radii), "lever_error"
    return [_of_test(name, x.error, x.test, e, *causes) for x in e.radii] or undetermined(name)


def _clock(e: ParameterEstimates) -> list[Measure]:
    clock, jump = e.clock, e.jump
    data = rests_on(e.parts, [t for r in e.ratios.values() for t in r.tests])
    out = [Measure.of("clock_error", clock.error, clock.note, data=data if clock.error else "")]
    for rate, words in RATES.items():
        error, ratio = clock.calibration.get(rate), e.ratios.get(rate)
        if error is None or ratio is None:
            out += undetermined(f"{rate}_error")
            continue
        code = "rate-calibrated" if abs(error.value) < NEGLIGIBLE else "rate-wrong"
        lag = Note("rate-lag", lag=ratio.lag) if abs(ratio.lag) > LEAST_LAG else ""
        notes = (Note(code, rate=words, error=error.value), lag)
        out.append(Measure.of(f"{rate}_error", error, *notes, data=rests_on(e.parts, ratio.tests)))
    if jump is None:
        return out + undetermined("length_jump")
    note = Note("jump", signal=jump.name, size=jump.size, at=jump.at, test=jump.test)
    return [*out, Measure.of("length_jump", jump.size, note, data=data)]


def _settings(campaign: Campaign, e: ParameterEstimates) -> list[Measure]:
    out = _motor_offset(campaign, e.motor)
    if e.pump is None:
        return out + undetermined("pump_gain_error")
    note, data = Note("pump-zero", offset=e.pump.offset.value), rests_on(e.parts, [p.test for p in e.parts])
    return [*out, Measure.of("pump_gain_error", e.pump.gain, note, data=data)]


def expected_offset(crane: Crane) -> float:
    """Offset that the twin's motors have [-]: none in a closed loop."""
    motor = crane.active.motor
    return 0.0 if motor.variant is ServoVariant.CLOSED_LOOP else motor.offset


def _motor_offset(campaign: Campaign, setting: settings.Offset | None) -> list[Measure]:
    """Offset of the motors' setting less the twin's own, which a closed loop does not have."""
    name = "motor_offset_error"
    if setting is None:
        return undetermined(name)
    if setting.offset is None:
        return undetermined(name, note=Note("motors-full", seconds=setting.seconds))
    expected = expected_offset(campaign.crane)
    x = Estimate.around(setting.offset.value - expected, setting.offset.half, setting.offset.n)
    wide = Note("hysteresis", width=setting.hysteresis.value) if setting.hysteresis is not None else ""
    notes = (Note("motors-off", offset=setting.offset.value, twin=expected), wide)
    return [Measure.of(name, x, *notes, data=f"{number(setting.seconds, 3)} s with reduced motors")]


def _flow(e: ParameterEstimates) -> list[Measure]:
    b = e.balance
    if b is None:
        return undetermined("displacement_ratio_error", "leakage_error", "leakage_file_error")
    data = rests_on(e.parts, b.tests, b.ratio.n)
    servo = Note("settings-by-servo", commands=b.assumed) if b.assumed else ""
    return [
        Measure.of("displacement_ratio_error", b.ratio, Note("speed-of-flow", error=b.ratio.value), servo, data=data),
        Measure.of("leakage_error", b.leak.value, *_leakage(b.leak), data=data),
        at_file_point(b.leak, data),
    ]


def at_file_point(leak: LeakChoice, data: str) -> Measure:
    """Leakage at the crane file's point; no value where the data do not reach its pressure."""
    name, note = "leakage_file_error", file_point(leak)
    if leak.beyond_pressure != 0.0:
        return Measure.of(name, None, note, Note("pressure-not-reached"), data=data)
    return Measure.of(name, leak.at_file_point, note, data=data)


def _leakage(leak: LeakChoice) -> list[str]:
    implied = leak.twin * (1.0 + leak.value.value)
    out = [Note("leakage", implied=implied, twin=leak.twin, at=point_text(leak.at)), file_point(leak)]
    out.append(Note("leakage-range", rise=RISE, p=SLIP_PRESSURE))
    if leak.refuted:
        return [*out, *form_refuted(leak)]
    return [*out, Note("leakage-forms", forms=leak.remaining_forms)] if len(leak.remaining_forms) > 1 else list(out)


def _cells(e: ParameterEstimates) -> list[Measure]:
    heavy, name = [c for c in e.cells if not c.light], "load_cell_error"
    causes = hoisting.cell_causes(heavy, e.parts)
    return [_of_test(name, c.error, c.test, e, *causes) for c in heavy] or undetermined(name)


def _friction(e: ParameterEstimates) -> Measure:
    name = "friction_error"
    if e.cell_error > CELL_BELIEVED:
        return Measure.of(name, None, Note("cell-wrong-torque"))
    kinds = {p.test: p.kind for p in e.parts}
    judged = [f for f in e.frictions if kinds[f.test] is Kind.AHC] or list(e.frictions)
    scale = hoisting.overall(judged)
    if scale is None:
        return Measure.of(name, None, torque_lacks(e.parts))
    return Measure.of(
        name, scale, *_friction_notes(e, judged, scale), data=rests_on(e.parts, [f.test for f in judged], scale.n)
    )


def torque_lacks(parts: Sequence[LogPart]) -> str:
    """Which signals to log for a torque balance at the motors; "" where all were logged."""
    lacks = tuple(dict.fromkeys(name for p in parts for name in hoisting.missing(p)))
    return Note("log-for-torque", signals=lacks) if lacks else ""


def _friction_notes(e: ParameterEstimates, judged: list[hoisting.Friction], scale: Estimate) -> list[str]:
    if 1.0 + scale.value < SWAPPED:
        return [Note("friction-drives")]
    times = {f.test: 1.0 + f.scale.value for f in judged}
    out = [Note("friction", times=1.0 + scale.value), by_test(times, "# 3")]
    others = {f.test: 1.0 + f.scale.value for f in e.frictions if f not in judged}
    out += [Note("friction-elsewhere", times=x, test=test) for test, x in others.items()]
    weight = {p.test: max(p.weight, 1.0) for p in e.parts}
    standing = max(judged, key=lambda f: abs(f.standing_force) / weight[f.test])
    if abs(standing.standing_force) > STANDS * weight[standing.test]:
        out.append(Note("force-left", force=standing.standing_force, test=standing.test))
    return out


def _delay(campaign: Campaign, e: ParameterEstimates) -> Measure:
    name = "tip_delay_error"
    if e.delays is None:
        return Measure.of(name, None)
    if e.cell_error > hoisting.CLOSE:
        return Measure.of(name, None, Note("cell-wrong"))
    total, each = e.delays.all, by_test(e.delays.tests, "ms")
    x = Estimate.around(total.value - campaign.delay, total.half, total.n)
    notes = (Note("tip-delay", delay=total.value, stated=campaign.delay), each)
    data = rests_on(e.parts, e.delays.tests, total.n)
    if total.half > signals.WIDEST and abs(x.value) < total.half:
        return Measure.of(name, x, *notes, Note("tip-delay-weak", half=total.half), data=data, undetectable=True)
    return Measure.of(name, x, *notes, Note("hook-force"), data=data)


def _wire(e: ParameterEstimates) -> Measure:
    """Elongation of the wire; one that the data do not detect is marked so."""
    name, wires = "wire_elongation_error", e.wires
    if e.delays is None:
        return Measure.of(name, None)
    if e.cell_error > hoisting.CLOSE:
        return Measure.of(name, None, Note("cell-wrong"))
    if wires is None:
        return Measure.of(name, None, Note("wire-weak"), Note("wire-undetected"), undetectable=True)
    total, tests = wires.overall, wires.errors.tests
    notes, data = [Note("hook-force"), by_test(tests, "% 3")], rests_on(e.parts, tests, wires.overall.n)
    if wire.detected(total):
        return Measure.of(name, total, *notes, data=data)
    open_ = wires.open_to_mass
    weak = Note("wire-mass", open=open_) if open_ > wire.WIDEST else Note("wire-weak")
    return Measure.of(name, total, *notes, weak, Note("wire-undetected"), data=data, undetectable=True)


def _references(e: ParameterEstimates) -> list[Measure]:
    out = []
    for r in e.references:
        lag = _of_test("reference_lag", r.lag, r.test, e, Note("reference", lag=r.lag.value))
        out += [lag, Measure.of("reference_spread", r.spread, test=lag.test, data=lag.data)]
    return out or undetermined("reference_lag", "reference_spread")


def _pressures(e: ParameterEstimates) -> list[Measure]:
    if not e.pressures:
        return undetermined("boost_error", "p_max_over_relief")
    boost = [
        Measure.of(
            "boost_error", p.low, Note("lowest", p=p.least), test=f"test {p.test}", data=rests_on(e.parts, [p.test])
        )
        for p in e.pressures
        if p.low is not None
    ]
    high = max(e.pressures, key=lambda p: p.high)
    top = Measure.of("p_max_over_relief", high.high, test=f"test {high.test}", data=rests_on(e.parts, [high.test]))
    return [*(boost or undetermined("boost_error", note=Note("lines-alike"))), top]


Row = tuple[str, str, str, str, str, str]


def check_parameters(campaign: Campaign, records: tuple[Record, ...], progress: Progress) -> Step[ParameterEstimates]:
    """Parameters implied by the logs against the crane. Nothing is refused: a check whose signals were not logged gives
    a measure without a value that states what to log."""
    e = parameter_estimates(parts_of(campaign, records), progress, records)
    without = lacks(campaign.crane)
    results = tuple(m for m in measures(campaign, e, records) if m.name not in without)
    data = {name: getattr(e, name) for name in ("radii", "frictions", "delays", "cells", "rests", "balance")}
    table = parameter_table(_rows(campaign, e), "Parameters that the logs imply, against the crane file")
    return Step(StepNumber.PARAMETERS, results, (), (table,), data, e)


def parameter_table(rows: Iterable[Row], title: str) -> Table:
    """One row a parameter, of what differs between the tests one a test."""
    return Table(("parameter", "crane\nfile", "log\nsays", "95 %", "differ-\nence", "tests"), tuple(rows), title)


def row(
    name: str, twin: float, e: Estimate, quantity: str, tests: Iterable[str], *, digits: int = 4, relative: bool = True
) -> Row:
    """Row of a parameter [SI] with its unit after its name; relative: its difference is over the twin's."""
    cells = [number(in_display(x, quantity) if quantity else x, digits) for x in (twin, e.value, e.low, e.high)]
    off = e.value / twin - 1.0 if relative else e.value - twin
    percent = f"{100.0 * off:+.2f} %" if abs(off) < 1.0 else f"{100.0 * off:+.3g} %"
    name = f"{name} [{KINDS[quantity].display}]" if quantity else name
    difference = percent if relative or not quantity else show(off, quantity, 2)
    return (name, cells[0], cells[1], f"{cells[2]} to {cells[3]}", difference, ", ".join(dict.fromkeys(tests)))


def error_row(name: str, twin: float, error: Estimate, quantity: str, tests: Iterable[str], digits: int = 4) -> Row:
    """Row of a parameter [SI] from the twin's value and the relative error."""
    e = Estimate.around(twin * (1.0 + error.value), twin * error.half)
    return row(name, twin, e, quantity, tests, digits=digits)


def _rows(campaign: Campaign, e: ParameterEstimates) -> Iterator[Row]:
    """Drum, hydraulics, load cell, friction, clock, scales of the speeds, delay of the tip."""
    b, motor, kinds = e.balance, e.motor, {p.test: p.kind for p in e.parts}
    moved, driven = ([p.test for p in e.parts if p.has(name)] for name in ("u_m", "u_p"))
    yield from (error_row("wire centre", x.d, x.error, "length", [x.test], 5) for x in e.radii)
    if b is not None:
        yield error_row("motor flow over pump flow", 1.0, b.ratio, "", b.tests)
        yield error_row("leakage", b.leak.twin, b.leak.value, "leakage", b.tests, 3)
    if motor is not None and motor.offset is not None:
        twin = expected_offset(campaign.crane)
        yield row("offset of the motors", twin, motor.offset, "", moved, digits=2, relative=False)
    if motor is not None and motor.hysteresis is not None:
        width = 2.0 * float(e.parts[0].params.active.control.half_width)
        yield row("hysteresis of the motors", width, motor.hysteresis, "", moved, digits=2, relative=False)
    if e.pump is not None:
        yield error_row("gain of the pumps' setting", 1.0, e.pump.gain, "", driven)
    yield from (row("load cell", c.weight, c.force, "force", [c.test]) for c in e.cells)
    judged = any(kinds[f.test] is Kind.AHC for f in e.frictions)
    for f in e.frictions:
        name = "friction at the motors" + (", not judged" if judged and kinds[f.test] is not Kind.AHC else "")
        yield error_row(name, f.mean, f.scale, "torque", [f.test])
    if e.rests is not None:
        tests = [r.test for r in e.rests.rests]
        yield row("line A less B at rest", 0.0, e.rests.dp, "pressure", tests, digits=2, relative=False)
    if e.clock.error is not None:
        yield error_row("clock of the log", 1.0, e.clock.error, "", [t for r in e.ratios.values() for t in r.tests], 5)
    for name, scale in e.clock.calibration.items():
        yield error_row(f"scale of {name}", 1.0, scale, "", e.ratios[name].tests, 5)
    if e.delays is not None and e.cell_error <= hoisting.CLOSE:
        delay = e.delays
        yield row("delay of the tip", campaign.delay, delay.all, "time", delay.tests, digits=3, relative=False)
