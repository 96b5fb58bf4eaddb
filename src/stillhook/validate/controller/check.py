"""Step 2: the controller in isolation. The logged inputs of the PLC drive the simulated PLC, whose commands are
compared with the logged ones.

Source: Moslatt 2020 paper F, verification element 2 and criterion 3 ("controller inputs from measured data are used as
inputs to the simulated controller"). The winch is not simulated here: a deviation is due to the controller or
the logged inputs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from stillhook.statistics.estimate import Estimate
from stillhook.validate.controller.explain import causes, deviation_table, gain_table, statements
from stillhook.validate.controller.inputs import lacking, plc_segments
from stillhook.validate.controller.law import Law, Rows, Run, joystick_gain, lag, law, rows_of
from stillhook.validate.controller.motor import Deviation, MotorLaw, deviations, motor_laws, threshold
from stillhook.validate.criteria.results import Measure, Step, StepNumber
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.records.record import Record

NOT_LOGGED = (
    "log s_tip, s_w and u_p, and best also v_tip, a_tip, alpha_m, u_m, e_c_measured and F_w, as the PLC has them in one"
    " cycle"
)


@dataclass(frozen=True)
class ControllerStep(Step):
    """Step 2 with what its figures need: runs of the simulated PLC, order of the log's rows, implied laws."""

    runs: tuple[Run, ...] = ()
    rows: Rows | None = None
    law: Law | None = None
    laws: Mapping[str, Law] = field(default_factory=dict)
    motor_laws: tuple[MotorLaw, ...] = ()
    deviations: tuple[Deviation, ...] = ()


@dataclass(frozen=True)
class ControllerEstimates:
    """Estimates of step 2; see the functions that compute them."""

    runs: tuple[Run, ...]
    rows: Rows
    deviations: tuple[Deviation, ...]
    law: Law | None
    laws: dict[str, Law]
    K_op: Estimate | None
    u_thr: Estimate | None
    motor_laws: tuple[MotorLaw, ...]


def check_controller(campaign: Campaign, records: tuple[Record, ...], progress: Callable[[float], None]) -> Step:
    """Step 2 of the validation. Measures: u_p_deviation, u_m_deviation (95 % quantile of |measured - simulated|, each
    test in compensation), their means, those of manual mode, command_lag [s], and K_1, K_2, K_p, u_thr implied by the
    logged commands, as shares off the crane file's."""
    crane = campaign.crane
    runs = []
    for i, record in enumerate(records):
        runs += [Run(s, s.simulated_commands(crane)) for s in plc_segments(crane, record)]
        progress(0.3 * (i + 1) / len(records))
    ahc = [r for r in runs if any(p.mode.value != "manual" for p in r.segment.parts)]
    if not ahc:
        return _not_shown(records)
    rows = rows_of(runs, lag(runs, ahc=True), lag(runs, ahc=False), crane)
    progress(0.5)
    names, noisy = dict.fromkeys(r.segment.record.test.name for r in ahc), rows.evidence != "fine"
    laws = {n: law([r for r in ahc if r.segment.record.test.name == n], rows.aligned, input_noise=noisy) for n in names}
    estimates = ControllerEstimates(
        tuple(runs),
        rows,
        tuple(deviations(runs, rows.cycles)),
        law(ahc, rows.aligned, input_noise=noisy),
        {n: f for n, f in laws.items() if f is not None},
        joystick_gain(runs, rows.cycles),
        threshold(crane, runs, rows.cycles),
        tuple(motor_laws(crane, runs, rows.cycles)),
    )
    progress(0.9)
    explanations = causes(
        campaign, estimates.runs, estimates.rows, estimates.law, estimates.laws, estimates.u_thr, estimates.motor_laws
    )
    return ControllerStep(
        StepNumber.CONTROLLER,
        _measures(campaign, estimates, explanations),
        statements(estimates.deviations, rows, explanations, runs, records),
        (
            deviation_table(estimates.deviations),
            gain_table(crane, estimates.law, estimates.laws, estimates.K_op, estimates.u_thr),
        ),
        _data(estimates),
        estimates.runs,
        rows,
        estimates.law,
        estimates.laws,
        estimates.motor_laws,
        estimates.deviations,
    )


