"""Ship motion and crane-tip motion from CSV files whose header names columns and units.

`time [s],heave [m],roll [deg],pitch [deg]` or `time [s];tip [m]`. Columns in any order; others are left alone. Time is
in a unit of time, or `time [UTC]` with ISO 8601 stamps. Separators are comma, semicolon and tab; with the latter two
the decimal sign may be a comma. Lines that begin with # and blank lines do not count; a byte-order mark, CRLF and
quotes do no harm. Heave and tip count up, roll with port side up, pitch with bow up, unless `heave="down"` is said.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.errors import MotionError, UnitError
from stillhook.formats.csv_table import CsvTable, csv_head, csv_table, csv_text, numbers_of
from stillhook.formats.motion.ship_log import (
    DEFAULT_MAX_GAP,
    HeaveSign,
    RawLog,
    evened,
    finish,
    head_of,
    sign_of,
)
from stillhook.sea.motion.recorded import Recorded
from stillhook.sea.vessel.ship_motion import ShipMotion, sea_worthy
from stillhook.units import KINDS, parse, quote

COLUMNS = {"time": "time", "heave": "length", "roll": "angle", "pitch": "angle", "tip": "length"}
EXAMPLES = {"time": "time [s]", "heave": "heave [m]", "roll": "roll [deg]", "pitch": "pitch [deg]", "tip": "tip [m]"}
EXAMPLE = '"time [s],heave [m],roll [deg],pitch [deg]" or "time [s],tip [m]"'
STAMPS = "UTC"  # the unit of a time column that holds ISO 8601 stamps
START = f"Begin with a line such as {EXAMPLE}."
_HEADING = re.compile(r"([^\[\]]*?)\s*(?:\[([^\[\]]*)\])?")


def _split(heading: str) -> tuple[str, str | None]:
    """Name in lower case, and unit, of a heading such as `Heave [m]`."""
    match = _HEADING.fullmatch(heading)
    return (match[1].strip().lower(), match[2]) if match else (heading.lower(), None)


def _column(table: CsvTable, name: str) -> int | None:
    """The place of a column."""
    matches = [i for i, heading in enumerate(table.headings) if _split(heading)[0] == name]
    if len(matches) > 1:
        raise MotionError(f'{table.name}: line {table.header_line}: {len(matches)} columns "{name}". Keep one.')
    return matches[0] if matches else None


def _load(path: str | os.PathLike[str]) -> CsvTable:
    file, _ = head_of(path)
    text = csv_text(file.name, file.read_bytes(), MotionError)
    return csv_table(file.name, text, MotionError, start=START, pad_last=True)


def _numbers(table: CsvTable, index: int, kind: str) -> FloatArray:
    """A column in SI."""
    name, unit = _split(table.headings[index])
    place = f"{table.name}: line {table.header_line}: column {quote(table.headings[index])}"
    text = table.column(index)
    if name == "time" and unit == STAMPS:
        return _stamps(table, text)
    allowed = ", ".join((*KINDS[kind].allowed, *((STAMPS,) if name == "time" else ())))
    if unit is None:
        raise UnitError(f'{place} has no unit. Write it as "{EXAMPLES[name]}" (allowed: {allowed}).')
    if unit.strip() not in KINDS[kind].allowed:
        raise UnitError(f"{place}: unit {quote(unit)} is not one of {allowed}.")
    if table.separator != ",":
        text = [cell.replace(",", ".", 1) for cell in text]
    values = numbers_of(text)
    _refuse(table, ~np.isfinite(values), text, name, "a finite number")
    return values * parse(f"1 {unit}", kind, place)


def _stamps(table: CsvTable, text: Sequence[str]) -> FloatArray:
    """ISO 8601 stamps as seconds since 1970; a stamp without a zone is UTC, as the header says."""

    def seconds(stamp: str) -> float:
        try:
            read = datetime.fromisoformat(stamp)
        except ValueError:
            return float("nan")
        return (read if read.tzinfo else read.replace(tzinfo=UTC)).timestamp()

    values = np.array([seconds(stamp) for stamp in text])
    _refuse(table, np.isnan(values), text, "time", "an ISO 8601 stamp such as 2014-08-01T00:00:00.95Z")
    return values


def _refuse(table: CsvTable, bad: NDArray[np.bool_], text: Sequence[str], name: str, expected: str) -> None:
    if not bad.any():
        return
    row = int(np.argmax(bad))
    more = f" ({int(bad.sum())} such values)" if bad.sum() > 1 else ""
    cut = " The file seems cut off there." if row == len(bad) - 1 else ""
    raise MotionError(
        f"{table.name}: line {table.lines[row]}: {name} = {quote(text[row])} is not"
        f" {expected}{more}."
        f"{cut} Correct or remove the line."
    )


def _increasing(table: CsvTable, t: FloatArray) -> None:
    back = np.diff(t) <= 0.0
    if back.any():
        i = int(np.argmax(back))
        verb = "repeats" if t[i + 1] == t[i] else "runs back to"
        raise MotionError(
            f"{table.name}: line {table.lines[i + 1]}: time {verb} {t[i + 1]:.10g} s after"
            f" {t[i]:.10g} s "
            f"({int(back.sum())} in all). Times must increase: sort the lines and remove doubles."
        )


def _raw(table: CsvTable, height: str) -> RawLog:
    """Time and the column `height` (heave or tip) in SI, with roll and pitch next to heave where the file has them."""
    columns: dict[str, FloatArray] = {}
    for name in ("time", height, *(("roll", "pitch") if height == "heave" else ())):
        index = _column(table, name)
        if index is not None:
            columns[name] = _numbers(table, index, COLUMNS[name])
        elif name == "heave" and _column(table, "tip") is not None:
            raise MotionError(f"{table.name}: holds a column tip, so the motion of a crane tip. Read it without tip=.")
        elif name in ("time", "heave", "tip"):
            present = ", ".join(quote(heading) for heading in table.headings)
            raise MotionError(
                f'{table.name}: line {table.header_line}: no column "{EXAMPLES[name]}" among {present}. Begin the '
                f"file with a header such as {EXAMPLE}."
            )
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
        line_of=lambda i: int(table.lines[i]),
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
    file, head = head_of(path)
    text = head.decode("utf-8", errors="replace").removeprefix("\ufeff").replace("\r", "\n")
    return _column(csv_head(file.name, text, MotionError, start=START), name) is not None
