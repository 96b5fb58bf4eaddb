"""A log of a binary format, read in a process of its own: see `stillhook.formats.binary.reader`."""

from __future__ import annotations

import itertools
import weakref
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from stillhook.errors import LogError, UnreadableError
from stillhook.formats.binary import process as reader_process
from stillhook.formats.binary.reader import Reader, time_limit
from stillhook.logs.formats.source import Chunk, Source, Want, master

T = TypeVar("T")


class BinaryLog:
    """An open log (`Source`) whose every step is taken by another process, under the limits of `binary_reader`.

    what: the format's name for messages; opened: makes the source there. Errors, of every step: LogError of one line.
    """

    def __init__(self, path: Path, content: str, opened: Callable[[Path], Source]) -> None:
        self._path, self._content = path, content
        self.name = path.name
        self._reader = self._refusing(Reader)
        weakref.finalize(self, self._reader.close)
        facts = self._call(reader_process.open_source, opened, path.absolute())
        self.row: str = facts["row"]
        self.time_base: bool = facts["time_base"]
        self.headings: tuple[str, ...] = facts["headings"]
        self.units: tuple[str, ...] = facts["units"]
        self._bases: tuple[int, ...] = facts["bases"]
        self._numbers = itertools.count()

    def _call(self, function: Callable[..., T], *arguments: Any) -> T:
        return self._refusing(partial(self._reader.call, time_limit(self._path), function, *arguments))

    def _refusing(self, step: Callable[[], T]) -> T:
        try:
            return step()
        except UnreadableError as problem:
            raise LogError(
                f"{self.name}: is not a readable {self._content} file ({problem}). Export the log again."
            ) from None

    def base(self, place: int) -> int:
        """The time base of a column."""
        return master(place) if place < 0 else self._bases[place]

    def sample(self, place: int) -> str:
        """The first cell of a column."""
        return self._call(reader_process.sample, place)

    def chunks(self, wants: Sequence[Want], size: int) -> Iterator[Chunk]:
        """The requested columns in pieces."""
        number = next(self._numbers)
        self._call(reader_process.begin, number, tuple(wants), size)
        while (chunk := self._call(reader_process.piece, number)) is not None:
            yield chunk
        self._call(reader_process.end, number)
