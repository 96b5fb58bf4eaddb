"""Step 2 in words: deviations and their size, statements and tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from stillhook.engine.pack.winch import gains
from stillhook.report.document import Table
from stillhook.report.formatting import change, fmt, percent
from stillhook.spec.crane import Crane
from stillhook.statistics.estimate import Estimate
from stillhook.units import number
from stillhook.validate.controller.inputs import lacking
from stillhook.validate.controller.law import Law, Rows, Run, significant
from stillhook.validate.controller.motor import Deviation, MotorLaw
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.records.record import Record
from stillhook.validate.data_set.records.segments import FLAT, FULL, ends_of

LEAST_SHARE = {"K_1": 0.01, "K_2": 0.1, "K_p": 0.1}
"""Relative deviations from which a gain is reported."""
LEAST_U_THR = 0.01
LEAST_SETTING = 0.01
QUANTITY = {"K_1": "time_per_length", "K_2": "time_squared_per_length", "K_p": "gain_per_length"}


def causes(
    campaign: Campaign,
    runs: Sequence[Run],
    rows: Rows,
    law: Law | None,
    laws: Mapping[str, Law],
    u_thr: Estimate | None,
    motors: Sequence[MotorLaw],
) -> dict[str, str]:
    """Deviations, one line each, by subject: K_1, K_2, K_p, K_wire, u_thr, mode, setting, lag, clip; "u_p"
    and "u_m" repeat the first that explains a deviation of that command."""
    crane, out = campaign.crane, {}
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
        if text := _by_case(laws):
            out["K_wire"] = text
            for name in ("K_2", "K_p"):
                out.pop(name, None)  # they depend on the same wrong ratio
    clip = _clipped(runs)
    if clip:
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
    for m in motors:
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
    known = {n: f.K_1 for n, f in laws.items() if f.K_1 is not None}
    if len(known) < 2:
        return ""
    low, high = min(known, key=lambda n: known[n].value), max(known, key=lambda n: known[n].value)
    apart = known[high].value - known[low].value
    if apart < 0.01 * known[low].value or apart < known[high].half + known[low].half:
        return ""
    a, b = (fmt(known[n].value, QUANTITY["K_1"], 3) for n in (low, high))
    return (
        f"K_1 {a} in test {low} and {b} in test {high}: the layer used for K_wire, or the share of the pumps in"
        " operation"
    )


def _clipped(runs: Sequence[Run]) -> str:
    for run in runs:
        lo, hi = ends_of(run.segment.u_p, run.simulated.u_raw, run.segment.record.step)
        end = min(-lo, hi) + FLAT
        if end < FULL and float(np.abs(run.simulated.u_p).max()) > end + 0.02:
            where = f"test {run.segment.record.test.name}"
            return (
                f"{where}: the logged pump commands stop at {100.0 * end:.3g} % of full command, the simulated ones at"
                " 100 %"
            )
    return ""


def statements(
    deviations: Sequence[Deviation],
    rows: Rows,
    explanations: Mapping[str, str],
    runs: Sequence[Run],
    records: Sequence[Record],
) -> tuple[str, ...]:
    """Lines for the reader, the most important first."""
    out = []
    for signal, name in (("u_p", "pump"), ("u_m", "motor")):
        worst = max((d for d in deviations if d.signal == signal and d.ahc), key=lambda d: d.high.value, default=None)
        if worst is not None:
            high, mean, largest = (percent(x, 2) for x in (worst.high.value, worst.mean.value, worst.worst))
            out.append(
                f"The simulated controller reproduces the logged {name} command to within {high} of full command, 95 %"
                f" of the time (test {worst.test}, the worst; mean {mean}, worst sample {largest})."
            )
    out += [f"Deviation: {text}." for key, text in explanations.items() if key not in ("u_p", "u_m")]
    out.append(f"{rows.description[0].upper()}{rows.description[1:]}.")
    out += _made_up(runs)
    out += [f"Test {r.test.name} cannot be used for the controller: {lack}." for r in records if (lack := lacking(r))]
    return tuple(out)


def _made_up(runs: Sequence[Run]) -> list[str]:
    notes: dict[str, list[str]] = {}
    for run in runs:
        for note in run.segment.notes:
            notes.setdefault(note, []).append(run.segment.record.test.name)
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


def gain_table(
    crane: Crane, law: Law | None, laws: Mapping[str, Law], K_op: Estimate | None, u_thr: Estimate | None
) -> Table:
    """Gains implied by the logged commands, by test, with those of the crane file."""
    g = gains(crane)
    file_row = ("crane file", *(f"{x:.4g}" for x in (g.K_1, g.K_2, g.K_p, crane.control.u_thr)))
    rows = [file_row, *((f"test {n}", _e(f.K_1), _e(f.K_2), _e(f.K_p), "") for n, f in laws.items())]
    if law is not None:
        rows.append(("all", _e(law.K_1), _e(law.K_2), _e(law.K_p), _e(u_thr)))
    if K_op is not None:
        rows.append(("joystick, manual", _e(K_op), "", "", ""))
    header = ("of", "K_1 [s/m]", "K_2 [s^2/m]", "K_p [1/m]", "u_thr [-]")
    return Table(header, tuple(rows), "Control law in the logged commands (95 % interval)")


def _e(e: Estimate | None) -> str:
    return f"{e.value:.4g} +- {e.half:.1g}" if e else "-"
