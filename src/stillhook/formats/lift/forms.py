"""Lift files of version 0.10 in the words of today: stages of a lowering, heights and durations of a plan's phases.

What changes is a list of changes, made alike in a parsed file (to read it) and in its text (to convert it).
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Callable, Iterator, Mapping
from copy import deepcopy
from dataclasses import replace
from typing import Any, NamedTuple, TypeVar

from stillhook.base.gateway.parse import from_toml
from stillhook.errors import ConvertError, LiftError, StillhookError, UnreadableError
from stillhook.library.toml.file import TomlTable
from stillhook.spec.lift.joining import CLOSE, STANDS
from stillhook.tables.table import place_of
from stillhook.units import parse, quote, text_at

Read = TypeVar("Read")

OLD_OF_STAGES = {"lower": "speed", "hold": "tension", "tension": "end_tension"}
NEW_OF_STAGES = ("kind", "speed", "planned", "end_tension", "start_depth")
OLD_OF_PHASES = ("start", "end", "duration", "lower")
NEW_OF_PHASES = ("depth", "time", "planned", "wire", "landed", "end_tension", "tension", "timeout", "start_depth")


class Change(NamedTuple):
    """A key of a phase (its number from 0; None: of the top of the file) that gets another name, and another value
    where `value` is one; new "": it is left out. to: the phase that it goes to, where that is another one."""

    phase: int | None
    old: str
    new: str
    value: Any = None
    to: int | None = -1

    @property
    def target(self) -> int | None:
        """The phase that has the new key."""
        return self.phase if self.to == -1 else self.to


def changes(data: Mapping[str, Any]) -> tuple[Change, ...]:
    """What an old file says otherwise than one of today; none where it is one of today.

    Errors: LiftError, one line, for a file that mixes both.
    """
    old, new = _words(data)
    if not old:
        return ()
    if new:
        raise LiftError(f"{old[0]} is of the old form, and {new[0]} of today's. Write the file in the words of today.")
    return tuple(_of_stages(data) if "stage" in data else _of_phases(_rows(data, "phase")))


def _rows(data: Mapping[str, Any], name: str) -> list[Any]:
    rows = data.get(name)
    return [row if isinstance(row, Mapping) else {} for row in rows] if isinstance(rows, list) else []


def _words(data: Mapping[str, Any]) -> tuple[list[str], list[str]]:
    """Words of the old form, and words that only today's has."""
    old = [name for name in ("stage", "start") if name in data]
    new = ["[[phase]]"] if old and "phase" in data else []
    new += ["start_depth"] if "start_depth" in data else []
    for name, olds, news in (("stage", (), NEW_OF_STAGES), ("phase", OLD_OF_PHASES, NEW_OF_PHASES)):
        for i, row in enumerate(_rows(data, name), 1):
            where = f"{name} {quote(row['name']) if isinstance(row.get('name'), str) else i}"
            old += [f"{where}: {key}" for key in olds if key in row]
            new += [f"{where}: {key}" for key in news if key in row]
            new += [f"{where}: [[phase]]"] if name == "phase" and "lower" in row else []
    return ["[[stage]]" if word == "stage" else word for word in old], new


def _of_stages(data: Mapping[str, Any]) -> Iterator[Change]:
    _check_signs(data)
    if "start" in data:
        yield Change(None, "start", "start_depth", negative(data["start"], "start"))
    for i, row in enumerate(_rows(data, "stage")):
        yield from (Change(i, key, OLD_OF_STAGES[key]) for key in ("tension", "hold", "lower") if key in row)


def _check_signs(data: Mapping[str, Any]) -> None:
    """A stage that lowers does not end above where it begins, nor one that hoists below, as far as the file alone
    says where: a depth says the direction today. Errors: LiftError, UnitError."""
    begin = -parse(data["start"], "length", "start") if "start" in data else math.nan
    for i, row in enumerate(_rows(data, "stage"), 1):
        v = parse(row["lower"], "speed", f"stage {i}: lower") if "lower" in row else 0.0
        if "depth" not in row:
            begin = begin if v == 0.0 and row.get("mode") != "constant-tension" else math.nan
            continue
        depth = parse(row["depth"], "length", f"stage {i}: depth")
        if (depth - begin) * v < 0.0:
            does, side = ("pays wire out", "above") if v > 0.0 else ("hoists", "below")
            both = f"lower = {row['lower']} {does}, and depth = {row['depth']} is {side} where it begins"
            raise LiftError(f"stage {i}: {both}. Turn the sign of lower, or correct the depth.")
        begin = depth


