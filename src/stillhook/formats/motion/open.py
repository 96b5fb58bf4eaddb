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
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.gateway.access import read_bytes, read_text
from stillhook.base.gateway.budget import JSON, RECORDS
from stillhook.base.gateway.guard import reader
from stillhook.errors import MotionError, StillhookError, all_of
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
from stillhook.formats.table.columns import (
    ColumnChoice,
    ColumnSpec,
    missing_column,
    place_of,
    si_values,
    split_heading,
    unit_in,
)
from stillhook.formats.table.dialect import apart, dialect_of
from stillhook.formats.table.text import HEAD, TextTable, decoded, find_table, headed_table, numbers_of
from stillhook.sea.motion.motion import Motion
from stillhook.sea.motion.recorded import Recorded
from stillhook.sea.motion.text import motion_from_json
from stillhook.sea.vessel.ship_motion import Offset, ShipMotion, sea_worthy, tip_motion
from stillhook.units import quote

if TYPE_CHECKING:
    from stillhook.formats.table.understood import Understood

_TIMES = ("timestamp", "time_stamp", "date_time", "datetime", "date/time", "zeit", "zeitstempel", "tid", "utc", "t")
COLUMNS = {
    "time": ColumnSpec("time", "time", _TIMES, "time [s]", required=True, word="time"),
    "heave": ColumnSpec("heave", "length", (), "heave [m]", required=True, word="heave"),
    "tip": ColumnSpec("tip", "length", (), "tip [m]", required=True),
    "roll": ColumnSpec("roll", "angle", (), "roll [deg]", word="roll"),
    "pitch": ColumnSpec("pitch", "angle", (), "pitch [deg]", word="pitch"),
}
START = 'Begin with a line such as "time [s],heave [m],roll [deg],pitch [deg]" or "time [s],tip [m]".'


SECONDS = (0.005, 2.5)
"""Spacing of times without a unit that are taken as seconds: of motion sensors, 0.4 to 200 samples a second."""


def raw_csv(path: str | os.PathLike[str], height: str, chosen: Mapping[str, ColumnChoice] | None = None) -> RawLog:
    """Time and the column `height` (heave or tip) in SI, with roll and pitch next to heave where the file has them.
    chosen: columns as their user describes them (`stillhook.formats.table.corrections`).

    Errors: MotionError or UnitError of one line with file, line and column for a missing column, a missing or unknown
    unit, a value that is not a number, times that do not increase.
    """
    table, chosen = motion_table(path, chosen or {}), dict(chosen or {})
    if height == "heave" and place_of(table, COLUMNS["heave"]) is None and place_of(table, COLUMNS["tip"]) is not None:
        raise MotionError(f"{table.name}: holds a column tip, so the motion of a crane tip. Read it without tip=.")
    columns: dict[str, FloatArray] = {}
    notes: list[str] = []
    problems: list[StillhookError] = []
    for name in ("time", height, *(("roll", "pitch") if height == "heave" else ())):
        spec = COLUMNS[name]
        if (place := place_of(table, spec, chosen.get(name))) is None:
            if spec.required:
                do = f'{START} Or say --column "{name}=HEADING [{spec.units[0]}]".'
                problems.append(missing_column(table, spec, do))
            continue
        unit = ""
        if name == "time" and _without_unit(table, place, chosen.get(name)):
            chosen[name] = replace(chosen.get(name) or ColumnChoice(table.headings[place]), unit="s")
            unit = " (no unit in the file: taken as s, by its spacing)"
        try:
            columns[name] = si_values(table, spec, place, chosen=chosen.get(name))
        except StillhookError as problem:
            problems.append(problem)
        if unit or split_heading(table.headings[place])[0] != name:
            against = " counted the other way" if name in chosen and chosen[name].sign < 0 else ""
            notes.append(f"{name} from {quote(table.headings[place])}{unit}{against}")
    if problems:
        raise all_of(problems)
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
        cautions=(*cautions, *([f"columns: {', '.join(notes)}"] if notes else ())),
        column=height,
    )


def motion_table(path: str | os.PathLike[str], chosen: Mapping[str, ColumnChoice]) -> TextTable:
    """The table of a file of motion: one that begins with its headings, or one below other lines."""
    file, _ = head_of(path)
    data = read_bytes(file, "log file", MotionError, RECORDS)
    try:
        table = headed_table(file.name, decoded(file.name, data, MotionError), MotionError, START, pad_last=True)
    except MotionError as problem:
        try:
            return find_table(file.name, data, MotionError, "log", START)
        except MotionError:
            raise problem from None
    if any(
        place_of(table, COLUMNS[name], chosen.get(name) if name in chosen and _has(table, chosen[name]) else None)
        is not None
        for name in ("heave", "tip")
    ):
        return table
    try:
        return find_table(file.name, data, MotionError, "log", START)
    except MotionError:
        return table


def _has(table: TextTable, row: ColumnChoice) -> bool:
    column = apart(row.column, row.unit, table.headings)[0].lower()
    return any(column in (h.lower(), split_heading(h)[0]) for h in table.headings)


def _without_unit(table: TextTable, place: int, row: ColumnChoice | None) -> bool:
    """Whether a column of times has no unit and is spaced as a motion sensor's seconds are."""
    if (row is not None and apart(row.column, row.unit, table.headings)[1] is not None) or unit_in(
        table, place, "time"
    ) is not None:
        return False
    t = numbers_of([cell.replace(",", ".") for cell in table.column(place)[:1000]])
    steps = np.diff(t[np.isfinite(t)])
    return len(steps) > 1 and SECONDS[0] <= float(np.median(steps)) <= SECONDS[1]


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
    with suppress(MotionError):  # below other lines, or with headings of its own
        if dialect_of(head, file.name, len(head) < HEAD, "log", MotionError).header_line:
            return "csv"
    raise MotionError(
        f"{file.name}: is neither a log of $PSXN,23 lines nor a CSV with a header such as "
        '"time [s],heave [m],roll [deg],pitch [deg]" or "time [s],tip [m]".'
    )


