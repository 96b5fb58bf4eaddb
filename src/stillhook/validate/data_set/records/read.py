"""Logs of a campaign to records: on an even grid, clocks corrected, cut into load cases; all findings are
reported."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.base.progress import Meter, Progress
from stillhook.control.registry import MANUAL_MODE
from stillhook.errors import StillhookError, ValidateError
from stillhook.logs.checks.findings import counted
from stillhook.logs.log import read_log
from stillhook.logs.types import Finding, Log
from stillhook.spec.scenario import Mode
from stillhook.validate.data_set.campaign import Campaign, CraneTest, Kind
from stillhook.validate.data_set.modes import standard_modes
from stillhook.validate.data_set.records.clocks import following, refined, wire_lags
from stillhook.validate.data_set.records.discontinuities import seams
from stillhook.validate.data_set.records.loads import load_of, load_segments, standing, with_wire
from stillhook.validate.data_set.records.record import Record, Segment
from stillhook.validate.data_set.records.resample import Grid, even
from stillhook.validate.data_set.records.segments import LEAST, SegmentBounds, segment, split, unbroken
from stillhook.validate.data_set.records.wire import completed

QUIET = ("constant",)
"""Kinds of findings that are not reported: a constant set value."""
MOST_FINDINGS = 12
"""Findings of a log that are reported individually."""


def read_records(campaign: Campaign, progress: Progress) -> tuple[Record, ...]:
    """Every test of a campaign, read.

    Errors: StillhookError (LogError, UnitError, ValidateError) of one line that names the test, for a log that cannot
    be read, is inconsistent or lacks signals that its kind of test needs.
    """
    meter = Meter(float(len(campaign.tests)), progress)
    logs: dict[tuple[Path, int], Log] = {}
    records = []
    for test in campaign.tests:
        reached = meter.part(1.0)
        try:
            key = (test.log.resolve(), id(test.mapping))
            if key not in logs:
                every = f"{campaign.crane.control.t_cycle!r} s"
                logs[key] = read_log(test.log, test.mapping, every=every, leave_out_clocks=True, progress=reached)
            records.append(_record(campaign, test, logs[key]))
        except StillhookError as e:
            place = f'test "{test.name}": '
            raise type(e)(str(e) if str(e).startswith(place) else f"{place}{e}") from None
        reached(1.0)
    return tuple(records)


def _record(campaign: Campaign, test: CraneTest, log: Log) -> Record:
    grid = even(log, test, campaign.crane.control.t_cycle)
    signals = dict(grid.signals)
    if "mode" in signals:
        signals["mode"] = standard_modes(signals["mode"], grid.step, test.modes, f'test "{test.name}": ')
    signals, clocks, of_clocks = refined(grid.t, grid.step, signals, log, campaign.crane, test.name)
    signals, derived, of_wire = completed(signals, grid.step, test, campaign.crane)
    segments, of_parts = _segments(campaign, test, grid, signals)
    test, _ = with_wire(test, campaign.crane, signals, slice(None))
    lags = wire_lags(grid.t, signals, segments) if test.kind is Kind.AHC and "s_w" not in derived else ()
    statements = [
        *of_clocks,
        *of_wire,
        *following(test, lags, segments, grid.step, signals),
        *of_parts,
        *_quality(test, log, grid),
    ]
    return Record(
        test=test,
        log=log,
        t=grid.t,
        step=grid.step,
        signals=signals,
        segments=segments,
        statements=tuple(dict.fromkeys(statements)),
        doubtful=grid.doubtful,
        derived=derived,
        zero=grid.zero,
        lost=grid.lost,
        longest_hole=grid.longest_hole,
        lags=lags,
        clocks=clocks,
    )


def _segments(
    campaign: Campaign, test: CraneTest, grid: Grid, signals: Mapping[str, FloatArray]
) -> tuple[tuple[Segment, ...], list[str]]:
    """The load cases of a test, and statements about the parts left out."""
    n, statements = len(grid.t), list[str]()
    mode = _mode(test, signals, n)
    cut = seams(grid.t, signals)
    for i, jump in cut:
        statements.append(
            f'Test "{test.name}", {grid.zero + grid.t[i]:.6g} s: {jump}; the parts before and after are used as two.'
        )
    levels = load_segments(signals.get("F_w"), n, grid.step, campaign.crane)
    good = _complete_samples(test, signals, n) & np.isfinite(mode) & standing(levels, n)
    if test.kind is Kind.AHC:
        good &= mode != float(list(Mode).index(MANUAL_MODE))
    edges = [*(i for i, _ in cut), *(np.flatnonzero(np.diff(mode) != 0.0) + 1), *(s.first for s in levels)]
    segments = []
    for a, b in split(unbroken(good), edges):
        if (b - 1 - a) * grid.step < LEAST[test.kind]:
            continue
        level = next(s for s in levels if s.first <= a < s.last)
        part_test, of_wire = with_wire(test, campaign.crane, signals, slice(a, b))
        load, load_text = load_of(level, levels, part_test, campaign.crane)
        statements += [text for text in (of_wire, load_text) if text]
        part = SegmentBounds(a, b, list(Mode)[int(mode[a])], load)
        segments.append(segment(test, part, grid.t, grid.step, signals, campaign.criteria.settings["window"]))
    return tuple(segments), [
        *_used(test, grid, mode, segments),
        *_operator(test, signals, segments, grid.step),
        *statements,
    ]


def _mode(test: CraneTest, signals: Mapping[str, FloatArray], n: int) -> FloatArray:
    """Mode by number (n,). Errors: ValidateError where neither log nor campaign file states it."""
    if "mode" in signals and np.isfinite(signals["mode"]).any():
        _as_stated(test, signals["mode"])
        return signals["mode"]
    if test.mode is None and test.kind is Kind.AHC:
        raise ValidateError(
            f'test "{test.name}": mode: missing. State the mode of the PLC in the campaign file, or map a signal mode;'
            " one of "
            f"{', '.join(m for m in Mode if m.compensates)}."
        )
    return np.full(n, float(list(Mode).index(test.mode or MANUAL_MODE)))


def _as_stated(test: CraneTest, mode: FloatArray) -> None:
    """Errors: ValidateError where the log never is in the mode that the campaign file states."""
    held = [list(Mode)[int(k)] for k in np.unique(mode[np.isfinite(mode)])]
    if test.mode is not None and test.mode not in held:
        raise ValidateError(
            f'test "{test.name}": mode = "{test.mode}" is stated, but the log contains {" and ".join(held)}. State what'
            ' the numbers of the log mean in the campaign file: [modes], such as "1" = "ssc", or leave mode out.'
        )


def _complete_samples(test: CraneTest, signals: Mapping[str, FloatArray], n: int) -> BoolArray:
    """Samples with all signals that a test of this kind needs."""
    if test.kind is Kind.AHC:
        return np.isfinite(signals["s_tip"]) & np.isfinite(signals["s_w"])
    moves = [name for name in ("v_w", "omega_m", "s_w") if name in signals]
    return np.logical_or.reduce([np.isfinite(signals[name]) for name in moves]) if moves else np.zeros(n, np.bool_)


def _used(test: CraneTest, grid: Grid, mode: FloatArray, segments: list[Segment]) -> list[str]:
    """Used part of a test, where it is not all of it."""
    duration = float(grid.t[-1] - grid.t[0])
    used = sum(s.duration for s in segments)
    if not segments:
        least, reason = LEAST[test.kind], ""
        if test.kind is Kind.AHC and not (mode > 0.0).any():
            reason = " The winch was in manual mode throughout."
        requirement = f"no uninterrupted part of at least {least:.0f} s has one mode and one load"
        return [f'Test "{test.name}": {requirement}: none of it is used.{reason}']
    if duration - used < 1.0:
        return []
    parts = f"in {len(segments)} parts" if len(segments) > 1 else f"from {grid.zero + segments[0].start:.6g} s on"
    manual = float(np.sum(mode == 0.0)) * grid.step if test.kind is Kind.AHC else 0.0
    reason = f"; in {manual:.4g} s the winch did not compensate" if manual > 0.0 else ""
    return [f'Test "{test.name}": {used:.4g} s of {duration:.4g} s are used, {parts}{reason}.']


def _operator(test: CraneTest, signals: Mapping[str, FloatArray], segments: list[Segment], step: float) -> list[str]:
    """Moves of the joystick while the winch compensates."""
    if test.kind is not Kind.AHC or "v_op" not in signals:
        return []
    moved = [np.abs(signals["v_op"][s.first : s.last]) > 0.0 for s in segments]
    number = sum(len(unbroken(m)) for m in moved)
    if not number:
        return []
    seconds = sum(float(m.sum()) for m in moved) * step
    return [
        f'Test "{test.name}": the operator moves the wire {number} times while the winch compensates, {seconds:.4g} s'
        " in all."
    ]


def _quality(test: CraneTest, log: Log, grid: Grid) -> list[str]:
    """Quality of the samples of the used part."""
    end = grid.zero + float(grid.t[-1])
    findings = [f for f in log.findings if f.kind not in QUIET and _touches(f, grid.zero, end)]
    spikes = [f"{counted(n, 'sample')} of {name}" for name, n in grid.spikes.items()]
    statements = (
        [(f'Test "{test.name}": {", ".join(spikes)} left out as spikes far from their neighbours.')] if spikes else []
    )
    statements += [f'Test "{test.name}", {log.source}: {f.text} ({f.action}).' for f in findings[:MOST_FINDINGS]]
    if len(findings) > MOST_FINDINGS:
        statements.append(f'Test "{test.name}", {log.source}: {len(findings) - MOST_FINDINGS} more findings.')
    return statements


def _touches(finding: Finding, start: float, end: float) -> bool:
    return not (finding.end < start or finding.start > end)
