"""Step 2: the controller in isolation. The logged inputs of the PLC drive the simulated PLC; deviations of the commands
test by test, as a share of full command, and the law of the motors' displacement: mode, threshold, settings.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.control.controllers import ff, rope, ssc, ssc_cubic, ssc_optimal
from stillhook.control.plc import MANUAL
from stillhook.control.registry import MANUAL_MODE, code_of
from stillhook.engine.pack.winch import gains
from stillhook.report.document import Table
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode
from stillhook.statistics.blocks import fit, interval
from stillhook.statistics.estimate import Estimate
from stillhook.units import number
from stillhook.validate.controller.inputs import PlcSegment, lacking, learned_before, plc_segments
from stillhook.validate.controller.law import Law, Rows, Run, lag, law, rows_of, shifted, significant
from stillhook.validate.criteria.results import Measure, Note, Step, StepNumber, nothing
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.record import FLAT, FULL, Record, ends_of

ROW = 5.0  # s that a row of the bootstrap sums up
HIGH = 0.95  # judged quantile
EDGES = np.concatenate([[0.0], np.geomspace(1e-5, 2.1, 120)])


@dataclass(frozen=True)
class Deviation:
    """|measured - simulated| of one command in one test, share of full command: mean, rms, 95 % quantile, worst;
    seconds of data; ahc: in compensation, else in manual mode."""

    test: str
    signal: str
    ahc: bool
    seconds: float
    mean: Estimate
    rms: float
    high: Estimate
    worst: float


def deviations(runs: Sequence[Run], cycles: int) -> list[Deviation]:
    """Of u_p and u_m, of each test in compensation and in manual mode; cycles: lag of logged commands behind their
    inputs."""
    result = []
    for test in dict.fromkeys(r.test for r in runs):
        same = [r for r in runs if r.test == test]
        for ahc in (True, False):
            for signal in ("u_p", "u_m"):
                parts = [d for r in same for d in differences(r, signal, cycles, ahc=ahc)]
                if parts:
                    result.append(_of(test, signal, ahc, parts, same[0].step))
    return result


def difference(run: Run, signal: str, cycles: int) -> FloatArray | None:
    """Measured less simulated command over a stretch (n,), NaN where it or the displacement is unknown; None where not
    logged."""
    s = run.segment
    measured, T = s.u_p if signal == "u_p" else s.u_m, run.step
    if measured is None:
        return None
    d = shifted(measured, -cycles * T, T) - getattr(run.simulated, signal)
    if signal == "u_p":
        d = np.where(s.seen.braked > 0.0, np.nan, d)  # behind the brake the pumps follow pressures
    return d if s.settled is None else np.where(s.settled, d, np.nan)


def differences(run: Run, signal: str, cycles: int, *, ahc: bool) -> list[FloatArray]:
    """The same in the unbroken parts of one kind of mode."""
    d = difference(run, signal, cycles)
    if d is None:
        return []
    parts = [d[run.segment.within(p)] for p in run.segment.parts if (p.mode.value != "manual") == ahc]
    return [x for p in parts if len(x := p[np.isfinite(p)])]


def _of(test: str, signal: str, ahc: bool, parts: list[FloatArray], step: float) -> Deviation:
    size = np.abs(np.concatenate(parts))
    n = max(1, round(ROW / step))
    rows = [np.stack([_row(np.abs(p[i : i + n])) for i in range(0, len(p), n)]) for p in parts]
    high = float(np.quantile(size, HIGH))
    mean_at = interval(lambda x: float(x[:, -1].sum() / x[:, :-1].sum()), rows, bounds=(0.0, np.inf))
    high_at = interval(_quantile, rows, bounds=(0.0, np.inf))
    scale = high / high_at.value if high_at.value > 0.0 else 1.0
    return Deviation(
        test,
        signal,
        ahc,
        len(size) * step,
        replace(mean_at, value=float(size.mean())),
        float(np.sqrt(np.mean(size**2))),
        Estimate(high, scale * high_at.low, scale * high_at.high, high_at.n),
        float(size.max()),
    )


def _row(size: FloatArray) -> FloatArray:
    """Samples in each bin, and their sum."""
    return np.concatenate([np.histogram(size, EDGES)[0].astype(float), [size.sum()]])


def _quantile(rows: FloatArray) -> float:
    count = np.concatenate([[0.0], np.cumsum(rows[:, :-1].sum(axis=0))])
    return float(np.interp(HIGH * count[-1], count, EDGES))


BETWEEN = (0.05, 0.95)  # of the reduction: outside, the law is saturated and does not depend on its threshold
FEWEST = 1.0  # s of reduction from which a threshold is reported
BLOCK = 2.0  # s: a wave's crest
OFF = 0.01  # rms of u_m from which another mode is considered
BETTER = 0.5  # of that rms: what another mode must be below to be named
SEMI = tuple(Mode(law.NAME) for law in (ssc, ssc_cubic, ff, rope))
OPTIMAL = Mode(ssc_optimal.NAME)


@dataclass(frozen=True)
class MotorLaw:
    """One part. mode: as the log states it; follows: the mode that fits better, None where none does; setting, wanted:
    median displacement of the log and of the twin in a mode with fixed motors, None in other modes."""

    test: str
    mode: Mode
    follows: Mode | None
    setting: float | None
    wanted: float | None


def motor_laws(crane: Crane, runs: Sequence[Run], cycles: int) -> list[MotorLaw]:
    """The law of every part with heave compensation in which the motor command was logged."""
    laws = []
    for run in runs:
        s = run.segment
        if s.u_m is None:
            continue
        u_m = shifted(s.u_m, -cycles * run.step, run.step)
        for part in (p for p in s.parts if p.mode.compensates):
            at, fixed = s.within(part), part.mode not in (*SEMI, OPTIMAL)
            setting = float(np.nanmedian(u_m[at])) if fixed else None
            wanted = float(np.median(run.simulated.u_m[at])) if fixed else None
            laws.append(MotorLaw(run.test, part.mode, _better(crane, run, part.mode, cycles), setting, wanted))
    return laws


def feedforward_logged(run: Run, cycles: int) -> FloatArray:
    """Feedforward in the logged pump command, which is that less the twin's feedback [-]; NaN where saturated."""
    u_p = run.logged_u_p(cycles)
    lo, hi = ends_of(run.segment.u_p, run.simulated.u_raw, run.step)
    feedback = run.simulated.u_raw - run.simulated.u_ff  # with the remainder of a bumpless start
    return np.where((u_p > lo) & (u_p < hi), u_p - feedback, np.nan)


