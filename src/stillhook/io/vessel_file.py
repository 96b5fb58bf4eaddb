"""Vessel files: which reader a file needs, found by its content."""

from __future__ import annotations

import os
from pathlib import Path

from stillhook.errors import SeaError
from stillhook.io.rao_re1 import read_re1
from stillhook.sea.rao import Rao
from stillhook.units import came

LARGEST_FILE = 200_000_000  # bytes


def read_vessel(path: str | os.PathLike[str]) -> Rao:
    """The motion transfer functions in a file: ShipX/VERES `.re1`."""
    file = Path(path)
    return read_re1(file, _text(file))


def _text(file: Path) -> str:
    if file.is_dir():
        raise SeaError(f"{came(str(file))} is a folder. Give a vessel file.")
    if not file.is_file():
        raise SeaError(f"{came(str(file))}: no such vessel file. Check the path.")
    if file.stat().st_size > LARGEST_FILE:
        raise SeaError(f"{file.name}: {file.stat().st_size / 1e6:.0f} MB, up to {LARGEST_FILE / 1e6:.0f} MB is read. Check the file.")
    try:
        return file.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError:
        return file.read_bytes().decode("cp1252", errors="replace")