def _not_shown(records: Sequence[Record]) -> Step:
    reason = next((w for r in records if (w := lacking(r))), "no log holds heave compensation with the PLC's inputs")
    note = f"{reason}: {NOT_LOGGED}"
    names = ("u_p_deviation", "u_m_deviation", "command_lag", "K_1_deviation")
    return Step(
        StepNumber.CONTROLLER,
        tuple(Measure(n, None, note=note) for n in names),
        (f"The controller is not shown: {note}.",),
    )


def _measures(campaign: Campaign, estimates: ControllerEstimates, explanations: dict[str, str]) -> tuple[Measure, ...]:
    out = [m for d in estimates.deviations for m in _of_test(d, explanations.get(d.signal, ""))]
    if not any(d.signal == "u_m" and d.ahc for d in estimates.deviations):
        out.append(
            Measure("u_m_deviation", None, note="u_m was not logged in heave compensation: log the motor command")
        )
    seconds = f"{estimates.law.seconds:.0f} s of unsaturated compensation" if estimates.law else ""
    lagging = estimates.rows.waves
    out.append(
        Measure(
            "command_lag",
            lagging.value,
            "time",
            lagging.low,
            lagging.high,
            data=seconds,
            note=explanations.get("lag", estimates.rows.description),
        )
        if lagging
        else Measure("command_lag", None, note="the tip does not move in compensation: log AHC tests in waves")
    )
    gains = estimates.runs[0].segment.plc.gains
    for name in ("K_1", "K_2", "K_p"):
        e = getattr(estimates.law, name) if estimates.law else None
        note = "; ".join(explanations[k] for k in (name, "K_wire") if k in explanations)
        out.append(_share(f"{name}_deviation", e, getattr(gains, name), seconds, note))
    u_thr = campaign.crane.control.u_thr
    e, never = estimates.u_thr, "the feedforward does not exceed the threshold long enough: log higher waves"
    known = (
        Measure(
            "u_thr_difference", e.value - u_thr, "", e.low - u_thr, e.high - u_thr, note=explanations.get("u_thr", "")
        )
        if e
        else None
    )
    out.append(known or Measure("u_thr_difference", None, note=never))
    return tuple(out)


def _of_test(d: Deviation, explanations: str) -> list[Measure]:
    data = f"{d.seconds:.0f} s, worst sample {100.0 * d.worst:.2g} %, rms {100.0 * d.rms:.2g} %"
    if not d.ahc:
        return [_deviation(f"{d.signal}_deviation_manual", d.high, d.test, data)]
    return [
        _deviation(f"{d.signal}_deviation", d.high, d.test, data, explanations),
        _deviation(f"{d.signal}_deviation_mean", d.mean, d.test, data),
    ]


def _deviation(name: str, e: Estimate, test: str, data: str, note: str = "") -> Measure:
    return Measure(name, e.value, "", e.low, e.high, test=f"test {test}", data=data, note=note)


def _share(name: str, e: Estimate | None, ours: float, data: str, note: str) -> Measure:
    if e is None or ours == 0.0:
        return Measure(
            name,
            None,
            note=("too little unsaturated compensation in the logs to determine the gain: log AHC tests in waves"),
        )
    low, high = e.low / ours - 1.0, e.high / ours - 1.0
    return Measure(name, e.value / ours - 1.0, "", low, high, data=f"{data}, {e.n} blocks", note=note)


def _data(estimates: ControllerEstimates) -> dict[str, object]:
    def of(e: Estimate | None) -> dict[str, float] | None:
        return e.to_dict() if e else None

    law, rows = estimates.law, estimates.rows
    return {
        "cycles": rows.cycles,
        "rows_by": rows.evidence,
        "lag_waves": of(rows.waves),
        "lag_joystick": of(rows.joystick),
        "implied": {n: of(getattr(law, n)) for n in ("K_1", "K_2", "K_p", "K_op")} if law else None,
        "K_1_joystick": of(estimates.K_op),
        "u_thr": of(estimates.u_thr),
        "deviations": [
            {
                "test": d.test,
                "signal": d.signal,
                "ahc": d.ahc,
                "mean": d.mean.value,
                "rms": d.rms,
                "high": d.high.value,
                "worst": d.worst,
                "seconds": d.seconds,
            }
            for d in estimates.deviations
        ],
    }
