"""Tens of thousands of runs in bounded memory: cut into tasks, shared by threads or by a cluster, kept in a store as
they finish. One path for every kind of problem.

Results kept on disk under what they follow from: crane, scenario, step and code. Every file is whole or not
there.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import pickle
from collections.abc import Callable, Generator, Hashable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import as_completed as as_done
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeVar, Unpack

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import atomic_file, cannot_write, check_folder
from stillhook.base.progress import Meter, Progress
from stillhook.engine.arguments import Series, check_threads
from stillhook.engine.runner import RunOptions
from stillhook.errors import SimulationError, StillhookError
from stillhook.kernels.build import Setup, driver, results_hash
from stillhook.kernels.lanes import VL
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario

if TYPE_CHECKING:
    import xarray


Case = TypeVar("Case")
SUFFIX = ".cases.npz"
KEY = 32
"""Length of a key [bytes]."""


class _Index(NamedTuple):
    """files that have been read; places: key -> file and row in it."""

    files: set[str]
    places: dict[bytes, tuple[str, int]]


_INDICES: dict[Path, _Index] = {}


class Store:
    """A folder of result files; one file a task, each with the keys of its cases. `names` are the columns of the
    numbers."""

    def __init__(self, folder: Path, names: Sequence[str]) -> None:
        self.folder, self.names = folder, tuple(names)
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as e:
            raise cannot_write(folder, e) from None

    def keys(
        self,
        cranes: Sequence[Crane],
        cases: Sequence[Case],
        n_sub: int,
        code: str,
        to_bytes: Callable[[Case], bytes],
    ) -> list[bytes]:
        """What each result follows from, as a hash: everything but names, titles and sources, which change no number.
        to_bytes: a case as bytes."""
        prints: dict[int, bytes] = {}
        start = f"{code} {n_sub} {' '.join(self.names)}".encode()
        out = []
        for crane, case in zip(cranes, cases, strict=True):
            if id(crane) not in prints:
                prints[id(crane)] = crane.model_dump_json(exclude={"sources", "title", "name"}).encode()
            out.append(hashlib.sha256(b"\0".join((start, prints[id(crane)], to_bytes(case)))).digest())
        return out

    def check_room(self) -> None:
        """Refuse a folder that nothing can be kept in, before the work is done. Errors: SimulationError."""
        check_folder(self.folder, ())

    def find(self, keys: Sequence[bytes]) -> dict[int, dict[str, Any]]:
        """Place in `keys` -> summary, for what is present. Errors: SimulationError naming a file that cannot be
        read."""
        index = self._index()
        hits: dict[str, list[tuple[int, int]]] = {}
        for i, key in enumerate(keys):
            if key in index.places:
                file, row = index.places[key]
                hits.setdefault(file, []).append((row, i))
        results: dict[int, dict[str, Any]] = {}
        for file, rows in hits.items():
            with self._opened(file) as data:
                self._take(data, rows, results)
        return results

    def _index(self) -> _Index:
        """Location of every key. Files never change, so each is read once in the life of this process."""
        present = {path.name for path in self.folder.glob(f"*{SUFFIX}")}
        index = _INDICES.get(self.folder.resolve())
        if index is None or not index.files <= present:
            index = _INDICES[self.folder.resolve()] = _Index(set(), {})
        for file in sorted(present - index.files):
            with self._opened(file) as data:
                index.places.update({key.tobytes(): (file, row) for row, key in enumerate(data["keys"])})
            index.files.add(file)
        return index

    @contextmanager
    def _opened(self, file: str) -> Iterator[Mapping[str, Any]]:
        path = self.folder / file
        try:
            with np.load(path, allow_pickle=False) as data:
                yield data
        except Exception as e:  # of a damaged file many kinds come
            raise SimulationError(
                f"{path}: not a result file of Stillhook ({' '.join(str(e).split())[:120]}). Remove it, and run again."
            ) from None

    def _take(
        self, data: Mapping[str, Any], hits: Sequence[tuple[int, int]], results: dict[int, dict[str, Any]]
    ) -> None:
        status, numbers, notes = data["status"], data["numbers"], data["notes"]
        for row, i in hits:
            columns = dict(zip(self.names, numbers[row].tolist(), strict=True))
            results[i] = {"status": str(status[row]), **columns, "notes": json.loads(str(notes[row]))}

    def put(
        self, keys: Sequence[bytes], status: Sequence[str], numbers: NDArray[np.float64], notes: Sequence[Sequence[str]]
    ) -> None:
        """Keep the results of one task. The file appears under its name only when it is complete."""
        name = hashlib.sha256(b"".join(keys)).hexdigest()[:KEY]
        with atomic_file(self.folder / f"{name}{SUFFIX}") as part, open(part, "wb") as file:
            np.savez_compressed(
                file,
                keys=np.frombuffer(b"".join(keys), dtype=f"V{KEY}"),
                status=np.array(list(status)),
                numbers=numbers,
                notes=np.array([json.dumps(list(n)) for n in notes]),
            )


NAMES = ("name", "source", "report")
"""What a scenario, and the record of a motion in it, are called and where they are from."""


def scenario_as_bytes(case: Scenario) -> bytes:
    return json.dumps(bare(case.to_dict()), sort_keys=True).encode()


def bare(data: Any) -> Any:
    """Plain data without names, at every depth."""
    if isinstance(data, dict):
        return {key: bare(x) for key, x in data.items() if key not in NAMES}
    return [bare(x) for x in data] if isinstance(data, list) else data


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


class Row(NamedTuple):
    """Summary of one case."""

    status: str
    numbers: list[float]  # in the order of the problem's columns
    notes: tuple[str, ...]


class Problem(Protocol):
    """A kind of case: how it is checked, grouped, run and summarised. Stateless; a worker imports it by its name."""

    def setup(self, case: Any) -> Setup:
        """What the kernel of a case runs besides a winch."""

    def check(self, cranes: Sequence[Crane], cases: Sequence[Any]) -> None:
        """Refuse what cannot be run, before anything runs. Errors: those of the first such case, with its place."""

    def default_step(self, cranes: Sequence[Crane], cases: Sequence[Any], *, series: bool) -> float:
        """Step that is taken unasked [s], with series or for statistics alone. Errors: as `check`."""

    def group(self, crane: Crane, case: Any) -> Hashable:
        """Cases of one group can share a block of lanes."""

    def seconds(self, crane: Crane, case: Any) -> float:
        """Simulated time of a case [s]."""

    def sort(self, places: list[int], cases: Sequence[Any]) -> list[int]:
        """Places of a group in the order in which they are best run."""

    def columns(self, crane: Crane, case: Any) -> tuple[str, ...]:
        """Names of the numbers of its summary."""

    def identity(self) -> Callable[[Any], bytes]:
        """A function that gives what a result follows from: the case as bytes, without names and sources."""

    def results(
        self,
        cranes: Sequence[Crane],
        cases: Sequence[Any],
        **options: Unpack[RunOptions],
    ) -> list[Any]:
        """What came out of every case, with its series where every > 0. `check` has passed the cases before."""

    def row(self, crane: Crane, case: Any, result: Any) -> Row:
        """The summary of one case."""

    def labelled(
        self,
        crane: Crane | Sequence[Crane],
        cases: Sequence[Any],
        rows: Sequence[Mapping[str, Any]],
        *,
        step: float,
        single: bool,
        series: Series | None,
    ) -> xarray.Dataset:
        """Summaries of cases (by their columns, with status and notes) and series as a labelled Dataset; step [s]."""


def run_batch(
    problem: Problem,
    cranes: Sequence[Crane],
    cases: Sequence[Any],
    *,
    n_sub: int,
    threads: int = 2,
    store: str | Path | None = None,
    client: Any = None,
    progress: Progress | None = None,
) -> list[dict[str, Any]]:
    """The summary of every case: status, numbers by the problem's columns, notes.

    Parameters
    ----------
    cranes, cases: one crane for each case. n_sub: steps per PLC cycle.
    threads: threads of this machine that share the work. client: a dask.distributed Client; its workers then share it,
    with the same numbers to the last bit, and threads is not used.
    store: folder in which results are kept as they finish, under what they follow from: crane, case, step and code.
    What is there already is not run again, so an interrupted run continues where it stopped, and a longer list of
    cases costs only what is new. progress: called with the share done, 0..1.

    Errors: those of the first case that cannot be run; SimulationError where store or cluster fail, or the cluster runs
    other code.
    """
    check_threads(threads)
    problem.check(cranes, cases)
    stored_runs = StoredRuns(problem, store, cranes, cases, n_sub) if store is not None else None
    results = stored_runs.stored() if stored_runs is not None else {}
    missing = [i for i in range(len(cases)) if i not in results]
    if stored_runs is not None and missing:
        stored_runs.check_room()
    seconds = _seconds(problem, cranes, cases) if progress is not None else [1.0] * len(cases)
    meter = Meter(sum(seconds), progress, done=sum(seconds[i] for i in results))
    meter.tell()
    workers = threads if client is None else max(sum(client.nthreads().values()), 1)
    places = _cut(problem, cranes, cases, missing, workers)
    tasks = [
        Task(
            problem=problem,
            indices=i,
            cranes=[cranes[k] for k in i],
            cases=[cases[k] for k in i],
            n_sub=n_sub,
            seconds=sum(seconds[k] for k in i),
        )
        for i in places
    ]
    landed = on_threads(tasks, threads, meter) if client is None else on_cluster(tasks, client, meter)
    with closing(landed):  # a store that fails stops the threads, or the cluster, at once
        for task, rows in landed:
            if stored_runs is not None:
                stored_runs.put(task.indices, rows)
            for i, row in zip(task.indices, rows, strict=True):
                results[i] = summary_of(row, problem.columns(cranes[i], cases[i]))
    return [results[i] for i in range(len(cases))]


def _seconds(problem: Problem, cranes: Sequence[Crane], cases: Sequence[Any]) -> list[float]:
    """Simulated time of every case [s]."""
    return [problem.seconds(crane, case) for crane, case in zip(cranes, cases, strict=True)]


def summary_of(row: Row, names: Sequence[str]) -> dict[str, Any]:
    """A row under the names of its columns, with status and notes."""
    return {"status": row.status, **dict(zip(names, row.numbers, strict=True)), "notes": list(row.notes)}


class Task(NamedTuple):
    """Cases that one worker runs, with their places in the whole list."""

    problem: Problem
    indices: list[int]
    cranes: list[Crane]
    cases: list[Any]
    n_sub: int
    seconds: float = 0.0  # simulated, of all cases

    def part(self, start: int, end: int) -> Task:
        """Some of its cases."""
        places = slice(start, end)
        return self._replace(indices=self.indices[places], cranes=self.cranes[places], cases=self.cases[places])

    def light(self) -> Task:
        """The same without the sources of the cranes' numbers, which no run reads; cranes that are one stay one."""
        each = {id(c): c for c in self.cranes}
        bare = {key: c.model_copy(update={"sources": {}}) for key, c in each.items()}
        return self._replace(cranes=[bare[id(c)] for c in self.cranes])


