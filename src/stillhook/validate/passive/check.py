"""Step 6: does the passive circuit of the crane file carry the load as the logs show? Measures, table and verdict."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from stillhook.base.progress import Progress
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane, passive_of
from stillhook.statistics.estimate import Estimate
from stillhook.units import number
from stillhook.validate.criteria.results import MEASURES, Measure, Note, Step, StepNumber
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.record import Record
from stillhook.validate.parameters.check import (
    Row,
    by_test,
    error_row,
    parameter_table,
    rests_on,
    row,
    torque_lacks,
    undetermined,
)
from stillhook.validate.parameters.segments import OIL, ByTest, LogPart, parts_of
from stillhook.validate.passive import circuit


@dataclass(frozen=True)
class PassiveEstimates:
    """Results of every check of step 6; empty or None where the log has no data for it."""

    parts: tuple[LogPart, ...]
    level: circuit.Level | None
    gas: circuit.Curve | None
    stroke: circuit.Stroke | None
    displacement: ByTest | None
    shares: tuple[circuit.Share, ...]
    setting: ByTest | None
    make_up: circuit.MakeUp | None


def passive_estimates(parts: Sequence[LogPart], progress: Progress) -> PassiveEstimates:
    """Take every check on the parts."""
    level, gas = circuit.levels(parts), circuit.curve(parts)
    progress(0.25)
    stroke, displacement = circuit.stroke(parts, gas), circuit.displacement(parts)
    progress(0.5)
    shares = circuit.shares(parts)
    progress(0.75)
    setting, make_up = circuit.setting(parts), circuit.make_up(parts)
    return PassiveEstimates(tuple(parts), level, gas, stroke, displacement, shares, setting, make_up)


TRANSMITTER = 2e5
"""Error of a transmitter of 400 bar and class 0.5 [Pa]."""
TRANSMITTER_SWING = 0.01
"""Relative error of the amplitude of a transmitter and of a flow [-]."""
APART = 0.02
"""Difference of the shares by load cell and by stated load from which it is reported [-]."""
DRY_WORTH = 0.3e5
"""Dry friction of the piston that is reported [Pa]."""
NEAR_INTEGER = 0.25
"""Tolerance of the number of motors to an integer that is named [-]."""
OTHER_VOLUME = 0.2
"""Error of the gas volume from which another index is named [-]."""


def measures(crane: Crane, e: PassiveEstimates) -> tuple[Measure, ...]:
    """Every measure of step 6; one without a value says what to log."""
    return (
        *_level(crane, e),
        *_gas(crane, e),
        *_stroke(crane, e),
        *_motors(crane, e),
        *_displacement(crane, e),
        *_setting(crane, e),
        *_make_up(e),
    )


def _measure(
    name: str, e: Estimate, calibration: float, *notes: str, law: float = 0.0, test: str = "", data: str = ""
) -> Measure:
    """A measure whose interval includes uncertainties of calibrations and of the form of the law: relative half
    widths."""
    total = math.sqrt(e.half**2 + calibration**2 + law**2)
    if not MEASURES[name].quantity:
        data += f", with {100.0 * calibration:.1f} % for calibrations"
    return Measure.of(name, Estimate.around(e.value, total, e.n, law), *notes, test=test, data=data)


def _level(crane: Crane, e: PassiveEstimates) -> list[Measure]:
    if e.level is None:
        return undetermined("precharge_error")
    p, p_0 = e.level.p, passive_of(crane).accumulator.gas.p_0
    x = Estimate.around(p.all.value / p_0 - 1.0, p.all.half / p_0, p.all.n)
    notes = (
        Note("precharge", log=p.all.value, file=p_0),
        Note("by-place" if e.level.placed else "by-mean"),
        by_test(p.tests, "pressure 4"),
    )
    return [_measure("precharge_error", x, TRANSMITTER / p_0, *notes, data=rests_on(e.parts, p.tests, p.all.n))]


def _gas(crane: Crane, e: PassiveEstimates) -> list[Measure]:
    gas, names = e.gas, ("gas_volume_error", "piston_loss_difference")
    if gas is None:
        lacks = tuple(dict.fromkeys(n for p in e.parts for n in p.lacking(*OIL, "omega_m")))
        return undetermined(*names, note=Note("log", signals=lacks) if lacks else "")
    acc, data = passive_of(crane).accumulator, rests_on(e.parts, gas.V.tests, gas.V.all.n)
    V, calibration = volume(e, gas)
    V_0 = acc.gas.V_0
    x = Estimate.around(V.value / V_0 - 1.0, V.half / V_0, V.n)
    notes = [*volume_notes(V.value, V_0, circuit.index(e.parts[0])), by_test(gas.V.tests, "volume 4")]
    Q = crane.active.pump.D_total * crane.active.pump.omega_p
    loss = Estimate.around(gas.loss.value - acc.R_piston * Q, gas.loss.half, gas.loss.n)
    loop = [Note("loop", log=2.0 * gas.loss.value, Q=Q, file=2.0 * acc.R_piston * Q)]
    loop += [Note("loop-dry", dry=2.0 * gas.dry)] if gas.dry > DRY_WORTH else []
    swing = TRANSMITTER_SWING * gas.loss.value
    return [
        _measure(names[0], x, calibration, *notes, law=circuit.FORM, data=data),
        _measure(names[1], loss, swing, *loop, law=circuit.LOSS_DOUBT, data=data),
    ]


def volume(e: PassiveEstimates, gas: circuit.Curve) -> tuple[Estimate, float]:
    """Gas volume with the displacement that the torque shows to work (dead motors move no oil), and the part of it that
    calibrations leave open [-]."""
    V = gas.V.all
    if not e.shares:
        return V, circuit.SETTING_DOUBT
    share, doubt = circuit.overall(e.shares)
    works = 1.0 + share.value
    return Estimate.around(works * V.value, math.hypot(works * V.half, share.half * V.value), V.n), doubt


def volume_notes(V: float, V_0: float, n: float) -> list[Note]:
    """Volume implied by the stiffness at the file's index n, and index at the file's volume: only their ratio is
    given."""
    at_file, soft, stiff = n * V_0 / V, V * circuit.SOFT / n, V * circuit.STIFF / n
    out = [
        Note("volume", log=V, n=n, file=V_0),
        Note("volume-range", soft=soft, stiff=stiff, n_soft=circuit.SOFT, n_stiff=circuit.STIFF),
    ]
    if abs(V / V_0 - 1.0) > OTHER_VOLUME:
        out.append(Note("other-n" if circuit.SOFT <= at_file <= circuit.STIFF else "no-such-n", n=at_file))
    return out


def _stroke(crane: Crane, e: PassiveEstimates) -> list[Measure]:
    s = e.stroke
    if s is None:
        return undetermined("stroke_used", "stroke_end_time")
    ends = Note("stroke-by-place" if s.placed else "stroke-by-gas", low=s.low, high=s.high)
    of, data = Note("stroke-of", V=passive_of(crane).accumulator.V_stroke), rests_on(e.parts, [p.test for p in e.parts])
    end = Note("at-an-end", where=s.where) if s.where else ""
    return [
        Measure.of("stroke_used", s.used, ends, of, data=data),
        Measure.of("stroke_end_time", s.at_end, ends, end, data=data),
    ]


def _motors(crane: Crane, e: PassiveEstimates) -> list[Measure]:
    names = ("passive_motors_error", "passive_torque_error")
    if not e.shares:
        return undetermined(*names, note=torque_lacks(e.parts))
    share, structural = circuit.overall(e.shares)
    total = Estimate.around(share.value, math.hypot(share.half, structural), share.n)  # causes rest on all of it
    full = crane.SWL * G * 0.5 * crane.drum.d_max / crane.i_hD
    data = rests_on(e.parts, [s.test for s in e.shares], share.n)
    out = [_measure(names[0], share, structural, *motor_notes(crane, e, total), data=data)]
    for s in e.shares:
        over = max(s.T_load, 0.25 * full)
        x = Estimate.around(s.standing.value / over, s.standing.half / over, s.standing.n)
        note = Note("torque-unexplained", standing=s.standing.value, load=s.T_load)
        data = rests_on(e.parts, [s.test], s.standing.n)
        out.append(_measure(names[1], x, s.structural, note, test=f"test {s.test}", data=data))
    return out


def motor_notes(crane: Crane, e: PassiveEstimates, share: Estimate) -> list[Note]:
    """Number of motors by their torque, compared with the load cell, and remaining explanations."""
    count = passive_of(crane).motor.count
    working = count * (1.0 + share.value)
    counted = count / (1.0 + e.setting.all.value) if e.setting is not None else math.nan
    nearest = round(working)
    near = abs(working - nearest) < NEAR_INTEGER and nearest != count
    out = [Note("motors", working=working, count=count)]
    if near and not share.low <= 0.0 <= share.high:
        if abs(counted - nearest) < NEAR_INTEGER:
            out = [Note("motors-counted", working=working, count=count, nearest=nearest)]
        elif nearest < count:
            out = [Note("motors-dead", working=working, count=count, dead=count - nearest)]
            out += [Note("motors-assumed")] if counted > working else []
        else:
            out = [Note("motors-more", working=working, count=count)]
    by_weight = {s.test: (s.share.value, s.by_weight) for s in e.shares if s.by_weight is not None}
    if by_weight:
        test, (cell, stated) = max(by_weight.items(), key=lambda x: abs(x[1][0] - x[1][1]))
        out.append(Note("cell-and-load", error=cell - stated, test=test))
        if abs(cell - stated) > APART:
            out.append(Note("cell-or-load", cell=count * (1.0 + cell), stated=count * (1.0 + stated)))
    return out


def _displacement(crane: Crane, e: PassiveEstimates) -> list[Measure]:
    if e.displacement is None:
        return undetermined("passive_flow_error")
    x, count = e.displacement.all, passive_of(crane).motor.count
    note, data = Note("oil-reaches", motors=count * (1.0 + x.value), count=count), e.displacement.tests
    return [_measure("passive_flow_error", x, circuit.SETTING_DOUBT, note, data=rests_on(e.parts, data, x.n))]


def _setting(crane: Crane, e: PassiveEstimates) -> list[Measure]:
    if e.setting is None:
        return undetermined("passive_setting_error")
    x = e.setting.all
    assumed = passive_of(crane).motor.count / (1.0 + x.value)
    notes = (
        Note("setting-by-law", times=1.0 + x.value, motors=assumed),
        Note("other-load") if abs(x.value) > APART else "",
    )
    data = rests_on(e.parts, e.setting.tests, x.n)
    return [_measure("passive_setting_error", x, circuit.SETTING_DOUBT, *notes, data=data)]


def _make_up(e: PassiveEstimates) -> list[Measure]:
    if e.make_up is None:
        return undetermined("make_up_error")
    data = rests_on(e.parts, [p.test for p in e.parts if p.has("alpha_pp")])
    return [Measure.of("make_up_error", e.make_up.gain, Note("make-up", apart=e.make_up.offset), data=data)]


def _rows(crane: Crane, e: PassiveEstimates) -> Iterator[Row]:
    """One row a parameter, the motors' share one a test as well."""
    passive = passive_of(crane)
    gas, count = passive.accumulator.gas, passive.motor.count
    implied = [("precharge", gas.p_0, e.level.p, "pressure")] if e.level is not None else []
    implied += [(f"gas volume at n {number(gas.n, 3)}", gas.V_0, e.gas.V, "volume")] if e.gas is not None else []
    for name, twin, x, kind in implied:
        yield row(name, twin, x.all, kind, x.tests)
    yield from (error_row("motors that work", count, s.share, "", [s.test]) for s in e.shares)
    if e.shares:
        share, structural = circuit.overall(e.shares)
        both = Estimate.around(share.value, (share.half**2 + structural**2) ** 0.5)
        yield error_row("motors, with load and calibration", count, both, "", [s.test for s in e.shares])
    if e.setting is not None:
        yield error_row("setting over its law", 1.0, e.setting.all, "", e.setting.tests)
    if e.make_up is not None:
        yield error_row("make-up over its law", 1.0, e.make_up.gain, "", ())


def check_passive(campaign: Campaign, records: tuple[Record, ...], progress: Progress) -> Step[PassiveEstimates]:
    """Passive circuit implied by the logs, against the crane file. A check whose signals were not logged gives a
    measure without a value that states what to log."""
    e = passive_estimates(parts_of(campaign, records), progress)
    table = parameter_table(_rows(campaign.crane, e), "The passive circuit by the logs, against the crane file")
    names = ("level", "gas", "stroke", "displacement", "shares", "setting", "make_up")
    data = {name: getattr(e, name) for name in names}
    return Step(StepNumber.PASSIVE, measures(campaign.crane, e), (), (table,), data, e)
