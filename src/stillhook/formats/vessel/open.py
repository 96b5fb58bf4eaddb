"""Vessel files: which reader a file needs, found by its content."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from stillhook.base.choice import nearest
from stillhook.base.gateway.access import first_bytes, read_bytes, refuse_foreign
from stillhook.base.gateway.budget import RECORDS
from stillhook.base.gateway.guard import reader
from stillhook.errors import SeaError
from stillhook.formats.vessel.aqwa import is_aqwa, read_aqwa
from stillhook.formats.vessel.capytaine import read_capytaine
from stillhook.formats.vessel.csv import read_rao_csv
from stillhook.formats.vessel.hydrostar import is_hydrostar, read_hydrostar
from stillhook.formats.vessel.orcaflex import read_orcaflex
from stillhook.formats.vessel.re1 import read_re1
from stillhook.formats.vessel.supplement import NOTHING, read_description, wrong
from stillhook.formats.vessel.wamit import is_wamit, read_wamit
from stillhook.library.catalogue import vessel_file, vessels
from stillhook.library.toml.kinds import FileKind, kind_of_toml
from stillhook.sea.vessel.floating_body import long_wave_test, remarks, wrong_line
from stillhook.sea.vessel.rao import Rao
from stillhook.units import quote

SUPPORTED = (
    "Supported: ShipX/VERES .re1, CSV with declared conventions, Capytaine NetCDF, OrcaFlex text files (.yml), AQWA"
    " .lis, WAMIT .4, HydroStar .rao and vessel descriptions (TOML)."
)


@reader(SeaError)
def read_vessel(path: str | os.PathLike[str]) -> Rao:
    """The vessel in a file of motions or a vessel description, or one of the library by its name.

    Parameters
    ----------
    path : str or path-like
        Path of the file, or a name of the library, such as "supply-vessel-82m".

    Returns
    -------
    Rao
        Motions per wave, tested against what every floating body does in long waves (`stillhook.sea.vessel.rao`); what
        deserves a look is in its notes.

    Raises
    ------
    SeaError
        One line, for a file that cannot be read, or whose motions are not those of a floating body in the
        convention it declares.

    Examples
    --------
    >>> import stillhook
    >>> stillhook.read_vessel("supply-vessel-82m").name
    'Supply vessel 82 m'
    """
    rao = read_untested(path)
    tests = long_wave_test(rao)
    if line := wrong_line(rao, tests):
        raise SeaError(line)
    return replace(rao, notes=(*rao.notes, *remarks(rao, tests)))


@reader(SeaError)
def read_untested(path: str | os.PathLike[str]) -> Rao:
    """The same without the test: a file of motions, or the one that a vessel description names."""
    file, head = first_bytes(_existing_file(path), 8, "vessel file", SeaError)
    stated = NOTHING
    if file.suffix.lower() == ".toml" and kind_of_toml(_text(file)) in (FileKind.VESSEL, None):
        file, stated = read_description(file)
        file, head = first_bytes(_existing_file(file), 8, "vessel file", SeaError)
    if head.startswith((b"\x89HDF", b"CDF")):
        return read_capytaine(file, stated)
    text = _text(file)
    if kind := kind_of_toml(text):
        raise SeaError(f"{file.name} is {kind.noun}, not a vessel file: {kind.read_by}. {SUPPORTED}")
    ending = file.suffix.lower()
    form = next((form for form in TEXT_FORMS if form.recognises(text) or ending == form.ending), None)
    if form is None:
        raise wrong(file.name, "is not a known vessel file", SUPPORTED)
    stated.allow(file.name, form.noun, *form.open)
    return form.read(file, text, stated) if form.open else form.read(file, text)


class TextForm(NamedTuple):
    """A form of text file: what it is called, how it is recognised by its content (or by the ending of its name), how
    it is read, and what may be stated of it in addition."""

    noun: str
    recognises: Callable[[str], bool]
    read: Callable[..., Rao]
    open: tuple[str, ...] = ()
    ending: str | None = None


TEXT_FORMS = (
    TextForm("HydroStar .rao files", is_hydrostar, read_hydrostar),
    TextForm(
        "ShipX/VERES .re1 files", lambda text: "TRANSFER FUNCTION" in text[:1000].upper(), read_re1, ending=".re1"
    ),
    TextForm("OrcaFlex models", lambda text: "VesselTypes:" in text, read_orcaflex, ("vessel_type", "draught")),
    TextForm(
        "CSV files with declared conventions",
        lambda text: text.startswith("#") or "omega [rad/s]" in text[:1000],
        read_rao_csv,
    ),
    TextForm("AQWA .lis files", is_aqwa, read_aqwa, ("body",)),
    TextForm("WAMIT .4 files", is_wamit, read_wamit, ("body", "length_scale", "depth")),
)
"""The first that recognises a file reads it."""


def _existing_file(path: str | os.PathLike[str]) -> Path:
    """The file of a path, or of a name of the library where no such file is."""
    file = Path(path)
    if not file.exists() and str(path) in vessels():
        return vessel_file(str(path))
    if not file.exists():
        have = f"{', '.join(vessels())}{nearest(str(path), vessels())}"
        raise SeaError(f"{quote(str(path))}: no such vessel file, and no vessel of the library, which has {have}")
    return file


def _text(file: Path) -> str:
    data = read_bytes(file, "vessel file", SeaError, RECORDS)
    refuse_foreign(file.name, data, SeaError, "Unpack it, or export the motions as text.")
    if not data.strip():
        raise wrong(file.name, "is empty", SUPPORTED)
    if b"\0" in data:
        raise wrong(file.name, "is not a text file", SUPPORTED)
    data = data.replace(b"\r\r\n", b"\n")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")
