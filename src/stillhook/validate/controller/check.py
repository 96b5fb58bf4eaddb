"""Step 2: the controller in isolation. The logged inputs of the PLC drive the simulated PLC; deviations in words
and tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.base.progress import Progress
from stillhook.engine.pack.winch import gains
from stillhook.report.document import Table
from stillhook.spec.crane import Crane
from stillhook.statistics.estimate import Estimate
from stillhook.units import number
from stillhook.validate.controller.inputs import lacking, plc_segments
from stillhook.validate.controller.law import Law, Rows, Run, lag, law, rows_of, significant
from stillhook.validate.controller.motor import Deviation, MotorLaw, deviations, motor_laws, threshold
from stillhook.validate.criteria.notes import Note
from stillhook.validate.criteria.results import Measure, Step, StepNumber, nothing
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.record import FLAT, FULL, Record, ends_of

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
    u_thr: Estimate | None
    motor_laws: tuple[MotorLaw, ...]


def causes(crane: Crane, e: ControllerEstimates) -> dict[str, Note]:
    """Deviations by subject: K_1, K_2, K_p, K_wire, u_thr, mode, setting, lag, clip; "u_p" and "u_m" repeat the first
    that explains a deviation of that command."""
    rows, law, u_thr, out = e.rows, e.law, e.u_thr, dict[str, Note]()
    ours = gains(crane)
    if rows.late and rows.waves is not None:
        lag = rows.waves.value
        code = "tip-later" if lag < 0.0 else "commands-later"
        out["lag"] = Note(code, lag=lag, other=ours.K_2 - lag * ours.K_1, K_2=ours.K_2)
    if law is not None:
        for name, least in LEAST_SHARE.items():
            x, file_value = getattr(law, name), getattr(ours, name)
            if x is None or not file_value > 0.0 or (rows.late and name == "K_2"):
                continue
            share = x.value / file_value - 1.0
            if abs(share) > least and significant(x, file_value):
                of = {"log": x.value, "file": file_value, "share": share, "quantity": QUANTITY[name]}
                out[name] = Note("gain", name=name, **of)
        if by_case := _by_case(e.laws):
            out["K_wire"] = by_case
            for name in ("K_2", "K_p"):
                out.pop(name, None)  # they depend on the same wrong ratio
    if clip := _clipped(e.runs):
        out["clip"] = clip
    file_thr = crane.control.u_thr
    if u_thr is not None and not rows.late and abs(u_thr.value - file_thr) > LEAST_U_THR:
        out |= {"u_thr": Note("u_thr", log=u_thr.value, file=file_thr)} if significant(u_thr, file_thr) else {}
    for m in e.motor_laws:
        if m.follows is not None:
            out["mode"] = Note("other-mode", test=m.test, follows=m.follows, mode=m.mode)
        elif m.setting is not None and m.wanted is not None and abs(m.setting - m.wanted) > LEAST_SETTING:
            out["setting"] = Note("motors-at", test=m.test, mode=m.mode, log=m.setting, file=m.wanted)
    for signal, subjects in EXPLAINS.items():
        if result := [out[k] for k in subjects if k in out]:
            out[signal] = result[0]
    return out


EXPLAINS = {
    "u_p": ("lag", "K_wire", "K_1", "clip", "K_2", "K_p"),
    "u_m": ("mode", "K_wire", "setting", "u_thr", "K_1", "lag"),
}
"""Subjects that explain a deviation of a command, the likeliest first."""


def _by_case(laws: Mapping[str, Law]) -> Note | None:
    """Whether K_1 differs between tests by more than their intervals allow: then it is K_wire, not K_1."""
    estimates = {n: f.K_1 for n, f in laws.items() if f.K_1 is not None}
    if len(estimates) < 2:
        return None
    low, high = min(estimates, key=lambda n: estimates[n].value), max(estimates, key=lambda n: estimates[n].value)
    apart = estimates[high].value - estimates[low].value
    if apart < 0.01 * estimates[low].value or apart < estimates[high].half + estimates[low].half:
        return None
    return Note("K_1-by-test", a=estimates[low].value, low=low, b=estimates[high].value, high=high)


def _clipped(runs: Sequence[Run]) -> Note | None:
    for run in runs:
        lo, hi = ends_of(run.segment.u_p, run.simulated.u_raw, run.step)
        end = min(-lo, hi) + FLAT
        if end < FULL and float(np.abs(run.simulated.u_p).max()) > end + 0.02:
            return Note("clipped", test=run.test, end=end)
    return None


def statements(e: ControllerEstimates, found: Mapping[str, Note], records: Sequence[Record]) -> tuple[Note, ...]:
    """Deviations, the order of the rows, substitutes for missing signals, and tests left out."""
    tests: dict[Note, dict[str, None]] = {}
    for run in e.runs:
        for note in run.segment.notes:
            tests.setdefault(note, {})[run.test] = None
    return (
        *(Note("deviation", cause=note) for key, note in found.items() if key not in EXPLAINS),
        Note("rows", order=e.rows.description),
        *(Note("substitute", tests=list(of), note=note) for note, of in tests.items()),
        *(Note("no-controller", test=r.test.name, signals=lack) for r in records if (lack := lacking(r))),
    )


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
    header = ("of", "K_1 [s/m]", "K_2 [s^2/m]", "K_p [1/m]", "u_thr [-]")
    return Table(header, tuple(rows), "Control law in the logged commands (95 % interval)")


def _e(e: Estimate | None) -> str:
    return f"{e.value:.4g} +- {e.half:.1g}" if e else "-"


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
        lack = next(filter(None, map(lacking, records)), None)
        return nothing(StepNumber.CONTROLLER, Note("log-inputs", signals=lack) if lack else Note("no-inputs"))
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
        threshold(crane, runs, rows.cycles),
        tuple(motor_laws(crane, runs, rows.cycles)),
    )
    progress(0.98)
    explanations = causes(crane, e)
    tables = (deviation_table(e.deviations), gain_table(crane, e))
    data = {"rows": e.rows, "implied": e.law, "u_thr": e.u_thr, "deviations": e.deviations}
    measures = _measures(crane, e, explanations)
    return Step(StepNumber.CONTROLLER, measures, statements(e, explanations, records), tables, data, e)


def _measures(crane: Crane, e: ControllerEstimates, found: Mapping[str, Note]) -> tuple[Measure, ...]:
    out = [m for d in e.deviations for m in _of_test(d, found.get(d.signal, ""))]
    closed = "active" in crane.circuits
    if closed and not any(d.signal == "u_m" and d.ahc for d in e.deviations):
        out.append(Measure.of("u_m_deviation", None))
    seconds = f"{e.law.seconds:.0f} s of unsaturated compensation" if e.law else ""
    out.append(_measure("command_lag", e.rows.waves, found.get("lag", e.rows.description), data=seconds))
    file_gains = e.runs[0].segment.plc.gains
    for name in LEAST_SHARE:
        x, file_value = getattr(e.law, name, None), getattr(file_gains, name)
        notes = [found[k] for k in (name, "K_wire") if k in found]
        share = None
        if x is not None and file_value != 0.0:
            share = Estimate(x.value / file_value - 1.0, x.low / file_value - 1.0, x.high / file_value - 1.0, x.n)
        out.append(_measure(f"{name}_deviation", share, *notes, data=f"{seconds}, {x.n} blocks" if x else ""))
    x, u_thr = e.u_thr, crane.control.u_thr
    difference = Estimate(x.value - u_thr, x.low - u_thr, x.high - u_thr) if x else None
    return (*out, _measure("u_thr_difference", difference, found.get("u_thr", ""))) if closed else tuple(out)


def _measure(name: str, x: Estimate | None, *notes: str, data: str = "") -> Measure:
    """A measure; without notes where there is no estimate."""
    return Measure.of(name, None) if x is None else Measure.of(name, x, *notes, data=data)


def _of_test(d: Deviation, cause: str) -> list[Measure]:
    test, data = f"test {d.test}", f"{d.seconds:.0f} s, worst sample {100.0 * d.worst:.2g} %, rms {100.0 * d.rms:.2g} %"
    if not d.ahc:
        return [Measure.of(f"{d.signal}_deviation_manual", d.high, test=test, data=data)]
    return [
        Measure.of(f"{d.signal}_deviation", d.high, cause, test=test, data=data),
        Measure.of(f"{d.signal}_deviation_mean", d.mean, test=test, data=data),
    ]
