"""`simulate`: crane and scenario in, labelled Dataset out."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook import units
from stillhook._version import __version__
from stillhook.base.progress import Progress
from stillhook.engine.arguments import SERIES_STEP, STATISTICS_STEP, check_threads, cycles, paired, steps_per_cycle
from stillhook.engine.runner import Ending
from stillhook.engine.scenario.batch import summaries
from stillhook.engine.scenario.run import Result, run_cases
from stillhook.engine.scenario.summary import summarise
from stillhook.engine.validity import twin_line
from stillhook.errors import ScenarioError, SimulationError
from stillhook.kernels.build import kernel_hash
from stillhook.library import crane_toml
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.variables import WINDOW, attributes

if TYPE_CHECKING:
    import xarray


class OnFailure(StrEnum):
    """What a batch does with a case that fails."""

    RAISE = "raise"
    MARK = "mark"


def simulate(
    crane: Crane | Sequence[Crane],
    case: Scenario | Sequence[Scenario],
    *,
    step: str | None = None,
    every: str | None = None,
    series: bool | None = None,
    on_failure: OnFailure | str = OnFailure.RAISE,
    threads: int = 2,
    store: str | Path | None = None,
    client: Any = None,
    progress: Progress | None = None,
) -> xarray.Dataset:
    """Run one scenario, or many on the same crane, or one or many on as many cranes.

    Parameters
    ----------
    crane, case: what the machine is, and what is done to it. A list of cases adds the dimension "case"; so does a list
    of cranes of one winch type, which all run the one case, or each its own of equally many (draws of uncertain
    parameters: `stillhook.identify.system_friction.fitting.draws`). step: integration step, at most the PLC cycle and a
    whole part of it; default 2 ms with series, 5 ms for statistics alone, or the next shorter step that the PLC cycle
    allows. every: spacing of the stored series, a whole number of PLC cycles; default 0.1 s, or the next longer spacing
    that there is. series: store time series; default True for one case, False for a list (statistics alone, sixteen
    cases side by side). on_failure: "raise" stops with SimulationError if a case fails, "mark" keeps the rest (`status`
    says which failed). threads: threads that share a batch. store, client: statistics alone may be kept in a folder as
    they finish, so that a run that was killed goes on, and made on a cluster (a dask.distributed Client), with the same
    numbers; see `stillhook.engine.scenario.batch.summaries`. progress: called with the share done, 0..1; first with 0,
    when everything that was given has been found good.

    Returns
    -------
    Dataset with the summary of every case, and the series over "time" [s]; names, units and meaning from
    `stillhook.variables`. Its attributes hold crane, scenarios, version, kernel and step:
    `stillhook.formats.results.rerun` repeats the run from them.

    Errors: ScenarioError (bad scenario), SpecError (step too long), SimulationError (failed case). Nothing is returned
    half-done.
    """
    single = isinstance(crane, Crane) and isinstance(case, Scenario)
    cranes, cases = paired(crane, case)
    if on_failure not in tuple(OnFailure):
        raise ScenarioError(f"on_failure = {units.quote(on_failure)}: give one of {', '.join(OnFailure)}.")
    check_threads(threads)
    stored = single if series is None else series
    if stored and (store is not None or client is not None):
        raise ScenarioError(
            "simulate: a run with series is made here and held in memory. Leave store and client out, or set"
            " series=False."
        )
    winch, rows = crane if isinstance(crane, Crane) else cranes, cycles(cranes[0], every)
    if stored:
        n_sub = steps_per_cycle(cranes[0], step, SERIES_STEP)
        results = run_cases(cranes, cases, n_sub=n_sub, lanes=1, every=rows, threads=threads, progress=progress)
        rows_of_cases = [summarise(w, c, r) for w, c, r in zip(cranes, cases, results, strict=True)]
    else:
        rows_of_cases = summaries(
            cranes, cases, step=step, threads=threads, store=store, client=client, progress=progress
        )
    if OnFailure(on_failure) is OnFailure.RAISE:
        raise_failures(rows_of_cases)
    if stored:
        return to_dataset(winch, cases, results, rows_of_cases, single=single)
    h = cranes[0].control.t_cycle / steps_per_cycle(cranes[0], step, STATISTICS_STEP)
    return labelled(winch, cases, rows_of_cases, step=h, single=single)


def raise_failures(summaries: Sequence[Mapping[str, Any]]) -> None:
    """Errors: SimulationError naming the first failed case."""
    failed = [i for i, s in enumerate(summaries) if s["status"] == Ending.DIVERGED]
    if failed:
        i = failed[0]
        raise SimulationError(
            f"{len(failed)} of {len(summaries)} cases failed. First: case {i} {summaries[i]['notes'][-1]}. "
            'Ramp the motion in, use a finer step, or keep the rest with on_failure="mark".'
        )


class Series(NamedTuple):
    """Time series of every case: one row of Signals every dt [s]."""

    rows: Sequence[NDArray[np.float64]]
    dt: float
    names: Sequence[str]


def to_dataset(
    crane: Crane | Sequence[Crane],
    cases: Sequence[Scenario],
    results: Sequence[Result],
    summaries: Sequence[Mapping[str, Any]],
    *,
    single: bool,
) -> xarray.Dataset:
    """Results with their series and summaries as a labelled Dataset; see `simulate`. crane: that of all cases, or one
    for each."""
    series = Series([r.series for r in results if r.series is not None], results[0].dt, results[0].signals)
    return labelled(crane, cases, summaries, step=results[0].step, single=single, series=series)


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
