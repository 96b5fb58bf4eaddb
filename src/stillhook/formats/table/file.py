"""Files of text that users name: opened, or refused in one line that says what to give."""

from __future__ import annotations

import gzip
import os
import stat
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from stillhook.errors import StillhookError
from stillhook.units import quote

LARGEST = 200_000_000
"""Bytes; a year of hourly spectra has 3 million, of 10 min weather 5 million."""
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


@contextmanager
def opened(path: str | os.PathLike[str], noun: str, error: type[StillhookError]) -> Iterator[BinaryIO]:
    """A file to read from; noun: what it should be, for messages.

    Errors: one line for what is not there, is a folder, a pipe or a device, or may not be read.
    """
    file = Path(path)
    try:
        mode = file.stat().st_mode
        if stat.S_ISDIR(mode):
            raise error(f"{file}: is a folder. Give one {noun} in it.")
        if not stat.S_ISREG(mode):
            raise error(f"{file}: is not an ordinary file. Give a {noun}.")
        with file.open("rb") as stream:
            yield stream
    except FileNotFoundError:
        raise error(f"{quote(str(file))}: no such file. Check the name and the folder.") from None
    except (OSError, ValueError) as problem:
        reason = getattr(problem, "strerror", None) or problem
        raise error(f"{quote(str(file))}: cannot be read ({reason}). Check the name and your rights.") from None


def first_bytes(path: str | os.PathLike[str], size: int, noun: str, error: type[StillhookError]) -> tuple[Path, bytes]:
    """The path and the first bytes of a file. Errors: as `opened`."""
    with opened(path, noun, error) as stream:
        return Path(path), stream.read(size)


def refuse_foreign(name: str, head: bytes, error: type[StillhookError], instead: str) -> None:
    """Refuse what begins as no text does. Errors: one line with what it is, and what to do instead."""
    for magic, content in FOREIGN:
        if head.lstrip().startswith(magic):
            raise error(f"{name}: is a {content} file. {instead}")


def unpacked(path: str | os.PathLike[str], noun: str, error: type[StillhookError], largest: int | None = None) -> bytes:
    """What a file holds, plain or gz, up to a size [bytes]. Errors: as `opened`, and where damaged or larger."""
    file, largest = Path(path), largest or LARGEST
    with opened(file, noun, error) as stream:
        compressed = stream.read(2) == b"\x1f\x8b"
        stream.seek(0)
        try:
            data = (gzip.GzipFile(fileobj=stream) if compressed else stream).read(largest + 1)
        except (EOFError, zlib.error, gzip.BadGzipFile) as problem:
            raise error(f"{file.name}: the gz file is cut short or damaged ({problem}). Fetch it again.") from None
    if len(data) > largest:
        raise error(f"{file.name}: holds more than {largest / 1e6:g} MB. Give a smaller {noun}.")
    return data
