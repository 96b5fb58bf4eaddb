"""Logs of a campaign to records: on an even grid, clocks corrected, cut into load cases; all findings are reported. The
load of a part is as stated, or from the load cell.

A log on an even time grid: values at the time of their samples, linear interpolation in between, gaps remain gaps.

Accuracy: the mean of a bin is placed at the mean time of its samples, so jitter of the stamps moves no edge; a
straight line between two samples h apart is off by at most h^2/8 of the second derivative (tip: 0.01 mm at 10 ms and 1
m/s^2, 1 mm at 0.1 s), an edge of a command is extended to h. A gap is bridged up to `BRIDGED` (5 mm of tip at 1
m/s^2), marked as doubtful and counted as lost; a longer one is NaN.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.base.progress import Meter, Progress
from stillhook.control.registry import MANUAL_MODE
from stillhook.engine.pack.lift import wire_carried
from stillhook.errors import StillhookError, ValidateError
from stillhook.logs.campaign import wire_text
from stillhook.logs.findings import counted
from stillhook.logs.log import read_log
from stillhook.logs.types import Log
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode
from stillhook.units import number
from stillhook.validate.criteria.results import Note
from stillhook.validate.data_set.campaign import Campaign, CraneTest, Kind, standard_modes
from stillhook.validate.data_set.record import (
    LEAST,
    Record,
    Segment,
    filled,
    seams,
    segment,
    split,
    stretches_of,
)
from stillhook.validate.data_set.signals import check_units, completed, refined
from stillhook.variables import PHYSICAL

BLOCK = 1.0
"""Length of the blocks for medians [s]."""
SPAN = 20.0
"""Least duration of a constant load [s]: two waves, over which the forces of heave compensation average out."""
STEP = 0.05
"""Change of the load cell's level that counts as another load [part of the weight of SWL and hook]: waves leave 1 to 2
%."""
APART = 0.1
"""Difference between stated load and load cell that is reported [part of the stated weight]; step 1 examines it in
detail."""


LEAST_HOOK = 0.5
"""Least part of the hook's weight on the wire, regardless of what is submerged."""


@dataclass(frozen=True)
class LoadSegment:
    """Samples [first, last) with one load; F: level of the load cell in them [N], NaN without one."""

    first: int
    last: int
    F: float