def _of_phases(rows: list[Any]) -> Iterator[Change]:
    for i, row in enumerate(rows):
        after = rows[i + 1] if i + 1 < len(rows) else {}
        if "start" in row and i == 0:
            yield Change(0, "start", "start_depth", negative(row["start"], f"{_named(row, i)}: start"), to=None)
        elif "start" in row and "end" in rows[i - 1]:
            _check_joins(rows[i - 1], row, i)
            yield Change(i, "start", "")
        elif "start" in row:
            yield Change(i, "start", "depth", negative(row["start"], f"{_named(row, i)}: start"), to=i - 1)
        if "end" in row:
            yield Change(i, "end", "depth", negative(row["end"], f"{_named(row, i)}: end"))
        if "duration" in row:
            moves = row.get("kind") not in STANDS and ("end" in row or "start" in after or row.get("kind") != "in-air")
            yield Change(i, "duration", "planned" if moves else "time")


def _named(row: Mapping[str, Any], i: int) -> str:
    return f"phase {quote(str(row.get('name', row.get('kind', i + 1))))}"


def _check_joins(before: Mapping[str, Any], row: Mapping[str, Any], i: int) -> None:
    """A phase starts where the one before it ends. Errors: LiftError, UnitError."""
    end, start = parse(before["end"], "length", "end"), parse(row["start"], "length", "start")
    if abs(start - end) > CLOSE:
        problem = f"starts at {row['start']}, and the one before it ends at {before['end']}"
        do = "Let each phase start where the one before it ends, or leave start out."
        raise LiftError(f"{_named(row, i)}: {problem}. {do}")


def negative(value: Any, where: str) -> str:
    """A height as a depth, or a depth as a height, in its own unit: "4 m" as "-4 m". Errors: UnitError, with its
    place, for what is not a length: its sign could not be turned."""
    number = parse(value, "length", where)
    text = str(value).strip()
    bare = text[1:].lstrip() if text[:1] in ("-", "+") else text
    return bare if number <= 0.0 else f"-{bare}"


def changed(data: Mapping[str, Any], these: tuple[Change, ...]) -> dict[str, Any]:
    """A parsed file with changes."""
    result = deepcopy(dict(data))
    if "stage" in result:
        result["phase"] = result.pop("stage")
    for change in these:
        table = result if change.phase is None else result["phase"][change.phase]
        target = result if change.target is None else result["phase"][change.target]
        kept = table.pop(change.old)
        if change.new:
            target[change.new] = kept if change.value is None else change.value
    return result


def today(table: TomlTable) -> TomlTable:
    """A lift file in the words of today; an old one with a warning. Errors: LiftError for one that mixes both."""
    these = changes(table.data)
    if not these and "stage" not in table.data:
        return table
    name = table.path.name
    line = f"{name}: an old form; stillhook convert {name} NEW.toml writes it in the words of today."
    warnings.warn(line, FutureWarning, stacklevel=2)
    return replace(table, data=changed(table.data, these))


def in_written_words(read: Callable[[TomlTable], Read]) -> Callable[[TomlTable], Read]:
    """A reader of lift files whose errors name the keys that the file has: an old one has other names than today's."""

    def reading(table: TomlTable) -> Read:
        try:
            return read(table)
        except StillhookError as problem:
            lines = [_in_old_words(line, table.data) for line in problem.lines]
            raise type(problem)(_in_old_words(str(problem), table.data)).with_lines(lines) from None

    return reading


def _in_old_words(line: str, data: Mapping[str, Any]) -> str:
    """A line on a phase in the words of an old file: its place as it is there, and old names of the words behind it."""
    try:
        these = changes(data)
    except StillhookError:  # this line, in words of the file already
        return line
    name = "stage" if "stage" in data else "phase"
    if not these and name == "phase":
        return line
    today_of = OLD_OF_STAGES if name == "stage" else {"start": "start_depth", "end": "depth", "duration": "time"}
    written = changed(data, these)
    for change in these:
        loc: tuple[int | str, ...] = (change.old,) if change.phase is None else (name, change.phase, change.old)
        place = place_of((change.new,) if change.target is None else ("phase", change.target, change.new), written)
        if line.startswith((f"{place} ", f"{place}:")):
            text = line.removeprefix(place)
            value = quote(text_at(data, loc, None))
            return place_of(loc, data) + (text if change.value is None else text.replace(quote(change.value), value, 1))
    if not line.startswith("phase "):
        return line
    words = set(re.findall(r"\w+", line))
    names = ", ".join(f"{today} is {old}" for old, today in today_of.items() if today in words)
    line = name + line.removeprefix("phase")
    return f"{line} In this file {names}." if names else line


