"""Step 2: the controller in isolation. The logged inputs of the PLC drive the simulated PLC; deviations in words
and tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.base.progress import Progress
from stillhook.engine.pack.winch import gains
from stillhook.report.document import Table
from stillhook.report.formatting import change, fmt
from stillhook.spec.crane import Crane
from stillhook.statistics.estimate import Estimate
from stillhook.units import number
from stillhook.validate.controller.inputs import lacking, plc_segments
from stillhook.validate.controller.law import Law, Rows, Run, joystick_gain, lag, law, rows_of, significant
from stillhook.validate.controller.motor import Deviation, MotorLaw, deviations, motor_laws, threshold
from stillhook.validate.criteria.results import Measure, Step, StepNumber, nothing
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.records.record import FLAT, FULL, Record, ends_of

LEAST_SHARE = {"K_1": 0.01, "K_2": 0.1, "K_p": 0.1}
"""Relative deviations from which a gain is reported."""
LEAST_U_THR = 0.01
LEAST_SETTING = 0.01
QUANTITY = {"K_1": "time_per_length", "K_2": "time_squared_per_length", "K_p": "gain_per_length"}


@dataclass(frozen=True)
class ControllerEstimates:
    """Estimates of step 2: runs of the simulated PLC, order of the log's rows, deviations of the commands, implied laws
    of all tests and of each; see the functions that compute them."""

    runs: tuple[Run, ...]
    rows: Rows
    deviations: tuple[Deviation, ...]
    law: Law | None
    laws: dict[str, Law]
    K_op: Estimate | None
    u_thr: Estimate | None
    motor_laws: tuple[MotorLaw, ...]


def causes(crane: Crane, estimates: ControllerEstimates) -> dict[str, str]:
    """Deviations, one line each, by subject: K_1, K_2, K_p, K_wire, u_thr, mode, setting, lag, clip; "u_p"
    and "u_m" repeat the first that explains a deviation of that command."""
    rows, law, u_thr, out = estimates.rows, estimates.law, estimates.u_thr, {}
    if rows.late and rows.waves is not None:
        out["lag"] = _late(rows.waves.value, crane)
    if law is not None:
        ours = gains(crane)
        for name, least in LEAST_SHARE.items():
            e, file_value = getattr(law, name), getattr(ours, name)
            if e is None or not file_value > 0.0 or (rows.late and name == "K_2"):
                continue
            share = e.value / file_value - 1.0
            if abs(share) > least and significant(e, file_value):
                log, file = fmt(e.value, QUANTITY[name], 3), fmt(file_value, QUANTITY[name], 3)
                out[name] = f"{name} {log} in the log's commands, {file} in the crane file ({change(share, 0)})"
        if text := _by_case(estimates.laws):
            out["K_wire"] = text
            for name in ("K_2", "K_p"):
                out.pop(name, None)  # they depend on the same wrong ratio
    if clip := _clipped(estimates.runs):
        out["clip"] = clip
    if (
        u_thr is not None
        and not rows.late
        and abs(u_thr.value - crane.control.u_thr) > LEAST_U_THR
        and significant(u_thr, crane.control.u_thr)
    ):
        out["u_thr"] = (
            f"u_thr {u_thr.value:.3g} in the log's motor commands, {crane.control.u_thr:.3g} in the crane file"
        )
    for m in estimates.motor_laws:
        if m.follows is not None:
            out["mode"] = f'test {m.test}: the motor command follows mode "{m.follows}", the log says "{m.mode}"'
        elif m.setting is not None and m.wanted is not None and abs(m.setting - m.wanted) > LEAST_SETTING:
            out["setting"] = (
                f"test {m.test}, mode {m.mode}: motors commanded to {m.setting:.3g}, by the crane file to"
                f" {m.wanted:.3g}"
            )
    out["u_p"] = next((out[k] for k in ("lag", "K_wire", "K_1", "clip", "K_2", "K_p") if k in out), "")
    out["u_m"] = next((out[k] for k in ("mode", "K_wire", "setting", "u_thr", "K_1", "lag") if k in out), "")
    return out


def _late(value: float, crane: Crane) -> str:
    ms, g = f"{abs(1e3 * value):.0f} ms", gains(crane)
    other = (
        f"or another clock, or K_2 {fmt(g.K_2 - value * g.K_1, QUANTITY['K_2'], 3)} in place of"
        f" {fmt(g.K_2, QUANTITY['K_2'], 3)}"
    )
    if value < 0.0:
        return (
            f"the tip's motion in the log is {ms} later than the motion that the PLC's commands follow: not the PLC's"
            " own signal,"
            f" {other}"
        )
    return f"the commands follow the logged tip motion {ms} late: it reaches the PLC later than the log, {other}"


def _by_case(laws: Mapping[str, Law]) -> str:
    """Whether K_1 differs between tests by more than their intervals allow: then it is K_wire, not K_1."""
    estimates = {n: f.K_1 for n, f in laws.items() if f.K_1 is not None}
    if len(estimates) < 2:
        return ""
    low, high = min(estimates, key=lambda n: estimates[n].value), max(estimates, key=lambda n: estimates[n].value)
    apart = estimates[high].value - estimates[low].value
    if apart < 0.01 * estimates[low].value or apart < estimates[high].half + estimates[low].half:
        return ""
    a, b = (fmt(estimates[n].value, QUANTITY["K_1"], 3) for n in (low, high))
    return (
        f"K_1 {a} in test {low} and {b} in test {high}: the layer used for K_wire, or the share of the pumps in"
        " operation"
    )


def _clipped(runs: Sequence[Run]) -> str:
    for run in runs:
        lo, hi = ends_of(run.segment.u_p, run.simulated.u_raw, run.step)
        end = min(-lo, hi) + FLAT
        if end < FULL and float(np.abs(run.simulated.u_p).max()) > end + 0.02:
            return (
                f"test {run.test}: the logged pump commands stop at {100.0 * end:.3g} % of full command, the simulated"
                " ones at 100 %"
            )
    return ""


def statements(
    estimates: ControllerEstimates, explanations: Mapping[str, str], records: Sequence[Record]
) -> tuple[str, ...]:
    """Deviations, the order of the rows, substitutes for missing signals, and tests left out."""
    order = estimates.rows.description
    return (
        *(f"Deviation: {text}." for key, text in explanations.items() if key not in ("u_p", "u_m")),
        f"{order[0].upper()}{order[1:]}.",
        *_substitutes(estimates.runs),
        *(f"Test {r.test.name} cannot be used for the controller: {lack}." for r in records if (lack := lacking(r))),
    )


def _substitutes(runs: Sequence[Run]) -> list[str]:
    notes: dict[str, list[str]] = {}
    for run in runs:
        for note in run.segment.notes:
            notes.setdefault(note, []).append(run.test)
    tests = {n: list(dict.fromkeys(names)) for n, names in notes.items()}
    return [f"Test{'s' if len(t) > 1 else ''} {', '.join(t)}: {note}." for note, t in tests.items()]


def deviation_table(deviations: Sequence[Deviation]) -> Table:
    """Deviations of the commands by test."""
    rows = []
    for d in deviations:
        shares = (number(100.0 * x, 2) for x in (d.mean.value, d.rms, d.high.value, d.worst))
        rows.append((d.test, "AHC" if d.ahc else "manual", d.signal, f"{d.seconds:.0f}", *shares))
    header = ("test", "mode", "command", "length\n[s]", "mean\n[%]", "rms\n[%]", "95 % below\n[%]", "worst\n[%]")
    return Table(header, tuple(rows), "Measured less simulated command, share of full command")


def gain_table(crane: Crane, estimates: ControllerEstimates) -> Table:
    """Gains implied by the logged commands, by test, with those of the crane file."""
    g, law = gains(crane), estimates.law
    file_row = ("crane file", *(f"{x:.4g}" for x in (g.K_1, g.K_2, g.K_p, crane.control.u_thr)))
    rows = [file_row, *((f"test {n}", _e(f.K_1), _e(f.K_2), _e(f.K_p), "") for n, f in estimates.laws.items())]
    if law is not None:
        rows.append(("all", _e(law.K_1), _e(law.K_2), _e(law.K_p), _e(estimates.u_thr)))
    if estimates.K_op is not None:
        rows.append(("joystick, manual", _e(estimates.K_op), "", "", ""))
    header = ("of", "K_1 [s/m]", "K_2 [s^2/m]", "K_p [1/m]", "u_thr [-]")
    return Table(header, tuple(rows), "Control law in the logged commands (95 % interval)")


def _e(e: Estimate | None) -> str:
    return f"{e.value:.4g} +- {e.half:.1g}" if e else "-"


NOT_LOGGED = (
    "log s_tip, s_w and u_p, and best also v_tip, a_tip, alpha_m, u_m, e_c_measured and F_w, as the PLC has them in one"
    " cycle"
)


def check_controller(campaign: Campaign, records: tuple[Record, ...], progress: Progress) -> Step[ControllerEstimates]:
    """Step 2 of the validation. Measures: u_p_deviation, u_m_deviation (95 % quantile of |measured - simulated|, each
    test in compensation), their means, those of manual mode, command_lag [s], and K_1, K_2, K_p, u_thr implied by the
    logged commands, as shares off the crane file's."""
    crane = campaign.crane
    runs = []
    for i, record in enumerate(records):
        runs += [Run(s, s.simulated_commands(crane)) for s in plc_segments(crane, record)]
        progress(0.03 * (i + 1) / len(records))
    ahc = [r for r in runs if any(p.mode.value != "manual" for p in r.segment.parts)]
    if not ahc:
        none = "no log holds heave compensation with the PLC's inputs"
        return nothing(StepNumber.CONTROLLER, f"{next(filter(None, map(lacking, records)), none)}: {NOT_LOGGED}")
    rows = rows_of(runs, lag(runs, ahc=True), lag(runs, ahc=False))
    progress(0.1)
    names, noisy = dict.fromkeys(r.test for r in ahc), rows.evidence != "fine"
    laws = {n: law([r for r in ahc if r.test == n], rows.aligned, input_noise=noisy) for n in names}
    e = ControllerEstimates(
        tuple(runs),
        rows,
        tuple(deviations(runs, rows.cycles)),
        law(ahc, rows.aligned, input_noise=noisy),
        {n: f for n, f in laws.items() if f is not None},
        joystick_gain(runs, rows.cycles),
        threshold(crane, runs, rows.cycles),
        tuple(motor_laws(crane, runs, rows.cycles)),
    )
    progress(0.98)
    explanations = causes(crane, e)
    tables = (deviation_table(e.deviations), gain_table(crane, e))
    data = {"rows": e.rows, "implied": e.law, "K_1_joystick": e.K_op, "u_thr": e.u_thr, "deviations": e.deviations}
    measures = _measures(crane, e, explanations)
    return Step(StepNumber.CONTROLLER, measures, statements(e, explanations, records), tables, data, e)


