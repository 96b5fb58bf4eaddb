"""Deviation of logged from simulated commands, as a share of full command, test by test."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.control.plc import MANUAL
from stillhook.statistics.block_bootstrap import interval
from stillhook.statistics.estimate import Estimate
from stillhook.validate.controller.law import Run, shifted

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
    for test in dict.fromkeys(r.segment.record.test.name for r in runs):
        same = [r for r in runs if r.segment.record.test.name == test]
        for ahc in (True, False):
            for signal in ("u_p", "u_m"):
                parts = [d for r in same for d in differences(r, signal, cycles, ahc=ahc)]
                if parts:
                    result.append(_of(test, signal, ahc, parts, same[0].segment.record.step))
    return result


def difference(run: Run, signal: str, cycles: int) -> FloatArray | None:
    """Measured less simulated command over a stretch (n,), NaN where it or the motors' displacement is
    unknown; None where it was not logged."""
    s = run.segment
    measured, T = s.u_p if signal == "u_p" else s.u_m, s.record.step
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


def manual(run: Run) -> bool:
    """Whether a segment has no compensation at all."""
    return bool((run.segment.seen.mode == MANUAL).all())
