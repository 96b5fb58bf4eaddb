"""The law of the motors' displacement in a crane's commands: its mode, its threshold, its settings.

Deviation of logged from simulated commands, as a share of full command, test by test.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.control.controllers import ssc, ssc_cubic
from stillhook.control.plc import MANUAL
from stillhook.control.registry import MANUAL_MODE, code_of
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode
from stillhook.statistics.blocks import fit, interval
from stillhook.statistics.estimate import Estimate
from stillhook.validate.controller.law import Run, shifted
from stillhook.validate.data_set.record import ends_of

ROW = 5.0  # s that a row of the bootstrap sums up
HIGH = 0.95  # judged quantile
EDGES = np.concatenate([[0.0], np.geomspace(1e-5, 2.1, 120)])


@dataclass(frozen=True)
class Deviation:
    """|measured - simulated| of one command in one test, share of full command: mean, rms, 95 % quantile,
    worst; seconds of data; ahc: in compensation, else in manual mode."""

    test: str
    signal: str
    ahc: bool
    seconds: float
    mean: Estimate
    rms: float
    high: Estimate
    worst: float


def deviations(runs: Sequence[Run], cycles: int) -> list[Deviation]:
    """Of u_p and u_m, of each test in compensation and in manual mode. cycles: lag of logged commands behind their
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
    """Measured less simulated command over a stretch (n,), NaN where it or the motors' displacement is
    unknown; None where it was not logged."""
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
SEMI = (Mode(ssc.NAME), Mode(ssc_cubic.NAME))


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
            at, fixed = s.within(part), part.mode not in SEMI
            setting = float(np.nanmedian(u_m[at])) if fixed else None
            wanted = float(np.median(run.simulated.u_m[at])) if fixed else None
            laws.append(MotorLaw(run.test, part.mode, _better(crane, run, part.mode, cycles), setting, wanted))
    return laws


def feedforward_logged(run: Run, cycles: int) -> FloatArray:
    """Feedforward in the logged pump command, which is that less the twin's feedback [-]; NaN where
    saturated."""
    u_p = run.logged_u_p(cycles)
    lo, hi = ends_of(run.segment.u_p, run.simulated.u_raw, run.step)
    feedback = run.simulated.u_raw - run.simulated.u_ff  # with the remainder of a bumpless start
    return np.where((u_p > lo) & (u_p < hi), u_p - feedback, np.nan)


def least(crane: Crane, run: Run) -> FloatArray:
    """Minimum displacement of the twin's SSC at full feedforward (n,) [-]: its PLC's command at a very high tip
    speed."""
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
