"""Signals that are stationary to the last digit while the winch moves."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.errors import LogError
from stillhook.logs.findings import NOT_THE_WINCH, REQUIRED, SET_VALUES, TIP
from stillhook.logs.resample import on_stretches
from stillhook.logs.streaming import Run, Watch
from stillhook.logs.types import Finding, Signal
from stillhook.units import quote

HELD = ("p_b",)
"""Signals that the machine itself may hold: a closed circuit's low side. What friction takes from it is its change
between hoisting and lowering, so a constant one is used, and reported."""
CHANCE = (
    1e-6  # expected number of runs so long, if values repeat as often as in the rest of the log: rarer is no chance
)
MOVES = 0.2  # of the spread of a signal over the complete log: so much change is motion
ABOVE_NOISE = 20.0  # times the step from bin to bin: a spread that is smaller is noise; in white noise it is 5 times
COMMANDED = 0.1  # of the pump command: with more, a winch that is stationary is not at rest
TURNING = 0.05  # of the largest speed: with more, the winch moves
TIP_MOVES = 10.0  # times the step from bin to bin, for a tip that moves: a wave of 4 s has 20, white noise 5
MOTION = ("rotation", "speed")
MOST_LISTED = 20  # findings of one signal that are reported one by one


@dataclass(frozen=True)
class Watched:
    """A signal on the bins of the main clock, and what was watched of its samples."""

    signal: Signal
    values: FloatArray
    watch: Watch
    runs: tuple[Run, ...]
    """Long runs of equal values, in the time of the main clock."""


def standstill(
    file: str,
    t: FloatArray,
    signals: Mapping[str, Watched],
    doubtful: Mapping[str, BoolArray],
    starts: NDArray[np.intp],
) -> list[Finding]:
    """Findings of signals that are stuck; their bins become doubtful. starts: the first bin of every stretch on which
    motion is looked for.

    Whether the winch moves is said by signals of the winch alone: a tip that moves above a winch at rest is no
    evidence. The tip's own signals are compared with each other.
    Errors: LogError where a signal that friction needs never changes although others move.
    """
    findings: list[Finding] = []
    looked = {name: replace(w, values=on_stretches(w.values, starts)) for name, w in signals.items()}
    at, spread = on_stretches(t, starts), {name: _spread(w.values) for name, w in looked.items()}
    for name, w in looked.items():
        others = {
            o: other
            for o, other in looked.items()
            if other is not w and (o in TIP if name in TIP else o not in NOT_THE_WINCH)
        }
        if w.watch.lowest == w.watch.highest:
            findings.append(_constant(file, t, w, others, spread, doubtful[name]))
        elif name not in SET_VALUES:
            stuck = [
                (run, reason)
                for run in w.runs
                if _beyond_chance(w.watch, run) and (reason := _while_moving(at, w, run, others, spread))
            ]
            findings += _stuck_findings(t, w, stuck, doubtful[name])
    return findings


def _spread(values: FloatArray) -> float:
    good = values[np.isfinite(values)]
    return float(np.subtract(*np.percentile(good, (99.0, 1.0)))) if len(good) else 0.0


def _constant(
    file: str,
    t: FloatArray,
    w: Watched,
    others: Mapping[str, Watched],
    spread: Mapping[str, float],
    doubtful: BoolArray,
) -> Finding:
    name, message = w.signal.name, f"{w.signal.name} stays at {w.signal.say(w.watch.highest)} throughout"

    def finding(kind: str, text: str) -> Finding:
        return Finding(name, kind, float(t[0]), float(t[-1]), w.watch.good, "noted", f"{message}{text}")

    if name in SET_VALUES:
        return finding("constant", ", as a set value may")
    moving = [other for other, o in others.items() if o.watch.lowest != o.watch.highest]
    if name in TIP and not any(spread[other] > TIP_MOVES * _noise(others[other].values) for other in moving):
        return finding("constant", ": the tip is at rest, or the signal is dead")
    if name in HELD and moving:
        text = f" while {moving[0]} changes: right for a low side that boost holds, wrong for a dead sensor"
        return finding("constant", text)
    if name in REQUIRED and moving:
        raise LogError(
            f"{file}: {message} while {moving[0]} changes: the sensor was off or stuck, or"
            f" column {quote(w.signal.column)} is another one. Map another column, or leave the signal out."
        )
    doubtful[:] = True
    also = f" while {moving[0]} changes: the sensor was off or stuck" if moving else ", and so does every other signal"
    return finding("stuck", f"{also}; none of it counts")


def _beyond_chance(watch: Watch, run: Run) -> bool:
    """Whether a run of equal values is longer than the repeats in the rest of the signal explain."""
    others = watch.changes - 1
    if others < 1:
        return False
    mean = max(1.0, (watch.good - run.samples) / others)  # samples that a value lasts
    if mean == 1.0:
        return True
    return math.log(others) + (run.samples - 1) * math.log1p(-1.0 / mean) < math.log(CHANCE)


def _while_moving(
    t: FloatArray, w: Watched, run: Run, others: Mapping[str, Watched], spread: Mapping[str, float]
) -> str:
    """What moves while a signal is stationary, "" where nothing says that it should change."""
    part = slice(*(int(i) for i in np.searchsorted(t, (run.start, run.end))))
    if part.stop - part.start < 2:
        return ""
    if w.signal.name in TIP:
        return next((name for name, other in others.items() if _moves(other, part, spread[name], TIP_MOVES)), "")
    turning = next((name for name, other in others.items() if _shows_motion(t, other, part)), "")
    if w.signal.quantity == "length" or (w.signal.quantity in MOTION and run.value == 0.0):
        return turning  # a winch at rest is allowed
    if w.signal.quantity in MOTION:  # pressures may change at a constant speed
        others = {name: other for name, other in others.items() if other.signal.quantity in MOTION or name == "u_p"}
    others = {name: o for name, o in others.items() if spread[name] > 0.0 and o.signal.quantity != "length"}
    others = {name: o for name, o in others.items() if name == "u_p" or name not in SET_VALUES}
    changing = next((name for name, o in others.items() if _moves(o, part, spread[name], ABOVE_NOISE)), "")
    if changing or not run.noisy:
        return changing
    return turning or ("the winch" if w.signal.quantity in MOTION else "")


def _shows_motion(t: FloatArray, other: Watched, part: slice) -> bool:
    values = other.values[part]
    good = np.isfinite(values)
    if good.sum() < 2:
        return False
    if other.signal.quantity in MOTION:
        return bool(np.median(np.abs(values[good])) > TURNING * float(np.nanmax(np.abs(other.values))))
    if other.signal.quantity == "length":
        rates = np.abs(np.diff(other.values) / np.diff(t))
        travel, time = values[good], t[part][good]
        return bool(abs(travel[-1] - travel[0]) / (time[-1] - time[0]) > TURNING * float(np.nanmax(rates)))
    return bool(other.signal.name == "u_p" and np.median(np.abs(values[good])) > COMMANDED)


def _noise(values: FloatArray) -> float:
    steps = np.abs(np.diff(values))
    return float(np.nanmedian(steps)) if np.isfinite(steps).any() else 0.0


def _moves(other: Watched, part: slice, spread: float, above_noise: float) -> bool:
    """Whether a signal, whose spread is so many times its noise, changes by much of it."""
    values = other.values[part]
    if not np.isfinite(values).any():
        return False
    return bool(spread > above_noise * _noise(other.values) and np.nanmax(values) - np.nanmin(values) > MOVES * spread)


def _stuck_findings(t: FloatArray, w: Watched, stuck: list[tuple[Run, str]], doubtful: BoolArray) -> list[Finding]:
    name, findings = w.signal.name, []
    for run, reason in stuck:
        doubtful[(t >= run.start - 1e-9) & (t <= run.end + 1e-9)] = True
        text = (
            f"{name} stays at {w.signal.say(run.value, 6)} to the last digit from {run.start:.6g} s to {run.end:.6g} s"
            f" while {reason} moves: stuck"
        )
        findings.append(Finding(name, "stuck", run.start, run.end, run.samples, "noted", text))
    rest = findings[MOST_LISTED:]
    if rest:
        seconds = sum(finding.end - finding.start for finding in rest)
        count = sum(finding.count for finding in rest)
        text = f"{name} is stuck {len(rest)} more times, {seconds:.4g} s in all, from {rest[0].start:.6g} s on"
        findings[MOST_LISTED:] = [Finding(name, "stuck", rest[0].start, rest[-1].end, count, "noted", text)]
    return findings
