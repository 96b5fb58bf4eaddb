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
    RawLog,
    evened,
    head_of,
)
from stillhook.formats.table.columns import ColumnSpec, missing_column, place_of, si_values, split_heading
from stillhook.formats.table.text import TextTable, decoded, headed_table, heading_names

COLUMNS = {
    "time": ColumnSpec("time", "time", (), "time [s]", required=True),
    "heave": ColumnSpec("heave", "length", (), "heave [m]", required=True),
    "tip": ColumnSpec("tip", "length", (), "tip [m]", required=True),
    "roll": ColumnSpec("roll", "angle", (), "roll [deg]"),
    "pitch": ColumnSpec("pitch", "angle", (), "pitch [deg]"),
}
START = 'Begin with a line such as "time [s],heave [m],roll [deg],pitch [deg]" or "time [s],tip [m]".'


def _increasing(table: TextTable, t: FloatArray) -> None:
    back = np.diff(t) <= 0.0
    if back.any():
        i = int(np.argmax(back))
        verb = "repeats" if t[i + 1] == t[i] else "runs back to"
        raise MotionError(
            f"{table.at(i + 1)}: time {verb} {t[i + 1]:.10g} s after {t[i]:.10g} s ({int(back.sum())} in all). Times"
            " must increase: sort the lines and remove doubles."
        )


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


def has_column(path: str | os.PathLike[str], name: str) -> bool:
    """Whether the header of a CSV names a column."""
    text = head_of(path)[1].decode("utf-8", errors="replace").removeprefix("\ufeff").replace("\r", "\n")
    return name in (split_heading(heading)[0] for heading in heading_names(text))
