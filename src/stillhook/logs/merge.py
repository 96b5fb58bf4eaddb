"""Everything on the bins of the main clock."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.errors import LogError
from stillhook.logs.checks.findings import Checked
from stillhook.logs.checks.frozen_signals import Watched
from stillhook.logs.clock import SOUND_DRIFT, Fit, align
from stillhook.logs.types import Finding, OtherClock

NEAR = 1.5  # bins or spacings: a sample further away contains nothing about a bin


@dataclass
class Merged:
    """All signals on the bins of the main clock: their centres t and the mean stamps `at` of the samples in them
    [s]."""

    t: FloatArray
    at: FloatArray
    watched: dict[str, Watched] = field(default_factory=dict)
    doubtful: dict[str, BoolArray] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)
    clocks: list[OtherClock] = field(default_factory=list)


@dataclass(frozen=True)
class Other:
    """Another track of the log; whether its clock is another one, and whether both clocks state the date."""

    track: Checked
    separate_clock: bool
    dated: bool


def merged(file: str, main: Checked, others: list[Other], *, leave_out: bool = False) -> Merged:
    """The main track with the others brought onto its bins; those of another clock are aligned first.

    Errors: LogError for a clock whose offset or drift cannot be found; with leave_out its signals are left out (NaN),
    and reported.
    """
    out = Merged(main.bins.t, main.bins.at, findings=list(main.findings))
    for i, column in enumerate(main.track.columns):
        name = column.signal.name
        out.watched[name] = Watched(column.signal, main.bins.means[i], column.watch, tuple(column.watch.runs))
        out.doubtful[name] = main.doubtful[i]
    main_signals = {name: w.values for name, w in out.watched.items()}
    for turn in others:
        other = turn.track
        names = [column.signal.name for column in other.track.columns]
        assert other.track.origin is not None
        assert main.track.origin is not None
        apart = other.track.origin - main.track.origin
        fit = Fit(apart, 0.0, 0.0, 0)
        if turn.separate_clock:
            other_side = (other.bins.at, dict(zip(names, other.bins.means, strict=True)))
            try:
                fit = align(
                    (out.at, main_signals), other_side, f"{file}: clock {other.track.time_column} of {', '.join(names)}"
                )
                out.findings.append(_clock_finding(other, fit, names))
                out.clocks.append(OtherClock(tuple(names), other.track.time_column, fit.offset, fit.drift, fit.scatter))
            except LogError as problem:
                if not turn.dated and leave_out:
                    _leave_out(out, other, names, str(problem))
                    continue
                if not turn.dated:
                    raise
                out.findings.append(_believed(other, names, str(problem), apart))
        _bring(out, other, fit, main.track.every)
    return out


def _believed(other: Checked, names: list[str], problem: str, apart: float) -> Finding:
    text = (
        f"{', '.join(names)}: the stamps in {other.track.time_column} are believed, both clocks state the date;"
        f" {problem.split(': ', 2)[-1]}"
    )
    return Finding(
        ", ".join(names), "clock-drift", apart, apart + float(other.bins.t[-1]), len(other.bins.t), "noted", text
    )


def _leave_out(out: Merged, other: Checked, names: list[str], problem: str) -> None:
    for i, column in enumerate(other.track.columns):
        watch = other.track.columns[i].watch
        out.watched[column.signal.name] = Watched(column.signal, np.full(len(out.t), np.nan), watch, ())
        out.doubtful[column.signal.name] = np.ones(len(out.t), np.bool_)
    start, end = float(out.t[0]), float(out.t[-1])
    text = (
        f"{', '.join(names)}: left out, for the clock {other.track.time_column} cannot be brought onto that of the"
        " log: "
    )
    out.findings.append(
        Finding(", ".join(names), "clock", start, end, len(out.t), "left out", text + problem.split(": ", 2)[-1])
    )


def _clock_finding(other: Checked, fit: Fit, names: list[str]) -> Finding:
    fast = -1e6 * fit.drift
    t = fit.to_main(other.bins.t)
    text = (
        f"{', '.join(names)}: the clock {other.track.time_column} runs {abs(fast):.0f} ppm"
        f" {'fast' if fast >= 0.0 else 'slow'}{', which no sound clock does,' if abs(fit.drift) > SOUND_DRIFT else ''}"
        f" and its first stamp is at {fit.offset:.3f} s of the main clock (from {fit.pieces} parts of the log, which"
        f" agree within {fit.scatter:.2g} s): brought onto the main clock, well enough for steady windows"
    )
    if fit.also is not None:
        text += (
            f"; the motion repeats, and {fit.also:.4g} s fits as well: the offset next to the start of the file was"
            " taken"
        )
    return Finding(", ".join(names), "clock-drift", float(t[0]), float(t[-1]), len(t), "repaired", text)


def _bring(out: Merged, other: Checked, fit: Fit, every: float) -> None:
    """The signals of another track at the bins of the main one, by straight lines between its own; NaN where none is
    near."""
    t, t_main = fit.to_main(other.bins.at), out.at
    for i, column in enumerate(other.track.columns):
        name, values = column.signal.name, other.bins.means[i]
        good = np.isfinite(values)
        if good.sum() < 2:  # no line can be drawn
            out.watched[name] = Watched(column.signal, np.full(len(t_main), np.nan), column.watch, ())
            out.doubtful[name] = np.ones(len(t_main), np.bool_)
            continue
        at = np.clip(np.searchsorted(t[good], t_main), 1, int(good.sum()) - 1)
        before, after = t[good][at - 1], t[good][at]
        far = np.minimum(np.abs(t_main - before), np.abs(t_main - after)) > NEAR * max(every, other.track.spacing)
        far |= (t_main < t[good][0] - every) | (
            t_main > t[good][-1] + every
        )  # nothing is known before the first sample and after the last
        on_main = np.where(far, np.nan, np.interp(t_main, t[good], values[good]))
        nearest = np.clip(np.searchsorted(t, t_main - 0.5 * other.track.every), 0, len(t) - 1)
        runs = tuple(
            replace(run, start=float(fit.to_main(np.array(run.start))), end=float(fit.to_main(np.array(run.end))))
            for run in column.watch.runs
        )
        out.watched[name] = Watched(column.signal, on_main, column.watch, runs)
        out.doubtful[name] = other.doubtful[i][nearest] | far
    for finding in other.findings:
        start, end = (float(fit.to_main(np.array(x))) for x in (finding.start, finding.end))
        text = (
            finding.text
            if finding.signal != "time"
            else f"clock {other.track.time_column}: {finding.text.removeprefix('time: ')}"
        )
        out.findings.append(replace(finding, start=start, end=end, text=text))
