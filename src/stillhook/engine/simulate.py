"""`run_cases`, through which everything is run, and `simulate`: crane and case in, labelled Dataset out."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from stillhook import units
from stillhook.base.progress import Meter, Progress
from stillhook.engine.arguments import (
    ANY_CASE,
    Case,
    check_threads,
    cycles,
    paired,
    steps_per_cycle,
)
from stillhook.engine.lowering.case import LoweringType
from stillhook.engine.runner import Ending, Refused, Run
from stillhook.engine.scenario.run import ScenarioType
from stillhook.engine.store import Store, Summary, keys_of, one_manifest
from stillhook.engine.tasks import CaseType, Task, cut, on_threads
from stillhook.engine.tasks.carried import kept_on_workers
from stillhook.engine.tasks.cluster import on_cluster
from stillhook.errors import Cancelled, ScenarioError, SimulationError, StillhookError
from stillhook.kernels.lanes import VL
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario

if TYPE_CHECKING:
    import xarray


T = TypeVar("T")


class End(StrEnum):
    """Where a run ends."""

    DURATION = "duration"
    PROGRAMME = "programme"


class OnFailure(StrEnum):
    """What a batch does with a case that fails."""

    RAISE = "raise"
    MARK = "mark"


@kept_on_workers
def row_of(run: Run) -> Summary:
    """The summary of a run: what a batch keeps of it unless something else is asked for."""
    return run.row


def unchanged(run: Run) -> Run:
    """The run as it is."""
    return run


def run_cases(
    crane: Crane | Sequence[Crane],
    case: Case | Sequence[Case],
    *,
    step: str | int | None = None,
    every: int = 0,
    lanes: int | None = None,
    keep: Callable[[Any], Any] = row_of,
    threads: int = 2,
    store: str | Path | None = None,
    client: Any = None,
    progress: Progress | None = None,
    mark: bool = False,
) -> list[Any]:
    """What is kept of every run, in the order of the cases; a case that loses its numbers is marked and affects no
    other.

    Parameters and errors as in `simulate`, and: step may be steps per PLC cycle; every PLC cycles between two rows of
    the series, 0 for none; lanes cases side by side, 1 or 16, which changes no number; default 16 where summaries are
    kept or there are many cases; keep what is kept of a run, made where it was run: its `Summary`, `unchanged`, or what
    a function of a module makes of it (a cluster sends no more than that); mark: a case that is refused is a `Refused`
    run among the others, with the status "refused".
    """
    cranes, cases = paired(crane, case, ANY_CASE)
    of = type_of(cases)
    n_sub, refused = _checked(of, cranes, cases, step, threads, series=every > 0, mark=mark)
    more: dict[str, Any] = {"every": every, "lanes": lanes, "keep": keep, "client": client, "progress": progress}
    return _run(of, cranes, cases, n_sub, threads=threads, store=store, refused=refused, mark=mark, **more)


Problems = dict[int, StillhookError]
"""Why cases were refused, by place."""


def _checked(
    of: CaseType,
    cranes: Sequence[Crane],
    cases: Sequence[Case],
    step: str | int | None,
    threads: int,
    *,
    series: bool,
    mark: bool,
) -> tuple[int, Problems]:
    """Steps per PLC cycle, default those for series or for statistics, and the cases that cannot be run. Errors: those
    of the first such case, unless they are marked and others can be run."""
    check_threads(threads)
    refused: Problems = {}
    _sorted_out(of.check, cranes, cases, refused, mark=mark)
    if isinstance(step, int):
        return step, refused
    if step is not None:
        return steps_per_cycle(cranes[0], step), refused
    return _sorted_out(lambda w, c: of.default_steps(w, c, series=series), cranes, cases, refused, mark=mark), refused


def _sorted_out(
    look: Callable[[list[Crane], list[Case]], T],
    cranes: Sequence[Crane],
    cases: Sequence[Case],
    refused: Problems,
    *,
    mark: bool,
) -> T:
    """What `look` says of all cases that can be run; the others are added to `refused` where they are marked."""
    places = [i for i in range(len(cases)) if i not in refused]
    try:
        return look([cranes[i] for i in places], [cases[i] for i in places])
    except StillhookError:
        if not mark:
            raise
        before = len(refused)
        for i in places:
            try:
                look([cranes[i]], [cases[i]])
            except StillhookError as problem:
                refused[i] = problem
        if len(refused) in (before, len(cases)):
            raise
    return _sorted_out(look, cranes, cases, refused, mark=mark)


def _run(
    of: CaseType,
    cranes: Sequence[Crane],
    cases: Sequence[Case],
    n_sub: int,
    *,
    every: int,
    lanes: int | None,
    keep: Callable[[Any], Any],
    threads: int,
    store: str | Path | None,
    client: Any,
    progress: Progress | None,
    refused: Problems,
    mark: bool,
) -> list[Any]:
    """`run_cases` of pairs that were checked."""
    if lanes is None:
        lanes = VL if keep is row_of or len(cases) >= VL // 2 else 1
    # without marks packed at once: they are all in memory anyway
    ready = of.ready(cranes, cases, n_sub) if keep is unchanged and not mark else None
    results: dict[int, Any] = {}
    keys: list[bytes] = []
    if store is not None:
        folder, keys, results = _stored(of, cranes, cases, n_sub, store)
        if len(results) < len(cases):
            folder.check_room()
    for i, problem in refused.items():
        results[i] = keep(Refused.of(cranes[i], cases[i], of.names(cranes[i], cases[i]), problem))
    seconds = [0.0 if i in refused else of.seconds(cranes[i], cases[i]) for i in range(len(cases))]
    done = sum(seconds[i] for i in results)
    meter = Meter(sum(seconds), progress, done, of=len(cases), finished=len(results))
    workers = threads if client is None else max(sum(client.nthreads().values()), 1)
    tasks = [
        Task(
            type=of,
            indices=part,
            cranes=[cranes[i] for i in part],
            cases=[cases[i] for i in part],
            n_sub=n_sub,
            lanes=lanes,
            every=every,
            keep=keep,
            seconds=sum(seconds[i] for i in part),
            ready=None if ready is None else [ready[i] for i in part],
            mark=mark,
        )
        for part in cut(of, cranes, cases, [i for i in range(len(cases)) if i not in results], lanes, workers)
    ]
    running = on_threads(tasks, threads, meter) if client is None else on_cluster(tasks, client, meter)
    try:
        meter.finish("", 0)
        meter.tell()
        with one_manifest(store), closing(running) as answers:
            for task, made in answers:
                if store is not None:
                    folder.put([keys[i] for i in task.indices], made)
                results.update(zip(task.indices, made, strict=True))
                meter.finish(of.words(task.cases[-1]), len(made))
    except Cancelled:
        raise Cancelled(lambda: results or None) from None
    return [results[i] for i in range(len(cases))]


def _stored(
    of: CaseType, cranes: Sequence[Crane], cases: Sequence[Case], n_sub: int, store: str | Path
) -> tuple[Store, list[bytes], dict[int, Any]]:
    """A store, the keys of these cases, and the summaries that it holds by place."""
    names = [of.names(w, c) for w, c in zip(cranes, cases, strict=True)]
    folder, keys = Store(Path(store)), keys_of(cranes, of.as_bytes(cases), names, n_sub)
    return folder, keys, folder.find(keys, names.__getitem__)


def stored_places(
    crane: Crane, cases: Sequence[Case], *, step: str, sampling: str, end: End, store: str | Path | None
) -> list[int]:
    """Places of the lowerings on one crane whose statistics a store holds; arguments as of `simulate`. Nothing is run,
    and no store is made."""
    if store is None or not Path(store).is_dir():
        return []
    of = type_of(cases, cycles(crane, sampling, "sampling"), short=end == End.PROGRAMME)
    return sorted(_stored(of, [crane] * len(cases), cases, steps_per_cycle(crane, step), store)[2])


def type_of(cases: Sequence[Case], sampled: int = 1, *, short: bool = False) -> CaseType:
    """What these cases are. Errors: ScenarioError where they are of several types."""
    scenario = [isinstance(c, Scenario) for c in cases]
    if other := [i for i, is_one in enumerate(scenario) if is_one != scenario[0]]:
        a, b = (type(cases[i]).__name__ for i in (0, other[0]))
        raise ScenarioError(f"simulate: case 0 is a {a}, case {other[0]} a {b}. Run scenarios and lowerings apart.")
    return ScenarioType() if scenario[0] else LoweringType(sampled, short=short)


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
    """Run a scenario or a lowering, one or many, on one crane or on as many.

    A scenario is a load on the wire in compensation; a lowering takes a payload from above the surface down, by a
    programme.

    Parameters
    ----------
    crane : Crane or sequence of Crane
        What the machine is. A list of cranes of one winch type adds the dimension "case": all run the one case, or each
        its own of equally many (draws of uncertain parameters:
        `stillhook.identify.system_friction.fitting.uncertainty`).
    case : Scenario, Lowering or sequence of them
        What is done to it. A list adds the dimension "case".
    step : str, optional
        Integration step, at most the PLC cycle and a whole part of it; default 2 ms with series, 5 ms for statistics
        alone (a lowering 5 ms, and down to 1 ms where a stiff winch needs it), or the next shorter step that the PLC
        cycle allows.
    every : str, optional
        Spacing of the stored series, a whole number of PLC cycles; default 0.1 s, or the next longer spacing that there
        is.
    series : bool, optional
        Store time series; default True for one case, False for a list (statistics alone, sixteen cases side by side).
    sampling : str, optional
        Spacing at which extremes, sums and energies of a lowering are taken, a whole number of PLC cycles of which
        `every` is a multiple; default every cycle. 20 ms saves a quarter of the time (docs/validation/step-size.md).
    end : {"duration", "programme"}
        "programme" ends a lowering soon after its programme; default after its duration.
    on_failure : {"raise", "mark"}
        "raise" (default) stops with SimulationError if a case fails, and before anything runs where one is refused;
        "mark" keeps the rest: `status` is "diverged" or "refused", `notes` say why, the other cases have the numbers
        that they have alone.
    threads : int, default 2
        Threads that share a batch.
    store : str or Path, optional
        Folder in which statistics alone are kept as they finish, so that an interrupted run continues; see
        `run_cases`.
    client : dask.distributed.Client, optional
        Cluster on which statistics alone are made, with the same numbers.
    progress : callable or Monitor, optional
        Called with the share done, 0..1; first with 0, when everything that was given has been found good. A
        `stillhook.Monitor` gets events and can cancel.

    Returns
    -------
    Dataset
        Summary of every case, and the series over "time" [s]; names, units and meaning from `stillhook.variables`. Its
        attributes hold crane, scenarios, version, kernel and step: `stillhook.formats.results.rerun` repeats the run
        from them.

    Raises
    ------
    ScenarioError
        For a bad scenario.
    SpecError
        For a step that is too long.
    SimulationError
        For a failed case. Nothing is returned half-done.
    Cancelled
        When the token of the monitor is set; its `partial` holds the cases that were finished.

    Examples
    --------
    >>> import stillhook
    >>> crane = stillhook.load_crane("nov-250t")
    >>> case = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 12 s", duration="40 s", warm_up="20 s")
    >>> run = stillhook.simulate(crane, [case.with_mode("ns"), case.with_mode("ssc")])
    >>> run.sizes["case"], bool(run.e_c_pp.max() < 0.1), run.e_c_pp.units
    (2, True, 'm')
    """
    single = isinstance(crane, Crane) and isinstance(case, ANY_CASE)
    cranes, cases = paired(crane, case, ANY_CASE)
    for name, value, allowed in (("on_failure", on_failure, OnFailure), ("end", end, End)):
        if value not in tuple(allowed):
            raise ScenarioError(f"{name} = {units.quote(value)}: give one of {', '.join(allowed)}.")
    stored = single if series is None else series
    if stored and (store is not None or client is not None):
        raise ScenarioError(
            "simulate: a run with series is made here and held in memory. Leave store and client out, or set"
            " series=False."
        )
    sampled = 1 if sampling is None else cycles(cranes[0], sampling, "sampling")
    of, rows = type_of(cases, sampled, short=end == End.PROGRAMME), cycles(cranes[0], every)
    if (sampling is not None or end != End.DURATION) and isinstance(of, ScenarioType):
        raise ScenarioError("simulate: sampling and end are for lowerings. Leave them out for scenarios.")
    if every is None:
        rows = math.ceil(rows / sampled) * sampled
    elif stored and rows % sampled:
        raise ScenarioError(f'every = "{every}" is not a whole number of samples of "{sampling}".')
    mark = OnFailure(on_failure) is OnFailure.MARK
    n_sub, refused = _checked(of, cranes, cases, step, threads, series=stored, mark=mark)

    def labelled(runs: Mapping[int, Any]) -> xarray.Dataset:
        """Runs by the places of their cases; all of them, or those that were finished."""
        places = sorted(runs)
        ordered = [runs[i] for i in places]
        summaries = [run.row for run in ordered] if stored else ordered
        if len(runs) == len(cases):
            (raise_refused if mark else raise_failures)(summaries)
        return of.dataset(
            crane if isinstance(crane, Crane) else [cranes[i] for i in places],
            [cases[i] for i in places],
            summaries,
            step=cranes[0].control.t_cycle / n_sub,
            single=single,
            runs=ordered if stored else (),
        )

    try:
        runs = _run(
            of,
            cranes,
            cases,
            n_sub,
            every=rows if stored else 0,
            lanes=None,
            keep=unchanged if stored else row_of,
            threads=threads,
            store=store,
            client=client,
            progress=progress,
            refused=refused,
            mark=mark,
        )
    except Cancelled as stopped:
        raise stopped.then(labelled) from None
    return labelled(dict(enumerate(runs)))


def dataset_of(runs: Sequence[Run], labels: Sequence[str] | None = None) -> xarray.Dataset:
    """Runs with their series as one labelled Dataset with these labels along "case"; of one run alone without."""
    first, cases = runs[0], [r.case for r in runs]
    if labels is not None:
        cases = [c.model_copy(update={"name": label}) for c, label in zip(cases, labels, strict=True)]
    return type_of(cases).dataset(
        first.crane if all(r.crane is first.crane for r in runs) else [r.crane for r in runs],
        cases,
        [r.row for r in runs],
        step=first.step,
        single=labels is None,
        runs=runs,
    )


def raise_refused(summaries: Sequence[Mapping[str, Any]]) -> None:
    """Errors: SimulationError where every case was refused, with the reason of the first."""
    if all(s["status"] == Ending.REFUSED for s in summaries):
        raise SimulationError(f"{len(summaries)} of {len(summaries)} cases {summaries[0]['notes'][-1]}")


def raise_failures(summaries: Sequence[Mapping[str, Any]]) -> None:
    """Errors: SimulationError naming the first failed case."""
    failed = [i for i, s in enumerate(summaries) if s["status"] == Ending.DIVERGED]
    if failed:
        i = failed[0]
        raise SimulationError(
            f"{len(failed)} of {len(summaries)} cases failed. First: case {i} {summaries[i]['notes'][-1]}. "
            'Ramp the motion in, use a finer step, or keep the rest with on_failure="mark".'
        )
