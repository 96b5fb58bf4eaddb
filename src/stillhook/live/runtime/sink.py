"""What happens in addition to the rows, and where rows and events go: a history, a file, a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import IO, Protocol

from stillhook.base.arrays import FloatArray
from stillhook.errors import LiveError
from stillhook.live.history.events import LONGEST as LONGEST
from stillhook.live.history.events import Event as Event
from stillhook.live.history.events import event as event

FULL = 20_000_000
"""Size at which a file of events is full [bytes]."""


class Sink(Protocol):
    """Where rows and events go. It is called in the process of the servers, never in that of the kernel."""

    def rows(self, first: int, names: Sequence[str], rows: Sequence[FloatArray]) -> None:
        """Complete rows in their order, with the number of the first and the names of their numbers."""

    def event(self, happened: Event) -> None:
        """An event."""

    def close(self) -> None:
        """Nothing more comes."""


class StateKeeper(Protocol):
    """Who acknowledges states in addition to the file of a twin: a history, together with its rows."""

    def save_state(self, data: bytes) -> None:
        """Store a state behind all rows so far."""

    def last_state(self) -> bytes | None:
        """The newest state; None where there is none. Errors: LiveError."""


class EventLog:
    """Events as lines of JSON at the end of a file, each written through before the next; rows are not kept. A file
    that is full takes the place of the one that was full before it, NAME.1.jsonl.

    Errors: LiveError where the file cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file: IO[str] = path.open("a", encoding="utf-8")
        except OSError as problem:
            raise LiveError(f"{path}: {problem.strerror}. Choose another folder for the events.") from None

    def rows(self, first: int, names: Sequence[str], rows: Sequence[FloatArray]) -> None:
        """Not kept."""

    def event(self, happened: Event) -> None:
        """Write it."""
        if self._file.tell() > FULL:
            self._file.close()
            self._path.replace(self._path.with_suffix(f".1{self._path.suffix}"))
            self._file = self._path.open("a", encoding="utf-8")
        self._file.write(happened.to_json() + "\n")
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()
