"""Thousands of lowerings, numbers alone, in bounded memory: shared by threads or a cluster, kept in a store as they
finish."""

from __future__ import annotations

import hashlib
import json
import pickle
from collections.abc import Iterable, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook import units
from stillhook.base.progress import Progress
from stillhook.engine.arguments import check_threads, steps_per_cycle
from stillhook.engine.lowering.checks import check_lift, check_sea
from stillhook.engine.lowering.lower import LIFT_STEP, Summarised, summarised
from stillhook.engine.lowering.run import KIND, run_lowerings, waves_step
from stillhook.engine.lowering.summary import RUN_NUMBERS, STAGE_NUMBERS, lift_summary
from stillhook.engine.scenario.batch import Answers, Task, in_tasks, on_cluster, on_threads
from stillhook.engine.scenario.run import Meter
from stillhook.engine.store import Store, bare
from stillhook.errors import LiftError, SpecError, StillhookError
from stillhook.kernels.build import results_hash
from stillhook.kernels.lanes import VL
from stillhook.spec.crane import Crane
from stillhook.spec.lift.in_sea import InSea
from stillhook.spec.lift.lowering import Lowering

if TYPE_CHECKING:
    import xarray

Case = Lowering | InSea


def lower_many(
    crane: Crane | Sequence[Crane],
    cases: Sequence[Case],
    *,
    store: str | Path | None = None,
    client: Any = None,
    threads: int = 2,
    step: str | None = None,
    progress: Progress | None = None,
) -> xarray.Dataset:
    """The numbers of many lowerings, the same to the last bit as those of `lower`; a case that loses its numbers is
    marked.

    Parameters
    ----------
    crane: that of all cases, or one for each; several are of one winch type and have one PLC cycle.
    cases: lowerings, or `InSea`, whose tip and water are made as they are run; cases that are moved alike are best run
    together, whatever their order here.
    store: folder in which results are kept as they finish, under what they follow from, so that a run that was killed
    goes on where it stood. client: a dask.distributed Client; its workers then share the work, and threads is not used.
    threads, step: as in `lower`. progress: called with the share done, 0..1.

    Returns
    -------
    Dataset over "case" with status, notes and numbers of each run, and those of its stages in "stage_..." over the
    dimension "stage".

    Errors: LiftError, ScenarioError, SpecError of the first case that cannot be run; SimulationError where store or
    cluster fail.
    """
    cases, cranes = _cases(cases), _cranes(crane, cases)
    check_threads(threads)
    n_sub = steps_per_cycle(cranes[0], step, LIFT_STEP)
    _check_all(cranes, cases)
    kept = _Kept(store, cranes, cases, n_sub) if store is not None else None
    results = kept.stored() if kept is not None else {}
    meter = Meter(len(cases), progress, done=len(results))
    meter.tell()
    missing = [i for i in range(len(cases)) if i not in results]
    if kept is not None and missing:
        kept.check_room()
    workers = threads if client is None else max(sum(client.nthreads().values()), 1)
    tasks = [Task(i, [cranes[k] for k in i], [cases[k] for k in i], n_sub) for i in _cut(cases, missing, workers)]
    landed = (
        on_threads(tasks, threads, meter, work, KIND)
        if client is None
        else on_cluster(tasks, client, meter, work_packed)
    )
    with closing(landed):  # a store that fails stops the threads, or the cluster, at once
        for task, answers in landed:
            if kept is not None:
                kept.put(task.indices, answers)
            results.update({i: answers.summary(k, _columns(cases[i])) for k, i in enumerate(task.indices)})
    numbers = [_parted(results[i], _stages(case)) for i, case in enumerate(cases)]
    h = cranes[0].control.t_cycle / n_sub
    return summarised(
        crane if isinstance(crane, Crane) else cranes, [_lift(c) for c in cases], numbers, step=h, single=False
    )


