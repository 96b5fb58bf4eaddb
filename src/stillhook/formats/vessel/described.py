"""Vessel descriptions: a TOML that names a file of motions and states what this file leaves open.

What may be stated, with an example: `stillhook.formats.vessel.supplement`.
"""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from stillhook.errors import SeaError
from stillhook.formats.vessel.supplement import Supplement
from stillhook.library.toml.file import TomlTable, read_toml
from stillhook.library.toml.kinds import FileKind
from stillhook.tables.table import Text


class VesselDescription(Supplement):
    """A vessel description as it is written."""

    motions: Text = Field(description="file of motions, seen from this file")


def read_description(path: Path) -> tuple[Path, Supplement]:
    """The file of motions that a description names, and what is stated of it. Errors: SeaError or UnitError of one
    line."""
    return read_toml(path, FileKind.VESSEL, SeaError, _description, start='Write motions = "FILE".')


def _description(table: TomlTable) -> tuple[Path, Supplement]:
    stated = table.read(VesselDescription)
    if stated.radii is not None and min(stated.radii) <= 0.0:
        raise table.wrong("radii of gyration are above 0 m. Correct them.", "radii")
    file = table.relative_file(stated.motions, "motions")
    if file.suffix.lower() == ".toml":
        raise table.wrong("is TOML as well. Name the file that holds the motions.", "motions")
    return file, stated
