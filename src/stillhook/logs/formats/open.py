"""Opens a log by its content: text, Parquet, MDF4, TDMS, MAT v5 and v7.3.

A log of a binary format, read in a separate process: see `stillhook.formats.binary`.
"""

from __future__ import annotations

import itertools
import os
import weakref
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from stillhook.base.extras import how_to_get, installed
from stillhook.base.gateway.access import first_bytes, refuse_foreign
from stillhook.base.gateway.guard import reader
from stillhook.errors import LogError, UnreadableError
from stillhook.formats import binary as reader_process
from stillhook.formats.binary import Reader, time_limit
from stillhook.logs.formats.columnar import open_hdf, open_mat, open_mdf, open_parquet, open_tdms
from stillhook.logs.formats.csv import open_csv
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
        return master(place) if place < 0 else self._bases[place]

    def sample(self, place: int) -> str:
        return self._call(reader_process.sample, place)

    def chunks(self, wants: Sequence[Want], size: int) -> Iterator[Chunk]:
        number = next(self._numbers)
        self._call(reader_process.begin, number, tuple(wants), size)
        while (chunk := self._call(reader_process.piece, number)) is not None:
            yield chunk
        self._call(reader_process.end, number)


_HEAD = 512


@reader(LogError)
def open_log(path: str | os.PathLike[str]) -> Source:
    """The log at a path, opened. Errors: LogError of one line for what is not a log."""
    file, head = first_bytes(path, 2 * _HEAD, "log file", LogError)
    if not head:
        raise LogError(f"{file.name}: is empty. Give a log with a header and rows of numbers.")
    return _opened(file, head)


def _opened(file: Path, head: bytes) -> Source:
    if head.startswith(b"PAR1"):
        _need("duckdb", "Parquet", file)
        return BinaryLog(file, "Parquet", open_parquet)
    if head.startswith((b"MDF ", b"UnFinMF")):
        _need("asammdf", "MDF", file)
        return BinaryLog(file, "MDF", open_mdf)
    if head.startswith(b"TDSm"):
        _need("nptdms", "TDMS", file)
        return BinaryLog(file, "TDMS", open_tdms)
    if head.startswith(b"\x89HDF") or head[_HEAD:].startswith(b"\x89HDF"):  # MATLAB puts 512 bytes of text before
        return BinaryLog(file, "HDF5", open_hdf)
    if head.startswith(b"MATLAB "):
        return BinaryLog(file, "MAT", open_mat)
    refuse_foreign(file.name, head, LogError, "Unpack it, or save the log as CSV or Parquet.")
    return open_csv(file)


def _need(reader: str, content: str, file: Path) -> None:
    if not installed(reader):
        raise LogError(f"{file.name}: is {content}, which takes the reader {reader}: {how_to_get(reader)}.")
