"""What is wrong with the samples of a log, reported as findings: gaps, missing and impossible values, time that runs
backwards.

What a signal of a winch can be at all: beyond, its unit or its sensor is wrong.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import BoolArray
from stillhook.errors import LogError
from stillhook.logs.resample import Binned, Column, Track, on_stretches
from stillhook.logs.streaming import Rail
from stillhook.logs.types import Action, Finding, Signal
from stillhook.units import quote

REV_PER_MIN = 2.0 * math.pi / 60.0  # rad/s
CM3_PER_REV = 1e-6 / (2.0 * math.pi)  # m^3/rad
BAR = 1e5  # Pa

BY_KIND: Mapping[str, float] = MappingProxyType(
    {
        "pressure": 1000.0 * BAR,  # hydraulics of winches stay below 450 bar, test benches below 1000
        "rotation": 10000.0 * REV_PER_MIN,  # no axial piston motor of a winch turns at half of that
        "displacement": 20000.0 * CM3_PER_REV,  # all motors of the largest winch: 21 x 215 cm^3/rev
        "speed": 20.0,  # m/s; the fastest wire runs at 5
        "length": 12000.0,  # m; deeper than the sea
        "force": 1e8,  # N; 10 000 t
        "torque": 1e9,  # N m; drum of the largest winch: 1e7
        "temperature": 473.15,  # K; 200 degC
    }
)
"""Largest magnitude by kind [SI]."""

LEAST: Mapping[str, float] = MappingProxyType(
    {
        "p_a": 2.0 * BAR,  # the boost alone is 15 to 25 bar
        "p_hp": 2.0 * BAR,
        "D_m": 1.0 * CM3_PER_REV,  # a tenth of the smallest motor of a winch
    }
)
"""What the largest sample of a complete log must reach [SI]: below, the unit is another."""

FRACTIONS = ("u_p", "u_m", "u_ff", "u_raw", "alpha_p", "alpha_m", "alpha_pp", "alpha_pm", "f_pump")
LARGEST_FRACTION = 1.5  # commands and displacements over their maximum; percent read as plain numbers is caught here
SET_VALUES = (
    "u_p",
    "u_m",
    "u_ff",
    "u_raw",
    "D_m",
    "alpha_p",
    "alpha_m",
    "alpha_pp",
    "alpha_pm",
    "f_pump",
    "layer",
    "mode",
    "v_op",
    "e_c",
    "e_c_measured",
)
"""Signals that the control sets or computes: they may be constant to the last digit by design, as the error does while
the winch does not compensate."""
TIP = ("s_tip", "v_tip", "a_tip")
"""Signals of the crane's tip."""
NOT_THE_WINCH = (*TIP, "v_op", "mode", "layer", "e_c", "e_c_measured", "s_load", "v_load")
"""Signals that may change while the winch rests."""
REQUIRED = ("p_a", "p_b", "dp_m", "omega_m", "speed", "effort")
"""Signals without which a log states nothing of friction: one that never changes is refused."""


def limit_of(signal: Signal) -> float:
    """Largest magnitude that a sample of the signal can have [SI], infinite where nothing is known."""
    if signal.name in FRACTIONS:
        return LARGEST_FRACTION
    return BY_KIND.get(signal.quantity, math.inf)


MOST_MISSING = 0.5  # of the samples of a bin: with more of them missing its mean is not to be trusted
MOST_IMPOSSIBLE = 0.01  # of the samples: more that cannot be are no spikes but another unit
RAIL_HITS, RAIL_BINS = 20, 5  # samples and bins at an extreme, in addition to others: fewer are chance
RAIL_LEVELS = 6  # other values around an extreme: with fewer the signal is coarse, and its extreme a value like others
RAIL_SHARE = 3.0  # times the commonest other value: noise that is cut off piles up at the rail
SLOWER = 0.5  # of the cells: with more of them empty, at even distances, the signal is a slower one
FEWEST_SLOW = 10  # values of a slower signal
IRREGULAR = 0.05  # of the distances between its values may be longer
RATE = 0.2  # by which the mean and the median number of samples per second may differ
MOST_LISTED = 20  # findings of one kind that are reported one by one


@dataclass
class Checked:
    """A track after its checks: its bins, doubtful ones by column, findings."""

    track: Track
    bins: Binned
    doubtful: list[BoolArray]
    findings: list[Finding] = field(default_factory=list)

    def note(
        self, signal: str, kind: str, start: float, end: float, count: int, text: str, action: Action = "noted"
    ) -> None:
        """One more finding, see `Finding`; its text begins with the signal."""
        self.findings.append(Finding(signal, kind, start, end, count, action, f"{signal}: {text}"))


