"""Numbers and series of runs as columns of a Dataset."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook.variables import attributes


class Series(NamedTuple):
    """Time series of every case: one row of Signals every dt [s]."""

    rows: Sequence[NDArray[np.float64]]
    dt: float
    names: Sequence[str]


def summary_columns(summaries: Sequence[Mapping[str, Any]], *, single: bool) -> dict[str, Any]:
    """Numbers of every run as variables of a Dataset, over "case" unless there is one run alone."""
    columns: dict[str, Any] = {}
    for name in summaries[0]:
        values = [("; ".join(s[name]) if name == "notes" else s[name]) for s in summaries]
        columns[name] = ((), values[0], attributes(name)) if single else (("case",), values, attributes(name))
    return columns


def series_columns(names: Sequence[str], rows: Sequence[NDArray[np.float64]], *, single: bool) -> dict[str, Any]:
    """Time series of every run, (n, len(names)) each, as variables of a Dataset; NaN beyond the end of the shorter
    ones."""
    table = np.full((len(rows), max(len(r) for r in rows), len(names)), np.nan)
    for i, row in enumerate(rows):
        table[i, : len(row)] = row
    dims = ("time",) if single else ("case", "time")
    return {
        name: (dims, table[0, :, j] if single else table[:, :, j], attributes(name)) for j, name in enumerate(names)
    }


def time_axis(series: Series) -> tuple[str, NDArray[Any], dict[str, str]]:
    """Times of the longest series, as a coordinate of a Dataset."""
    return "time", np.arange(max(len(r) for r in series.rows)) * series.dt, {"units": "s", "long_name": "time"}