def _cases(cases: Sequence[Case]) -> list[Case]:
    lifts = list(cases) if isinstance(cases, Iterable) else [cases]
    if not lifts:
        raise LiftError("lower_many: the list of lowerings is empty. Give at least one.")
    for i, each in enumerate(lifts):
        if not isinstance(each, Lowering | InSea):
            raise LiftError(
                f"lowering {i} = {units.came(each)}: not a Lowering. Give lowerings, or lowerings in a sea (InSea)."
            )
    return lifts


def _cranes(crane: Crane | Sequence[Crane], cases: Sequence[Case]) -> list[Crane]:
    cranes = (
        [crane] * len(cases) if isinstance(crane, Crane) else list(crane) if isinstance(crane, Iterable) else [crane]
    )
    if len(cranes) != len(cases):
        raise LiftError(
            f"lower_many: {len(cranes)} cranes and {len(cases)} lowerings. Give one crane, or one for each lowering."
        )
    first = cranes[0]
    for i, each in enumerate(cranes):
        if not isinstance(each, Crane):
            raise SpecError(f"crane = {units.came(each)}: not a Crane. Read one with load_crane, by name or path.")
        if each.plant is not first.plant or each.control.t_cycle != first.control.t_cycle:
            raise SpecError(
                f'lower_many: crane {i} "{each.name}" has another winch type or PLC cycle than "{first.name}". Run them'
                " apart."
            )
    return cranes


def _check_all(cranes: Sequence[Crane], cases: Sequence[Case]) -> None:
    """Refuse what cannot be asked before anything runs; lifts that many seas share are looked at once."""
    seen: set[tuple[int, int]] = set()
    for i, (crane, case) in enumerate(zip(cranes, cases, strict=True)):
        lift = _lift(case)
        try:
            check_sea(lift)
            if (id(crane), id(lift)) not in seen:
                check_lift(crane, lift)
                seen.add((id(crane), id(lift)))
        except StillhookError as e:
            raise type(e)(f"case {i}: {e}" if len(cases) > 1 else str(e)) from None


def _lift(case: Case) -> Lowering:
    return case.lift if isinstance(case, InSea) else case


def _stages(case: Case) -> int:
    """Rows of stages in the answer: those of the programme, and the time after it."""
    return len(_lift(case).programme) + 1


def _columns(case: Case) -> tuple[str, ...]:
    """Names of all numbers of a case in one row: of the run, then of each stage."""
    return RUN_NUMBERS + tuple(f"{i} {name}" for i in range(_stages(case)) for name in STAGE_NUMBERS)


def _parted(row: Mapping[str, Any], stages: int) -> Summarised:
    """A row of `_columns` with status and notes, as numbers of the run and of each stage."""
    run = {"status": row["status"], **{name: row[name] for name in RUN_NUMBERS}, "notes": row["notes"]}
    return run, [{name: row[f"{i} {name}"] for name in STAGE_NUMBERS} for i in range(stages)]


def _cut(cases: Sequence[Case], missing: Sequence[int], workers: int) -> list[list[int]]:
    """Places of the missing cases in tasks: what can share a block of lanes, and what is moved alike, lies together."""
    groups: dict[tuple[Any, ...], list[int]] = {}
    for i in missing:
        case, lift = cases[i], _lift(cases[i])
        water = case.spacing if isinstance(case, InSea) else waves_step(lift.waves)
        groups.setdefault((lift.duration, lift.wire.nodes, water, _stages(case)), []).append(i)
    for group in groups.values():
        alike = {i: c.motion if isinstance(c := cases[i], InSea) else b"" for i in group}
        first = {motion: k for k, motion in reversed(list(enumerate(alike.values())))}
        group.sort(key=lambda i, alike=alike, first=first: first[alike[i]])  # type: ignore[misc]
    return in_tasks([(key[0], group) for key, group in groups.items()], workers)


