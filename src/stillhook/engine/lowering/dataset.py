"""Lowerings as a labelled Dataset."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook._version import __version__
from stillhook.engine.columns import Series, series_columns, summary_columns, time_axis
from stillhook.kernels.build import kernel_hash
from stillhook.library import crane_toml
from stillhook.spec.crane import Crane
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.lift.programme import stage_names
from stillhook.variables import attributes

if TYPE_CHECKING:
    import xarray

Summarised = tuple[Mapping[str, Any], Sequence[Mapping[str, Any]]]
"""Numbers of one lowering: of the whole run, and of each of its stages."""


def labelled(
    crane: Crane | Sequence[Crane],
    cases: Sequence[Lowering],
    summaries: Sequence[Summarised],
    *,
    step: float,
    single: bool,
    series: Series | None = None,
) -> xarray.Dataset:
    """Numbers of lowerings, of the whole runs and of each stage, and series where there are, as a labelled Dataset with
    the cranes; step [s]."""
    import xarray

    columns = summary_columns([run for run, _ in summaries], single=single)
    n_stages = max(len(stages) for _, stages in summaries)
    for name in summaries[0][1][0]:
        table = np.full((len(summaries), n_stages), np.nan)
        for i, (_, stages) in enumerate(summaries):
            table[i, : len(stages)] = [s[name] for s in stages]
        columns[f"stage_{name}"] = (
            (("stage",), table[0], attributes(name)) if single else (("case", "stage"), table, attributes(name))
        )
    coords: dict[str, Any] = {} if single else {"case": [c.name or str(i) for i, c in enumerate(cases)]}
    names = {stage_names(c.programme) for c in cases}
    coords["stage"] = [*names.pop(), "after"] if len(names) == 1 else [str(i) for i in range(n_stages)]
    if series is not None:
        columns |= series_columns(series.names, series.rows, single=single)
        coords["time"] = time_axis(series)
    data = xarray.Dataset(columns, coords=coords)
    data.attrs = {
        "title": f"Stillhook lowering from {crane.name if isinstance(crane, Crane) else f'{len(crane)} cranes'}",
        **_cranes(crane),
        "single": int(single),
        "stillhook_version": __version__,
        "stillhook_kernel": kernel_hash(),
        "step": step,
        "every": series.dt if series is not None else 0.0,
    }
    return data


def _cranes(crane: Crane | Sequence[Crane]) -> dict[str, Any]:
    """What a Dataset says of its cranes: the one, or each once and the number of that of every case."""
    if isinstance(crane, Crane):
        return {"crane": crane_toml(crane)}
    each = {id(c): c for c in crane}
    number = {key: i for i, key in enumerate(each)}
    return {
        "crane": json.dumps([crane_toml(c) for c in each.values()]),
        "crane_of_case": [number[id(c)] for c in crane],
    }
