"""Files that can be made again, each with a checksum: one that is damaged, cut or renamed is never believed and never
an error; it is made again, with one note.

The checksum is the SHA-256 of the file's name and of its content, so that a good file under the name of another is not
believed either. It is the last line of the file, or is beside one that must stay as it is, such as a library. It finds
damage, not intent: whoever can write the file can write its checksum.
"""

from __future__ import annotations

import hashlib
import logging
import stat
from enum import StrEnum
from pathlib import Path

from stillhook.base.atomic import atomic_file

MARK = b"\nstillhook sha256 "
"""Begins the last line of a checked file."""
LINE = len(MARK) + 64 + 1
BESIDE = ".sha256"
"""Suffix of the checksum beside a file."""
LARGEST = 2_000_000_000
"""Bytes; nothing that is kept in this way is larger."""
OTHER = "not what was kept under this name"
"""Why a file is not believed whose checksum fits, or which has another."""
LOG = logging.getLogger("stillhook")


class Kept(StrEnum):
    """Types of files, as what is done about a damaged one; each is noted once in a process."""

    LIBRARY = "The kernel is compiled again"
    MACHINE_CODE = "Numba compiles the kernel again"
    WHEEL = "The compiled kernels of this installation are not used: install Stillhook again"
    ZIG = "Zig makes what it keeps again"
    RESIDUAL = "The winch is identified again"
    ANSWER = "The answer is computed again"
    CASES = "Its cases are computed again"
    CAMPAIGN = "The campaign is measured again"


_NOTED: set[Kept] = set()


def write_checked(file: Path, content: bytes) -> None:
    """Write a file with its checksum, complete or not at all. Errors: SimulationError of one line."""
    with atomic_file(file) as part:
        part.write_bytes(content + _last_line(file, content))


def read_checked(file: Path, kept: Kept) -> bytes | None:
    """The content that `write_checked` was given; None where there is no such file, and, with a note, where it is
    damaged."""
    data = _bytes_of(file, kept)
    if data is None:
        return None
    content = data[:-LINE]
    if data[-LINE:] == _last_line(file, content):
        return content
    complete = data[-LINE:].startswith(MARK)
    note(file, "its checksum does not fit" if complete else "cut, or without its checksum", kept)
    return None


def write_beside(file: Path, content: bytes) -> None:
    """Write the checksum of a file that gets this content next. Errors: SimulationError of one line."""
    write_checked(_checksum_file(file), _digest(file, content).encode())


def is_sound(file: Path, kept: Kept) -> bool:
    """Whether a file has the content that the checksum beside it is of. False, without a note, where one of them is
    absent."""
    if (written := read_checked(_checksum_file(file), kept)) is None or (data := _bytes_of(file, kept)) is None:
        return False
    if written == _digest(file, data).encode():
        return True
    note(file, "its checksum does not fit", kept)
    return False


def note(file: Path, reason: str, kept: Kept) -> None:
    """Say that a file is damaged, once in this process for each type of file."""
    if kept not in _NOTED:
        _NOTED.add(kept)
        LOG.warning(f"{file}: damaged ({reason}). {kept}.")


def _bytes_of(file: Path, kept: Kept) -> bytes | None:
    """All of a file; None where there is none, and, with a note, where it cannot be read."""
    try:
        status = file.stat()
        if not stat.S_ISREG(status.st_mode) or status.st_size > LARGEST:
            raise OSError(None, "not a file" if not stat.S_ISREG(status.st_mode) else "too large")
        return file.read_bytes()
    except FileNotFoundError:
        return None
    except OSError as problem:
        note(file, problem.strerror or "cannot be read", kept)
        return None


def _checksum_file(file: Path) -> Path:
    return file.with_name(file.name + BESIDE)


def _digest(file: Path, content: bytes) -> str:
    digest = hashlib.sha256(file.name.encode() + b"\0")
    digest.update(content)
    return digest.hexdigest()


def _last_line(file: Path, content: bytes) -> bytes:
    return MARK + _digest(file, content).encode() + b"\n"
