"""`simulate`: crane and scenario in, labelled Dataset out."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from enum import StrEnum
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook import units
from stillhook._version import __version__
from stillhook.crane import Crane
from stillhook.engine.build import kernel_hash
from stillhook.engine.lanes import VL
from stillhook.engine.run import Ending, Progress, Result, run_cases
from stillhook.engine.stability import MOST_STEPS, whole_parts
from stillhook.engine.summary import summarise
from stillhook.errors import ScenarioError, SimulationError, SpecError
from stillhook.library import crane_toml
from stillhook.plants.state import Signals
from stillhook.scenario import Scenario
from stillhook.variables import BY_NAME

if TYPE_CHECKING:
    import xarray

SERIES_STEP = 2e-3
STATISTICS_STEP = 5e-3
"""Default steps [s]. Proven in docs/validation/step-size.md: within 0.1 mm of wire and 0.2 bar of peak pressure of a 0.1 ms reference."""

EVERY = 0.1
"""Default spacing of a stored series [s]."""

MOST_THREADS = 1024


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
    progress: Progress | None = None,
) -> xarray.Dataset:
    """Run one scenario, or many on the same crane, or one or many on as many cranes.

    Parameters
    ----------
    crane, case: what the machine is, and what is done to it. A list of cases adds the dimension "case"; so does a list of cranes of one
    winch type, which all run the one case, or each its own of equally many (draws of uncertain parameters: `stillhook.identify.draws`).
    step: integration step, at most the PLC cycle and a whole part of it; default 2 ms with series, 5 ms for statistics alone,
    or the next shorter step that the PLC cycle allows.
    every: spacing of the stored series, a whole number of PLC cycles; default 0.1 s, or the next longer spacing that there is.
    series: store time series; default True for one case, False for a list (statistics alone, sixteen cases side by side).
    on_failure: "raise" stops with SimulationError if a case fails, "mark" keeps the rest (`status` says which failed).
    threads: threads that share the blocks of a batch. progress: called with the share done, 0..1; first with 0,
    when everything that was given has been found good.

    Returns
    -------
    Dataset with the summary of every case, and the series over "time" [s]; names, units and meaning from `stillhook.variables`.
    Its attributes hold crane, scenarios, version, kernel and step: `stillhook.io.results.rerun` repeats the run from them.

    Errors: ScenarioError (bad scenario), SpecError (step too long), SimulationError (failed case). Nothing is returned half-done.
    """
    single = isinstance(crane, Crane) and isinstance(case, Scenario)
    cranes, cases = paired(crane, case)
    if on_failure not in tuple(OnFailure):
        raise ScenarioError(f"on_failure = {units.came(on_failure)}: give one of {', '.join(OnFailure)}.")
    if type(threads) is not int or not 1 <= threads <= MOST_THREADS:
        raise ScenarioError(f"threads = {units.came(threads)}: give a whole number from 1 to {MOST_THREADS}.")
    stored = single if series is None else series
    n_sub = steps_per_cycle(cranes[0], step, SERIES_STEP if stored else STATISTICS_STEP)
    rows = cycles(cranes[0], every)
    lanes, rows = (1, rows) if stored else (VL, 0)
    results = run_cases(cranes, cases, n_sub=n_sub, lanes=lanes, every=rows, threads=threads, progress=progress)
    if OnFailure(on_failure) is OnFailure.RAISE:
        raise_failures(results)
    summaries = [summarise(w, c, r) for w, c, r in zip(cranes, cases, results, strict=True)]
    return to_dataset(crane if isinstance(crane, Crane) else cranes, cases, results, summaries, single=single)


def paired(crane: Crane | Sequence[Crane], case: Scenario | Sequence[Scenario]) -> tuple[list[Crane], list[Scenario]]:
    """Cranes and scenarios in pairs; one of either goes with all of the other. Errors: ScenarioError, SpecError."""
    if isinstance(crane, Crane) or not isinstance(crane, Iterable) or isinstance(crane, str):
        cases = checked_cases(crane, case)  # type: ignore[arg-type]
        return [crane] * len(cases), cases  # type: ignore[list-item]
    cranes = list(crane)
    if not cranes:
        raise SpecError("simulate: the list of cranes is empty. Give at least one Crane.")
    first = cranes[0]
    for i, each in enumerate(cranes):
        cases = checked_cases(each, case)
        if each.plant is not first.plant or each.control.t_cycle != first.control.t_cycle:
            a, b = (f"{c.plant} with a PLC cycle of {units.show(c.control.t_cycle, 'time')}" for c in (first, each))
            raise SpecError(f'simulate: crane 0 "{first.name}" is {a}, crane {i} "{each.name}" {b}. Run winches of one kind together.')
    if isinstance(case, Scenario):
        return cranes, cases * len(cranes)
    if len(cases) != len(cranes):
        raise ScenarioError(f"simulate: {len(cranes)} cranes and {len(cases)} cases. Give one case, or one for each crane.")
    return cranes, cases


def checked_cases(crane: Crane, case: Scenario | Sequence[Scenario]) -> list[Scenario]:
    """The scenarios as a list. Errors: ScenarioError, SpecError where something else was given."""
    if not isinstance(crane, Crane):
        raise SpecError(f"crane = {units.came(crane)}: not a Crane. Read one with load_crane, by name or path.")
    if isinstance(case, Scenario):
        return [case]
    cases = list(case) if isinstance(case, Iterable) else [case]
    if not cases:
        raise ScenarioError("simulate: the list of cases is empty. Give at least one Scenario.")
    for i, each in enumerate(cases):
        if not isinstance(each, Scenario):
            raise ScenarioError(f"case {i} = {units.came(each)}: not a Scenario. Give one Scenario, or a list of them.")
    return cases


def steps_per_cycle(crane: Crane, step: str | None, default: float = SERIES_STEP) -> int:
    """Steps per PLC cycle for a step given as text, or for the default [s] where there is none.

    Errors: ScenarioError where the step is not a whole part of the cycle.
    """
    t_cycle = crane.control.t_cycle
    if step is None:
        return whole_parts(t_cycle, default)
    h = units.parse(step, "time", "step")
    n = round(t_cycle / h) if h > 0.0 else 0
    if n < 1 or abs(n * h - t_cycle) > 1e-9 * t_cycle or n > MOST_STEPS:
        raise ScenarioError(
            f'step = "{step}" is not a whole part of the PLC cycle {units.show(t_cycle, "time")}. '
            f'Use for instance "{t_cycle / 5 * 1e3:g} ms" or "{t_cycle / 2 * 1e3:g} ms".'
        )
    return n


def cycles(crane: Crane, every: str | None) -> int:
    """PLC cycles in a spacing given as text, or in the default one. Errors: ScenarioError where it is not a whole number of them."""
    t_cycle = crane.control.t_cycle
    if every is None:
        return math.ceil(EVERY / t_cycle * (1.0 - 1e-9))
    dt = units.parse(every, "time", "every")
    n = round(dt / t_cycle)
    if n < 1 or abs(n * t_cycle - dt) > 1e-9 * dt:
        raise ScenarioError(f'every = "{every}" is not a whole number of PLC cycles of {units.show(t_cycle, "time")}.')
    return n


def raise_failures(results: Sequence[Result]) -> None:
    """Errors: SimulationError naming the first failed case."""
    failed = [i for i, r in enumerate(results) if r.ending is not Ending.DONE]
    if failed:
        i = failed[0]
        raise SimulationError(
            f"{len(failed)} of {len(results)} cases failed. First: case {i} lost its numbers by {results[i].t_end:.2f} s. "
            'Ramp the motion in, use a finer step, or keep the rest with on_failure="mark".'
        )


def to_dataset(
    crane: Crane | Sequence[Crane],
    cases: Sequence[Scenario],
    results: Sequence[Result],
    summaries: Sequence[Mapping[str, Any]],
    *,
    single: bool,
) -> xarray.Dataset:
    """Results with their summaries as a labelled Dataset; see `simulate`. crane: that of all cases, or one for each."""
    import xarray  # heavy: not wanted for the command line's first table

    columns: dict[str, Any] = {}
    for name in summaries[0]:
        values = [("; ".join(s[name]) if name == "notes" else s[name]) for s in summaries]
        columns[name] = ((), values[0], _attrs(name)) if single else (("case",), values, _attrs(name))
    coords: dict[str, Any] = {} if single else {"case": _labels(crane, cases)}
    if results[0].series is not None:
        n = max(len(r.series) for r in results if r.series is not None)
        coords["time"] = ("time", np.arange(n) * results[0].dt, {"units": "s", "long_name": "time"})
        table = np.full((len(results), n, len(Signals._fields)), np.nan)
        for i, r in enumerate(results):
            table[i, : len(r.series)] = r.series  # type: ignore[arg-type]
        for j, name in enumerate(Signals._fields):
            values = table[0, :, j] if single else table[:, :, j]
            columns[name] = (("time",) if single else ("case", "time"), values, _attrs(name))
    data = xarray.Dataset(columns, coords=coords)
    data.attrs = {
        "title": f"Stillhook run of {crane.name if isinstance(crane, Crane) else f'{len(crane)} cranes'}",
        "crane": crane_toml(crane) if isinstance(crane, Crane) else json.dumps([crane_toml(c) for c in crane]),
        "scenarios": json.dumps([c.to_dict() for c in (cases[:1] if _one_for_all(crane, cases) else cases)]),
        "single": int(single),
        "stillhook_version": __version__,
        "stillhook_kernel": kernel_hash(),
        "step": results[0].step,
        "every": results[0].dt if results[0].series is not None else 0.0,
        "window_full": int(all(r.full_window for r in results)),
    }
    return data


def _one_for_all(crane: Crane | Sequence[Crane], cases: Sequence[Scenario]) -> bool:
    """Whether several cranes ran one and the same scenario, which is then stored once."""
    return not isinstance(crane, Crane) and all(c is cases[0] for c in cases)


def _labels(crane: Crane | Sequence[Crane], cases: Sequence[Scenario]) -> list[str]:
    """Names along "case": those of the cases, or of the cranes where several ran one case; numbers where they are not told apart."""
    if isinstance(crane, Crane) or not _one_for_all(crane, cases):
        return [c.name or str(i) for i, c in enumerate(cases)]
    names = [c.name for c in crane]
    return names if len(set(names)) == len(names) else [str(i) for i in range(len(names))]


def _attrs(name: str) -> dict[str, str]:
    v = BY_NAME[name]
    return {k: str(x) for k, x in (("units", v.unit), ("long_name", v.meaning), ("sign", v.sign), ("source", v.source)) if x}


