"""Ship motion and crane-tip motion from CSV files whose header names columns and units.

`time [s],heave [m],roll [deg],pitch [deg]` or `time [s];tip [m]`. Columns in any order; others are left alone. Time is
in a unit of time, or `time [UTC]` with ISO 8601 stamps. Separators are comma, semicolon and tab; with the latter two
the decimal sign may be a comma. Lines that begin with # and blank lines do not count; a byte-order mark, CRLF and
quotes do no harm. Heave and tip count up, roll with port side up, pitch with bow up, unless `heave="down"` is said.
"""

from __future__ import annotations

import os

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import MotionError
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
from stillhook.formats.table.text import TextTable, decoded, headed_table, heading_names
from stillhook.sea.motion.recorded import Recorded
from stillhook.sea.vessel.ship_motion import ShipMotion, sea_worthy

COLUMNS = {
    "time": ColumnSpec("time", "time", (), "time [s]", required=True),
    "heave": ColumnSpec("heave", "length", (), "heave [m]", required=True),
    "tip": ColumnSpec("tip", "length", (), "tip [m]", required=True),
    "roll": ColumnSpec("roll", "angle", (), "roll [deg]"),
    "pitch": ColumnSpec("pitch", "angle", (), "pitch [deg]"),
}
START = 'Begin with a line such as "time [s],heave [m],roll [deg],pitch [deg]" or "time [s],tip [m]".'


def _load(path: str | os.PathLike[str]) -> TextTable:
    file, _ = head_of(path)
    text = decoded(file.name, file.read_bytes(), MotionError)
    return headed_table(file.name, text, MotionError, START, pad_last=True)


def _increasing(table: TextTable, t: FloatArray) -> None:
    back = np.diff(t) <= 0.0
    if back.any():
        i = int(np.argmax(back))
        verb = "repeats" if t[i + 1] == t[i] else "runs back to"
        raise MotionError(
            f"{table.at(i + 1)}: time {verb} {t[i + 1]:.10g} s after {t[i]:.10g} s ({int(back.sum())} in all). Times"
            " must increase: sort the lines and remove doubles."
        )


def _raw(table: TextTable, height: str) -> RawLog:
    """Time and the column `height` (heave or tip) in SI, with roll and pitch next to heave where the file has them."""
    if height == "heave" and place_of(table, COLUMNS["heave"]) is None and place_of(table, COLUMNS["tip"]) is not None:
        raise MotionError(f"{table.name}: holds a column tip, so the motion of a crane tip. Read it without tip=.")
    columns: dict[str, FloatArray] = {}
    for name in ("time", height, *(("roll", "pitch") if height == "heave" else ())):
        spec = COLUMNS[name]
        if (place := place_of(table, spec)) is not None:
            columns[name] = si_values(table, spec, place)
        elif spec.required:
            raise missing_column(table, spec, START)
    columns["time"], cautions = evened(columns["time"])
    _increasing(table, columns["time"])
    return RawLog(
        source=table.name,
        form="CSV",
        time="file",
        t=columns["time"],
        heave=columns[height],
        roll=columns.get("roll"),
        pitch=columns.get("pitch"),
        line_of=lambda i: table.lines[i],
        counts={"lines": len(columns["time"]), "other columns": len(table.headings) - len(columns)},
        cautions=cautions,
        column=height,
    )


def read_ship_csv(
    path: str | os.PathLike[str],
    *,
    heave: HeaveSign = "up",
    max_gap: str = DEFAULT_MAX_GAP,
    start: str | None = None,
    duration: str | None = None,
) -> ShipMotion:
    """Ship motion from a CSV with time and heave, and roll and pitch where a crane tip off the sensor is needed.

    Parameters as `read_psxn` has them; heave counts up by default. Errors: MotionError or UnitError of one line with
    file, line and column for a missing column, a missing or unknown unit, a value that is not a number, times that
    do not increase, gaps longer than max_gap, a heave beyond 20 m or that never changes, angles beyond 45 deg.
    """
    table = _load(path)
    sign = sign_of(heave, table.name)
    return finish(_raw(table, "heave"), heave=sign, max_gap=max_gap, start=start, duration=duration)


def read_tip_csv(
    path: str | os.PathLike[str],
    *,
    max_gap: str = DEFAULT_MAX_GAP,
    start: str | None = None,
    duration: str | None = None,
    every: str | None = "0.5 s",
) -> Recorded:
    """Crane-tip motion from a CSV with time and tip, the height of the crane tip, positive up.

    Parameters and errors as in `read_ship_csv`; every as in `tip_motion`.
    """
    piece = finish(_raw(_load(path), "tip"), heave="up", max_gap=max_gap, start=start, duration=duration)
    motion = Recorded(piece.t, piece.heave, source=piece.report.source, report=piece.report.describe())
    return sea_worthy(motion, every)


def has_column(path: str | os.PathLike[str], name: str) -> bool:
    """Whether the header of a CSV names a column."""
    text = head_of(path)[1].decode("utf-8", errors="replace").removeprefix("\ufeff").replace("\r", "\n")
    return name in (split_heading(heading)[0] for heading in heading_names(text))
