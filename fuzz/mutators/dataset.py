"""Changes of a NetCDF file by what it holds: variables, attributes and the JSON in them, in place."""

from __future__ import annotations

import io
import json
import random
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import h5py  # type: ignore[import-untyped]
import numpy as np

from fuzz.mutators import odd
from fuzz.mutators.repair import FLOATS
from fuzz.mutators.values import changed
from stillhook.formats.binary import read_binary

HDF5 = b"\x89HDF"
OF_NETCDF = ("CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST", "_Netcdf4Dimid", "_Netcdf4Coordinates")
"""Attributes with which NetCDF ties variables to dimensions, changed more seldom."""


def by_netcdf(r: random.Random, data: bytes, others: Sequence[bytes]) -> bytes:
    """One change of a file's contents, in the process that reads: HDF5 may wait for ever on one that was damaged
    before."""
    if not data.startswith(HDF5):
        raise ValueError("no NetCDF file any more")
    return read_binary(_changed, Path("changed.nc"), data, r.getrandbits(32))


def _changed(_: Path, data: bytes, seed: int) -> bytes:
    stream, r = io.BytesIO(data), random.Random(seed)
    with h5py.File(stream, "r+") as file:
        groups = [file, *(each for each in file.values() if isinstance(each, h5py.Group))]
        _change(r, r.choice(groups) if r.random() < 0.3 else file)
    return stream.getvalue()


def _change(r: random.Random, of: Any) -> None:
    names = [name for name, each in of.items() if isinstance(each, h5py.Dataset)]
    pick = r.randrange(10)
    if (pick < 4 and of.attrs) or not names:
        _change_attribute(r, of.attrs)
        return
    name = r.choice(names)
    x = of[name]
    if pick == 4:
        del of[name]
    elif pick == 5:
        of.move(name, r.choice(("x", "time", "case", "mode", f"{r.choice(names)}_2")))
    elif pick == 6:
        _change_attribute(r, x.attrs)
    elif pick == 7:
        _replace(of, name, x, x[()] if r.random() < 0.5 else np.zeros(r.choice(SHAPES)))
    elif pick == 8 and x.dtype.kind in "fiub":
        with np.errstate(invalid="ignore"):
            values = np.asarray(x[()]).astype(r.choice(("f4", "i8", "u1", "S3", "f8", "?", "c16")))
        _replace(of, name, x, values)
    elif x.size:
        _change_value(r, x)


SHAPES = ((), (0,), (1,), (2, 2), (1, 1, 1))


def _replace(of: Any, name: str, x: Any, values: Any) -> None:
    """Other values under a name, without what ties them to dimensions."""
    attrs = {key: value for key, value in x.attrs.items() if key not in OF_NETCDF}
    del of[name]
    of.create_dataset(name, data=values).attrs.update(attrs)


def _change_value(r: random.Random, x: Any) -> None:
    at = tuple(r.randrange(n) for n in x.shape)
    if x.dtype.kind == "f":
        x[at] = r.choice(FLOATS)
    elif x.dtype.kind in "iu":
        x[at] = r.choice((0, 1, np.iinfo(x.dtype).max, np.iinfo(x.dtype).min))
    else:
        old = x[at]
        x[at] = str(_attribute(r, old.decode("utf-8", "replace") if isinstance(old, bytes) else old))


def _change_attribute(r: random.Random, attrs: Any) -> None:
    own = [name for name in attrs if name not in OF_NETCDF or r.random() < 0.1]
    name = r.choice([*own, *own, "units", "calendar", "_FillValue", "scale_factor", "dtype"])
    if name in attrs and r.random() < 0.2:
        del attrs[name]
    else:
        attrs[name] = _attribute(r, attrs.get(name, "m"))


def _attribute(r: random.Random, old: Any) -> Any:
    """A changed attribute; one that is JSON stays JSON more often than not."""
    if isinstance(old, str) and old[:1] in ("{", "[") and r.random() < 0.8:
        try:
            return json.dumps(changed(r, json.loads(old), lambda: odd.value(r)))
        except ValueError:
            pass
    return r.choice(
        (odd.quantity(r), odd.number(r), "", "{}", "[]", "[{}]", "null", 0, -1, 1e308, np.array([1.0, 2.0]))
    )