def load_segments(F: FloatArray | None, n: int, step: float, crane: Crane) -> list[LoadSegment]:
    """Parts of n samples, `step` [s] apart, with constant load by the load cell F (n,) [N], or None."""
    if F is None or not np.isfinite(F).any():
        return [LoadSegment(0, n, np.nan)]
    size = max(1, round(BLOCK / step))
    blocks = np.array([_median(F[a : a + size]) for a in range(0, n, size)])
    limit, least = STEP * (crane.SWL + crane.hook_mass) * G, max(1, round(SPAN / BLOCK))
    level = np.array([_median(blocks[max(0, i - least // 2) : i + least // 2 + 1]) for i in range(len(blocks))])
    plateaus = _plateaus(level, limit, least)
    out = [LoadSegment(a * size, min(n, b * size), _median(blocks[a:b])) for a, b in plateaus]
    return out or [LoadSegment(0, n, _median(F))]


def _plateaus(level: FloatArray, limit: float, least: int) -> list[tuple[int, int]]:
    """Runs in which the level stays within the limit of its median for the least duration; shorter ones are changes."""
    out: list[tuple[int, int]] = []
    a = 0
    while a < len(level):
        b = a + 1
        while b < len(level) and not abs(level[b] - _median(level[a:b])) > limit:
            b += 1
        # a slow change follows its own median for a while
        steady = np.flatnonzero(np.abs(level[a:b] - _median(level[a:b])) <= limit)
        first, last = a + int(steady[0]), a + int(steady[-1]) + 1
        if last - first >= least or (not out and b == len(level)):
            out.append((first, last))
        a = b
    if len(out) == 1 and out[0][1] - out[0][0] > len(level) - least:  # a remainder at an end is no other load
        return [(0, len(level))]
    return out


def with_wire(test: CraneTest, crane: Crane, signals: Mapping[str, FloatArray], part: slice) -> tuple[CraneTest, str]:
    """The test with the load of a part (payload and weight of the wire out) and a statement; unchanged where the file
    states no payload. Errors: ValidateError where the winch would carry more than the SWL."""
    if test.hook is None or test.payload is None:
        return test, ""
    s_w = signals["s_w"] if "s_w" in signals else np.zeros(0)
    if np.isfinite(s_w).any():
        h_tip = test.hook.tip_height(float(s_w[np.isfinite(s_w)][0]))
        out = _median(s_w[part]) if np.isfinite(s_w[part]).any() else _median(s_w)
    elif test.s_w is not None:
        h_tip, out = test.hook.tip_height(test.s_w), test.s_w
    else:
        out, h_tip = test.hook.wire_out(), float(test.hook.h_tip or 0.0)
    load = test.payload + wire_carried(crane, out, h_tip)
    of = {"test": test.name, "payload": test.payload, "wire": wire_text(crane, out, h_tip), "load": load}
    if load > crane.SWL:
        raise ValidateError(Note("payload-over-swl", crane=crane.name, SWL=crane.SWL, **of))
    return replace(test, load=load), Note("payload-and-wire", **of)


def load_of(part: LoadSegment, all_of: list[LoadSegment], test: CraneTest, crane: Crane) -> tuple[float, str]:
    """Payload of a segment [kg] and a statement, "" where it is as stated. Errors: ValidateError where unknown."""
    buoyancy = test.water.rho * test.water.volume if test.water is not None else 0.0
    shown = (part.F / G + buoyancy) - crane.hook_mass
    of = {"test": test.name, "F": part.F}
    if test.load is not None:
        weight = (test.load + crane.hook_mass - buoyancy) * G
        if len(all_of) == 1 or part is min(all_of, key=lambda s: abs(s.F - weight)):
            apart = np.isfinite(part.F) and abs(part.F - weight) > APART * weight
            return test.load, Note("cell-apart", weight=weight, **of) if apart else ""
    if not np.isfinite(part.F):
        raise ValidateError(Note("load-missing", test=test.name))
    if part.F < LEAST_HOOK * crane.hook_mass * G or shown > crane.SWL * (1.0 + STEP):
        raise ValidateError(Note("cell-implausible", crane=crane.name, hook=crane.hook_mass, SWL=crane.SWL, **of))
    load = max(0.0, shown)
    return load, Note("load-by-cell" if test.load is None else "other-load-by-cell", test=test.name, load=load)


def _median(x: FloatArray) -> float:
    good = x[np.isfinite(x)]
    return float(np.median(good)) if len(good) else np.nan


def standing(parts: list[LoadSegment], n: int) -> NDArray[np.bool_]:
    """(n,) samples with constant load."""
    out = np.zeros(n, np.bool_)
    for part in parts:
        out[part.first : part.last] = True
    return out


BRIDGED = 0.2
"""Longest gap bridged by linear interpolation [s], if it is longer than HOLE spacings of the log as well."""
HOLE = 2.5
"""Spacings of the log: a larger distance between samples is a loss, not jitter of the stamps."""
CYCLES = 0.1
"""Relative tolerance of the mean spacing against an integer number of PLC cycles."""
SPIKES = {"s_tip": 0.03, "v_tip": 0.3, "s_w": 0.03, "e_c_measured": 0.03}
"""Smallest spike by signal [SI]. Neither tip nor wire moves and returns within two samples; pressures and speeds of the
winch may."""
BEYOND = 12.0
"""Times the median distance from the median of five samples: noise reaches 6."""
FASTEST = 3.0
"""Acceleration that neither tip nor wire exceeds [m/s^2]: curvature below it within five samples is not a spike."""
LONGEST = 3_000_000
"""Samples of a test on the grid, 8 h at 10 ms: more do not fit into the memory of a small computer."""
HELD = ("mode",)
"""Signals that jump: the value before holds until the next sample."""


@dataclass(frozen=True)
class Grid:
    """Signals (n,) at t [s], even by step [s], NaN where not known; doubtful (n,) by signal; zero: time of t = 0 in the
    log [s]; lost: share of the expected samples that are missing; longest_hole [s]."""

    t: FloatArray
    step: float
    signals: Mapping[str, FloatArray]
    doubtful: Mapping[str, BoolArray]
    zero: float
    lost: float
    longest_hole: float
    spikes: Mapping[str, int]
    """Samples left out as spikes, because no mass moves and returns that fast, by signal."""


def even(log: Log, test: CraneTest, t_cycle: float) -> Grid:
    """The part of a log that counts, every PLC cycle t_cycle [s], or every few of them where the log is slower. Errors:
    ValidateError where there are no samples, or more than LONGEST."""
    at = log.t if log.at is None else log.at
    use = np.flatnonzero((at >= test.start) & (at <= test.end))
    if len(use) < 2:
        bounds = [f"{k} = {number(x)} s" for k, x in (("start", test.start), ("end", test.end)) if np.isfinite(x)]
        raise ValidateError(Note("no-samples", test=test.name, bounds=bounds, log=log.source, seconds=log.duration))
    t, spacing = at[use], 1.0 / log.rate
    step = t_cycle * max(1, round(spacing / t_cycle))
    if (t[-1] - t[0]) / step > LONGEST:
        of = {"log": log.source, "n": len(use), "seconds": t[-1] - t[0], "most": LONGEST * step}
        raise ValidateError(Note("too-long", test=test.name, **of))
    longest = max(BRIDGED, HOLE * max(spacing, log.every))
    grid = t[0] + step * np.arange(int(np.floor((t[-1] - t[0]) / step + 1e-6)) + 1)
    signals, doubtful, spikes = {}, {}, {}
    for name, values in log.signals.items():
        usable = np.isfinite(values[use]) & ~_stuck(log, name)[use]
        spike = _spikes(values[use], log.every, name)
        if spike.any():
            usable &= ~spike
            spikes[name] = int(spike.sum())
        signals[name], bridged = _filled(
            grid, t[usable], values[use][usable], longest, HOLE * max(spacing, log.every), name in HELD
        )
        nearest = np.clip(np.searchsorted(t, grid - 0.5 * step), 0, len(t) - 1)
        doubtful[name] = log.doubtful[name][use][nearest] | bridged | np.isnan(signals[name])
    present = len(use) if log.number is None else int(log.number[use].sum())
    lost = _lost(np.diff(t), present, spacing, t_cycle)
    return Grid(grid - grid[0], step, signals, doubtful, float(t[0]), lost, float(np.diff(t).max()), spikes)


def _lost(apart: FloatArray, present: int, spacing: float, t_cycle: float) -> float:
    """Share of missing samples. A log that records every few PLC cycles on average does so by design, however
    uneven."""
    holes = apart > HOLE * spacing
    mean = float(apart[~holes].sum()) / max(1, present - 1 - int(holes.sum()))
    cycles = t_cycle * max(1, round(mean / t_cycle))
    due = cycles if abs(mean - cycles) < CYCLES * mean else spacing
    return max(0.0, 1.0 - (present - 1) * due / float(apart.sum()))


def _stuck(log: Log, name: str) -> BoolArray:
    """Bins in which a signal is constant while others of its kind move."""
    stuck = np.zeros(len(log.t), np.bool_)
    for finding in log.findings:
        if finding.kind == "stuck" and finding.signal == name:
            stuck |= (log.t >= finding.start - 1e-9) & (log.t <= finding.end + 1e-9)
    return stuck & log.doubtful[name]


def _spikes(x: FloatArray, every: float, name: str) -> BoolArray:
    """One or two samples far from their neighbours."""
    if name not in SPIKES or len(x) < 5:
        return np.zeros(len(x), np.bool_)
    finite = np.isfinite(x)
    line = filled(x)
    distance = np.abs(line - scipy.ndimage.median_filter(line, 5, mode="nearest"))
    bent = FASTEST * (2.0 * every) ** 2 if PHYSICAL[name].kind == "length" else FASTEST * 2.0 * every
    return np.asarray(finite & (distance > max(SPIKES[name] + bent, BEYOND * float(np.median(distance)))), np.bool_)


def _filled(
    grid: FloatArray, t: FloatArray, values: FloatArray, longest: float, usual: float, stepwise: bool
) -> tuple[FloatArray, BoolArray]:
    """Values on the grid, NaN in gaps that are too long, and where a gap was bridged."""
    if len(t) < 2:
        return np.full(len(grid), np.nan), np.zeros(len(grid), np.bool_)
    after = np.clip(np.searchsorted(t, grid, side="right"), 1, len(t) - 1)
    apart = t[after] - t[after - 1]
    outside = (grid < t[0] - usual) | (grid > t[-1] + usual)
    hole = outside | ((apart > longest) & (grid > t[after - 1] + 1e-9) & (grid < t[after] - 1e-9))
    line = values[np.where(grid >= t[after], after, after - 1)] if stepwise else np.interp(grid, t, values)
    return np.where(hole, np.nan, line), (apart > usual) & ~hole & (grid > t[after - 1]) & (grid < t[after])


QUIET = ("constant",)
"""Kinds of findings that are not reported: a constant set value."""
MOST_FINDINGS = 12
"""Findings of a log that are reported individually."""

READING = 0.3
"""Part of a log's time that goes into reading it; the rest into checking it. Both follow the size of its file."""


def read_records(campaign: Campaign, progress: Progress) -> tuple[Record, ...]:
    """Every test of a campaign, read. Errors: StillhookError of one line that names the test, for a log that cannot be
    read, is inconsistent or lacks signals that its kind of test needs."""
    sizes = [max(test.log.stat().st_size, 1) if test.log.is_file() else 1 for test in campaign.tests]
    meter = Meter(float(sum(sizes)), progress)
    logs: dict[tuple[Path, int], Log] = {}
    records = []
    for test, size in zip(campaign.tests, sizes, strict=True):
        reached, checked = meter.part(READING * size), meter.part((1.0 - READING) * size)
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
        checked(1.0)
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
    if test.kind is Kind.AHC and "s_w" not in derived:
        check_units(test, grid.t, signals, segments, grid.step)
    statements = [*of_clocks, *of_wire, *of_parts, *_quality(test, log, grid)]
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
        statements.append(Note("seam", test=test.name, t=grid.zero + grid.t[i], jump=jump))
    levels = load_segments(signals.get("F_w"), n, grid.step, campaign.crane)
    good = _complete_samples(test, signals, n) & np.isfinite(mode) & standing(levels, n)
    if test.kind is Kind.AHC:
        good &= mode != float(list(Mode).index(MANUAL_MODE))
    edges = [*(i for i, _ in cut), *(np.flatnonzero(np.diff(mode) != 0.0) + 1), *(s.first for s in levels)]
    segments = []
    for a, b in split(stretches_of(good), edges):
        if (b - 1 - a) * grid.step < LEAST[test.kind]:
            continue
        level = next(s for s in levels if s.first <= a < s.last)
        part_test, of_wire = with_wire(test, campaign.crane, signals, slice(a, b))
        load, load_text = load_of(level, levels, part_test, campaign.crane)
        statements += [text for text in (of_wire, load_text) if text]
        window = campaign.criteria.settings["window"]
        mode_of_part = list(Mode)[int(mode[a])]
        segments.append(segment(test, slice(a, b), mode_of_part, load, grid.t, grid.step, signals, window))
    return tuple(segments), [
        *_used(test, grid, mode, segments),
        *statements,
    ]


def _mode(test: CraneTest, signals: Mapping[str, FloatArray], n: int) -> FloatArray:
    """Mode by number (n,). Errors: ValidateError where neither log nor campaign file states it."""
    if "mode" in signals and np.isfinite(signals["mode"]).any():
        _check_mode(test, signals["mode"])
        return signals["mode"]
    if test.mode is None and test.kind is Kind.AHC:
        raise ValidateError(Note("mode-missing", test=test.name, modes=[m for m in Mode if m.compensates]))
    return np.full(n, float(list(Mode).index(test.mode or MANUAL_MODE)))


def _check_mode(test: CraneTest, mode: FloatArray) -> None:
    """Errors: ValidateError where the log never is in the mode that the campaign file states."""
    logged = [list(Mode)[int(k)] for k in np.unique(mode[np.isfinite(mode)])]
    if test.mode is not None and test.mode not in logged:
        raise ValidateError(Note("mode-not-logged", test=test.name, mode=test.mode, logged=logged))


def _complete_samples(test: CraneTest, signals: Mapping[str, FloatArray], n: int) -> BoolArray:
    """Samples with all signals that a test of this kind needs."""
    if test.kind is Kind.AHC:
        return np.isfinite(signals["s_tip"]) & np.isfinite(signals["s_w"])
    moves = [name for name in ("v_w", "omega_m", "s_w") if name in signals]
    return np.logical_or.reduce([np.isfinite(signals[name]) for name in moves]) if moves else np.zeros(n, np.bool_)


def _used(test: CraneTest, grid: Grid, mode: FloatArray, segments: list[Segment]) -> list[Note]:
    """Used part of a test, where it is not all of it."""
    duration, ahc = float(grid.t[-1] - grid.t[0]), test.kind is Kind.AHC
    used = sum(s.duration for s in segments)
    if not segments:
        manual = ahc and not (mode > 0.0).any()
        return [Note("none-used-manual" if manual else "none-used", test=test.name, least=LEAST[test.kind])]
    if duration - used < 1.0:
        return []
    of = {"n": len(segments), "start": grid.zero + segments[0].start}
    parts = Note("in-parts" if len(segments) > 1 else "from-on", **of)
    uncompensated = float(np.sum(mode == 0.0)) * grid.step if ahc else 0.0
    out = [Note("used", test=test.name, used=used, duration=duration, parts=parts)]
    return [*out, Note("not-compensated", test=test.name, seconds=uncompensated)] if uncompensated > 0.0 else out


def _quality(test: CraneTest, log: Log, grid: Grid) -> list[Note]:
    """Quality of the samples of the used part."""
    end = grid.zero + float(grid.t[-1])
    findings = [f for f in log.findings if f.kind not in QUIET and f.end >= grid.zero and f.start <= end]
    spikes = [f"{counted(n, 'sample')} of {name}" for name, n in grid.spikes.items()]
    statements = [Note("spikes", test=test.name, samples=spikes)] if spikes else []
    of = {"test": test.name, "log": log.source}
    statements += [Note("finding", text=f.text, action=f.action, **of) for f in findings[:MOST_FINDINGS]]
    more = len(findings) - MOST_FINDINGS
    return [*statements, Note("more-findings", n=more, **of)] if more > 0 else statements
