"""Names of sheets in Excel files: `hindcast.xlsx#2010` is the sheet 2010 of hindcast.xlsx; without a name the first."""

from __future__ import annotations

from os.path import isfile
from pathlib import Path

ENDINGS = (".xlsx", ".xlsm")
"""Files that hold sheets."""


def sheet_of(path: Path) -> tuple[Path, str]:
    """The file and the sheet that a path names; "" for the first sheet. A file whose own name has a # is itself."""
    name, sign, sheet = path.name.rpartition("#")
    if sign and Path(name).suffix.lower() in ENDINGS and not isfile(path):
        return path.with_name(name), sheet
    return path, ""


def is_table(path: Path) -> bool:
    """Whether there is such a file, or the Excel file of such a sheet."""
    return isfile(sheet_of(path)[0])