def checked(track: Track) -> Checked:
    """The bins of a track with everything that is wrong with them. Errors: LogError for signals that cannot be trusted
    at all."""
    bins = track.finish()
    for i, column in enumerate(track.columns):
        watch = column.watch
        watch.finish()
        t, means = on_stretches(bins.t, bins.starts), on_stretches(bins.means[i], bins.starts)
        may_rest = column.signal.name in SET_VALUES or watch.lowest == watch.highest
        watch.runs = [] if may_rest else [replace(run, noisy=watch.noisy_at(run, t, means)) for run in watch.runs]
        watch.spans.clear()
    out = Checked(track, bins, [np.zeros(len(bins.t), np.bool_) for _ in track.columns])
    _time(out)
    for i, column in enumerate(track.columns):
        _impossible(out, column)
        _missing(out, i, column)
        _too_small(out, column)
        _saturated(out, i, column)
    return out


def counted(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def _time(out: Checked) -> None:
    track = out.track
    untimed, back = track.untimed, track.backwards
    if untimed.number:
        text = f"{counted(untimed.number, track.row)} without a readable time left out, the first is"
        out.note("time", "missing", np.nan, np.nan, untimed.number, f"{text} {track.row} {untimed.line}", "left out")
    if back.number:
        text = (
            f"{counted(back.number, 'sample')} whose time repeats or runs back (by up to {back.largest:.3g} s) left"
            f" out, the first is {track.row} {back.line}"
        )
        out.note("time", "time-backwards", back.start, back.end, back.number, text, "left out")
    _uneven(out)
    for start, end in track.gaps[:MOST_LISTED]:
        out.note("time", "gap", start, end, 1, f"no samples for {end - start:.4g} s from {start:.6g} s on")
    rest = track.gaps[MOST_LISTED:]
    if rest:
        longest = max(end - start for start, end in rest)
        text = f"{len(rest)} more gaps, the longest {longest:.4g} s, from {rest[0][0]:.6g} s on"
        out.note("time", "gap", rest[0][0], rest[-1][1], len(rest), text)


def _uneven(out: Checked) -> None:
    track = out.track
    if len(out.bins.t) < 2:
        return
    covered = float(out.bins.t[-1] - out.bins.t[0]) - sum(end - start for start, end in track.gaps)
    if covered <= 0.0 or track.spacing <= 0.0:
        return
    mean = track.samples / max(covered, track.spacing)
    if abs(mean * track.spacing - 1.0) > RATE and covered > FEWEST_SLOW * track.every:
        text = f"{mean:.4g} samples per second on average, and {1.0 / track.spacing:.4g} at the start"
        out.note("time", "uneven", 0.0, float(out.bins.t[-1]), track.samples, f"{text}: the spacing is uneven")


def _impossible(out: Checked, column: Column) -> None:
    watch, signal, track = column.watch, column.signal, out.track
    if not watch.beyond:
        return
    message = f"{signal.name} = {signal.say(watch.beyond_value)} is beyond {signal.say(watch.limit)}"
    if watch.beyond > MOST_IMPOSSIBLE * max(1, watch.good + watch.beyond):
        raise LogError(
            f"{track.file}: {track.row} {watch.beyond_line}: {message} ({watch.beyond} such samples of"
            f" {watch.good + watch.beyond}). {_check_unit(column)}"
        )
    text = f"{message} in {track.row} {watch.beyond_line}: {counted(watch.beyond, 'such sample')} left out"
    at = watch.beyond_at
    out.findings.append(Finding(signal.name, "impossible", at, at, watch.beyond, "left out", text))


def _check_unit(column: Column) -> str:
    unit, heading = quote(column.unit), quote(column.signal.column)
    return f"Check the unit {unit} of column {heading} in the mapping, or its scale."


def _missing(out: Checked, i: int, column: Column) -> None:
    signal, track, missing = column.signal, out.track, out.bins.missing[i]
    number = int(missing.sum()) - column.watch.beyond
    texts = ", ".join(quote(text) if text else "empty cells" for text in column.texts)
    if not column.watch.good:
        raise LogError(
            f"{track.file}: {signal.name}: column {quote(signal.column)} holds no number that can be read"
            f" ({texts or 'all cells empty'}). Map another column or leave the signal out."
        )
    per_bin = max(1.0, track.every / track.spacing) if track.spacing > 0.0 else 1.0
    if not any(column.texts) and number > SLOWER * track.samples and _slower(out, i):
        return
    out.doubtful[i] |= missing > MOST_MISSING * per_bin  # the mean of the others is good
    if number <= 0:
        return
    t = out.bins.t[missing > 0]
    text = f"{counted(number, 'sample')} missing ({texts or 'empty cells'}), first near {t[0]:.6g} s"
    out.note(signal.name, "missing", float(t[0]), float(t[-1]), number, text, "left out")


def _slower(out: Checked, i: int) -> bool:
    """Whether a column with many empty cells is that of a slower signal, one value in so many rows; then the bins
    between are filled."""
    means, t, column = out.bins.means[i], out.bins.t, out.track.columns[i]
    good = np.flatnonzero(np.isfinite(means))
    if len(good) < FEWEST_SLOW:
        return False
    apart = np.diff(t[good])
    usual = float(np.median(apart))
    if np.count_nonzero(apart > 1.5 * usual) > IRREGULAR * len(apart):
        return False
    bins = np.arange(len(t))
    after = np.clip(np.searchsorted(good, bins), 1, len(good) - 1)
    near = (t[good[after]] - t[good[after - 1]] <= 2.5 * usual) & (bins >= good[0]) & (bins <= good[-1])
    filled = np.where(near, np.interp(t, t[good], means[good]), np.nan)
    out.bins.means[i] = np.where(np.isfinite(means), means, filled)
    out.doubtful[i] |= np.isnan(out.bins.means[i])
    count = column.watch.good
    every = out.track.samples / max(1, count)
    text = f"one value in {every:.3g} {out.track.row}s, the other cells are empty: read as a slower signal"
    out.note(column.signal.name, "slower", float(t[0]), float(t[-1]), count, text)
    return True


def _saturated(out: Checked, i: int, column: Column) -> None:
    """Samples at the ends of the sensor's range, and extremes at which a noisy signal is cut off."""
    watch, signal = column.watch, column.signal
    if watch.at_ends:
        assert signal.lo is not None
        assert signal.hi is not None
        ends = f"an end of its range ({signal.say(signal.lo)} to {signal.say(signal.hi)})"
        text = f"{watch.at_ends_samples} samples are at {ends}"
        _mark_saturated(out, i, watch.at_ends, watch.at_ends_samples, text)
    if signal.name in SET_VALUES or not watch.noisy:
        return
    for rail, extreme in ((watch.top, "largest"), (watch.bottom, "smallest")):
        inside = signal.lo is None or signal.hi is None or signal.lo < rail.value < signal.hi
        if inside and _is_rail(rail) and not (rail.value == 0.0 and signal.quantity in ("rotation", "speed")):
            at = f"its {extreme} value {signal.say(rail.value)}"
            text = f"{rail.hits} samples or more are exactly at {at}, which a noisy signal does not"
            _mark_saturated(out, i, rail.bins, rail.hits, text)


def _is_rail(rail: Rail) -> bool:
    others = [count for level, count in rail.levels.items() if level != rail.value]
    return (
        rail.hits >= RAIL_HITS
        and rail.mixed >= RAIL_BINS
        and len(others) >= RAIL_LEVELS
        and rail.hits >= RAIL_SHARE * max(others)
    )


def _mark_saturated(out: Checked, i: int, parts: list[NDArray[np.int64]], samples: int, text: str) -> None:
    """The bins of these stretches are doubtful."""
    at = np.isin(out.bins.wide, np.unique(np.concatenate(parts)))
    out.doubtful[i] |= at
    t = out.bins.t[at]
    text += f", from {t[0]:.6g} s on, in {int(at.sum())} bins: the sensor or its converter is saturated"
    out.note(out.track.columns[i].signal.name, "saturated", float(t[0]), float(t[-1]), samples, text)


def _too_small(out: Checked, column: Column) -> None:
    """LogError for a signal that stays far below what it must reach: its unit is another."""
    watch, signal = column.watch, column.signal
    least = LEAST.get(signal.name)
    largest = max(abs(watch.lowest), abs(watch.highest))
    if least is not None and watch.good and largest < least:
        raise LogError(
            f"{out.track.file}: {signal.name} never exceeds {signal.say(largest)}, where {signal.say(least)} is the"
            f" smallest plausible value. {_check_unit(column)}"
        )