def _cut(
    problem: Problem, cranes: Sequence[Crane], cases: Sequence[Any], missing: Sequence[int], workers: int
) -> list[list[int]]:
    """Places of the missing cases in tasks of full blocks of lanes: cases that can share a block are together."""
    groups: dict[Hashable, list[int]] = {}
    for i in missing:
        groups.setdefault(problem.group(cranes[i], cases[i]), []).append(i)
    fair = math.ceil(len(missing) / (TASKS_EACH * workers) / VL) * VL
    out: list[list[int]] = []
    for group in groups.values():
        seconds, places = problem.seconds(cranes[group[0]], cases[group[0]]), problem.sort(group, cases)
        worth = math.ceil(max(TASK_SECONDS, TASK_SECONDS_EACH * workers) / seconds / VL) * VL
        size = max(VL, min(fair, worth))
        out += [places[k : k + size] for k in range(0, len(places), size)]
    return out


def work(task: Task, progress: Progress | None = None) -> list[Row]:
    """Summaries of the cases of one task, run on one thread: block by block, each summed up while its motions are at
    hand."""
    rows: list[Row] = []
    total = len(task.indices)
    for k in range(0, total, VL):
        block = task.part(k, k + VL)
        places = None if task.indices == [0] else block.indices

        def report(share: float, before: int = k, size: int = len(block.indices)) -> None:
            if progress is not None:
                progress((before + share * size) / total)

        results = block.problem.results(
            block.cranes,
            block.cases,
            n_sub=block.n_sub,
            lanes=VL,
            every=0,
            threads=1,
            progress=report,
            places=places,
        )
        rows += map(block.problem.row, block.cranes, block.cases, results)
    return rows


