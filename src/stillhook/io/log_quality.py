"""What is wrong with the samples of a log, told as findings: gaps, missing and impossible values, time that runs backwards."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from stillhook.errors import LogError
from stillhook.io.log_bins import Binned, Column, Track
from stillhook.io.log_types import BoolArray, Finding
from stillhook.units import came

MOST_IMPOSSIBLE = 0.01  # of the samples: more that cannot be are no spikes but another unit
MOST_LISTED = 20  # findings of one kind that are told one by one


@dataclass
class Checked:
    """A track after its checks: its bins, doubtful ones by column, findings."""

    track: Track
    bins: Binned
    doubtful: list[BoolArray]
    findings: list[Finding] = field(default_factory=list)


def checked(track: Track) -> Checked:
    """The bins of a track with everything that is wrong with them. Errors: LogError for signals that cannot be trusted at all."""
    bins = track.finish()
    for column in track.columns:
        column.watch.finish()
    out = Checked(track, bins, [np.zeros(len(bins.t), np.bool_) for _ in track.columns])
    _time(out)
    for i, column in enumerate(track.columns):
        _impossible(out, column)
        _missing(out, i, column)
    return out


def _time(out: Checked) -> None:
    track = out.track
    if track.untimed.number:
        out.findings.append(Finding(
            "time", "missing", np.nan, np.nan, track.untimed.number, "left out",
            f"time: {track.untimed.number} {track.row}s without a readable time are left out, the first is {track.row} "
            f"{track.untimed.line}",
        ))  # fmt: skip
    back = track.backwards
    if back.number:
        out.findings.append(Finding(
            "time", "time-backwards", back.start, back.end, back.number, "left out",
            f"time: {back.number} samples whose time repeats or runs back (by up to {back.largest:.3g} s) are left out, the first is "
            f"{track.row} {back.line}",
        ))  # fmt: skip
    for start, end in track.gaps[:MOST_LISTED]:
        out.findings.append(
            Finding("time", "gap", start, end, 1, "noted", f"time: no samples for {end - start:.4g} s from {start:.6g} s on")
        )
    if len(track.gaps) > MOST_LISTED:
        rest = track.gaps[MOST_LISTED:]
        longest = max(end - start for start, end in rest)
        out.findings.append(Finding(
            "time", "gap", rest[0][0], rest[-1][1], len(rest), "noted",
            f"time: {len(rest)} more gaps, the longest {longest:.4g} s, from {rest[0][0]:.6g} s on",
        ))  # fmt: skip


def _impossible(out: Checked, column: Column) -> None:
    watch, signal, track = column.watch, column.signal, out.track
    if not watch.beyond:
        return
    said = f"{signal.name} = {signal.say(watch.beyond_value)} is beyond {signal.say(watch.limit)}"
    if watch.beyond > MOST_IMPOSSIBLE * max(1, watch.good + watch.beyond):
        raise LogError(
            f"{track.file}: {track.row} {watch.beyond_line}: {said} ({watch.beyond} such samples of {watch.good + watch.beyond}). Check "
            "the unit "
            f"{came(column.unit)} of column {came(signal.column)} in the mapping, or its scale."
        )
    out.findings.append(Finding(
        signal.name, "impossible", watch.beyond_at, watch.beyond_at, watch.beyond, "left out",
        f"{said} in {track.row} {watch.beyond_line}: {watch.beyond} such samples are left out",
    ))  # fmt: skip


def _missing(out: Checked, i: int, column: Column) -> None:
    signal, track, missing = column.signal, out.track, out.bins.missing[i]
    number = int(missing.sum()) - column.watch.beyond
    texts = ", ".join(came(text) if text else "empty cells" for text in column.texts)
    if not column.watch.good:
        raise LogError(
            f"{track.file}: {signal.name}: column {came(signal.column)} holds no number that can be read ({texts or 'all cells empty'}). "
            "Map another column or leave the signal out."
        )
    bad = missing > 0
    out.doubtful[i] |= bad
    if number <= 0:
        return
    where = np.flatnonzero(bad)
    out.findings.append(Finding(
        signal.name, "missing", float(out.bins.t[where[0]]), float(out.bins.t[where[-1]]), number, "left out",
        f"{signal.name}: {number} samples are missing ({texts or 'empty cells'}), first near {out.bins.t[where[0]]:.6g} s",
    ))  # fmt: skip
