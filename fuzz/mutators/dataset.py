"""Changes of a NetCDF file by what it holds: variables, dimensions, attributes and the JSON in them."""

from __future__ import annotations

import io
import json
import random
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray

from fuzz.mutators import odd
from fuzz.mutators.repair import FLOATS
from fuzz.mutators.values import changed


def by_netcdf(r: random.Random, data: bytes, others: Sequence[bytes]) -> bytes:
    """One change of a file's contents."""
    with xarray.open_dataset(io.BytesIO(data), engine="h5netcdf", decode_cf=False) as file:
        of = file.load()
    of = _changed(r, of)
    return bytes(of.to_netcdf(engine="h5netcdf", invalid_netcdf=True))  # type: ignore[call-overload]


def _changed(r: random.Random, of: xarray.Dataset) -> xarray.Dataset:
    pick, names = r.randrange(10), list(of.variables)
    if pick < 3 and of.attrs:
        name = r.choice(list(of.attrs))
        of.attrs[name] = _attribute(r, of.attrs[name])
        return of
    if pick == 3 and of.attrs:
        del of.attrs[r.choice(list(of.attrs))]
        return of
    if not names:
        return of
    name = r.choice(names)
    x = of[name]
    if pick == 4:
        return of.drop_vars([name])
    if pick == 5:
        return of.rename({name: r.choice([*map(str, names), "x", "time", "case"]) + r.choice(("", "_2"))})
    if pick == 6 and of.sizes:
        dim = r.choice(list(of.sizes))
        return of.isel({dim: slice(0, r.choice((0, 1, 2)))})
    if pick == 7:
        x.attrs[r.choice([*x.attrs, "units", "calendar", "_FillValue", "scale_factor", "dtype"])] = _attribute(r, "m")
        return of
    if pick == 8:
        kind = r.choice(("f4", "i8", "u1", "S3", "U", "f8", "?"))
        of[name] = x.astype(kind) if x.dtype.kind in "fiub" else x
        return of
    if x.dtype.kind == "f" and x.size:
        values = x.values.copy()
        values.flat[r.randrange(values.size)] = r.choice(FLOATS)
        of[name] = (x.dims, values, x.attrs)
    elif x.dtype.kind in "OUS" and x.size:
        values = x.values.astype(object)
        values.flat[r.randrange(values.size)] = str(_attribute(r, str(values.flat[0])))
        of[name] = (x.dims, values.astype(str), x.attrs)
    return of


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