def least(crane: Crane, run: Run) -> FloatArray:
    """Minimum displacement of the twin's SSC at full feedforward (n,) [-]: its command at a very high tip speed."""
    s = run.segment
    all_ssc = np.full(len(s.seen.mode), code_of(ssc.NAME))
    seen = s.seen._replace(v_tip=np.full(len(all_ssc), 1e3), mode=all_ssc)
    return replace(s, seen=seen, memory=s.memory._replace(mode=code_of(ssc.NAME))).simulated_commands(crane).u_m


def _better(crane: Crane, run: Run, stated: Mode, cycles: int) -> Mode | None:
    """The mode that the logged motor command follows, where it is clearly not the stated one."""
    stated_rms = _rms(run, cycles)
    if not stated_rms > OFF:
        return None
    scores = {}
    for mode in Mode:
        if mode in (MANUAL_MODE, stated):
            continue
        s = run.segment
        code = np.where(s.seen.mode > MANUAL, code_of(mode), s.seen.mode)
        memory = s.memory._replace(mode=code[0])
        commands = replace(s, seen=s.seen._replace(mode=code), memory=memory).simulated_commands(crane)
        scores[mode] = _rms(Run(s, commands), cycles)
    best = min(scores, key=lambda m: scores[m])
    return best if scores[best] < BETTER * stated_rms else None


def _rms(run: Run, cycles: int) -> float:
    parts = differences(run, "u_m", cycles, ahc=True)
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) if parts else 0.0


