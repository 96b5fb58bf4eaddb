"""Step 6: does the passive circuit of the crane file carry the load as the logs show? Measures, table and verdict."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from stillhook.base.progress import Progress
from stillhook.physics.scalar import G
from stillhook.report.document import Table
from stillhook.spec.crane import Crane, passive_of
from stillhook.statistics.estimate import Estimate, extremes
from stillhook.units import number, show
from stillhook.validate.criteria.results import MEASURES, Measure, Step, StepNumber
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.records.record import Record
from stillhook.validate.parameters.check import HEADER, Row, error_row, row
from stillhook.validate.parameters.measures import lacking_for_torque, rests_on, undetermined
from stillhook.validate.parameters.segments import OIL, LogPart, parts_of
from stillhook.validate.passive import gas as gas_law
from stillhook.validate.passive import orders, torque


@dataclass(frozen=True)
class PassiveEstimates:
    """Results of every check of step 6; empty or None where the log has no data for it."""

    parts: tuple[LogPart, ...]
    level: gas_law.Level | None
    gas: gas_law.Curve | None
    stroke: gas_law.Stroke | None
    displacement: gas_law.Displacement | None
    shares: tuple[torque.Share, ...]
    setting: orders.Setting | None
    make_up: orders.MakeUp | None


def passive_estimates(parts: Sequence[LogPart], progress: Progress) -> PassiveEstimates:
    """Take every check on the parts."""
    level, gas = gas_law.levels(parts), gas_law.curve(parts)
    progress(0.25)
    stroke, displacement = gas_law.stroke(parts, gas), gas_law.displacement(parts)
    progress(0.5)
    shares = torque.shares(parts)
    progress(0.75)
    setting, make_up = orders.setting(parts), orders.make_up(parts)
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


def measures(crane: Crane, estimates: PassiveEstimates) -> tuple[Measure, ...]:
    """Every measure of step 6; one without a value says what to log."""
    return (
        *_level(crane, estimates),
        *_gas(crane, estimates),
        *_stroke(crane, estimates),
        *_motors(crane, estimates),
        *_flow(crane, estimates),
        *_setting(estimates),
        *_make_up(estimates),
    )


def _measure(
    name: str, e: Estimate, calibration: float, *, law: float = 0.0, test: str = "", data: str = "", note: str = ""
) -> Measure:
    """A measure whose interval includes, in addition to its scatter, uncertainties of calibrations and the form of the
    law: relative half widths."""
    total = math.sqrt(e.half**2 + calibration**2 + law**2)
    if not MEASURES[name].quantity:
        data += f", with {100.0 * calibration:.1f} % for calibrations"
    return Measure.of(name, Estimate.around(e.value, total, e.n, law), test=test, data=data, note=note)


def spread(tests: dict[str, Estimate], quantity: str) -> str:
    """Smallest and largest of several tests in words; "" of one."""
    each = extremes(_values(tests), lambda x: show(x, quantity, 4))
    return f"; {each} by test" if each else ""


def _level(crane: Crane, estimates: PassiveEstimates) -> list[Measure]:
    level = estimates.level
    if level is None:
        return undetermined("precharge_error")
    p_0 = passive_of(crane).accumulator.gas.p_0
    e = Estimate.around(level.p.value / p_0 - 1.0, level.p.half / p_0, level.p.n)
    whence = (
        "carried to mid stroke by V_acc"
        if level.placed
        else "the mean, which is held by make-up; log V_acc for the pressure of the gas itself"
    )
    implied, file = (show(x, "pressure", 4) for x in (level.p.value, p_0))
    against = f"not {file}" if abs(e.value) > 0.02 else f"{file} in the crane file"
    note = f"precharge {implied}, {against} ({whence})"
    data = rests_on(estimates.parts, level.tests, level.p.n)
    return [_measure("precharge_error", e, TRANSMITTER / p_0, data=data, note=note + spread(level.tests, "pressure"))]


def _gas(crane: Crane, estimates: PassiveEstimates) -> list[Measure]:
    gas, passive = estimates.gas, passive_of(crane)
    if gas is None:
        lacks = dict.fromkeys(n for p in estimates.parts for n in p.lacking(*OIL, "omega_m"))
        note = f"log {', '.join(lacks)}" if lacks else ""
        return undetermined("gas_volume_error", "piston_loss_difference", note=note)
    acc, data = passive.accumulator, rests_on(estimates.parts, gas.tests, gas.V.n)
    V_0 = acc.gas.V_0
    V, calibration = volume(estimates, gas)
    e = Estimate.around(V.value / V_0 - 1.0, V.half / V_0, V.n)
    note = volume_says(V.value, V_0, gas_law.index(estimates.parts[0]))
    Q = crane.active.pump.D_total * crane.active.pump.omega_p
    loss = Estimate.around(gas.loss.value - acc.R_piston * Q, gas.loss.half, gas.loss.n)
    wide, file = (show(2.0 * p, "pressure", 3) for p in (gas.loss.value, acc.R_piston * Q))
    dry = f", {show(2.0 * gas.dry, 'pressure', 2)} of it dry" if gas.dry > DRY_WORTH else ""
    loop = f"the loop of pressure over oil is {wide} wide at {show(Q, 'flow', 3)}{dry}, {file} in the crane file"
    note += spread(gas.tests, "volume")
    swing = TRANSMITTER_SWING * gas.loss.value
    return [
        _measure("gas_volume_error", e, calibration, law=gas_law.FORM, data=data, note=note),
        _measure("piston_loss_difference", loss, swing, law=gas_law.LOSS_DOUBT, data=data, note=loop),
    ]


def volume(estimates: PassiveEstimates, gas: gas_law.Curve) -> tuple[Estimate, float]:
    """Gas volume with the displacement that the torque shows to work (dead motors move no oil), and the part of it that
    calibrations leave open [-]: settings where there is no torque balance, else the share of the motors."""
    if not estimates.shares:
        return gas.V, torque.SETTING_DOUBT
    share, doubt = torque.overall(estimates.shares)
    works = 1.0 + share.value
    half = math.hypot(works * gas.V.half, share.half * gas.V.value)
    return Estimate.around(works * gas.V.value, half, gas.V.n), doubt


def volume_says(V: float, V_0: float, n: float) -> str:
    """Volume implied by the stiffness at the file's index n, and index at the file's volume: the stiffness gives only
    their ratio."""
    at_file = n * V_0 / V
    not_this = "not " if abs(V / V_0 - 1.0) > 0.2 else ""
    text = (
        f"gas volume {show(V, 'volume', 3)} at n {number(n, 3)}, {not_this or 'and '}{show(V_0, 'volume', 3)} in the"
        " crane file"
    )
    soft, stiff = (show(V * x / n, "volume", 3) for x in (gas_law.SOFT, gas_law.STIFF))
    text += f"; the stiffness determines only n / V: {soft} to {stiff} for n of {gas_law.SOFT} to {gas_law.STIFF}"
    if not_this and not gas_law.SOFT <= at_file <= gas_law.STIFF:
        text += f", and no n of nitrogen (here {at_file:.2f}) makes it the file's volume"
    elif not_this:
        text += f', or n {at_file:.2f} at the file\'s volume (real nitrogen is stiffer than n 1.4: model = "nitrogen")'
    return text


def _stroke(crane: Crane, estimates: PassiveEstimates) -> list[Measure]:
    stroke = estimates.stroke
    if stroke is None:
        return undetermined("stroke_used", "stroke_end_time")
    whence = "V_acc" if stroke.placed else "the pressure along the implied gas curve"
    ends = f"{show(stroke.low, 'volume', 2)} to {show(stroke.high, 'volume', 2)} about mid stroke by {whence}"
    V = show(passive_of(crane).accumulator.V_stroke, "volume", 3)
    tests = rests_on(estimates.parts, [p.test for p in estimates.parts])
    end = f"; the pressure changes as with a piston at its end at {stroke.where}" if stroke.where else ""
    return [
        Measure.of("stroke_used", stroke.used, data=tests, note=f"{ends}, of a stroke of {V}"),
        Measure.of("stroke_end_time", stroke.at_end, data=tests, note=f"{ends}{end}"),
    ]


def _motors(crane: Crane, estimates: PassiveEstimates) -> list[Measure]:
    names = ("passive_motors_error", "passive_torque_error")
    if not estimates.shares:
        return undetermined(*names, note=lacking_for_torque(estimates.parts))
    share, structural = torque.overall(estimates.shares)
    total = Estimate.around(share.value, math.hypot(share.half, structural), share.n)  # words use the total uncertainty
    full = crane.SWL * G * 0.5 * crane.drum.d_max / crane.i_hD
    data = rests_on(estimates.parts, [s.test for s in estimates.shares], share.n)
    out = [_measure(names[0], share, structural, data=data, note=motors_say(crane, estimates, total))]
    for s in estimates.shares:
        over = max(s.T_load, 0.25 * full)
        e = Estimate.around(s.standing.value / over, s.standing.half / over, s.standing.n)
        note = (
            f"{show(s.standing.value, 'torque', 3)} of {show(s.T_load, 'torque', 3)} required by the load are not"
            " explained"
        )
        data = rests_on(estimates.parts, [s.test], s.standing.n)
        out.append(_measure(names[1], e, s.structural, test=f"test {s.test}", data=data, note=note))
    return out


def motors_say(crane: Crane, estimates: PassiveEstimates, share: Estimate) -> str:
    """Number of motors by their torque, compared with the load cell, and remaining explanations."""
    count = passive_of(crane).motor.count
    working = count * (1.0 + share.value)
    text = f"torque of {number(working, 3)} of {count} motors"
    counted = count / (1.0 + estimates.setting.gain.value) if estimates.setting is not None else math.nan
    nearest = round(working)
    near = abs(working - nearest) < NEAR_INTEGER and nearest != count
    if near and not share.low <= 0.0 <= share.high:
        if abs(counted - nearest) < NEAR_INTEGER:
            text = (
                f"{working:.1f} motors, not {count}: the PLC also uses {nearest}, so the number in the crane file is"
                " wrong"
            )
        elif nearest < count:
            text = f"{working:.1f} of {count} motors work: {count - nearest} dead" + (
                ", and the PLC assumes all" if counted > working else ""
            )
        else:
            text = f"torque of {working:.1f} motors, {count} in the crane file"
    by_weight = [s for s in estimates.shares if s.by_weight is not None]
    if by_weight:
        apart = max(by_weight, key=lambda s: abs(s.share.value - (s.by_weight or 0.0)))
        error = apart.share.value - (apart.by_weight or 0.0)
        cell = f"; load cell {100.0 * error:+.1f} % from the stated load in {apart.test}"
        if abs(error) > APART:
            by_cell, stated = count * (1.0 + apart.share.value), count * (1.0 + (apart.by_weight or 0.0))
            each = f"{number(by_cell, 3)} motors by the cell, {number(stated, 3)} by the stated load"
            return f"{text}{cell}: {each}; correct load cell or load first"
        text += cell
    return text


def _flow(crane: Crane, estimates: PassiveEstimates) -> list[Measure]:
    moved = estimates.displacement
    if moved is None:
        return undetermined("passive_flow_error")
    count = passive_of(crane).motor.count
    note = f"oil of {number(count * (1.0 + moved.error.value), 3)} of {count} motors reaches the piston"
    data = rests_on(estimates.parts, moved.tests, moved.error.n)
    return [_measure("passive_flow_error", moved.error, torque.SETTING_DOUBT, data=data, note=note)]


def _setting(estimates: PassiveEstimates) -> list[Measure]:
    s = estimates.setting
    if s is None:
        return undetermined("passive_setting_error")
    count = passive_of(estimates.parts[0].crane).motor.count
    motors = count / (1.0 + s.gain.value)
    note = (
        f"the motors' setting is {1.0 + s.gain.value:.3f} times that required by load cell and pressure: the PLC"
        " assumes"
        f" {motors:.1f} motors"
    )
    note += ", or reads another load than the log" if abs(s.gain.value) > APART else ""
    data = rests_on(estimates.parts, s.tests, s.gain.n)
    return [_measure("passive_setting_error", s.gain, torque.SETTING_DOUBT, data=data, note=note)]


def _make_up(estimates: PassiveEstimates) -> list[Measure]:
    m = estimates.make_up
    if m is None:
        return undetermined("make_up_error")
    note = f"set pressure and transmitter {show(m.offset, 'pressure', 2)} apart"
    data = rests_on(estimates.parts, [p.test for p in estimates.parts if p.has("alpha_pp")])
    return [Measure.of("make_up_error", m.gain, data=data, note=note)]


def table(crane: Crane, estimates: PassiveEstimates) -> Table:
    """One row a parameter, the motors' share one a test as well."""
    passive, rows = passive_of(crane), list[Row]()
    level, gas_curve, settings, made_up = estimates.level, estimates.gas, estimates.setting, estimates.make_up
    gas, count = passive.accumulator.gas, passive.motor.count
    if level is not None:
        rows.append(_row("precharge", gas.p_0, level.p, "pressure", level.tests))
    if gas_curve is not None:
        rows.append(_row(f"gas volume at n {number(gas.n, 3)}", gas.V_0, gas_curve.V, "volume", gas_curve.tests))
    rows += [error_row("motors that work", count, s.share, "", [s.test]) for s in estimates.shares]
    if estimates.shares:
        share, structural = torque.overall(estimates.shares)
        both = Estimate.around(share.value, (share.half**2 + structural**2) ** 0.5)
        tests = [s.test for s in estimates.shares]
        rows.append(error_row("motors, with load and calibration", count, both, "", tests))
    if settings is not None:
        rows.append(error_row("setting over its law", 1.0, settings.gain, "", settings.tests))
    if made_up is not None:
        rows.append(error_row("make-up over its law", 1.0, made_up.gain, "", ()))
    return Table(HEADER, tuple(rows), "The passive circuit by the logs, against the crane file")


def _row(name: str, twin: float, e: Estimate, quantity: str, tests: Iterable[str]) -> Row:
    return row(name, twin, e, quantity, tests, e.value / twin - 1.0)


def check_passive(campaign: Campaign, records: tuple[Record, ...], progress: Progress) -> Step[PassiveEstimates]:
    """Passive circuit implied by the logs, against the crane file.

    Parameters: campaign with the twin under test; records as read; progress is called with the share done.
    Nothing is refused here: a check whose signals were not logged gives a measure without a value that states what to
    log.
    """
    e = passive_estimates(parts_of(campaign, records), progress)
    data = {
        "level": e.level,
        "gas": e.gas,
        "stroke": e.stroke,
        "displacement": e.displacement,
        "shares": e.shares,
        "setting": e.setting,
        "make_up": e.make_up,
    }
    return Step(StepNumber.PASSIVE, measures(campaign.crane, e), (), (table(campaign.crane, e),), data, e)


def _values(tests: Mapping[str, Estimate]) -> dict[str, float]:
    return {test: e.value for test, e in tests.items()}
