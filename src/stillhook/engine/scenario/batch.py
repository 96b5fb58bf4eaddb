"""Tens of thousands of runs in bounded memory: cut into tasks, shared by threads or by a cluster, kept in a store as
they finish."""

from __future__ import annotations

import itertools
import math
import pickle
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import as_completed as as_done
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from stillhook.base.progress import Progress
from stillhook.engine.arguments import STATISTICS_STEP, check_threads, paired, steps_per_cycle
from stillhook.engine.inputs import shape
from stillhook.engine.scenario.checks import check
from stillhook.engine.scenario.run import Meter, run_cases
from stillhook.engine.scenario.summary import summarise
from stillhook.engine.store import Store
from stillhook.errors import SimulationError, StillhookError
from stillhook.kernels.build import driver, results_hash
from stillhook.kernels.lanes import VL
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.variables import SUMMARY

NUMBERS = tuple(v.name for v in SUMMARY if v.name not in ("status", "notes"))
TASK_SECONDS = 5.0e4
"""Simulated seconds in a task: about a second of one core, so that a cluster's overhead of some milliseconds a task
does not count."""
TASK_SECONDS_EACH = 250.0
"""The same for each worker, where there are hundreds: 5 ms of work, more than giving out a task costs whoever gives
it."""
TASKS_EACH = 8
"""Tasks for each worker at least, where there are enough cases: nobody then waits long for the last one."""
IN_FLIGHT = 3
"""Tasks given to a cluster at once, for each of its threads: more would only fill the scheduler's memory."""


class Answers(NamedTuple):
    """What a task gives back: status and notes of each case, numbers of shape (case, names), and the code that made
    them."""

    status: list[str]
    numbers: NDArray[np.float64]
    notes: list[tuple[str, ...]]
    made_by: str

    def summary(self, i: int, names: Sequence[str] = NUMBERS) -> dict[str, Any]:
        """The summary of one case, keys and SI units of `stillhook.variables`; names of its numbers."""
        return {
            "status": self.status[i],
            **dict(zip(names, self.numbers[i].tolist(), strict=True)),
            "notes": list(self.notes[i]),
        }


def summaries(
    crane: Crane | Sequence[Crane],
    case: Scenario | Sequence[Scenario],
    *,
    step: str | None = None,
    threads: int = 2,
    store: str | Path | None = None,
    client: Any = None,
    progress: Progress | None = None,
) -> list[dict[str, Any]]:
    """The summary of every case, statistics alone; a case that loses its numbers is marked and spoils no other.

    Parameters
    ----------
    crane, case, step: as in `stillhook.simulate`.
    threads: threads of this machine that share the work. client: a dask.distributed Client; its workers then share it,
    with the same numbers to the last bit, and threads is not used.
    store: folder in which results are kept as they finish, under what they follow from: crane, scenario, step and code.
    What is there already is not run again, so a run that was killed goes on where it stood, and a longer list of cases
    costs only what is new. progress: called with the share done, 0..1.

    Errors: ScenarioError and SpecError of the first case that cannot be run; SimulationError where the cluster fails,
    or runs other code.
    """
    cranes, cases = paired(crane, case)
    check_threads(threads)
    n_sub = steps_per_cycle(cranes[0], step, STATISTICS_STEP)
    _check_all(cranes, cases)
    kept = Store(Path(store), NUMBERS) if store is not None else None
    keys = kept.keys(cranes, cases, n_sub, results_hash()) if kept is not None else []
    results = kept.find(keys) if kept is not None else {}
    missing = [i for i in range(len(cases)) if i not in results]
    if kept is not None and missing:
        kept.check_room()
    meter = Meter(len(cases), progress, done=len(results))
    meter.tell()
    workers = threads if client is None else max(sum(client.nthreads().values()), 1)
    tasks = [
        Task(i, [cranes[k] for k in i], [cases[k] for k in i], n_sub) for i in _cut(cranes, cases, missing, workers)
    ]
    landed = on_threads(tasks, threads, meter) if client is None else on_cluster(tasks, client, meter)
    with closing(landed):  # a store that fails stops the threads, or the cluster, at once
        for task, answers in landed:
            if kept is not None:
                kept.put([keys[i] for i in task.indices], answers.status, answers.numbers, answers.notes)
            results.update({i: answers.summary(k) for k, i in enumerate(task.indices)})
    return [results[i] for i in range(len(cases))]


def _check_all(cranes: Sequence[Crane], cases: Sequence[Scenario]) -> None:
    """Refuse what cannot be asked before anything runs."""
    for i, (crane, case) in enumerate(zip(cranes, cases, strict=True)):
        try:
            check(crane, case)
        except StillhookError as e:
            raise type(e)(f"case {i}: {e}" if len(cases) > 1 else str(e)) from None


class Task(NamedTuple):
    """Cases that one worker runs, with their places in the whole list."""

    indices: list[int]
    cranes: list[Crane]
    cases: list[Any]
    n_sub: int

    def part(self, start: int, end: int) -> Task:
        """Some of its cases."""
        return Task(self.indices[start:end], self.cranes[start:end], self.cases[start:end], self.n_sub)

    def light(self) -> Task:
        """The same without the sources of the cranes' numbers, which no run reads; cranes that are one stay one."""
        bare = {id(c): c for c in self.cranes}
        bare = {key: c.model_copy(update={"sources": {}}) for key, c in bare.items()}
        return self._replace(cranes=[bare[id(c)] for c in self.cranes])


