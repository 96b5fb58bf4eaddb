"""Writes a table in the format that a file's name, or the user, says."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import ModuleType

from stillhook import units
from stillhook.base.atomic import atomic_file
from stillhook.errors import ConvertError
from stillhook.formats.out import csv, mat, mdf, orcaflex, parquet, sima
from stillhook.formats.out.table import Content

FORMATS: Mapping[str, ModuleType] = {
    "csv": csv,
    "parquet": parquet,
    "mat": mat,
    "mdf": mdf,
    "orcaflex": orcaflex,
    "sima": sima,
}
"""Formats by name."""
SUFFIXES = {module.SUFFIX: name for name, module in FORMATS.items()} | {".mdf": "mdf", ".asc": "sima"}


def format_of(file: str | Path, form: str | None = None) -> str:
    """The format by name, or by a file's suffix. Errors: ConvertError."""
    if form is None:
        suffix = Path(file).suffix.lower()
        if suffix not in SUFFIXES:
            shown = ", ".join(SUFFIXES)
            raise ConvertError(
                f"{file}: {units.quote(suffix)} is no ending of a format. Choose one of {shown}, or --format."
            )
        return SUFFIXES[suffix]
    if form not in FORMATS:
        raise ConvertError(f"--format {units.quote(form)}: choose one of {', '.join(FORMATS)}.")
    return form


def write_table(content: Content, file: str | Path, form: str | None = None) -> Path:
    """Write a table; the file appears under its name when it is complete. form: name of a format, by default that of
    the file's suffix. Errors: ConvertError, SimulationError where the file cannot be written."""
    module = FORMATS[format_of(file, form)]
    if not content.tables or not any(len(t.columns[0].values) for t in content.tables if t.columns):
        raise ConvertError(f"{Path(file).name}: there is nothing to write.")
    target = Path(file)
    with atomic_file(target) as part:
        scratch = part.with_suffix(module.SUFFIX)  # some writers look at the suffix
        try:
            module.write(content, scratch)
            if scratch != part:
                scratch.replace(part)
        finally:
            if scratch != part:
                scratch.unlink(missing_ok=True)
    return target