_HEADER = re.compile(r"\s*\[")
_PHASE = re.compile(r"(\s*\[\[\s*)(stage|phase)(\s*\]\].*)", re.DOTALL)
_KEY = re.compile(r"""(\s*)(["']?)([A-Za-z_]+)\2(\s*=\s*)(.*)""", re.DOTALL)
_TEXT = re.compile(r"""("[^"]*"|'[^']*')(.*)""", re.DOTALL)


def converted(text: str) -> tuple[str, tuple[str, ...]]:
    """The text of an old lift file in the words of today, its comments kept; and what was changed, a line each.

    Errors: LiftError for a file that mixes both; ConvertError for one of today, or one written in a way that its lines
    do not show, such as phases in one line.
    """
    text = text if text.endswith("\n") else f"{text}\n"
    data = from_toml(text)
    these = changes(data)
    if not these and "stage" not in data:
        if not _rows(data, "phase"):
            raise ConvertError("is not a lift file of an older version: it has no [[stage]] and no [[phase]].")
        raise ConvertError("is in the words of today already. Leave it as it is.")
    lines, said = text.splitlines(keepends=True), []
    if "stage" in data:
        lines = [m[1] + "phase" + m[3] if (m := _PHASE.fullmatch(line)) else line for line in lines]
        said.append("[[stage]] is [[phase]]")
    for change in these:
        lines = _rewritten(lines, change)
        said.append(_sentence(change, data))
    result = "".join(lines)
    try:
        same = from_toml(result) == changed(data, these)
    except UnreadableError:
        same = False
    if not same:
        table = "stage" if "stage" in data else "phase"
        raise ConvertError(f"its {table}s are not written as tables. Write each as [[{table}]], a line for each field.")
    return result, tuple(said)


def _block(lines: list[str], phase: int | None) -> tuple[int, int]:
    """First line of a phase, or of the top of the file, and the line after its last field."""
    headers = [i for i, line in enumerate(lines) if _HEADER.match(line)]
    starts = [i + 1 for i in headers if _PHASE.fullmatch(lines[i])]
    first = 0 if phase is None else starts[phase] if phase < len(starts) else len(lines)
    last = next((i for i in headers if i >= first), len(lines))
    while last > first and (not lines[last - 1].strip() or lines[last - 1].lstrip().startswith("#")):
        last -= 1
    return first, last


def _rewritten(lines: list[str], change: Change) -> list[str]:
    """Lines of a file with one change; as they are where the key is not found in a line of its own."""
    first, last = _block(lines, change.phase)
    for i in range(first, last):
        key = _KEY.fullmatch(lines[i])
        if key is None or key[3] != change.old:
            continue
        written = key[5]
        if change.value is not None and (value := _TEXT.fullmatch(written)):
            written = f'"{change.value}"{value[2]}'
        line = f"{key[1]}{change.new}{key[4]}{written}"
        if change.new and change.target == change.phase:
            return [*lines[:i], line, *lines[i + 1 :]]
        fewer = [*lines[:i], *lines[i + 1 :]]
        if not change.new:
            return fewer
        _, end = _block(fewer, change.target)
        return [*fewer[:end], line, *fewer[end:]]
    return lines


def _sentence(change: Change, data: Mapping[str, Any]) -> str:
    rows = _rows(data, "stage" if "stage" in data else "phase")

    def where(phase: int | None) -> str:
        return "the file" if phase is None else _named(rows[phase], phase)

    if not change.new:
        return f"{where(change.phase)}: {change.old} is left out, for a phase starts where the one before it ends"
    value = "" if change.value is None else f' = "{change.value}"'
    moved = "" if change.target == change.phase else f" of {where(change.target)}"
    return f"{where(change.phase)}: {change.old} is {change.new}{value}{moved}"
