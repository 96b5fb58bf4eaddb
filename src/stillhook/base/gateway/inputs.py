"""Files that a command follows from: those that the user typed, and those that they name. The manifest of what the
command writes has their hashes.

Only a command collects them (`collecting`): manifests of what a program writes name none. Files of the package are left
out: the hash of the code covers them.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from stillhook.base.kept.sources import PACKAGE

NOT_READ = ("out", "store", "save", "key", "reference", "film")
"""Options that name what is written, or a private key."""
LOG = logging.getLogger("stillhook")
_State = tuple[int, int]
_FILES: ContextVar[dict[Path, _State] | None] = ContextVar("files that a command follows from", default=None)
_DOUBTED: ContextVar[dict[Path, None] | None] = ContextVar("files that are not those of their manifest", default=None)


@contextmanager
def collecting(options: Mapping[str, Any]) -> Iterator[None]:
    """A command runs, with these options by name: its files are collected."""
    before, doubted_before = _FILES.set({}), _DOUBTED.set({})
    try:
        for name, value in options.items():
            for each in value if isinstance(value, list | tuple) else [value]:
                if isinstance(each, str | Path) and name not in NOT_READ:
                    note_input(Path(each))
        yield
    finally:
        _FILES.reset(before)
        _DOUBTED.reset(doubted_before)


def note_input(path: Path) -> None:
    """A file is one of the command's, if it is one: not a folder, and not of the package."""
    if (files := _FILES.get()) is not None and (state := _state(path)) is not None:
        end = Path(os.path.realpath(path))
        if not end.is_relative_to(PACKAGE.folder):
            files.setdefault(end, state)


def note_doubted(path: Path) -> None:
    """A file that the command reads is another one than the manifest of its folder says."""
    if (files := _DOUBTED.get()) is not None:
        files[path] = None


def doubted() -> tuple[Path, ...]:
    """Such files of the command that runs, none outside of one."""
    return tuple(_DOUBTED.get() or ())


def inputs() -> Iterator[Path]:
    """Files of the command that runs, none outside of one. One that has changed or gone since is left out with a line
    on standard error: it is not known any more what was read."""
    for path, state in (_FILES.get() or {}).items():
        if _state(path) == state:
            yield path
        else:
            LOG.warning(f"{path}: changed while the command ran, so that the manifest does not name it.")


def _state(path: Path) -> _State | None:
    """Size and time of the last change of a file; None where there is none."""
    if not os.path.isfile(path):
        return None
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_size, status.st_mtime_ns
