"""Ship and crane-tip motion from a file of either kind, recognised by its content and not by its name: logs of a
Seapath (`psxn`), and CSV files whose header names columns and units.

`time [s],heave [m],roll [deg],pitch [deg]` or `time [s];tip [m]`. Columns in any order; others are left alone. Time is
in a unit of time, or `time [UTC]` with ISO 8601 stamps. Separators are comma, semicolon and tab; with the latter two
the decimal sign may be a comma. Lines that begin with # and blank lines do not count; a byte-order mark, CRLF and
quotes do no harm. Heave and tip count up, roll with port side up, pitch with bow up, unless `heave="down"` is said.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Literal

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import MotionError
from stillhook.formats.motion.psxn import raw_psxn
from stillhook.formats.motion.ship_log import (
    DEFAULT_MAX_GAP,
    HeaveSign,
    RawLog,
    evened,
    finish,
    head_of,
    sign_of,
)
from stillhook.formats.table.columns import ColumnSpec, missing_column, place_of, si_values, split_heading
from stillhook.formats.table.text import decoded, headed_table, heading_names
from stillhook.sea.motion.motion import Motion
from stillhook.sea.motion.recorded import Recorded
from stillhook.sea.motion.text import motion_from_json
from stillhook.sea.vessel.ship_motion import Offset, ShipMotion, sea_worthy, tip_motion
from stillhook.units import quote

COLUMNS = {
    "time": ColumnSpec("time", "time", (), "time [s]", required=True),
    "heave": ColumnSpec("heave", "length", (), "heave [m]", required=True),
    "tip": ColumnSpec("tip", "length", (), "tip [m]", required=True),
    "roll": ColumnSpec("roll", "angle", (), "roll [deg]"),
    "pitch": ColumnSpec("pitch", "angle", (), "pitch [deg]"),
}
START = 'Begin with a line such as "time [s],heave [m],roll [deg],pitch [deg]" or "time [s],tip [m]".'


def raw_csv(path: str | os.PathLike[str], height: str) -> RawLog:
    """Time and the column `height` (heave or tip) in SI, with roll and pitch next to heave where the file has them.

    Errors: MotionError or UnitError of one line with file, line and column for a missing column, a missing or unknown
    unit, a value that is not a number, times that do not increase.
    """
    file, _ = head_of(path)
    text = decoded(file.name, file.read_bytes(), MotionError)
    table = headed_table(file.name, text, MotionError, START, pad_last=True)
    if height == "heave" and place_of(table, COLUMNS["heave"]) is None and place_of(table, COLUMNS["tip"]) is not None:
        raise MotionError(f"{table.name}: holds a column tip, so the motion of a crane tip. Read it without tip=.")
    columns: dict[str, FloatArray] = {}
    for name in ("time", height, *(("roll", "pitch") if height == "heave" else ())):
        spec = COLUMNS[name]
        if (place := place_of(table, spec)) is not None:
            columns[name] = si_values(table, spec, place)
        elif spec.required:
            raise missing_column(table, spec, START)
    t, cautions = evened(columns["time"])
    if (back := np.diff(t) <= 0.0).any():
        i = int(np.argmax(back))
        verb = "repeats" if t[i + 1] == t[i] else "runs back to"
        raise MotionError(
            f"{table.at(i + 1)}: time {verb} {t[i + 1]:.10g} s after {t[i]:.10g} s ({int(back.sum())} in all). Times"
            " must increase: sort the lines and remove doubles."
        )
    return RawLog(
        source=table.name,
        form="CSV",
        time="file",
        t=t,
        heave=columns[height],
        roll=columns.get("roll"),
        pitch=columns.get("pitch"),
        line_of=lambda i: table.lines[i],
        counts={"lines": len(t), "other columns": len(table.headings) - len(columns)},
        cautions=cautions,
        column=height,
    )


_SENTENCE = re.compile(rb"\$(PSXN,|[A-Z]{2}(ZDA|GGA|VTG|HDT|RMC|GLL),)")


def motion_form(path: str | os.PathLike[str]) -> Literal["psxn", "csv"]:
    """What a file of ship motion holds: NMEA sentences as a Seapath sends them, or a table with a header."""
    from stillhook.library.toml.kinds import toml_instead  # heavy: the library of cranes comes with it

    if line := toml_instead(path, "a log of motion"):
        raise MotionError(line)
    file, head = head_of(path)
    if _SENTENCE.search(head):
        return "psxn"
    lines = [line for line in head.replace(b"\r", b"\n").split(b"\n") if line.strip() and not line.startswith(b"#")]
    if lines and re.search(rb"(?i)time|heave|tip|\[", lines[0]):
        return "csv"
    raise MotionError(
        f"{file.name}: is neither a log of $PSXN,23 lines nor a CSV with a header such as "
        '"time [s],heave [m],roll [deg],pitch [deg]" or "time [s],tip [m]".'
    )


def stored_motion(path: str | os.PathLike[str]) -> Motion | None:
    """The motion that `stillhook tip --out` stored as tip.json, exact; None for a file that is not JSON.

    Errors: MotionError for a file that cannot be read, JSON that is not a motion, and a record, which is read from
    its own log.
    """
    file, head = head_of(path)
    if not head.lstrip().startswith(b"{"):
        return None
    try:
        motion = motion_from_json(file.read_text(encoding="utf-8"))
    except (MotionError, UnicodeDecodeError) as problem:
        raise MotionError(f"{file.name}: {problem}") from None
    if isinstance(motion, Recorded):
        raise MotionError(f"{file.name}: holds a recorded motion. Give the log that it was read from.")
    return motion


def read_ship_motion(
    path: str | os.PathLike[str],
    *,
    heave: HeaveSign | None = None,
    time: Literal["logger", "instrument"] | None = None,
    max_gap: str = DEFAULT_MAX_GAP,
    start: str | None = None,
    duration: str | None = None,
) -> ShipMotion:
    """Ship motion from a Seapath log ($PSXN,23 lines) or a CSV with time and heave, with roll and pitch where a crane
    tip off the sensor is needed.

    Parameters: path; heave, which way the file counts it, None for what its form has as a rule (a Seapath "down" by its
    manual, a CSV "up"), the report says which; time, for Seapath logs only, "logger" (None) or "instrument"; max_gap,
    the longest stretch without samples that the curve may bridge: at 1 Hz, a gap of 3 s costs up to 5 cm of a 0.84 m
    (standard deviation) sea, 4 s 18 cm, 5 s 50 cm; start and duration, a piece of the log counted from its first
    usable sample.
    Errors: MotionError or UnitError, one line, for what cannot be read (`raw_psxn`, `raw_csv`), gaps longer than
    max_gap, a heave beyond 20 m or that never changes, angles beyond 45 deg.
    """
    name, form = Path(path).name, motion_form(path)
    sign = sign_of(heave or ("down" if form == "psxn" else "up"), name)
    if form == "csv":
        _only_seapath(name, time)
        raw = raw_csv(path, "heave")
    elif time in (None, "logger", "instrument"):
        raw = raw_psxn(path, sign, time or "logger")
    else:
        raise MotionError(f'{name}: time = {quote(time)} is not one of "logger", "instrument".')
    return finish(raw, heave=sign, max_gap=max_gap, start=start, duration=duration)


def read_tip_motion(
    path: str | os.PathLike[str],
    *,
    tip: Offset | None = None,
    heave: HeaveSign | None = None,
    time: Literal["logger", "instrument"] | None = None,
    max_gap: str = DEFAULT_MAX_GAP,
    start: str | None = None,
    duration: str | None = None,
    every: str | None = "0.5 s",
) -> Recorded:
    """Crane-tip motion from a file: its column `tip` if no lever arm is given, else the ship's motion at that arm.

    Parameters
    ----------
    path : str or path-like
        Seapath log or CSV.
    tip : Offset, optional
        From the motion sensor's point to the crane tip, forward, to port and up, as texts with units.
    heave : {"up", "down"}, optional
        Which way the file counts heave; default what its form has as a rule, see `read_ship_motion`.
    time : {"logger", "instrument"}, optional
        Clock, for Seapath logs only; default "logger".
    max_gap : str, default "5 s"
        Longest stretch without samples that the curve may bridge.
    start : str, optional
        Start of the piece to read, counted from the first usable sample, such as "60 s"; default the first.
    duration : str, optional
        Length of that piece, such as "300 s"; default up to the end.
    every : str or None, default "0.5 s"
        As in `tip_motion`.

    Returns
    -------
    Recorded
        Motion of the tip, up positive [m].

    Raises
    ------
    MotionError, UnitError
        One line.

    Examples
    --------
    >>> import math, pathlib, stillhook, tempfile
    >>> rows = [f"{t},{math.sin(t):.4f}" for t in range(40)]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder) / "tip.csv"
    ...     with file.open("w") as text:
    ...         print("time [s],tip [m]", *rows, sep=chr(10), file=text)
    ...     stillhook.read_tip_motion(file).duration
    39.0
    """
    if tip is not None:
        ship = read_ship_motion(path, heave=heave, time=time, max_gap=max_gap, start=start, duration=duration)
        return tip_motion(ship, tip, every=every)
    name = Path(path).name
    begin = head_of(path)[1].decode("utf-8", errors="replace").removeprefix("\ufeff").replace("\r", "\n")
    if motion_form(path) == "csv" and "tip" in (split_heading(heading)[0] for heading in heading_names(begin)):
        _only_seapath(name, time)
        if heave is not None:
            raise MotionError(f"{name}: heave states how a column heave counts; the column tip is up. Leave heave out.")
        piece = finish(raw_csv(path, "tip"), heave="up", max_gap=max_gap, start=start, duration=duration)
        return sea_worthy(Recorded(piece.t, piece.heave, source=name, report=piece.report.describe()), every)
    raise MotionError(
        f"{name}: holds the motion of the ship, not of the crane tip. Give the way from the motion sensor to the crane"
        ' tip, forward, to port and up, as tip=("-20 m", "12 m", "35 m").'
    )


def _only_seapath(name: str, time: str | None) -> None:
    if time is not None:
        raise MotionError(f"{name}: time chooses a clock of a Seapath log; a CSV has one. Leave time out.")
