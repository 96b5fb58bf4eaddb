"""`lower`: crane and lowering in, labelled Dataset out."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook import units
from stillhook._version import __version__
from stillhook.base.progress import Progress
from stillhook.engine.arguments import check_threads, cycles, steps_per_cycle
from stillhook.engine.lowering.run import LiftResult, run_lowerings
from stillhook.engine.lowering.summary import lift_summary
from stillhook.engine.scenario.simulate import (
    OnFailure,
    Series,
    raise_failures,
    series_columns,
    summary_columns,
    time_axis,
)
from stillhook.errors import LiftError, SpecError
from stillhook.kernels.build import kernel_hash
from stillhook.kernels.lanes import VL
from stillhook.library import crane_toml
from stillhook.spec.crane import Crane
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.lift.programme import stage_names
from stillhook.variables import attributes

if TYPE_CHECKING:
    import xarray

LIFT_STEP = 5e-3
"""Default step [s]: the wire is stepped implicitly, and the winch at 5 ms is right to 0.1 mm of wire
(docs/validation/step-size.md)."""
Summarised = tuple[Mapping[str, Any], Sequence[Mapping[str, Any]]]
"""Numbers of one lowering: of the whole run, and of each of its stages."""


def lower(
    crane: Crane,
    case: Lowering | Sequence[Lowering],
    *,
    step: str | None = None,
    every: str | None = None,
    series: bool | None = None,
    threads: int = 2,
    progress: Progress | None = None,
    on_failure: OnFailure | str = OnFailure.RAISE,
) -> xarray.Dataset:
    """Lower a payload, or many, each in one run in the time domain, winch and controller in the loop.

    Parameters
    ----------
    crane, case: what the machine is, and what hangs from it, in which water, under which programme. A list adds the
    dimension "case". step: integration step, a whole part of the PLC cycle; default 5 ms. every: spacing of the stored
    series; default 0.1 s. series: store time series; default True for one lowering, False for a list (statistics alone,
    sixteen side by side). threads: threads that share a list. progress: called with the share done, 0..1.
    on_failure: "raise" stops with SimulationError if a lowering fails, "mark" keeps the rest.

    Returns
    -------
    Dataset with the summary of the run; the same numbers of each stage under "stage_..." over the dimension "stage",
    and the series over "time" [s]; names, units and meaning from `stillhook.variables`. In the series, s_load and
    v_load are those of the payload.

    Errors: LiftError (what cannot be lowered so), ScenarioError, SpecError (step too long), SimulationError (failed
    run).
    """
    single = isinstance(case, Lowering)
    cases = _cases(crane, case)
    if on_failure not in tuple(OnFailure):
        raise LiftError(f"on_failure = {units.quote(on_failure)}: give one of {', '.join(OnFailure)}.")
    check_threads(threads)
    stored = single if series is None else series
    n_sub, rows = steps_per_cycle(crane, step, LIFT_STEP), cycles(crane, every)
    lanes = 1 if stored or single else VL
    results = run_lowerings(
        crane, cases, n_sub=n_sub, lanes=lanes, every=rows if stored else 0, threads=threads, progress=progress
    )
    summaries = [lift_summary(crane, c, r) for c, r in zip(cases, results, strict=True)]
    if OnFailure(on_failure) is OnFailure.RAISE:
        raise_failures([run for run, _ in summaries])
    return labelled(crane, cases, results, summaries, single=single)


def _cases(crane: Crane, case: Lowering | Sequence[Lowering]) -> list[Lowering]:
    if not isinstance(crane, Crane):
        raise SpecError(f"crane = {units.quote(crane)}: not a Crane. Read one with load_crane, by name or path.")
    cases = [case] if isinstance(case, Lowering) else list(case) if isinstance(case, Iterable) else [case]
    if not cases:
        raise LiftError("lower: the list of lowerings is empty. Give at least one Lowering.")
    for i, each in enumerate(cases):
        if not isinstance(each, Lowering):
            raise LiftError(
                f"lowering {i} = {units.quote(each)}: not a Lowering. Give one Lowering, or a list of them."
            )
    return cases


def labelled(
    crane: Crane,
    cases: Sequence[Lowering],
    results: Sequence[LiftResult],
    summaries: Sequence[Summarised],
    *,
    single: bool,
) -> xarray.Dataset:
    """Summaries and series of lowerings as a labelled Dataset; see `lower`."""
    data = summarised(crane, cases, summaries, step=results[0].step, single=single)
    if series := [r.series for r in results if r.series is not None]:
        data = data.assign(series_columns(results[0].signals, series, single=single)).assign_coords(
            time=time_axis(Series(series, results[0].dt, results[0].signals))
        )
    data.attrs["every"] = results[0].dt
    return data


def summarised(
    crane: Crane | Sequence[Crane],
    cases: Sequence[Lowering],
    summaries: Sequence[Summarised],
    *,
    step: float,
    single: bool,
) -> xarray.Dataset:
    """Numbers of lowerings, of the whole runs and of each stage, as a labelled Dataset; step [s]."""
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
    data = xarray.Dataset(columns, coords=coords)
    data.attrs = {
        "title": f"Stillhook lowering from {crane.name if isinstance(crane, Crane) else f'{len(crane)} cranes'}",
        **_cranes(crane),
        "single": int(single),
        "stillhook_version": __version__,
        "stillhook_kernel": kernel_hash(),
        "step": step,
        "every": 0.0,
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
