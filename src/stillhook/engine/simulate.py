"""`simulate`: crane and scenario or lowering in, labelled Dataset out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stillhook import units
from stillhook.base.progress import Progress
from stillhook.engine.arguments import Case, Series, check_threads, cycles, paired, steps_per_cycle, substeps
from stillhook.engine.batch import Problem, StoredRuns, run_batch, summary_of
from stillhook.engine.lowering.problem import LoweringProblem
from stillhook.engine.runner import Ending
from stillhook.engine.scenario.problem import ScenarioProblem
from stillhook.errors import ScenarioError, SimulationError
from stillhook.spec.crane import Crane
from stillhook.spec.lift.lowering import InSea, Lowering
from stillhook.spec.scenario import Scenario

if TYPE_CHECKING:
    import xarray

PROBLEMS: tuple[tuple[tuple[type, ...], Problem], ...] = (
    ((Scenario,), ScenarioProblem()),
    ((Lowering, InSea), LoweringProblem()),
)
"""What there is to simulate: classes of cases, and how they are run."""


class End(StrEnum):
    """Where a run ends."""

    DURATION = "duration"
    PROGRAMME = "programme"


class OnFailure(StrEnum):
    """What a batch does with a case that fails."""

    RAISE = "raise"
    MARK = "mark"


def simulate(
    crane: Crane | Sequence[Crane],
    case: Case | Sequence[Case],
    *,
    step: str | None = None,
    every: str | None = None,
    series: bool | None = None,
    sampling: str | None = None,
    end: End | str = End.DURATION,
    on_failure: OnFailure | str = OnFailure.RAISE,
    threads: int = 2,
    store: str | Path | None = None,
    client: Any = None,
    progress: Progress | None = None,
) -> xarray.Dataset:
    """Run a scenario (a load on the wire in compensation) or a lowering (a payload from above the surface down, by a
    programme), one or many, on one crane or on as many.

    Parameters
    ----------
    crane, case: what the machine is, and what is done to it. A list of cases adds the dimension "case"; so does a list
    of cranes of one winch type, which all run the one case, or each its own of equally many (draws of uncertain
    parameters: `stillhook.identify.system_friction.fitting.uncertainty`). step: integration step, at most the PLC cycle
    and a whole part of it; default 2 ms with series, 5 ms for statistics alone (a lowering 5 ms, and down to 1 ms where
    a stiff winch asks for it), or the next shorter step that the PLC cycle allows. every: spacing of the stored
    series, a whole number of PLC cycles; default 0.1 s, or the next longer spacing that there is. series: store time
    series; default True for one case, False for a list (statistics alone, sixteen cases side by side). sampling:
    spacing at which extremes, sums and energies of a lowering are taken, a whole number of PLC cycles of which `every`
    is a multiple; default every cycle. 20 ms saves a quarter of the time (docs/validation/step-size.md). end:
    "programme" ends a lowering soon after its programme; default after its duration. on_failure: "raise"
    stops with SimulationError if a case fails, "mark" keeps the rest (`status` says which failed). threads: threads
    that share a batch. store, client: statistics alone may be kept in a folder as they finish, so that a run that was
    killed goes on, and made on a cluster (a dask.distributed Client), with the same numbers; see
    `stillhook.engine.scenario.problem.summaries`. progress: called with the share done, 0..1; first with 0, when
    everything that was given has been found good.

    Returns
    -------
    Dataset with the summary of every case, and the series over "time" [s]; names, units and meaning from
    `stillhook.variables`. Its attributes hold crane, scenarios, version, kernel and step:
    `stillhook.formats.results.rerun` repeats the run from them.

    Errors: ScenarioError (bad scenario), SpecError (step too long), SimulationError (failed case). Nothing is returned
    half-done.

    >>> import stillhook
    >>> crane = stillhook.load_crane("nov-250t")
    >>> case = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 12 s", duration="40 s", warm_up="20 s")
    >>> run = stillhook.simulate(crane, [case.with_mode("ns"), case.with_mode("ssc")])
    >>> run.sizes["case"], bool(run.e_c_pp.max() < 0.1), run.e_c_pp.units
    (2, True, 'm')
    """
    kinds: Any = tuple(kind for some, _ in PROBLEMS for kind in some)
    single = isinstance(crane, Crane) and isinstance(case, kinds)
    cranes, cases = paired(crane, case, kinds)
    if on_failure not in tuple(OnFailure):
        raise ScenarioError(f"on_failure = {units.quote(on_failure)}: give one of {', '.join(OnFailure)}.")
    check_threads(threads)
    stored = single if series is None else series
    if stored and (store is not None or client is not None):
        raise ScenarioError(
            "simulate: a run with series is made here and held in memory. Leave store and client out, or set"
            " series=False."
        )
    problem, every_rows = _problem(cases), cycles(cranes[0], every)
    if sampling is not None or end != End.DURATION:
        sampled = 1 if sampling is None else cycles(cranes[0], sampling, "sampling")
        problem = _shorter(problem, sampled, end)
        if every is None:
            every_rows = math.ceil(every_rows / sampled) * sampled
        elif stored and every_rows % sampled:
            raise ScenarioError(f'every = "{every}" is not a whole number of samples of "{sampling}".')
    if step is None:
        n_sub = substeps(cranes[0].control.t_cycle, problem.default_step(cranes, cases, series=stored))
    else:
        n_sub = steps_per_cycle(cranes[0], step)
    traces = None
    if stored:
        problem.check(cranes, cases)
        results = problem.results(
            cranes, cases, n_sub=n_sub, lanes=1, every=every_rows, threads=threads, progress=progress
        )
        rows = [
            summary_of(problem.row(w, c, r), problem.columns(w, c))
            for w, c, r in zip(cranes, cases, results, strict=True)
        ]
        traces = Series([r.series for r in results], results[0].dt, results[0].signals)
    else:
        rows = run_batch(
            problem, cranes, cases, n_sub=n_sub, threads=threads, store=store, client=client, progress=progress
        )
    if OnFailure(on_failure) is OnFailure.RAISE:
        raise_failures(rows)
    h = cranes[0].control.t_cycle / n_sub
    return problem.labelled(
        crane if isinstance(crane, Crane) else cranes, cases, rows, step=h, single=single, series=traces
    )


def stored_places(
    crane: Crane, cases: Sequence[Case], *, step: str, sampling: str, end: End, store: str | Path | None
) -> list[int]:
    """Places of the lowerings on one crane whose statistics a store holds; arguments as of `simulate`. Nothing is run,
    and no store is made."""
    if store is None or not Path(store).is_dir():
        return []
    problem = _shorter(_problem(cases), cycles(crane, sampling, "sampling"), end)
    return sorted(StoredRuns(problem, store, [crane] * len(cases), cases, steps_per_cycle(crane, step)).stored())


def _problem(cases: Sequence[Case]) -> Problem:
    """How these cases are run. Errors: ScenarioError where they are of several kinds."""
    of = [next(i for i, (kinds, _) in enumerate(PROBLEMS) if isinstance(c, kinds)) for c in cases]
    if other := [i for i, kind in enumerate(of) if kind != of[0]]:
        a, b = (type(cases[i]).__name__ for i in (0, other[0]))
        raise ScenarioError(f"simulate: case 0 is a {a}, case {other[0]} a {b}. Run scenarios and lowerings apart.")
    return PROBLEMS[of[0]][1]


def _shorter(problem: Problem, sampled: int, end: End | str) -> Problem:
    """The problem with statistics taken every so many cycles, and runs that end as given. Errors: ScenarioError."""
    if end not in tuple(End):
        raise ScenarioError(f"end = {units.quote(end)}: give one of {', '.join(End)}.")
    if not isinstance(problem, LoweringProblem):
        raise ScenarioError("simulate: sampling and end are for lowerings. Leave them out for scenarios.")
    return LoweringProblem(sampled, short=end == End.PROGRAMME)


def raise_failures(summaries: Sequence[Mapping[str, Any]]) -> None:
    """Errors: SimulationError naming the first failed case."""
    failed = [i for i, s in enumerate(summaries) if s["status"] == Ending.DIVERGED]
    if failed:
        i = failed[0]
        raise SimulationError(
            f"{len(failed)} of {len(summaries)} cases failed. First: case {i} {summaries[i]['notes'][-1]}. "
            'Ramp the motion in, use a finer step, or keep the rest with on_failure="mark".'
        )
