"""Temporary files and folders of Stillhook: named after the process that writes them, and removed by a later one where
that was killed.

Removed is what carries such a name, belongs to this user, was not written to for a day, and whose process is not alive
on this machine: a folder may be shared with machines whose processes cannot be seen, hence the day.
"""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import stat
import tempfile
import time
from pathlib import Path

AGE = 86_400.0
"""Seconds since the last write, after which a temporary file may be a leftover."""
LONGEST = 40
"""Characters of a target's name in that of its temporary file: names of files have at most 255 bytes."""
_TEMPORARY = re.compile(r"(?:\..*|stillhook-[a-z-]+)-(\d+)\.part-[a-z0-9_]{8}(?:\..*)?")
_SWEPT: set[tuple[Path, bool]] = set()


def prefix(of: str) -> str:
    """Start of the name of a temporary file or folder of this process."""
    return f"{of[:LONGEST]}-{os.getpid()}.part-"


def temporary_folder(purpose: str) -> tempfile.TemporaryDirectory[str]:
    """A folder among the system's temporary ones that a later process removes where this one is killed. purpose: a word
    for its name."""
    sweep(Path(tempfile.gettempdir()))
    return tempfile.TemporaryDirectory(prefix=prefix(f"stillhook-{purpose}"), ignore_cleanup_errors=True)


def sweep(folder: Path, *, own: bool = False) -> None:
    """Remove leftovers of killed processes from a folder, once in the life of this process; never an error.

    own: a folder of the cache, where every hidden file is Stillhook's.
    """
    if (folder, own) in _SWEPT:
        return
    _SWEPT.add((folder, own))
    with contextlib.suppress(OSError):
        for entry in list(os.scandir(folder)):
            name = _TEMPORARY.fullmatch(entry.name)
            if name or (own and entry.name.startswith(".")):
                with contextlib.suppress(OSError):
                    _remove_leftover(Path(entry.path), int(name[1]) if name else None)


def _remove_leftover(path: Path, process: int | None) -> None:
    status = path.lstat()
    if stat.S_ISLNK(status.st_mode) or (os.name != "nt" and status.st_uid != os.geteuid()):
        return
    folder = stat.S_ISDIR(status.st_mode)
    last = max([status.st_mtime, *(each.lstat().st_mtime for each in path.rglob("*"))]) if folder else status.st_mtime
    if time.time() - last < AGE or (process is not None and _is_alive(process)):
        return
    if folder:
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def _is_alive(process: int) -> bool:
    """Whether a process of this number runs on this machine. On Windows, where that question would end the process,
    the age of its files decides."""
    if os.name == "nt":
        return process == os.getpid()
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # of another user
        return True
    return True