def work(task: Task, progress: Progress | None = None) -> Answers:
    """Run one task on one thread: block by block, motions made and summed up while they are at hand."""
    status, rows, notes = [], [], []
    total = len(task.indices)
    for k in range(0, total, VL):
        block = task.part(k, k + VL)

        def report(share: float, before: int = k, size: int = len(block.indices)) -> None:
            if progress is not None:
                progress((before + share * size) / total)

        lifts = _made(block.cases)
        places = None if task.indices == [0] else block.indices
        results = run_lowerings(
            block.cranes, lifts, n_sub=task.n_sub, lanes=VL, every=0, threads=1, progress=report, places=places
        )
        for crane, lift, result in zip(block.cranes, lifts, results, strict=True):
            run, stages = lift_summary(crane, lift, result)
            status.append(run["status"])
            notes.append(tuple(run["notes"]))
            rows.append(
                [run[name] for name in RUN_NUMBERS] + [stage[name] for stage in stages for name in STAGE_NUMBERS]
            )
    return Answers(status, np.array(rows, dtype=np.float64), notes, results_hash())


def work_packed(task: bytes) -> Answers:
    """`work` on a pickled task."""
    return work(pickle.loads(task))


def _made(cases: Sequence[Case]) -> list[Lowering]:
    """Lowerings of a block; tip and water of those that are moved alike are made once."""
    made: dict[bytes, Lowering] = {}
    out: list[Lowering] = []
    for case in cases:
        if isinstance(case, Lowering):
            out.append(case)
            continue
        motion = case.motion
        first = made.setdefault(motion, case.made()) if motion not in made else made[motion]
        out.append(case.lift.model_copy(update={"tip": first.tip, "waves": first.waves}))
    return out


class _Kept:
    """A store of lowerings: columns are as many as a case has stages."""

    def __init__(self, folder: str | Path, cranes: Sequence[Crane], cases: Sequence[Case], n_sub: int) -> None:
        self.groups: dict[int, list[int]] = {}
        for i, case in enumerate(cases):
            self.groups.setdefault(_stages(case), []).append(i)
        self.stores = {n: Store(Path(folder), _columns(cases[group[0]])) for n, group in self.groups.items()}
        self.keys: dict[int, bytes] = {}
        texts = _Texts()
        for n, group in self.groups.items():
            keys = self.stores[n].keys(
                [cranes[i] for i in group], [cases[i] for i in group], n_sub, results_hash(), texts
            )
            self.keys.update(zip(group, keys, strict=True))
        self.stages = [_stages(case) for case in cases]

    def stored(self) -> dict[int, dict[str, Any]]:
        """Place -> row, for what is there."""
        out = {}
        for n, group in self.groups.items():
            out.update({group[k]: row for k, row in self.stores[n].find([self.keys[i] for i in group]).items()})
        return out

    def check_room(self) -> None:
        next(iter(self.stores.values())).check_room()

    def put(self, indices: Sequence[int], answers: Answers) -> None:
        """Keep a task, whose cases all have as many stages."""
        self.stores[self.stages[indices[0]]].put(
            [self.keys[i] for i in indices], answers.status, answers.numbers, answers.notes
        )


class _Texts:
    """A case as bytes: everything but names and sources, which change no number; lifts that cases share are written
    once.

    Names of stages stay in, because notes tell them.
    """

    def __init__(self) -> None:
        self.lifts: dict[int, bytes] = {}

    def __call__(self, case: Case) -> bytes:
        lift = _lift(case)
        if id(lift) not in self.lifts:
            self.lifts[id(lift)] = _print(lift)
        return self.lifts[id(lift)] + (case.motion if isinstance(case, InSea) else b"")


def _print(lift: Lowering) -> bytes:
    plain = lift.model_dump(
        mode="json",
        exclude={"name": True, "tip": True, "waves": True, "payload": {"name", "title", "source", "sources"}},
    )
    content = json.dumps({**plain, "tip": bare(lift.tip.to_dict())}, sort_keys=True).encode()
    if (w := lift.waves) is not None:
        water = (np.array([w.dt, w.z_0, w.ds]), w.eta, w.eta_dot, w.w, w.a)
        content += hashlib.sha256(b"".join(a.tobytes() for a in water)).digest()
    return content
