"""What happens in addition to the rows, and where rows and events go: a history, a file, a terminal."""

from __future__ import annotations

import errno
import os
from collections.abc import Sequence
from io import FileIO
from pathlib import Path
from typing import Protocol

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
    that is full takes the place of the one that was full before it, NAME.1.jsonl. A disk that takes no line holds no
    twin up: the events are counted, and the next line that is written says how many.

    Errors: LiveError where the file cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._left_out, self._problem = 0, ""
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self._open()
        except OSError as problem:
            raise LiveError(f"{path}: {problem.strerror}. Choose another folder for the events.") from None

    def rows(self, first: int, names: Sequence[str], rows: Sequence[FloatArray]) -> None:
        """Not kept."""

    def event(self, happened: Event) -> None:
        """Write it."""
        try:
            if not self._file.closed and self._file.seek(0, os.SEEK_END) > FULL:
                self._file.close()  # Windows renames no open file
                self._path.replace(self._path.with_suffix(f".1{self._path.suffix}"))
            if self._file.closed:
                self._file = self._open()
            if self._left_out:
                text = f"{self._left_out} events were not written here: {self._problem}."
                self._add(event("twin", "lost-events", text, self._left_out))
                self._left_out = 0
            self._add(happened)
        except OSError as problem:
            self._left_out, self._problem = self._left_out + 1, str(problem.strerror)

    def _open(self) -> FileIO:
        return FileIO(self._path, "a")

    def _add(self, happened: Event) -> None:
        """Write a line, or none of it."""
        begin, line = self._file.seek(0, os.SEEK_END), happened.to_json().encode() + b"\n"
        if (self._file.write(line) or 0) < len(line):
            self._file.truncate(begin)
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def close(self) -> None:
        """Close the file."""
        self._file.close()
