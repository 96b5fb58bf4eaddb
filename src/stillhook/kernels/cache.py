"""The folder that compiled kernels are kept in. What is in it runs as machine code, so only a folder that nobody else
may write to is used.

On POSIX systems the folder belongs to the user, and neither group nor others may write to it; every folder above it
belongs to the user or to root, and is closed in the same way or has the sticky bit, as /tmp has. Links are resolved
first. Access lists of network drives are not read. On Windows rights are not read either: a folder inside the user's
profile is taken, which Windows closes to other users, and no other.
"""

from __future__ import annotations

import contextlib
import functools
import getpass
import logging
import os
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path

import platformdirs

from stillhook.base.kept.leftovers import prefix, sweep
from stillhook.errors import SimulationError

VARIABLE = "STILLHOOK_CACHE"
SHIPPED = Path(__file__).resolve().parents[1] / "shipped"
"""What a wheel is made with: compiled kernels and residuals. A checkout has none."""
PRIVATE = 0o700
LOG = logging.getLogger("stillhook")


def cache_root() -> Path:
    """Folder for compiled kernels and residuals: STILLHOOK_CACHE, else the user's cache folder; a private temporary one
    where that cannot be written to, or where somebody else may write to it, which is noted once."""
    wanted = Path(os.environ.get(VARIABLE) or platformdirs.user_cache_dir("stillhook", appauthor=False))
    try:
        wanted = wanted.resolve()
        reason = weakness(wanted)
        if not reason:
            make_private(wanted)
            reason = weakness(wanted)
        if not reason:
            return wanted if os.access(wanted, os.W_OK) else private_folder()
    except (
        OSError,
        RuntimeError,
        ValueError,
    ):  # a loop of links is a RuntimeError, a zero byte in the name a ValueError
        return private_folder()
    _note(wanted, reason)
    return private_folder()


@functools.cache
def _note(folder: Path, reason: str) -> None:
    LOG.warning(
        f"Cache folder {folder}: {reason}, so compiled code is kept in {private_folder()} instead. "
        f"Remove the folder, or set {VARIABLE} to one that only you can write to."
    )


def weakness(folder: Path) -> str:
    """Why somebody else could replace what is in a resolved folder, "" where nobody can. What does not exist yet is
    left out."""
    if os.name == "nt":
        return "" if folder.is_relative_to(Path.home().resolve()) else "is outside your profile"
    for path in (folder, *folder.parents):
        try:
            status = path.lstat()
        except FileNotFoundError:
            continue
        prefix = "" if path == folder else f"{path} "
        if not stat.S_ISDIR(status.st_mode):
            return f"{prefix}is not a folder"
        if status.st_uid != os.geteuid() and (path == folder or status.st_uid != 0):
            return f"{prefix}belongs to another user"
        if status.st_mode & 0o022 and (path == folder or not status.st_mode & stat.S_ISVTX):
            return f"others may write to {path if prefix else 'it'}"
    return ""


def weak_content(folder: Path) -> str:
    """Why what is in a folder of the cache is not to be trusted: a link, another owner, or files that others may write
    to; "" where all is well or nothing is there."""
    if os.name == "nt" or not os.path.lexists(folder):
        return ""
    closed = not (folder.lstat().st_mode & folder.parent.lstat().st_mode) & 0o011
    for path in (folder, *_below(folder)):
        status = path.lstat()
        if stat.S_ISLNK(status.st_mode):
            return f"{path.name} in it is a link"
        if status.st_uid != os.geteuid():
            return f"{path.name} in it belongs to another user"
        if status.st_mode & 0o022 and not closed:
            return f"others may write to {path.name} in it"
    return ""


def _below(folder: Path) -> Iterator[Path]:
    for top, folders, files in os.walk(folder):
        yield from (Path(top) / name for name in (*folders, *files))


def make_private(folder: Path) -> None:
    """Make a folder, and what is missing above it, that only the user can enter."""
    for path in (*reversed(folder.parents), folder):
        path.mkdir(mode=PRIVATE, exist_ok=True)


def kernel_folder(name: str) -> Path:
    """The cache's folder of this name, not made yet; one in the private folder where its content is not to be trusted,
    which is noted once."""
    folder = cache_root() / name
    try:
        reason = weak_content(folder)
    except OSError as problem:  # removed by another process meanwhile
        reason = str(problem.strerror)
    if reason:
        _note(folder, reason)
        return private_folder() / name
    return folder


@functools.cache
def private_folder() -> Path:
    """A temporary folder that nobody else can write to. Errors: SimulationError where there is none."""
    above = Path(tempfile.gettempdir()).resolve()
    for name in ("stillhook-cache", f"stillhook-cache-{getpass.getuser()}"):
        with contextlib.suppress(OSError):
            (above / name).mkdir(mode=PRIVATE, exist_ok=True)
            if not weakness(above / name):
                return above / name
    sweep(above)
    made = Path(tempfile.mkdtemp(prefix=prefix("stillhook-cache")))
    if reason := weakness(made):
        made.rmdir()
        raise SimulationError(
            f"{above}: {reason}, so that no compiled code can be kept there. Set {VARIABLE} to a folder that only you"
            " can write to."
        )
    return made
