"""What happened, one record each: alarms, refused writes, commands, changes of state, and what the history itself did.

A text from outside is kept as one line of bounded length, so that it can forge no other line.
"""

from __future__ import annotations

import json
import math
import sqlite3
import time as clock
from collections.abc import Mapping, Sequence
from contextlib import closing
from enum import StrEnum
from pathlib import Path
from typing import Any, NamedTuple

from stillhook.errors import LiveError, printed
from stillhook.live.history.journal import JOURNAL, connect, in_one_line
from stillhook.live.history.moments import moment, show_moment
from stillhook.units import quote

LONGEST_TEXT, LONGEST_DATA = 500, 4000
"""Letters that are stored of a text and of the data of an event."""
LONGEST = 480
"""Bytes of an event as a line of JSON at most; a longer text is cut."""


class EventKind(StrEnum):
    """What an event is about."""

    ALARM = "alarm"
    COMMAND = "command"
    REFUSED = "refused-write"
    STATE = "state"
    START = "start"
    STOP = "stop"
    CLOCK = "clock"
    REMOVED = "removed"
    DAMAGED = "damaged"


KINDS = {"alarm": EventKind.ALARM, "command": EventKind.COMMAND, "write": EventKind.COMMAND}
KINDS |= {"malformed": EventKind.REFUSED, "started": EventKind.START, "stopped": EventKind.STOP}
"""What a name says an event is about; one that begins with `refused` is refused, any other a state."""


class Event(NamedTuple):
    """An event: kind, one line of text, facts as plain data; time in UTC [s since 1970], None for that of this
    computer. number and row are given by the journal: the last row that was acknowledged before it.

    The data of one of a running twin (`event`) has its source, its name and its value.
    """

    kind: EventKind
    text: str
    data: Mapping[str, Any] = {}
    time: float | None = None
    number: int = 0
    row: int = 0

    @property
    def when(self) -> str:
        """Its time as ISO 8601."""
        return "" if self.time is None else show_moment(self.time)

    @property
    def source(self) -> str:
        """Who of a running twin: kernel, opcua, modbus, udp, replay, twin; empty for the history itself."""
        return str(self.data.get("source", ""))

    @property
    def name(self) -> str:
        """What, in one word."""
        return str(self.data.get("name", self.kind))

    @property
    def value(self) -> float:
        """Its size in SI, NaN where it has none."""
        value = self.data.get("value")
        return math.nan if value is None else float(value)

    def to_json(self) -> str:
        """Time, source, name, value and text as one line of JSON, at most `LONGEST` bytes."""
        row = {"time": self.time, "source": self.source, "name": self.name, "value": self.data.get("value")}
        for most in (300, 60, 20):
            line = json.dumps({**row, "text": self.text[:most]})
            if len(line) <= LONGEST:
                break
        return line

    @classmethod
    def from_json(cls, line: str | bytes) -> Event:
        """The event of such a line."""
        row = json.loads(line)
        return event(row["source"], row["name"], row["text"], row["value"], row["time"])


def event(source: str, name: str, text: str, value: float | None = None, time: float | None = None) -> Event:
    """An event of a running twin, of now where no time is given. value: its size in SI, where it has one."""
    kind = EventKind.REFUSED if name.startswith("refused") else KINDS.get(name, EventKind.STATE)
    size = float(value) if value is not None and math.isfinite(value) else None
    return Event(kind, text, {"source": source, "name": name, "value": size}, clock.time() if time is None else time)


def one_line(text: str, most: int = LONGEST_TEXT) -> str:
    """A text with nothing in it that is not printed, cut where it is too long."""
    shown = printed(text)
    return shown if len(shown) <= most else f"{shown[: most - 3]}..."


def add_events(connection: sqlite3.Connection, events: Sequence[Event], row: int) -> None:
    """Store events, within a transaction. row: the last one that was acknowledged. Errors: LiveError."""
    for each in events:
        if each.kind not in tuple(EventKind):
            raise LiveError(f"event: kind = {quote(each.kind)}: choose one of {', '.join(EventKind)}.")
        at = clock.time() if each.time is None else moment(each.time, f"event {quote(each.text)}: time", 0.0)
        connection.execute(
            "INSERT INTO events (time, row, kind, text, data) VALUES (?, ?, ?, ?, ?)",
            (at, row, str(each.kind), one_line(each.text), _as_text(each)),
        )


def _as_text(of: Event) -> str:
    try:
        text = json.dumps(dict(of.data), default=lambda value: one_line(str(value)))
    except (TypeError, ValueError, RecursionError) as problem:
        reason = one_line(str(problem))
        raise LiveError(f"event {quote(of.text)}: its data cannot be stored ({reason}). Give plain data.") from None
    return text if len(text) <= LONGEST_DATA else json.dumps({"cut": text[: LONGEST_DATA // 2]})


def read_events(
    folder: str | Path,
    *,
    start: str | float | None = None,
    end: str | float | None = None,
    kinds: Sequence[EventKind] = tuple(EventKind),
) -> list[Event]:
    """Events of a history, in the order in which they were stored.

    Parameters
    ----------
    folder : str or Path
        Folder of the history; it may be written at the same time.
    start, end : str or float, optional
        UTC as ISO 8601, or in seconds since 1970; from start on, and before end.
    kinds : sequence of EventKind, default all
        What they are about.

    Returns
    -------
    list of Event
        With number, time [s since 1970, UTC] and the last row before each.

    Raises
    ------
    LiveError
        Where no history is there, or a time is unknown.
    """
    begin, stop = moment(start, "start", -math.inf), moment(end, "end", math.inf)
    wanted = [EventKind(kind).value for kind in kinds]
    query = f"time >= ? AND time < ? AND kind IN ({','.join('?' * len(wanted))})"
    with closing(connect(Path(folder))) as connection, in_one_line(Path(folder) / JOURNAL):
        rows = connection.execute(
            f"SELECT kind, text, data, time, id, row FROM events WHERE {query} ORDER BY id", (begin, stop, *wanted)
        ).fetchall()
    return [Event(EventKind(kind), text, json.loads(data), *others) for kind, text, data, *others in rows]
