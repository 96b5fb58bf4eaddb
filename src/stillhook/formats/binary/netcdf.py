"""NetCDF as labelled arrays: what the process that reads does; see `stillhook.formats.binary.reader`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from stillhook.errors import UnreadableError
from stillhook.formats.binary.reader import read_binary, refuse_bomb

if TYPE_CHECKING:
    import xarray

MAGIC = {b"\x89HDF": "h5netcdf", b"CDF\x01": "scipy", b"CDF\x02": "scipy"}
"""First bytes of a file, and what reads it."""


def magic(path: Path) -> bytes:
    """The first bytes of a file. Errors: UnreadableError."""
    try:
        with path.open("rb") as file:
            return file.read(4)
    except (OSError, ValueError) as problem:
        raise UnreadableError(str(getattr(problem, "strerror", None) or problem)) from None


def read_dataset(path: Path) -> xarray.Dataset:
    """A complete NetCDF file in memory. Errors: UnreadableError with a reason in a few words."""
    return read_datasets(path, ())[0]


def read_datasets(path: Path, groups: Sequence[str]) -> tuple[xarray.Dataset, dict[str, xarray.Dataset]]:
    """A NetCDF file without its groups, and by name those of the groups that it has. Errors: UnreadableError with a
    reason in a few words."""
    first = magic(path)
    if first not in MAGIC:
        raise UnreadableError("is empty" if not first else "does not begin as NetCDF does")
    return read_binary(_datasets, path, MAGIC[first], tuple(groups))


def _datasets(path: Path, engine: str, groups: Sequence[str]) -> tuple[xarray.Dataset, dict[str, xarray.Dataset]]:
    """In the process that reads."""
    required: Sequence[str] = ()
    if groups:
        import h5py  # type: ignore[import-untyped]

        with h5py.File(path) as file:
            required = [name for name in groups if name in file]
    return _loaded(path, engine, None), {name: _loaded(path, engine, name) for name in required}


def _loaded(path: Path, engine: str, group: str | None) -> xarray.Dataset:
    import xarray

    with xarray.open_dataset(path, engine=engine, group=group) as data:
        refuse_bomb(path, data.nbytes)
        return data.load()