def on_threads(tasks: Sequence[Task], threads: int, meter: Meter) -> Generator[tuple[Task, list[Row]], None, None]:
    """Tasks with the summaries of their cases, as they finish."""
    if threads == 1 or len(tasks) < 2:
        for task in tasks:
            yield task, work(task, meter.part(task.seconds))
        return
    driver(tasks[0].cranes[0].plant.value, VL, tasks[0].problem.setup(tasks[0].cases[0]))
    with ThreadPoolExecutor(threads) as pool:
        waiting: dict[Future[list[Row]], Task] = {
            pool.submit(work, task, meter.part(task.seconds)): task for task in tasks
        }
        try:
            for done in as_done(list(waiting)):
                yield waiting.pop(done), done.result()
        except BaseException:
            meter.stopped = True
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def on_cluster(tasks: Sequence[Task], client: Any, meter: Meter) -> Generator[tuple[Task, list[Row]], None, None]:
    """Tasks with the summaries of their cases, as they finish."""
    with closing(spread(tasks, Task.light, work, client)) as answered:
        for task, rows in answered:
            meter.part(task.seconds)(1.0)
            yield task, rows


Job = TypeVar("Job")
Answer = TypeVar("Answer")


def run_packed(packed: bytes) -> tuple[Any, str]:
    """The result of a pickled function and its argument, into which a cluster need not look, and the hash of the code
    that made it."""
    run, job = pickle.loads(packed)
    return run(job), results_hash()


