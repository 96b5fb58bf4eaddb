"""Ship motion from logs of a Kongsberg Seapath: `$PSXN,23,<roll deg>,<pitch deg>,<heading deg>,<heave m>*hh` lines.

Format. Each line is one NMEA sentence with what the logger put before it, the last of which is the time of receipt
(ISO 8601, or a date such as 11/04/2017; without a zone it is taken as UTC). $PSXN,23 carries no time: it belongs to the
epoch of the $..ZDA or $..GGA before it. $PSXN,20 carries quality flags.

Signs (Seapath manual): roll positive with port side up, pitch positive with bow up, **heave positive down**; a
Seapath can be set up to send another sign. What the file holds is tested where it can be: the altitude in $..GGA is
positive up by its standard and, at the same reference point, moves with the heave. In the log of R/V Nathaniel B.
Palmer (cruise NBP1406, 2014) the altitude is minus the $PSXN,23 heave between 18 s and 5 s period, with a coherence of
0.99 and more, a gain of 0.95 to 1.02 and a phase of 178 to 180 deg, so heave there is positive down; pitch says the
same, as its bow rises a quarter period before the (turned) heave, which is how a ship meets a head sea.
"""

from __future__ import annotations

import os
import re
from array import array
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import partial, reduce
from operator import xor
from typing import Literal

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.gateway.access import opened
from stillhook.base.gateway.budget import in_time
from stillhook.errors import MotionError
from stillhook.formats.motion.ship_log import HeaveSign, RawLog, evened, head_of

LONGEST_LINE = 1 << 16  # bytes; a sentence has up to 82
INVALID = b"2"  # quality flag in $PSXN,20: 0 normal, 1 reduced performance, 2 invalid
AGREEMENT = 0.5  # correlation of altitude and heave steps beyond which their relative sign is beyond doubt
HALF_A_DAY = 43200.0  # s: a time of day that falls back by more has passed midnight
DAY = 86400.0  # s
TAIL = 4096  # bytes at the end of a log in which dates are looked at
COUNTED = ("lines", "$PSXN,23 lines")
LEFT_OUT = ("checksum errors", "without checksum", "missing fields", "flagged invalid", "without time")
_CLOCK = re.compile(rb"(\d\d)(\d\d)(\d\d(?:\.\d*)?)")
_NUMBER = re.compile(rb"[+-]?(\d+\.?\d*|\.\d+)")
_SLASHED = re.compile(r"(\d{1,2})/(\d{1,2})/(\d{4})(?=T)")
"""A date as the SCS of NOAA's ships writes it, month first; day first where a number above 12 says so."""
_DAY_FIRST = re.compile(rb"(?m)^\D{0,12}(1[3-9]|2\d|3[01])/\d{1,2}/\d{4}")


@dataclass
class _Scan:
    """What one pass over the file gathers: a row per usable $PSXN,23 line, and counts of all that is not usable."""

    instrument: bool
    rows: array[float] = field(default_factory=lambda: array("d"))
    counts: dict[str, int] = field(default_factory=lambda: dict.fromkeys((*COUNTED, *LEFT_OUT), 0))
    day_first: bool = False
    slashed: bool = False
    clock: float = float("nan")
    altitude: float = float("nan")
    valid: bool = True

    def line(self, number: int, raw: bytes) -> None:
        begin = raw.find(b"$")
        if begin < 0:
            return
        name = raw[begin + 1 : begin + 9]
        if name.startswith(b"PSXN,23,"):
            self.counts["$PSXN,23 lines"] += 1
            self._attitude(number, raw[:begin], raw[begin:])
        elif name.startswith(b"PSXN,20,"):
            if (fields := self._fields(raw[begin:], count=False)) and len(fields) >= 6:
                self.valid = INVALID not in (fields[3], fields[5])  # heave, and roll and pitch
        elif name[2:6] in (b"ZDA,", b"GGA,") and (fields := self._fields(raw[begin:], count=False)):
            self._epoch(fields)

    def _fields(self, sentence: bytes, *, count: bool) -> list[bytes] | None:
        """The fields of a sentence whose checksum holds."""
        body, star, checksum = sentence[1:].rstrip().partition(b"*")
        try:
            stated = int(checksum[:2], 16) if star and checksum else None  # some loggers leave out the leading 0
        except ValueError:
            stated = -1
        if stated is not None and stated == reduce(xor, body, 0):
            return body.split(b",")
        if count:
            self.counts["without checksum" if stated is None else "checksum errors"] += 1
        return None

    def _epoch(self, fields: list[bytes]) -> None:
        if match := _CLOCK.fullmatch(fields[1]):
            now = 3600.0 * int(match[1]) + 60.0 * int(match[2]) + float(match[3])
            days = 0.0 if np.isnan(self.clock) else DAY * (self.clock // DAY)
            self.clock = now + days + (DAY if now + days < self.clock - HALF_A_DAY else 0.0)
        if fields[0].endswith(b"GGA") and len(fields) > 9:
            self.altitude = float(fields[9]) if _NUMBER.fullmatch(fields[9]) else float("nan")

    def _attitude(self, number: int, before: bytes, sentence: bytes) -> None:
        fields = self._fields(sentence, count=True)
        if fields is None:
            return
        angles = (fields[2], fields[3], fields[5]) if len(fields) == 6 else ()
        if not angles or not all(_NUMBER.fullmatch(value) for value in angles):
            self.counts["missing fields"] += 1
            return
        if not self.valid:
            self.counts["flagged invalid"] += 1
            return
        t = self.clock if self.instrument else self._receipt(before)
        if np.isnan(t):
            self.counts["without time"] += 1
            return
        self.rows.extend((t, float(angles[0]), float(angles[1]), float(angles[2]), self.altitude, number))

    def _receipt(self, before: bytes) -> float:
        """The logger's time of receipt [s since 1970], from the last words before the sentence; nan if none."""
        words = before.decode("ascii", "replace").strip(" ,;\t").replace(",", " ").replace(";", " ").split()
        for text in (*words[-1:], "T".join(words[-2:])):
            if match := _SLASHED.match(text):
                a, b, year = match.groups()
                month, day = (b, a) if self.day_first else (a, b)
                text = f"{year}-{int(month):02d}-{int(day):02d}{text[match.end() :]}"
                self.slashed = True
            try:
                stamp = datetime.fromisoformat(text)
            except ValueError:
                continue
            return (stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)).timestamp()
        return float("nan")