@reader(MotionError)
def stored_motion(path: str | os.PathLike[str]) -> Motion | None:
    """The motion that `stillhook tip --out` stored as tip.json, exact; None for a file that is not JSON.

    Errors: MotionError for a file that cannot be read, JSON that is not a motion, and a record, which is read from
    its own log.
    """
    file, head = head_of(path)
    if not head.lstrip().startswith(b"{"):
        return None
    try:
        motion = motion_from_json(read_text(file, "motion", MotionError, JSON))
    except MotionError as problem:
        raise MotionError(f"{file.name}: {problem}") from None
    if isinstance(motion, Recorded):
        raise MotionError(f"{file.name}: holds a recorded motion. Give the log that it was read from.")
    return motion


@reader(MotionError)
def read_ship_motion(
    path: str | os.PathLike[str],
    *,
    heave: HeaveSign | None = None,
    time: Literal["logger", "instrument"] | None = None,
    max_gap: str = DEFAULT_MAX_GAP,
    start: str | None = None,
    duration: str | None = None,
    columns: Mapping[str, Any] | None = None,
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
    chosen = _chosen(name, form, columns)
    if form == "csv":
        _only_seapath(name, time)
        if heave is not None and "heave" in chosen and chosen["heave"].sign < 0:
            raise MotionError(f'{name}: heave = {quote(heave)} and a column heave that counts "down". Say it once.')
        raw = raw_csv(path, "heave", chosen)
    elif time in (None, "logger", "instrument"):
        raw = raw_psxn(path, sign, time or "logger")
    else:
        raise MotionError(f'{name}: time = {quote(time)} is not one of "logger", "instrument".')
    return finish(raw, heave=sign, max_gap=max_gap, start=start, duration=duration)


@reader(MotionError)
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
    columns: Mapping[str, Any] | None = None,
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
    columns : mapping, optional
        Columns of a CSV with names of its own, such as {"heave": "MRU_Heave_m [m] down"}.

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
        ship = read_ship_motion(
            path, heave=heave, time=time, max_gap=max_gap, start=start, duration=duration, columns=columns
        )
        return tip_motion(ship, tip, every=every)
    name, form = Path(path).name, motion_form(path)
    chosen = _chosen(name, form, columns)
    if form == "csv" and ("tip" in chosen or place_of(motion_table(path, chosen), COLUMNS["tip"]) is not None):
        _only_seapath(name, time)
        if heave is not None:
            raise MotionError(f"{name}: heave states how a column heave counts; the column tip is up. Leave heave out.")
        piece = finish(raw_csv(path, "tip", chosen), heave="up", max_gap=max_gap, start=start, duration=duration)
        return sea_worthy(Recorded(piece.t, piece.heave, source=name, report=piece.report.describe()), every)
    raise MotionError(
        f"{name}: holds the motion of the ship, not of the crane tip. Give the way from the motion sensor to the crane"
        ' tip, forward, to port and up, as tip=("-20 m", "12 m", "35 m").'
    )


def _chosen(name: str, form: str, columns: Mapping[str, Any] | None) -> dict[str, ColumnChoice]:
    """Rows of corrections for a file of this form. Errors: LogError, UnitError."""
    if columns and form == "psxn":
        raise MotionError(f"{name}: is a log of $PSXN,23 sentences, whose fields are fixed. Leave columns out.")
    if not columns:
        return {}
    from stillhook.formats.table.read import chosen_rows  # heavy: files of corrections come with it

    return chosen_rows(columns, tuple(COLUMNS.values()), "columns")


def _only_seapath(name: str, time: str | None) -> None:
    if time is not None:
        raise MotionError(f"{name}: time chooses a clock of a Seapath log; a CSV has one. Leave time out.")


def understood_motion(path: str | os.PathLike[str], columns: Mapping[str, Any] | None = None) -> Understood:
    """What a file of motion holds. Errors: MotionError, LogError, UnitError where it has no table of motion."""
    from stillhook.formats.table.understood import Understood, understood_columns

    name, form = Path(path).name, motion_form(path)
    chosen = _chosen(name, form, columns)
    if form == "psxn":
        ship = read_ship_motion(path)
        return Understood(name, "log of $PSXN,23 sentences", notes=(ship.report.describe(),), fixed=True)
    table, problem = motion_table(path, chosen), ""
    assumed = {}
    place = place_of(table, COLUMNS["time"], chosen.get("time"))
    if place is not None and _without_unit(table, place, chosen.get("time")):
        assumed["time"] = "s"
    specs = [
        spec for name, spec in COLUMNS.items() if name != "tip" or place_of(table, spec, chosen.get(name)) is not None
    ]
    rows = understood_columns(table, specs, chosen, assumed)
    notes: tuple[str, ...] = ("heave up, roll port side up and pitch bow up are positive",)
    try:
        tip = any(row.name == "tip" for row in rows)
        read = read_tip_motion(path, columns=columns) if tip else read_ship_motion(path, columns=columns)
        notes = (*notes, read.report if isinstance(read, Recorded) else read.report.describe())
    except StillhookError as error:
        problem = str(error)
    used = {row.heading for row in rows}
    return Understood(
        name, "log of motion", tuple(rows), tuple(h for h in table.headings if h not in used), notes, problem=problem
    )