def threshold(crane: Crane, runs: Sequence[Run], cycles: int) -> Estimate | None:
    """u_thr that the motors' reduction over the feedforward implies [-], None where the feedforward does not reach it.

    Every sample between the ends of the law gives one: k = (1 - u_m) / (1 - alpha_min) and |u_ff| = u_thr + k (1 -
    u_thr).
    Source: Moslatt 2020 eqs 2.9 and 2.10; of the cubic law k = s^2 (3 - 2 s) is solved for s first.
    """
    values, blocks, at = [], [], 0
    for run in runs:
        s = run.segment
        if s.u_m is None or difference(run, "u_m", cycles) is None:
            continue
        u_ff, u_m = np.abs(feedforward_logged(run, cycles)), shifted(s.u_m, -cycles * s.record.step, s.record.step)
        room = 1.0 - least(crane, run)
        with np.errstate(divide="ignore", invalid="ignore"):
            k = np.where(room > 0.02, (1.0 - u_m) / room, np.nan)
        k = np.where(s.seen.mode == code_of(ssc_cubic.NAME), _line_of(k), k)
        semi = np.isin(s.seen.mode, [code_of(m) for m in SEMI])
        use = semi & np.isfinite(u_ff) & (k > BETWEEN[0]) & (k < BETWEEN[1])
        values.append((u_ff[use] - k[use]) / (1.0 - k[use]))
        blocks.append(at + np.asarray(np.flatnonzero(use) * s.record.step // BLOCK, dtype=np.intp))
        at += int(len(k) * s.record.step // BLOCK) + 1
    y = np.concatenate(values) if values else np.zeros(0)
    if len(y) < FEWEST / (runs[0].segment.record.step if runs else 1.0):
        return None
    f = fit([np.ones(len(y))], y, np.concatenate(blocks))
    return f.estimate(0) if f is not None else None


def _line_of(k: FloatArray) -> FloatArray:
    """s of k = s^2 (3 - 2 s), for k in [0, 1]."""
    return 0.5 - np.sin(np.arcsin(1.0 - 2.0 * np.clip(k, 0.0, 1.0)) / 3.0)


LEAST_SHARE = {"K_1": 0.01, "K_2": 0.1, "K_p": 0.1}
"""Relative deviations from which a gain is reported."""
LEAST_U_THR = 0.01
LEAST_SETTING = 0.01
QUANTITY = {"K_1": "time_per_length", "K_2": "time_squared_per_length", "K_p": "gain_per_length"}


@dataclass(frozen=True)
class ControllerEstimates:
    """Estimates of step 2: runs of the simulated PLC, order of the log's rows, deviations, implied laws of all tests
    and of each."""

    runs: tuple[Run, ...]
    rows: Rows
    deviations: tuple[Deviation, ...]
    law: Law | None
    laws: dict[str, Law]
    u_thr: Estimate | None
    motor_laws: tuple[MotorLaw, ...]


def causes(crane: Crane, e: ControllerEstimates) -> dict[str, Note]:
    """Deviations by subject: K_1, K_2, K_p, K_wire, u_thr, mode, setting, lag, clip; "u_p" and "u_m" repeat the first
    that explains one of that command."""
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


def statements(
    crane: Crane, e: ControllerEstimates, explanations: Mapping[str, Note], records: Sequence[Record]
) -> tuple[Note, ...]:
    """Deviations, the order of the rows, substitutes for missing signals, and tests left out."""
    tests: dict[Note, dict[str, None]] = {}
    for run in e.runs:
        for note in run.segment.notes:
            tests.setdefault(note, {})[run.test] = None
    return (
        *(Note("deviation", cause=note) for key, note in explanations.items() if key not in EXPLAINS),
        Note("rows", order=e.rows.description),
        *(Note("substitute", tests=list(of), note=note) for note, of in tests.items()),
        *(Note("no-controller", test=r.test.name, signals=lack) for r in records if (lack := lacking(crane, r))),
        *(
            Note("substitute", tests=[r.test.name], note=unknown)
            for r in records
            if (unknown := _learned_before(crane, r, [run.segment for run in e.runs]))
        ),
    )


def _learned_before(crane: Crane, record: Record, used: Sequence[PlcSegment]) -> Note | None:
    """What a controller has learned before a log begins is not known."""
    mode = learned_before(crane, record, used)
    return Note("learned-before", mode=mode) if mode else None


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
    """Step 2 of the validation. Gains implied by the logged commands are shares off the crane file's."""
    crane = campaign.crane
    runs = []
    for i, record in enumerate(records):
        runs += [Run(s, s.simulated_commands(crane)) for s in plc_segments(crane, record)]
        progress(0.03 * (i + 1) / len(records))
    ahc = [r for r in runs if any(p.mode.value != "manual" for p in r.segment.parts)]
    if not ahc:
        lack = next(filter(None, (lacking(crane, r) for r in records)), None)
        learned = next(filter(None, (_learned_before(crane, r, ()) for r in records)), None)
        none = learned or Note("no-inputs")
        return nothing(StepNumber.CONTROLLER, Note("log-inputs", signals=lack) if lack else none)
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
    return Step(StepNumber.CONTROLLER, measures, statements(crane, e, explanations, records), tables, data, e)


def _measures(crane: Crane, e: ControllerEstimates, explanations: Mapping[str, Note]) -> tuple[Measure, ...]:
    out = [m for d in e.deviations for m in _of_test(d, explanations.get(d.signal, ""))]
    closed = "active" in crane.circuits
    if closed and not any(d.signal == "u_m" and d.ahc for d in e.deviations):
        out.append(Measure.of("u_m_deviation", None))
    seconds = f"{e.law.seconds:.0f} s of unsaturated compensation" if e.law else ""
    out.append(_measure("command_lag", e.rows.waves, explanations.get("lag", e.rows.description), data=seconds))
    file_gains = e.runs[0].segment.plc.gains
    for name in LEAST_SHARE:
        x, file_value = getattr(e.law, name, None), getattr(file_gains, name)
        notes = [explanations[k] for k in (name, "K_wire") if k in explanations]
        share = None
        if x is not None and file_value != 0.0:
            share = Estimate(x.value / file_value - 1.0, x.low / file_value - 1.0, x.high / file_value - 1.0, x.n)
        out.append(_measure(f"{name}_deviation", share, *notes, data=f"{seconds}, {x.n} blocks" if x else ""))
    x, u_thr = e.u_thr, crane.control.u_thr
    difference = Estimate(x.value - u_thr, x.low - u_thr, x.high - u_thr) if x else None
    return (*out, _measure("u_thr_difference", difference, explanations.get("u_thr", ""))) if closed else tuple(out)


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