def _cut(cranes: Sequence[Crane], cases: Sequence[Scenario], missing: Sequence[int], workers: int) -> list[list[int]]:
    """Places of the missing cases in tasks: cases that can share a block of lanes lie together."""
    groups: dict[tuple[int, int, int], list[int]] = {}
    for i in missing:
        groups.setdefault(shape(cranes[i], cases[i]), []).append(i)
    return in_tasks([(n * cranes[group[0]].control.t_cycle, group) for (n, _, _), group in groups.items()], workers)


def in_tasks(groups: Sequence[tuple[float, Sequence[int]]], workers: int) -> list[list[int]]:
    """Groups of cases, each with the simulated time of one case [s], in tasks of whole blocks of lanes."""
    fair = math.ceil(sum(len(group) for _, group in groups) / (TASKS_EACH * workers) / VL) * VL
    out: list[list[int]] = []
    for seconds, group in groups:
        worth = math.ceil(max(TASK_SECONDS, TASK_SECONDS_EACH * workers) / seconds / VL) * VL
        size = max(VL, min(fair, worth))
        out += [list(group[k : k + size]) for k in range(0, len(group), size)]
    return out


def work(task: Task, progress: Progress | None = None) -> Answers:
    """Run one task on one thread: block by block, each summed up while its motions are at hand."""
    rows: list[dict[str, Any]] = []
    total = len(task.indices)
    for k in range(0, total, VL):
        block = task.part(k, k + VL)
        places = None if task.indices == [0] else block.indices

        def report(share: float, before: int = k, size: int = len(block.indices)) -> None:
            if progress is not None:
                progress((before + share * size) / total)

        results = run_cases(
            block.cranes, block.cases, n_sub=task.n_sub, lanes=VL, every=0, threads=1, progress=report, places=places
        )
        rows += [summarise(w, c, r) for w, c, r in zip(block.cranes, block.cases, results, strict=True)]
    numbers = np.array([[s[name] for name in NUMBERS] for s in rows], dtype=np.float64)
    return Answers([s["status"] for s in rows], numbers, [tuple(s["notes"]) for s in rows], results_hash())


Work = Callable[[Task, Progress | None], Answers]


def work_packed(task: bytes) -> Answers:
    """`work` on a pickled task: a cluster need not look into what it carries."""
    return work(pickle.loads(task))


def on_threads(
    tasks: Sequence[Task], threads: int, meter: Meter, run: Work | None = None, kind: str = "driver"
) -> Generator[tuple[Task, Answers], None, None]:
    """Tasks with their answers, as they finish; run: what makes answers of a task, `work` by default, kind: driver that
    it runs."""
    run = work if run is None else run
    if threads == 1 or len(tasks) < 2:
        for task in tasks:
            yield task, run(task, meter.part(len(task.indices)))
        return
    driver(tasks[0].cranes[0].plant.value, VL, kind)
    with ThreadPoolExecutor(threads) as pool:
        waiting: dict[Future[Answers], Task] = {
            pool.submit(run, task, meter.part(len(task.indices))): task for task in tasks
        }
        try:
            for done in as_done(list(waiting)):
                yield waiting.pop(done), done.result()
        except BaseException:
            meter.stopped = True
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def on_cluster(
    tasks: Sequence[Task], client: Any, meter: Meter, run: Callable[[bytes], Answers] = work_packed
) -> Generator[tuple[Task, Answers], None, None]:
    """Tasks with their answers, as they finish; run: what a worker makes of a pickled task."""
    with closing(spread(tasks, lambda task: task.light(), run, client)) as answered:
        for task, answers in answered:
            meter.part(len(task.indices))(1.0)
            yield task, answers


class MadeBy(Protocol):
    """An answer that says by which code it was made (`results_hash`)."""

    @property
    def made_by(self) -> str: ...


Job = TypeVar("Job")
Answer = TypeVar("Answer", bound=MadeBy)


def spread(
    jobs: Sequence[Job], light: Callable[[Job], Any], run: Callable[[bytes], Answer], client: Any
) -> Generator[tuple[Job, Answer], None, None]:
    """Jobs with their answers, as they finish; a few are under way for each thread of the cluster, and a lost worker's
    are given again.

    light: what of a job crosses the network, pickled; run: makes the answer of that on a worker.
    Errors: those of a job; SimulationError where the cluster fails, or runs other code.
    """
    from distributed import as_completed

    rest = iter(jobs)
    room = IN_FLIGHT * max(sum(client.nthreads().values()), 1)
    submitted: dict[str, tuple[Any, Job]] = {}

    def give(put: Callable[[Any], None]) -> None:
        for job in itertools.islice(rest, 1):
            future = client.submit(run, pickle.dumps(light(job), pickle.HIGHEST_PROTOCOL), pure=False)
            submitted[future.key] = future, job
            put(future)

    under_way = as_completed(loop=client.loop)
    try:
        for _ in range(room):
            give(under_way.add)
        for future in under_way:
            answer: Answer = _answer_of(future)
            yield submitted.pop(future.key)[1], answer
            give(under_way.add)
    finally:
        client.cancel([future for future, _ in submitted.values()])


def _answer_of(future: Any) -> Any:
    """What a worker gave back. Errors: those of the case; SimulationError where the worker failed, or runs other code
    than this machine."""
    try:
        answer = future.result()
    except StillhookError:
        raise
    except Exception as e:
        error = f"{type(e).__name__}: {' '.join(str(e).split())}"
        raise SimulationError(
            f"cluster: a task failed ({error[:200]}). Look at its workers, and run again; a store keeps what is done."
        ) from None
    if answer.made_by != results_hash():
        raise SimulationError(
            f"cluster: a worker runs Stillhook {answer.made_by}, this machine {results_hash()}. Install the same"
            " version everywhere."
        )
    return answer
