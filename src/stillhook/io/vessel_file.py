"""Vessel files: which reader a file needs, found by its content."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from stillhook.errors import SeaError
from stillhook.io.rao_csv import read_rao_csv
from stillhook.io.rao_re1 import read_re1
from stillhook.sea.long_wave import long_wave_test, remarks, wrong_line
from stillhook.sea.rao import Rao
from stillhook.units import came

FORMS = "ShipX/VERES .re1 and CSV with declared conventions (stillhook vessel show --help)"
LARGEST_FILE = 200_000_000  # bytes


def read_vessel(path: str | os.PathLike[str]) -> Rao:
    """The vessel in a file, tested against what every floating body does in long waves (`sea.long_wave`); what deserves a look is in its
    notes.

    Errors: SeaError of one line for a file that cannot be read, or whose motions are no floating body's in the convention it declares.
    """
    rao = read_untested(path)
    tests = long_wave_test(rao)
    if line := wrong_line(rao, tests):
        raise SeaError(line)
    return replace(rao, notes=(*rao.notes, *remarks(rao, tests)))


def read_untested(path: str | os.PathLike[str]) -> Rao:
    """The motion transfer functions in a file: ShipX/VERES `.re1`, or CSV with declared conventions."""
    file = Path(path)
    text = _text(file)
    if "TRANSFER FUNCTION" in text[:1000].upper():
        return read_re1(file, text)
    if text.startswith("#") or "omega [rad/s]" in text[:1000]:
        return read_rao_csv(file, text)
    raise SeaError(f"{file.name}: is no vessel file that is known. Read are {FORMS}.")


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
