"""Paths that a file names: they lead to files in the folder of that file, and elsewhere only where the user allows it.

A file that comes from somebody else could otherwise have any file of the user read, or written over. A path that the
user types is followed as it is; one in a file that was read goes through `named_path`. The user allows further folders
in the environment variable `STILLHOOK_FILES`, separated as in PATH, or types one whose files are read (`allowing`).
Names are compared before anything is looked up, so that no server is asked for a path of a network, and again after
links are followed.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path, PureWindowsPath

from stillhook.base.gateway.inputs import note_input
from stillhook.errors import StillhookError
from stillhook.units import quote

_TYPED: ContextVar[tuple[Path, ...]] = ContextVar("folders that the user typed", default=())
VARIABLE = "STILLHOOK_FILES"
"""Environment variable with the folders that files may name files in, besides their own."""

LONGEST_NAME = 255
"""Bytes of a name on the usual file systems."""


def named_path(folder: Path, name: str, wrong: Callable[[str], StillhookError]) -> Path:
    """The path that a file in a folder names, which need not exist.

    Parameters: folder of the file; name: as it is written there; wrong: the error of a message without the name.

    Errors: what `wrong` makes, one line, for a path that leads out of the folder and of those that are allowed, by its
    name or by a link on its way.
    """
    path = folder / name
    try:
        kept = [Path(os.path.abspath(each)) for each in (folder, *_allowed())]
        if not any(Path(os.path.abspath(path)).is_relative_to(each) for each in kept):
            raise wrong(_leads_out(Path(os.path.abspath(path)), "leads"))
        book, sign, _ = path.name.rpartition("#")  # of a sheet of an Excel file: "book.xlsx#sheet"
        for end in (path.resolve(), *([path.with_name(book).resolve()] if sign and book else [])):
            if not any(end.is_relative_to(each.resolve()) for each in kept):
                raise wrong(_leads_out(end, "is a link that leads"))
        with suppress(FileNotFoundError, NotADirectoryError):
            path.lstat()  # a name that is too long, a folder that may not be entered
    except (OSError, RuntimeError, ValueError) as problem:  # a zero byte in the name, a loop of links
        reason = getattr(problem, "strerror", None) or " ".join(str(problem).split())
        raise wrong(f"not a path that can be followed ({reason}). Correct it.") from None
    note_input(path)
    return path


def links_in(folder: Path) -> Iterator[str]:
    """Links in a folder and below, as a file in it would name them; none where it does not exist."""
    for where, folders, files in os.walk(folder):
        for path in (Path(where, each) for each in (*folders, *files)):
            if path.is_symlink():
                yield path.relative_to(folder).as_posix()


def plain_name(name: str) -> bool:
    """Whether a text is the name of a file alone, on every system: no folder, drive or link to one."""
    alone = name not in ("", "..") and PureWindowsPath(name).name == name
    return alone and len(name.encode(errors="replace")) <= LONGEST_NAME


def _leads_out(end: Path, how: str) -> str:
    folder = str(end.parent)
    return (
        f"{how} out of the folder of this file. Copy it there, or allow its folder, or that of the whole project, in"
        f" the environment: {VARIABLE}={folder if folder.isprintable() else quote(folder)}."
    )


@contextmanager
def allowing(folders: Iterable[Path]) -> Iterator[None]:
    """Files that are read meanwhile may name files in these folders, which the user typed."""
    before = _TYPED.set((*_TYPED.get(), *folders))
    try:
        yield
    finally:
        _TYPED.reset(before)


def _allowed() -> list[Path]:
    """Folders that the user allows."""
    return [*_TYPED.get(), *(Path(each) for each in os.environ.get(VARIABLE, "").split(os.pathsep) if each)]
