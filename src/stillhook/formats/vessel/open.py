"""Vessel files: which reader a file needs, found by its content."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from stillhook.base.choice import nearest
from stillhook.errors import SeaError
from stillhook.formats.vessel.capytaine import read_capytaine
from stillhook.formats.vessel.csv import read_rao_csv
from stillhook.formats.vessel.orcaflex import read_orcaflex
from stillhook.formats.vessel.re1 import read_re1
from stillhook.library.catalogue import vessel_file, vessels
from stillhook.library.toml.kinds import kind_of_toml
from stillhook.sea.vessel.floating_body import long_wave_test, remarks, wrong_line
from stillhook.sea.vessel.rao import Rao
from stillhook.units import quote

FORMS = "ShipX/VERES .re1, CSV with declared conventions, Capytaine NetCDF and OrcaFlex text files (.yml)"
LARGEST_FILE = 200_000_000  # bytes


def read_vessel(path: str | os.PathLike[str]) -> Rao:
    """The vessel in a file, or one of the library by its name, tested against what every floating body does in long
    waves (`stillhook.sea.vessel.rao`); what deserves a look is in its notes.

    Errors: SeaError of one line for a file that cannot be read, or whose motions are no floating body's in the
    convention it declares.

    >>> import stillhook
    >>> stillhook.read_vessel("supply-vessel-82m").name
    'Supply vessel 82 m'
    """
    rao = read_untested(path)
    tests = long_wave_test(rao)
    if line := wrong_line(rao, tests):
        raise SeaError(line)
    return replace(rao, notes=(*rao.notes, *remarks(rao, tests)))


def read_untested(path: str | os.PathLike[str]) -> Rao:
    """The same without the test: ShipX/VERES `.re1`, CSV with declared conventions, Capytaine NetCDF, OrcaFlex text
    file."""
    file = _existing_file(path)
    with file.open("rb") as stream:
        binary = stream.read(8).startswith((b"\x89HDF", b"CDF"))
    if binary:
        return read_capytaine(file)
    text = _text(file)
    if file.suffix.lower() == ".re1" or "TRANSFER FUNCTION" in text[:1000].upper():
        return read_re1(file, text)
    if "VesselTypes:" in text:
        return read_orcaflex(file, text)
    if kind := kind_of_toml(text):
        raise SeaError(f"{file.name} is {kind.noun}, not a vessel file: {kind.read_by}. Read as vessels are {FORMS}.")
    if text.startswith("#") or "omega [rad/s]" in text[:1000]:
        return read_rao_csv(file, text)
    raise SeaError(f"{file.name}: is not a known vessel file. Supported: {FORMS}.")


def _existing_file(path: str | os.PathLike[str]) -> Path:
    """The file of a path, or of a name of the library where no such file is."""
    file = Path(path)
    if not file.exists() and str(path) in vessels():
        return vessel_file(str(path))
    if file.is_dir():
        raise SeaError(f"{quote(str(file))} is a folder. Give a vessel file.")
    if not file.is_file():
        near = nearest(str(path), vessels())
        raise SeaError(
            f"{quote(str(path))}: no such vessel file, and no vessel of the library, which has"
            f" {', '.join(vessels())}{near}"
        )
    if not os.access(file, os.R_OK):
        raise SeaError(f"{file.name}: cannot be read (permission denied). Check your rights.")
    if file.stat().st_size > LARGEST_FILE:
        raise SeaError(
            f"{file.name}: {file.stat().st_size / 1e6:.0f} MB, up to {LARGEST_FILE / 1e6:.0f} MB is read. Check the"
            " file."
        )
    return file


def _text(file: Path) -> str:
    data = file.read_bytes()
    if data.startswith((b"\x1f\x8b", b"PK")):
        raise SeaError(f"{file.name}: is compressed. Unpack it.")
    if not data.strip():
        raise SeaError(f"{file.name}: is empty. Supported: {FORMS}.")
    if b"\0" in data:
        raise SeaError(f"{file.name}: is not a text file. Supported: {FORMS}.")
    data = data.replace(b"\r\r\n", b"\n")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")
