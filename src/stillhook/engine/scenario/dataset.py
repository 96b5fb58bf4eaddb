"""Runs of scenarios as a labelled Dataset."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from stillhook._version import __version__
from stillhook.engine.columns import Series, series_columns, summary_columns, time_axis
from stillhook.engine.scenario.run import Result
from stillhook.engine.validity import twin_line
from stillhook.kernels.build import kernel_hash
from stillhook.library import crane_toml
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.variables import WINDOW

if TYPE_CHECKING:
    import xarray


def to_dataset(
    crane: Crane | Sequence[Crane],
    cases: Sequence[Scenario],
    results: Sequence[Result],
    summaries: Sequence[Mapping[str, Any]],
    *,
    single: bool,
) -> xarray.Dataset:
    """Results with their series and summaries as one labelled Dataset; see `stillhook.simulate`.
    crane: that of all cases, or one for each."""
    series = Series([r.series for r in results if r.series is not None], results[0].dt, results[0].signals)
    return labelled(crane, cases, summaries, step=results[0].step, single=single, series=series)


def labelled(
    crane: Crane | Sequence[Crane],
    cases: Sequence[Scenario],
    summaries: Sequence[Mapping[str, Any]],
    *,
    step: float,
    single: bool,
    series: Series | None = None,
) -> xarray.Dataset:
    """Summaries, and series where there are, as a labelled Dataset with everything that repeats the run; step [s]."""
    import xarray  # heavy: not wanted for the command line's first table

    columns = summary_columns(summaries, single=single)
    coords: dict[str, Any] = {} if single else {"case": _labels(crane, cases)}
    if series is not None:
        columns |= series_columns(series.names, series.rows, single=single)
        coords["time"] = time_axis(series)
    data = xarray.Dataset(columns, coords=coords)
    data.attrs = {
        "title": f"Stillhook run of {crane.name if isinstance(crane, Crane) else f'{len(crane)} cranes'}",
        "crane": crane_toml(crane) if isinstance(crane, Crane) else json.dumps([crane_toml(c) for c in crane]),
        "twin": twin_line(crane if isinstance(crane, Crane) else crane[0]),
        "scenarios": json.dumps([c.to_dict() for c in (cases[:1] if _one_for_all(crane, cases) else cases)]),
        "single": int(single),
        "stillhook_version": __version__,
        "stillhook_kernel": kernel_hash(),
        "step": step,
        "every": series.dt if series is not None else 0.0,
        "window_full": int(all(c.duration - c.warm_up >= WINDOW for c in cases)),
    }
    return data


def _one_for_all(crane: Crane | Sequence[Crane], cases: Sequence[Scenario]) -> bool:
    """Whether several cranes ran one and the same scenario, which is then stored once."""
    return not isinstance(crane, Crane) and all(c is cases[0] for c in cases)


def _labels(crane: Crane | Sequence[Crane], cases: Sequence[Scenario]) -> list[str]:
    """Names along "case": those of the cases, or of the cranes where several ran one case; numbers where they are not
    told apart."""
    if isinstance(crane, Crane) or not _one_for_all(crane, cases):
        return [c.name or str(i) for i, c in enumerate(cases)]
    names = [c.name for c in crane]
    return names if len(set(names)) == len(names) else [str(i) for i in range(len(names))]