def spread(
    jobs: Sequence[Job], light: Callable[[Job], Any], run: Callable[[Any], Answer], client: Any
) -> Generator[tuple[Job, Answer], None, None]:
    """Jobs with their answers, as they finish; a few are under way for each thread of the cluster, and a lost worker's
    are given again.

    light: what of a job crosses the network, pickled; run: function of a module that makes the answer of that on a
    worker.
    Errors: those of a job; SimulationError where the cluster fails, or runs other code.
    """
    from distributed import as_completed

    rest = iter(jobs)
    room = IN_FLIGHT * max(sum(client.nthreads().values()), 1)
    submitted: dict[str, tuple[Any, Job]] = {}

    def submit_next(put: Callable[[Any], None]) -> None:
        for job in itertools.islice(rest, 1):
            future = client.submit(run_packed, pickle.dumps((run, light(job)), pickle.HIGHEST_PROTOCOL), pure=False)
            submitted[future.key] = future, job
            put(future)

    under_way = as_completed(loop=client.loop)
    try:
        for _ in range(room):
            submit_next(under_way.add)
        for future in under_way:
            answer: Answer = _answer_of(future)
            yield submitted.pop(future.key)[1], answer
            submit_next(under_way.add)
    finally:
        client.cancel([future for future, _ in submitted.values()])


def _answer_of(future: Any) -> Any:
    """What a worker gave back. Errors: those of the case; SimulationError where the worker failed, or runs other code
    than this machine."""
    try:
        answer, made_by = future.result()
    except StillhookError:
        raise
    except Exception as e:
        error = f"{type(e).__name__}: {' '.join(str(e).split())}"
        raise SimulationError(
            f"cluster: a task failed ({error[:200]}). Look at its workers, and run again; a store keeps what is done."
        ) from None
    if made_by != results_hash():
        raise SimulationError(
            f"cluster: a worker runs Stillhook {made_by}, this machine {results_hash()}. Install the same"
            " version everywhere."
        )
    return answer


class StoredRuns:
    """The store of a batch. Cases with other columns have separate files."""

    def __init__(
        self, problem: Problem, folder: str | Path, cranes: Sequence[Crane], cases: Sequence[Any], n_sub: int
    ) -> None:
        self.columns = [problem.columns(crane, case) for crane, case in zip(cranes, cases, strict=True)]
        self.groups: dict[tuple[str, ...], list[int]] = {}
        for i, names in enumerate(self.columns):
            self.groups.setdefault(names, []).append(i)
        self.stores = {names: Store(Path(folder), names) for names in self.groups}
        self.keys: dict[int, bytes] = {}
        identity, code = problem.identity(), results_hash()
        for names, group in self.groups.items():
            keys = self.stores[names].keys([cranes[i] for i in group], [cases[i] for i in group], n_sub, code, identity)
            self.keys.update(zip(group, keys, strict=True))

    def stored(self) -> dict[int, dict[str, Any]]:
        """Place -> summary, for what is there."""
        out: dict[int, dict[str, Any]] = {}
        for names, group in self.groups.items():
            summaries: Mapping[int, dict[str, Any]] = self.stores[names].find([self.keys[i] for i in group])
            out.update({group[k]: summary for k, summary in summaries.items()})
        return out

    def check_room(self) -> None:
        next(iter(self.stores.values())).check_room()

    def put(self, indices: Sequence[int], rows: Sequence[Row]) -> None:
        """Keep a task, whose cases all have the same columns."""
        numbers: FloatArray = np.array([row.numbers for row in rows], dtype=np.float64)
        store = self.stores[self.columns[indices[0]]]
        store.put([self.keys[i] for i in indices], [r.status for r in rows], numbers, [r.notes for r in rows])
