"""Files that a command leaves in a folder: checked before anything runs, written all or none, and announced."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from stillhook.base.atomic import check_folder


def check_out(out: Path | None, names: Iterable[str]) -> None:
    """Refuse a folder that files of these names cannot be written to, before the work is done. None: nothing to
    write."""
    if out is not None:
        check_folder(out, tuple(names))


def write_out(out: Path, files: Mapping[str, Any], *, quiet: bool) -> None:
    """Write files by name as `stillhook.formats.results.save_files` does, and announce them unless quiet."""
    from stillhook.formats.results import save_files

    save_files(out, files)
    announce(out, files, quiet=quiet)


def announce(out: Path, names: Iterable[str], *, quiet: bool = False) -> None:
    """Print which files a folder now has."""
    if not quiet:
        print("written: " + ", ".join(str(out / name) for name in names))
