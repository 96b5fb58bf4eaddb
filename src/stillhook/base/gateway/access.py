"""Files that users name: opened, or refused in one line that says what to give; and their bytes within a budget.

A pipe or device in place of a file is refused without waiting for it; of a file that grows meanwhile, no more is read
than the budget allows.
"""

from __future__ import annotations

import gzip
import hashlib
import os
import stat
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from io import BufferedReader
from pathlib import Path

from stillhook.base.gateway.budget import Budget
from stillhook.errors import StillhookError
from stillhook.units import quote

FOREIGN = (
    (b"\x1f\x8b", "gzip"),
    (b"PK\x03\x04", "zip or Excel"),
    (b"\x89HDF", "HDF5 or NetCDF"),
    *((b"CDF" + version, "NetCDF") for version in (b"\x01", b"\x02", b"\x05")),
    (b"%PDF", "PDF"),
    (b"\xd0\xcf\x11\xe0", "old Excel"),
    (b"7z\xbc\xaf", "7z"),
    *((begin, "web page") for begin in (b"<!", b"<html", b"<HTML", b"<?xml")),
)
"""First bytes of files that are not text, and what to call them."""


SEPARATORS = (b",", b";", b"\t")
"""Signs between the cells of a table."""


@contextmanager
def opened(path: str | os.PathLike[str], noun: str, error: type[StillhookError]) -> Iterator[BufferedReader]:
    """A file to read from; noun: what it should be, for messages.

    Errors: one line for what is not there, is a folder, a pipe or a device, or may not be read.
    """
    with _open(path, noun, error) as stream:
        try:
            yield stream
        except OSError as problem:
            raise _unreadable(path, problem, error) from None


def _open(path: str | os.PathLike[str], noun: str, error: type[StillhookError]) -> BufferedReader:
    try:
        file = Path(path)
        _refuse_other(file, file.stat().st_mode, noun, error)
        stream = open(file, "rb", opener=_at_once)  # noqa: SIM115  # closed by `opened`
    except FileNotFoundError:
        raise error(f"{quote(str(path))}: no such file. Check the path.") from None
    except (OSError, ValueError, TypeError) as problem:
        raise _unreadable(path, problem, error) from None
    try:
        _refuse_other(file, os.fstat(stream.fileno()).st_mode, noun, error)
    except BaseException:
        stream.close()
        raise
    return stream


def _at_once(path: str, flags: int) -> int:
    """Open without waiting: a pipe that took the file's place has nobody who writes."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def _refuse_other(file: Path, mode: int, noun: str, error: type[StillhookError]) -> None:
    if stat.S_ISDIR(mode):
        raise error(f"{file}: is a folder. Give one {noun} in it.")
    if not stat.S_ISREG(mode):
        raise error(f"{file}: is not an ordinary file. Give a {noun}.")


def _unreadable(path: object, problem: Exception, error: type[StillhookError]) -> StillhookError:
    reason = getattr(problem, "strerror", None) or " ".join(str(problem).split())
    return error(f"{quote(str(path))}: cannot be read ({reason}). Check the name and your rights.")


def first_bytes(path: str | os.PathLike[str], size: int, noun: str, error: type[StillhookError]) -> tuple[Path, bytes]:
    """The path and the first bytes of a file. Errors: as `opened`."""
    with opened(path, noun, error) as stream:
        return Path(path), stream.read(size) or b""


def sha256_of(path: str | os.PathLike[str], error: type[StillhookError]) -> str:
    """Hash of a file of any size. Errors: as `opened`."""
    with opened(path, "file", error) as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def refuse_foreign(name: str, head: bytes, error: type[StillhookError], instead: str) -> None:
    """Refuse what begins as no text does. Errors: one line with what it is, and what to do instead."""
    for magic, content in FOREIGN:
        if head.lstrip().startswith(magic):
            raise error(f"{name}: is a {content} file. {instead}")


def read_bytes(path: str | os.PathLike[str], noun: str, error: type[StillhookError], budget: Budget) -> bytes:
    """All bytes of a file. Errors: as `opened`, and where it is larger than its budget."""
    with opened(path, noun, error) as stream:
        data = stream.read(budget.size + 1) or b""
    return _within(data, Path(path).name, noun, error, budget)


def unpacked(path: str | os.PathLike[str], noun: str, error: type[StillhookError], budget: Budget) -> bytes:
    """What a file holds, plain or gz. Errors: as `read_bytes`, and where it is damaged."""
    name = Path(path).name
    with opened(path, noun, error) as stream:
        compressed = stream.read(2) == b"\x1f\x8b"
        stream.seek(0)
        try:
            data = (gzip.GzipFile(fileobj=stream) if compressed else stream).read(budget.size + 1)
        except (EOFError, zlib.error, gzip.BadGzipFile) as problem:
            raise error(f"{name}: the gz file is cut short or damaged ({problem}). Fetch it again.") from None
    return _within(data or b"", name, noun, error, budget)


def _within(data: bytes, name: str, noun: str, error: type[StillhookError], budget: Budget) -> bytes:
    if len(data) > budget.size:
        raise error(f"{name}: holds more than {budget.size / 1e6:g} MB. Give a smaller {noun}.")
    if budget.rows and max(data.count(b"\n"), data.count(b"\r")) > budget.rows:
        raise error(f"{name}: holds more than {budget.rows} lines. Give a part of it.")
    if budget.cells and sum(map(data.count, SEPARATORS)) > budget.cells:
        raise error(f"{name}: holds more than {budget.cells} cells. Give a part of it.")
    return data


def read_text(
    path: str | os.PathLike[str], noun: str, error: type[StillhookError], budget: Budget, *, errors: str = "strict"
) -> str:
    """The text of a file in UTF-8, with or without a mark of byte order; errors: as `bytes.decode` has them. Errors: as
    `read_bytes`, and where it is not UTF-8."""
    data = read_bytes(path, noun, error, budget)
    try:
        return data.decode("utf-8-sig", errors)
    except UnicodeDecodeError as problem:
        raise error(f"{Path(path).name}: not UTF-8 text (byte {problem.start}). Save it as UTF-8.") from None
