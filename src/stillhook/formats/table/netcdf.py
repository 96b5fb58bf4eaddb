"""NetCDF files, which are complete in memory before a byte of them is written: HDF5 survives neither a disk that
refuses a write nor memory that runs out."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray

COPIES, BUFFERS = 2.0, 32e6
"""Memory that HDF5 and the file in memory take at most: over that of the data, and of its own [bytes]."""


def write_netcdf(file: Path, groups: Mapping[str, xarray.Dataset], *, packed: str = "f") -> None:
    """Write Datasets by the names of their groups, "" that of the file, the first first. packed: kinds of numbers that
    are compressed, as of `dtype.kind`. Errors: OSError where the file cannot be written, MemoryError
    where there is not enough for all of it."""
    needed = COPIES * sum(data.nbytes for data in groups.values()) + BUFFERS
    np.empty(int(needed), dtype=np.uint8)  # a MemoryError here, in place of the end of the process in HDF5
    memory = io.BytesIO()
    for mode, (group, data) in zip("w" + "a" * len(groups), groups.items(), strict=False):
        encoding: dict[Any, dict[str, Any]] = {
            name: {"zlib": True} for name in data.data_vars if data[name].ndim and data[name].dtype.kind in packed
        }
        data.to_netcdf(memory, engine="h5netcdf", mode=mode, group=group or None, encoding=encoding)  # type: ignore[call-overload]
    file.write_bytes(memory.getbuffer())
