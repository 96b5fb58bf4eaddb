"""Signals that another clock stamped: its offset and drift against the main clock, found from what the winch does.

Both clocks see the same changes of motion. Features of either side (slopes of the signals, changes of direction) are
correlated: first over the complete log for the offset, then in pieces of it for the drift.

Everything on the bins of the main clock.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.errors import LogError
from stillhook.logs.findings import Checked
from stillhook.logs.frozen_signals import Watched
from stillhook.logs.resample import Column
from stillhook.logs.streaming import Run
from stillhook.logs.types import Finding, OtherClock

SLOPE = 0.6  # s over which slopes are taken: long against noise, short against moves
COARSE = 3.0  # s: smoothing for the search of the offset, so that a drift of 2000 ppm over 20 minutes does not hide it
PIECES = 12  # of the log, for the drift
SHORTEST_PIECE = 40.0  # s: holds some moves of a staircase ...
LEAST_PIECE, FEW_PIECES = 20.0, 4  # s: ... but a short log is cut into so many, down to some waves
REACH = 2.5  # s to either side of the offset in which a piece is looked for
CLEAR = 0.3  # correlation: below, the two sides do not show the same motion
ALONE = 1.15  # times the match of the next best offset that the best must reach
# s: columns of one file begin together; where the motion repeats, the one offset within this is taken, and reported
STARTED = 5.0
CANDIDATES = 8  # offsets that are tried ...
PEAK = 0.5  # ... if their correlation is at least this share of the best; a staircase repeats itself every two moves
APART = 3.5  # s: offsets nearer than this are one; waves repeat themselves after 4 s and more
FEWEST_PIECES = 3
SCATTER = 0.2  # s: pieces that disagree by more do not follow one drift
ROUNDS = 4  # of fitting the drift and looking again
SOUND_DRIFT = 1e-3  # quartz drifts by 1e-4: a clock with more is named
LARGEST_DRIFT = 1e-2  # beyond this the stamps are in another unit
SCAN_STEP = 0.25  # s: of the features when drifts are tried one by one
SCAN_SLIP = 2.4  # s over the log from one drift tried to the next: half of the shortest wave to either side
SCAN_CLEAR = 0.5  # correlation that a drift found so must have
REVERSING = (
    "omega_m",
    "v_w",
    "u_p",
    "speed",
)  # friction turns round with these: their direction shows in pressures, their slopes do not
DEADBAND = 0.01  # of the largest value: below, a signal has no direction; a wider one sees reversals late
OVERLAP = 0.25  # of the shorter side that must be seen by both


@dataclass(frozen=True)
class Fit:
    """Time of the main clock = offset + (1 + drift) * time of the other, both from their first sample [s]; scatter of
    the pieces [s]."""

    offset: float
    drift: float
    scatter: float
    pieces: int
    match: float = 1.0
    """Correlation of both sides with the drift taken out."""
    also: float | None = None
    """Another offset that fits as well [s]; this one was taken because both clocks began with the file."""

    def to_main(self, t: FloatArray) -> FloatArray:
        return self.offset + (1.0 + self.drift) * t


Side = tuple[FloatArray, Mapping[str, FloatArray]]
"""Times of the bins [s] and the signals on them."""


def align(main: Side, other: Side, where: str) -> Fit:
    """Offset and drift of another clock. Errors: LogError that says why they cannot be found."""
    try:
        return _aligned(main, other, where)
    except LogError as problem:  # perhaps the drift hides the offset: then one of these comes near
        drift = _scanned(main, other)
        if not drift:
            raise
        try:
            near = _aligned(main, ((1.0 + drift) * other[0], other[1]), where)
        except LogError:
            raise problem from None
    return _plausible(replace(near, drift=(1.0 + near.drift) * (1.0 + drift) - 1.0), where)


def _plausible(fit: Fit, where: str) -> Fit:
    if abs(fit.drift) > LARGEST_DRIFT:
        raise LogError(
            f"{where}: it would drift by {1e6 * fit.drift:.0f} ppm, which no clock does. Check the unit of its stamps."
        )
    return fit


def _scanned(main: Side, other: Side) -> float:
    """The drift under which both sides match best overall, 0 where none makes them match clearly."""
    main_features = _features(main, SCAN_STEP)
    best, drift = SCAN_CLEAR, 0.0
    step = SCAN_SLIP / max(SCAN_SLIP, float(other[0][-1] - other[0][0]))
    for k in range(1, int(LARGEST_DRIFT / step) + 2):
        for tried in (k * step, -k * step):
            match = _offsets(main_features, _features(((1.0 + tried) * other[0], other[1]), SCAN_STEP), SCAN_STEP)[0]
            if match > best:
                best, drift = match, tried
    return drift


def _aligned(main: Side, other: Side, where: str) -> Fit:
    step = max(0.05, float(np.median(np.diff(main[0]))), float(np.median(np.diff(other[0]))))
    main_features, other_features = _features(main, step), _features(other, step)
    best, name, other_name, offsets = _offsets(main_features, other_features, step)
    if best < CLEAR:
        raise LogError(
            f"{where}: its offset cannot be found: a correlation of {best:.2f} connects its signals with those of the"
            " main clock. Log a signal with both clocks, or remove `clock`."
        )
    if all(abs(offset) >= STARTED for offset in offsets):
        offsets = [*offsets, 0.0]
    tried = [
        fit
        for offset in offsets
        if (fit := _drift(main_features[name], other_features[other_name], offset, step)) is not None
    ]
    if not tried:
        raise LogError(
            f"{where}: its drift cannot be found: fewer than {FEWEST_PIECES} parts of the log show a change of motion"
            " on both clocks. Give a longer log."
        )
    fit, *others = sorted(tried, key=lambda fit: -fit.match)
    similar = [o for o in tried if ALONE * o.match > fit.match]
    ambiguous = next((o for o in others if abs(o.offset - fit.offset) > APART and o in similar), None)
    started = [o for o in similar if abs(o.offset) < STARTED]
    if ambiguous is not None and len(started) == 1:
        ambiguous = min((o for o in similar if o is not started[0]), key=lambda o: abs(o.offset))
        fit, ambiguous = replace(started[0], also=ambiguous.offset), None
    if ambiguous is not None:
        raise LogError(
            f"{where}: its offset cannot be found: the motion repeats, so that {fit.offset:.4g} s and"
            f" {ambiguous.offset:.4g} s fit equally well. Give a log with moves that differ."
        )
    if fit.scatter > SCATTER:
        raise LogError(
            f"{where}: its drift is not steady: parts of the log disagree by {fit.scatter:.2g} s. The clock was set"
            " during the log; cut it there."
        )
    return _plausible(fit, where)


def _features(side: Side, step: float) -> dict[str, FloatArray]:
    """Slopes of every signal and of its direction, on an even grid of time, of unit size."""
    t, signals = side
    grid = np.arange(t[0], t[-1] + 0.5 * step, step)
    span = max(1, round(0.5 * SLOPE / step))
    out = {}
    for name, values in signals.items():
        good = np.isfinite(values)
        if good.sum() < FEWEST_PIECES:
            continue
        x = np.interp(grid, t[good], values[good])
        ways = [] if name in REVERSING else [("", x)]
        if x.min() < 0.0 < x.max():
            ways.append((" direction", np.where(np.abs(x) > DEADBAND * np.abs(x).max(), np.sign(x), 0.0)))
        for kind, y in ways:
            slope = np.zeros_like(y)
            slope[span:-span] = y[2 * span :] - y[: -2 * span]
            if slope.any():
                out[name + kind] = _of_unit_size(slope)
    return out


def _smooth(x: FloatArray, step: float) -> FloatArray:
    width = max(1, round(COARSE / step))
    return _of_unit_size(np.convolve(x, np.ones(width) / width, mode="same"))


def _of_unit_size(x: FloatArray) -> FloatArray:
    size = float(np.sqrt(np.sum(x**2)))
    return x / size if size > 0.0 else x


def _offsets(
    main_features: Mapping[str, FloatArray], other_features: Mapping[str, FloatArray], step: float
) -> tuple[float, str, str, list[float]]:
    """Best correlation of two smoothed features, which they are, and the offsets at which they fit well [s]."""
    best: tuple[float, str, str, list[float]] = (0.0, "", "", [])
    for name, x in main_features.items():
        for other, y in other_features.items():
            c = np.abs(_correlate(_smooth(x, step), _smooth(y, step)))
            lags = np.arange(len(c)) - (len(y) - 1)
            overlap = np.minimum(len(x), lags + len(y)) - np.maximum(0, lags)
            c = np.where(overlap >= OVERLAP * min(len(x), len(y)), c, 0.0)
            if c.max() > best[0]:
                offsets = [float(lag) * step for lag in lags[_peaks(c, round(APART / step))]]
                best = (float(c.max()), name, other, offsets)
    return best


def _peaks(c: FloatArray, apart: int) -> list[int]:
    """The highest peaks that are apart, best first."""
    remaining = c.copy()
    out: list[int] = []
    while len(out) < CANDIDATES and remaining.max() > PEAK * c.max():
        i = int(np.argmax(remaining))
        out.append(i)
        remaining[max(0, i - apart) : i + apart + 1] = 0.0
    return out


def _correlate(x: FloatArray, y: FloatArray) -> FloatArray:
    """sum x(t + lag) y(t) for every lag from -(len(y) - 1) on."""
    size = 1 << (len(x) + len(y) - 2).bit_length()
    return np.asarray(
        np.fft.irfft(np.fft.rfft(x, size) * np.fft.rfft(y[::-1], size), size)[: len(x) + len(y) - 1], dtype=np.float64
    )


def _drift(x: FloatArray, y: FloatArray, offset: float, step: float) -> Fit | None:
    """Offset and drift from pieces of the log, each shifted to where it fits best."""
    sign = 1.0
    drift, scatter, used = 0.0, 0.0, 0
    seconds = len(y) * step
    length = max(min(SHORTEST_PIECE, max(LEAST_PIECE, seconds / FEW_PIECES)), seconds / PIECES)
    t_x, t_y = np.arange(len(x)) * step, np.arange(len(y)) * step

    def on_main_clock() -> FloatArray:
        return np.asarray(np.interp((t_x - offset) / (1.0 + drift), t_y, y, left=0.0, right=0.0))

    for turn in range(ROUNDS):
        warped = on_main_clock()
        if turn == 0:
            sign = 1.0 if _best_lag(x, _smooth(warped, step), step, sign=0.0)[1] >= 0.0 else -1.0
        points = []
        for begin in np.arange(max(0.0, offset), min(t_x[-1], offset + t_y[-1]), length):
            part = slice(int(begin / step), int((begin + length) / step))
            lag, size = _best_lag(x[part], warped[part], step, sign=sign)
            if size >= CLEAR:
                points.append((begin + 0.5 * length, lag, size))
        if len(points) < FEWEST_PIECES:
            return None
        at, lag, weight = np.array(points).T
        if turn == 0:
            keep = np.abs(lag - np.median(lag)) < REACH
        else:
            keep = np.abs(lag) < max(2.0 * step, 3.0 * float(np.median(np.abs(lag))))
        if keep.sum() < FEWEST_PIECES:
            return None
        slope, zero = np.polyfit(at[keep], lag[keep], 1, w=weight[keep])
        scatter, used = float(np.std(lag[keep] - (zero + slope * at[keep]))), int(keep.sum())
        # main = offset + (1 + drift) tau was off by lag = zero + slope * main
        offset, drift = offset + zero + slope * offset, (1.0 + drift) * (1.0 + slope) - 1.0
    warped = on_main_clock()
    overlap = (t_x > offset) & (t_x < offset + (1.0 + drift) * t_y[-1])
    size = float(np.sqrt(np.sum(x[overlap] ** 2) * np.sum(warped[overlap] ** 2)))
    return Fit(offset, drift, scatter, used, sign * float(np.sum(x[overlap] * warped[overlap])) / size if size else 0.0)


def _best_lag(x: FloatArray, y: FloatArray, step: float, *, sign: float) -> tuple[float, float]:
    """How much later x shows what y shows [s], and the correlation there (sign 0: of either sign)."""
    size = float(np.sqrt(np.sum(x**2) * np.sum(y**2)))
    if size == 0.0:
        return 0.0, 0.0
    c = _correlate(x, y) / size
    middle, reach = len(y) - 1, round(REACH / step)
    low = max(0, middle - reach)
    near = c[low : middle + reach + 1]
    i = int(np.argmax(np.abs(near) if sign == 0.0 else sign * near))
    shift = 0.0
    if 0 < i < len(near) - 1:
        a, b, d = near[i - 1], near[i], near[i + 1]
        curve = a - 2.0 * b + d
        shift = float(np.clip(0.5 * (a - d) / curve, -0.5, 0.5)) if curve else 0.0
    return (low + i + shift - middle) * step, float(near[i] if sign == 0.0 else sign * near[i])


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

    def put(self, column: Column, values: FloatArray, doubtful: BoolArray, runs: tuple[Run, ...]) -> None:
        self.watched[column.signal.name] = Watched(column.signal, values, column.watch, runs)
        self.doubtful[column.signal.name] = doubtful

    def leave_out(self, column: Column) -> None:
        """A signal of which nothing is known on the bins: NaN."""
        self.put(column, np.full(len(self.t), np.nan), np.ones(len(self.t), np.bool_), ())


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
    for column, means, doubtful in zip(main.track.columns, main.bins.means, main.doubtful, strict=True):
        out.put(column, means, doubtful, tuple(column.watch.runs))
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
                if not turn.dated and not leave_out:
                    raise
                if not turn.dated:
                    out.findings.append(_left_out(out, other, names, str(problem)))
                    continue
                out.findings.append(_believed(other, names, str(problem), apart))
        _bring(out, other, fit, main.track.every)
    return out


def _believed(other: Checked, names: list[str], problem: str, apart: float) -> Finding:
    signals, t = ", ".join(names), other.bins.t
    text = (
        f"{signals}: the stamps in {other.track.time_column} are believed, both clocks state the date;"
        f" {problem.split(': ', 2)[-1]}"
    )
    return Finding(signals, "clock-drift", apart, apart + float(t[-1]), len(t), "noted", text)


def _left_out(out: Merged, other: Checked, names: list[str], problem: str) -> Finding:
    for column in other.track.columns:
        out.leave_out(column)
    signals, t = ", ".join(names), out.t
    text = (
        f"{signals}: left out, for the clock {other.track.time_column} cannot be brought onto that of the log:"
        f" {problem.split(': ', 2)[-1]}"
    )
    return Finding(signals, "clock", float(t[0]), float(t[-1]), len(t), "left out", text)


def _clock_finding(other: Checked, fit: Fit, names: list[str]) -> Finding:
    signals, t = ", ".join(names), fit.to_main(other.bins.t)
    direction = "slow" if fit.drift > 0.0 else "fast"
    unsound = ", which no sound clock does," if abs(fit.drift) > SOUND_DRIFT else ""
    text = (
        f"{signals}: the clock {other.track.time_column} runs {abs(1e6 * fit.drift):.0f} ppm {direction}{unsound} and"
        f" its first stamp is at {fit.offset:.3f} s of the main clock (from {fit.pieces} parts of the log, which agree"
        f" within {fit.scatter:.2g} s): brought onto the main clock, well enough for steady windows"
    )
    if fit.also is not None:
        text += (
            f"; the motion repeats, and {fit.also:.4g} s fits as well: the offset next to the start of the file was"
            " taken"
        )
    return Finding(signals, "clock-drift", float(t[0]), float(t[-1]), len(t), "repaired", text)


def _bring(out: Merged, other: Checked, fit: Fit, every: float) -> None:
    """The signals of another track at the bins of the main one, by straight lines between its own; NaN where none is
    near."""
    t, t_main = fit.to_main(other.bins.at), out.at
    for i, column in enumerate(other.track.columns):
        values = other.bins.means[i]
        good = np.isfinite(values)
        if good.sum() < 2:  # no line can be drawn
            out.leave_out(column)
            continue
        stamps = t[good]
        at = np.clip(np.searchsorted(stamps, t_main), 1, len(stamps) - 1)
        nearest_sample = np.minimum(np.abs(t_main - stamps[at - 1]), np.abs(t_main - stamps[at]))
        far = nearest_sample > NEAR * max(every, other.track.spacing)
        far |= (t_main < stamps[0] - every) | (t_main > stamps[-1] + every)
        on_main = np.where(far, np.nan, np.interp(t_main, stamps, values[good]))
        nearest = np.clip(np.searchsorted(t, t_main - 0.5 * other.track.every), 0, len(t) - 1)
        runs = tuple(
            replace(run, start=float(fit.to_main(np.array(run.start))), end=float(fit.to_main(np.array(run.end))))
            for run in column.watch.runs
        )
        out.put(column, on_main, other.doubtful[i][nearest] | far, runs)
    for finding in other.findings:
        start, end = (float(fit.to_main(np.array(x))) for x in (finding.start, finding.end))
        text = finding.text
        if finding.signal == "time":
            text = f"clock {other.track.time_column}: {text.removeprefix('time: ')}"
        out.findings.append(replace(finding, start=start, end=end, text=text))
