"""What happens beside the rows, and where rows and events go: a history, a file, a terminal."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import IO, NamedTuple, Protocol

from stillhook.base.arrays import FloatArray
from stillhook.errors import LiveError

LONGEST = 480
"""Bytes of an event at most; a longer text is cut."""


class Event(NamedTuple):
    """Something that happened.

    time: UTC [s since 1970]; source: kernel, opcua, modbus, udp, replay or twin; name: what, in one word; value: its
    size in SI, NaN where it has none; text: one sentence.
    """

    time: float
    source: str
    name: str
    value: float
    text: str

    def to_json(self) -> str:
        """One line of JSON, at most `LONGEST` bytes."""
        value = None if self.value != self.value else self.value
        for most in (300, 60, 20):
            row = {**self._asdict(), "value": value, "text": self.text[:most]}
            line = json.dumps(row)
            if len(line) <= LONGEST:
                break
        return line

    @classmethod
    def from_json(cls, line: str | bytes) -> Event:
        """The event of such a line."""
        row = json.loads(line)
        value = float("nan") if row["value"] is None else float(row["value"])
        return cls(float(row["time"]), str(row["source"]), str(row["name"]), value, str(row["text"]))


def event(source: str, name: str, text: str, value: float = float("nan")) -> Event:
    """An event of now."""
    return Event(time.time(), source, name, value, text)


class Sink(Protocol):
    """Where rows and events go. It is called in the process of the servers, never in that of the kernel."""

    def rows(self, first: int, names: Sequence[str], rows: Sequence[FloatArray]) -> None:
        """Complete rows in their order, with the number of the first and the names of their numbers."""

    def event(self, happened: Event) -> None:
        """An event."""

    def close(self) -> None:
        """Nothing more comes."""


class StateKeeper(Protocol):
    """Who acknowledges states beside the file of a twin: a history, together with its rows."""

    def save_state(self, data: bytes) -> None:
        """Store a state behind all rows so far."""

    def last_state(self) -> bytes | None:
        """The newest state; None where there is none. Errors: LiveError."""


class EventLog:
    """Events as lines of JSON at the end of a file, each written through before the next. Rows are not kept.

    Errors: LiveError where the file cannot be written.
    """

    def __init__(self, path: Path) -> None:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file: IO[str] = path.open("a", encoding="utf-8")
        except OSError as problem:
            raise LiveError(f"{path}: {problem.strerror}. Choose another folder for the events.") from None

    def rows(self, first: int, names: Sequence[str], rows: Sequence[FloatArray]) -> None:
        """Not kept."""

    def event(self, happened: Event) -> None:
        """Write it."""
        self._file.write(happened.to_json() + "\n")
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()
