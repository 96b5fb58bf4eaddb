"""What every reader of ship motion does alike: open the file, choose a piece, refuse what cannot be true, report."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Literal

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.gateway.access import first_bytes, refuse_foreign
from stillhook.errors import MotionError
from stillhook.sea.motion.recorded import FEWEST_POINTS
from stillhook.sea.vessel.ship_motion import ReadReport, ShipMotion
from stillhook.units import parse, quote

HeaveSign = Literal["up", "down"]

LARGEST_HEAVE = 20.0  # m: no ship heaves more; mm or cm meant as m are caught here
FASTEST = 10.0  # m/s: no ship heaves so fast; a step that says so, and is larger than JUMP, is a spike
JUMP = 0.2  # m: twenty times the resolution of a Seapath, so that rounding between close samples is no spike
LARGEST_ANGLE = 45.0  # deg: no ship under a crane rolls more; deg meant as rad are caught here
GAP = 1.5  # median intervals: a longer one is a gap
DEFAULT_MAX_GAP = "5 s"
COARSE = 1.0 + 1e-2  # s: with slower sampling, waves of 5 s come out worse than `Recorded` promises
JITTERY = 0.1  # medians: above, the jitter of the times shows as acceleration
SLACK = 0.1  # medians: jitter that does not count when a gap is held against its limit
HARDLY = 0.01  # m: a standard deviation of heave below this is a harbour, or another unit
HARDLY_TURNS = 0.05  # deg: a standard deviation of an angle below this in a seaway is perhaps in another unit
MOST_REPEAT = 0.5  # share of samples that repeat the time of the one before: from it on times are full seconds
STANDSTILL = 10.0  # s: a heave that keeps its last digit so long was not measured in a seaway
_HEAD = 65536  # bytes looked at to distinguish one kind of file from another
_CONTROL = bytes((*range(9), *range(14, 32)))  # more than one in a hundred of these is not a text file


@dataclass(frozen=True)
class RawLog:
    """Columns as a reader found them, heave with the sign of the file; times strictly increasing [s]; angles [rad]."""

    source: str
    form: str
    time: str
    t: FloatArray
    heave: FloatArray
    roll: FloatArray | None
    pitch: FloatArray | None
    line_of: Callable[[int], int]
    """Line number in the file of sample i."""
    counts: Mapping[str, int]
    left_out: Mapping[str, int] = field(default_factory=dict)
    """Samples that the reader could not use, by the reason."""
    cautions: tuple[str, ...] = ()
    column: str = "heave"
    """What the file calls the height: heave, or tip."""


def head_of(path: str | os.PathLike[str]) -> tuple[Path, bytes]:
    """The path and the first bytes of a text file; MotionError in one line for everything else."""
    file, head = first_bytes(path, _HEAD, "log file", MotionError)
    refuse_foreign(file.name, head, MotionError, "Give the log as plain text (unpack it or save it as CSV).")
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise MotionError(f"{file.name}: is UTF-16 text. Save it as CSV UTF-8.")
    if not head.strip(b"\xef\xbb\xbf \t\r\n"):
        raise MotionError(f"{file.name}: is empty. Give a CSV or a log of $PSXN,23 lines.")
    if b"$PSXN," not in head and len(head) - len(head.translate(None, _CONTROL)) > len(head) // 100:
        raise MotionError(f"{file.name}: is binary, not text. Give a CSV or a log of $PSXN,23 lines.")
    return file, head


def sign_of(heave: str, place: str) -> HeaveSign:
    """The option heave, checked."""
    match heave:
        case "up" | "down":
            return heave
    raise MotionError(f'{place}: heave = {quote(heave)} is not one of "up", "down" (which way the file counts heave).')


def evened(t: FloatArray) -> tuple[FloatArray, tuple[str, ...]]:
    """Times (n,) of samples, and what to say of them. Those that are stamped in full seconds, several in each, are
    spread evenly within their seconds, those of the first at its end; others, with fractions or few that repeat, stay
    as they are."""
    if len(t) < FEWEST_POINTS or (t != np.round(t)).any() or np.mean(np.diff(t) == 0.0) < MOST_REPEAT:
        return t, ()
    starts = np.flatnonzero(np.concatenate(([True], np.diff(t) != 0.0)))
    counts = np.diff(np.append(starts, len(t)))
    usual = float(np.median(counts[1:-1])) if len(counts) > 2 else float(counts.max())
    place = np.arange(len(t)) - np.repeat(starts, counts)
    of = np.repeat(np.maximum(counts, usual), counts)
    first = np.where(np.repeat(np.arange(len(counts)) == 0, counts), of - np.repeat(counts, counts), 0.0)
    n = float(np.median(np.unique(t, return_counts=True)[1]))
    caution = f"times are full seconds with {n:g} samples in each: spread evenly within their seconds"
    return np.asarray(t + (place + first) / of), (caution,)


def finish(raw: RawLog, *, heave: HeaveSign, max_gap: str, start: str | None, duration: str | None) -> ShipMotion:
    """The chosen piece of a log as ship motion, heave up, with its report; MotionError for what no ship does."""
    piece = _piece(raw, start, duration)
    limit = parse(max_gap, "time", f"{raw.source}: max_gap")
    t, report = _report(raw, piece, heave, limit)
    z = raw.heave[piece]
    roll, pitch = (None if angle is None else angle[piece] for angle in (raw.roll, raw.pitch))
    _refuse_beyond(raw, piece, raw.column, z, LARGEST_HEAVE, "m")
    _refuse_jumps(raw, piece, t, z)
    for name, angle in (("roll", roll), ("pitch", pitch)):
        if angle is not None:
            _refuse_beyond(raw, piece, name, np.degrees(angle), LARGEST_ANGLE, "deg")
    if np.ptp(z) == 0.0:
        problem = f"{raw.column} stays at {z[0]:g} m throughout: the sensor was stuck or off"
        raise MotionError(f"{raw.source}: {problem}. Choose another piece or log.")
    return ShipMotion(t, -z if heave == "down" else z, roll, pitch, report)


def _piece(raw: RawLog, start: str | None, duration: str | None) -> slice:
    t = raw.t - raw.t[0] if len(raw.t) else raw.t
    last = float(t[-1]) if len(t) else 0.0
    begin = 0.0 if start is None else parse(start, "time", f"{raw.source}: start")
    length = math.inf if duration is None else parse(duration, "time", f"{raw.source}: duration")
    if begin < 0.0 or length <= 0.0 or begin > last or (duration is not None and begin + length > last + 1e-6):
        piece = f"start {begin:g} s and duration {'to its end' if duration is None else f'{length:g} s'}"
        raise MotionError(f"{raw.source}: {piece} are not within the record of {last:g} s. Choose another piece.")
    low = int(np.searchsorted(t, begin - 1e-6))
    high = int(np.searchsorted(t, begin + length + 1e-6, side="right"))
    if high - low < FEWEST_POINTS:
        count = f"{high - low} samples{_omission_note(raw)}"
        raise MotionError(f"{raw.source}: {count}. A motion needs {FEWEST_POINTS} or more.")
    return slice(low, high)


def _omission_note(raw: RawLog) -> str:
    """What the reader left out, for errors about what is missing."""
    omitted = ", ".join(f"{name} {n}" for name, n in raw.left_out.items() if n)
    return f" ({omitted})" if omitted else ""


def _report(raw: RawLog, piece: slice, heave: HeaveSign, max_gap: float) -> tuple[FloatArray, ReadReport]:
    t = raw.t[piece] - raw.t[piece.start]
    step = np.diff(t)
    median = float(np.median(step))
    gaps, longest = step > GAP * median, int(np.argmax(step))
    if gaps.any() and step[longest] > max_gap + SLACK * median:
        since = raw.t[piece.start] - raw.t[0]
        raise MotionError(
            f"{raw.source}: line {raw.line_of(piece.start + longest)}: gap of {step[longest]:.4g} s from "
            f"{since + t[longest]:.6g} s on is longer than max_gap {max_gap:g} s{_omission_note(raw)}. Choose a piece "
            f'without it, such as start="{math.ceil(since + t[longest + 1])} s", or raise max_gap.'
        )
    regular = step[~gaps]
    jitter = float(np.std(regular)) if len(regular) else 0.0
    report = ReadReport(
        source=raw.source,
        form=raw.form,
        heave=heave,
        time=raw.time,
        samples=len(t),
        duration=float(t[-1]),
        interval=median,
        shortest=float(step.min()),
        longest=float(step[longest]),
        jitter=jitter,
        gaps=int(gaps.sum()),
        longest_at=float(t[longest]),
        counts=MappingProxyType({**raw.counts, **raw.left_out}),
        cautions=(*raw.cautions, *_cautions(raw, piece, t, median, jitter)),
        column=raw.column,
    )
    return t, report


def _cautions(raw: RawLog, piece: slice, t: FloatArray, median: float, jitter: float) -> list[str]:
    cautions = []
    if median > COARSE:
        cautions.append(f"one sample in {median:.3g} s is too slow for waves shorter than {5.0 * median:.3g} s")
    if jitter > JITTERY * median:
        cautions.append(f"the times jitter by {jitter:.3g} s, which shows as false acceleration")
    changed = np.flatnonzero(np.diff(raw.heave[piece])) + 1
    edges = t[np.concatenate(([0], changed, [len(t) - 1]))]
    if np.diff(edges).max() > STANDSTILL:
        since = edges[np.argmax(np.diff(edges))]
        cautions.append(f"{raw.column} is stationary for {np.diff(edges).max():.3g} s from {since:.6g} s")
    moves = float(np.std(raw.heave[piece]))
    if moves < HARDLY:
        cautions.append(f"{raw.column} hardly moves (standard deviation {1e3 * moves:.3g} mm), so check its unit")
    for name, angle in (("roll", raw.roll), ("pitch", raw.pitch)):
        if angle is not None and moves >= HARDLY and (turns := math.degrees(np.std(angle[piece]))) < HARDLY_TURNS:
            cautions.append(f"{name} hardly turns (standard deviation {turns:.3g} deg), so check its unit")
    return cautions


def _refuse_jumps(raw: RawLog, piece: slice, t: FloatArray, z: FloatArray) -> None:
    jumps = (np.abs(np.diff(z)) > JUMP) & (np.abs(np.diff(z)) > FASTEST * np.diff(t))
    if jumps.any():
        i = int(np.argmax(jumps))
        raise MotionError(
            f"{raw.source}: line {raw.line_of(piece.start + i + 1)}: {raw.column} jumps from {z[i]:.4g} m to"
            f" {z[i + 1]:.4g} m in {t[i + 1] - t[i]:.3g} s. Correct the spike or choose a piece without it (start,"
            " duration)."
        )


def _refuse_beyond(raw: RawLog, piece: slice, name: str, column: FloatArray, bound: float, unit: str) -> None:
    beyond = np.abs(column) > bound
    if beyond.any():
        i = int(np.argmax(beyond))
        raise MotionError(
            f"{raw.source}: line {raw.line_of(piece.start + i)}: {name} {column[i]:.5g} {unit} is beyond "
            f"{bound:g} {unit}. Check the unit in the file, or choose a piece without the spike (start, duration)."
        )