def raw_psxn(path: str | os.PathLike[str], heave: HeaveSign, time: Literal["logger", "instrument"]) -> RawLog:
    """The samples of a log of $PSXN,23 lines.

    Parameters: path; heave, which way the file counts it; time: "logger" for the time of receipt, which every line has,
    or "instrument" for the last $..ZDA or $..GGA, free of the delays of the network.

    Left out and counted: lines with a wrong or no checksum, with missing fields, flagged invalid by $PSXN,20, without
    time, with the time of the sample before (duplicates) and with times running backwards. A caution says if the
    altitude in $..GGA contradicts the stated sign of heave.
    Errors: MotionError, one line, for a file without usable lines.
    """
    file, head = head_of(path)
    number = 0
    with opened(file, "log file", MotionError) as stream:
        size = os.fstat(stream.fileno()).st_size
        stream.seek(max(size - TAIL, 0))
        tail = b"\n" + stream.read(TAIL).partition(b"\n")[2]  # whole lines
        stream.seek(0)
        scan = _Scan(instrument=time == "instrument", day_first=bool(_DAY_FIRST.search(head + tail)))
        lines = iter(partial(stream.readline, LONGEST_LINE), b"")  # a longer one is none of the sentences
        for number, raw in enumerate(in_time(lines, size, file.name, MotionError), start=1):
            scan.line(number, raw)
    scan.counts["lines"] = number
    rows = np.frombuffer(scan.rows, dtype=np.float64).reshape(-1, 6)
    if not len(rows):
        raise MotionError(f"{file.name}: {_no_samples_message(scan.counts, time)}")
    times, notes = evened(rows[:, 0]) if time == "logger" else (rows[:, 0], ())
    rows = np.column_stack((times, rows[:, 1:]))
    if scan.slashed:
        notes = (*notes, f"dates are read as {'day/month' if scan.day_first else 'month/day'}/year")
    raw_log = _in_order(file.name, rows, scan.counts, time, heave)
    return replace(raw_log, cautions=(*notes, *raw_log.cautions))


def _no_samples_message(counts: Mapping[str, int], time: str) -> str:
    if not counts["$PSXN,23 lines"]:
        return f"no $PSXN,23 line in {counts['lines']} lines. Give a Seapath log, or a CSV with heave [m]."
    sentences = ", ".join(f"{name} {count}" for name, count in counts.items() if count)
    needed, other = "a $..ZDA or $..GGA before them", "logger"
    if time == "logger":
        needed, other = "a time before their $ (ISO 8601, or 11/04/2017 07:00:00.1)", "instrument"
    return f'no usable $PSXN,23 line ({sentences}). Lines need a checksum and {needed}; or use time="{other}".'


def _in_order(
    name: str, rows: FloatArray, counts: Mapping[str, int], time: Literal["logger", "instrument"], sign: HeaveSign
) -> RawLog:
    """The samples with times that increase; what repeats a time or runs backwards is counted and left out."""
    latest = np.maximum.accumulate(rows[:, 0])
    ahead = np.concatenate(([True], rows[1:, 0] > latest[:-1]))
    same = np.concatenate(([False], rows[1:, 0] == latest[:-1]))
    doubles, backwards = int(same.sum()), int((~ahead & ~same).sum())
    if time == "instrument" and doubles > len(rows) // 2:
        raise MotionError(
            f"{name}: {doubles} of {len(rows)} $PSXN,23 lines share the instrument time of the one before: they come "
            'faster than $..ZDA and $..GGA. Use time="logger".'
        )
    t, roll, pitch, heave, altitude, number = rows[ahead].T
    return RawLog(
        source=name,
        form="Seapath $PSXN,23",
        time=time,
        t=t,
        heave=heave,
        roll=np.radians(roll),
        pitch=np.radians(pitch),
        line_of=lambda i: int(number[i]),
        counts={name: counts[name] for name in COUNTED},
        left_out={name: counts[name] for name in LEFT_OUT}
        | {"duplicates": doubles, "times running backwards": backwards},
        cautions=_doubts(heave, altitude, sign),
    )


def _doubts(heave: FloatArray, altitude: FloatArray, sign: HeaveSign) -> tuple[str, ...]:
    """A line where the steps of GGA altitude go against those of heave.

    Steps from sample to sample, because the altitude of a satellite receiver drifts over minutes and heave does not.
    Correlation near +1: the sign of heave is right; near -1: wrong; near 0: the altitude does not see the waves.
    """
    a, h = np.diff(altitude), np.diff(-heave if sign == "down" else heave)
    finite = np.isfinite(a)
    if finite.sum() < 30 or np.ptp(a[finite]) == 0.0 or np.ptp(h[finite]) == 0.0:
        return ()
    agreement = float(np.corrcoef(a[finite], h[finite])[0, 1])
    if agreement > -AGREEMENT:
        return ()
    other = "up" if sign == "down" else "down"
    against = f"the $..GGA altitude moves against the heave (correlation {agreement:.2f})"
    return (f'{against}: the log counts heave {other}, so use heave="{other}"',)
