"""Work that one process does and the others wait for."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import time
from collections.abc import Iterator
from pathlib import Path

LONGEST = 600.0
"""Seconds that a process waits for another, before it does the work itself: longer than any kernel takes to compile."""
AGE = 86_400.0
"""Seconds after which the file of a lock that nobody holds is removed."""


@contextlib.contextmanager
def one_at_a_time(lock: Path, wait: float = LONGEST) -> Iterator[None]:
    """One process of this machine within, the others wait [s]. The system frees the lock of a process that ends in any
    way. Without filelock (extra `native`), and where no lock can be made, nobody waits: what is written inside must
    be written by `atomic_file`."""
    if importlib.util.find_spec("filelock") is None:
        yield
        return
    from filelock import FileLock

    held = FileLock(lock)
    try:
        held.acquire(timeout=wait)
    except (OSError, NotImplementedError):  # its Timeout is an OSError
        yield
        return
    try:
        yield
    finally:
        held.release()


def remove_old_locks(folder: Path) -> None:
    """Remove the files of locks that nobody holds and that are a day old; never an error."""
    if importlib.util.find_spec("filelock") is None:
        return
    from filelock import FileLock

    with contextlib.suppress(OSError):
        for path in folder.glob("*.lock"):
            with contextlib.suppress(OSError, NotImplementedError):
                if time.time() - path.lstat().st_mtime > AGE:
                    with FileLock(path, timeout=0):  # whoever opened it meanwhile finds it gone, and tries again
                        os.unlink(path)