def _measures(crane: Crane, estimates: ControllerEstimates, explanations: Mapping[str, str]) -> tuple[Measure, ...]:
    out = [m for d in estimates.deviations for m in _of_test(d, explanations.get(d.signal, ""))]
    closed = "active" in crane.circuits
    if closed and not any(d.signal == "u_m" and d.ahc for d in estimates.deviations):
        out.append(Measure.of("u_m_deviation", None))
    seconds = f"{estimates.law.seconds:.0f} s of unsaturated compensation" if estimates.law else ""
    note = explanations.get("lag", estimates.rows.description)
    out.append(_measure("command_lag", estimates.rows.waves, note, seconds))
    gains = estimates.runs[0].segment.plc.gains
    for name in ("K_1", "K_2", "K_p"):
        e, file_value = getattr(estimates.law, name, None), getattr(gains, name)
        note = "; ".join(explanations[k] for k in (name, "K_wire") if k in explanations)
        if e is not None and file_value != 0.0:
            share = Estimate(e.value / file_value - 1.0, e.low / file_value - 1.0, e.high / file_value - 1.0)
            out.append(Measure.of(f"{name}_deviation", share, data=f"{seconds}, {e.n} blocks", note=note))
        else:
            out.append(Measure.of(f"{name}_deviation", None))
    e, u_thr = estimates.u_thr, crane.control.u_thr
    difference = Estimate(e.value - u_thr, e.low - u_thr, e.high - u_thr) if e else None
    if closed:
        out.append(_measure("u_thr_difference", difference, explanations.get("u_thr", "")))
    return tuple(out)


def _measure(name: str, e: Estimate | None, note: str, data: str = "") -> Measure:
    """A measure from its estimate."""
    return Measure.of(name, None) if e is None else Measure.of(name, e, data=data, note=note)


def _of_test(d: Deviation, explanation: str) -> list[Measure]:
    test, data = f"test {d.test}", f"{d.seconds:.0f} s, worst sample {100.0 * d.worst:.2g} %, rms {100.0 * d.rms:.2g} %"
    if not d.ahc:
        return [Measure.of(f"{d.signal}_deviation_manual", d.high, test=test, data=data)]
    return [
        Measure.of(f"{d.signal}_deviation", d.high, test=test, data=data, note=explanation),
        Measure.of(f"{d.signal}_deviation_mean", d.mean, test=test, data=data),
    ]
