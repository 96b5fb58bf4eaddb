"""Hashes of the package's own files: what is kept, and what is handed out, names the code that made it by one.

The folder is walked once in the life of a process, and each file is read once, when the first hash needs it.
"""

from __future__ import annotations

import functools
import hashlib
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

LEFT_OUT = ("__pycache__", "shipped")
"""Folders of what is made from the rest: bytecode; kernels and residuals of a wheel."""


class Sources:
    """The files of a folder by their names in it, "/" between folders."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._digests: dict[str, bytes] = {}

    @functools.cached_property
    def names(self) -> tuple[str, ...]:
        """All of them, in the same order on every system; without hidden ones."""
        return tuple(sorted(_names(str(self.folder), "")))

    def inside(self, folders: Iterable[str], endings: tuple[str, ...]) -> list[str]:
        """Those in some folders, or below, that end so."""
        starts = tuple(f"{folder}/" for folder in folders)
        return [name for name in self.names if name.startswith(starts) and name.endswith(endings)]

    def hash(self, names: Iterable[str], *, before: str = "", others: Iterable[Path] = ()) -> str:
        """SHA-256 as hexadecimal digits of a text, of files with their names in order, and of other files as they are
        now. Errors: OSError where one cannot be read."""
        digest = hashlib.sha256(before.encode())
        for name in sorted(names):
            digest.update(name.encode() + b"\0" + self._digest(name))
        for path in others:
            digest.update(path.read_bytes())
        return digest.hexdigest()

    def _digest(self, name: str) -> bytes:
        known = self._digests.get(name)
        if known is None:
            with open(f"{self.folder}/{name}", "rb", buffering=0) as file:  # a Path takes as long as the reading
                known = self._digests[name] = hashlib.sha256(file.read()).digest()
        return known


def _names(folder: str, place: str) -> Iterator[str]:
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.name in LEFT_OUT or entry.name.startswith("."):
                continue
            if entry.is_dir(follow_symlinks=False):
                yield from _names(entry.path, f"{place}{entry.name}/")
            else:
                yield place + entry.name


PACKAGE = Sources(Path(__file__).resolve().parents[2])
