"""A type of case, and many cases of it: cut into tasks of what can run side by side, shared by threads
(a cluster: `stillhook.engine.tasks.cluster`)."""

from __future__ import annotations

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Hashable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import TYPE_CHECKING, Any, NamedTuple

from stillhook.base.progress import Meter, Progress
from stillhook.engine.runner import Block, Ready, Refused, Run
from stillhook.engine.store import Summary
from stillhook.errors import StillhookError
from stillhook.kernels.build import Setup, driver
from stillhook.spec.crane import Crane

if TYPE_CHECKING:
    import xarray


TASK_SECONDS = 5.0e4
"""Simulated seconds in a task: about a second of one core, so that a cluster's overhead of some milliseconds a task
does not count."""
TASK_SECONDS_EACH = 250.0
"""The same for each worker, where there are hundreds: 5 ms of work, more than giving out a task costs whoever gives
it."""
TASKS_EACH = 8
"""Tasks for each worker at least, where there are enough cases: none then waits long for the last one."""


class CaseType(ABC):
    """A type of case: how it is checked, packed, grouped, run and labelled. A worker imports it by its name."""

    @abstractmethod
    def check(self, cranes: Sequence[Crane], cases: Sequence[Any]) -> None:
        """Refuse what cannot be run, before anything runs. Errors: those of the first such case, with its place."""

    @abstractmethod
    def default_steps(self, cranes: Sequence[Crane], cases: Sequence[Any], *, series: bool) -> int:
        """Steps per PLC cycle that are taken unasked, with series or for statistics alone. Errors: as `check`."""

    @abstractmethod
    def ready(
        self, cranes: Sequence[Crane], cases: Sequence[Any], n_sub: int, places: Sequence[int] | None = None
    ) -> Sequence[Ready]:
        """Packed cases, which `check` has passed. Errors: SpecError where the step is too long."""

    @abstractmethod
    def block(self, ready: Sequence[Any], *, lanes: int, n_sub: int, every: int) -> Block[Any]:
        """Those of one group side by side."""

    @abstractmethod
    def kernel(self, crane: Crane, case: Any) -> tuple[Setup, tuple[str, ...]]:
        """What the kernel of a case runs besides its winch, and the controllers that not every kernel holds."""

    @abstractmethod
    def group(self, crane: Crane, case: Any) -> Hashable:
        """What cases of one kernel must have alike to share a block of lanes."""

    @abstractmethod
    def seconds(self, crane: Crane, case: Any) -> float:
        """Simulated time of a case [s]."""

    @abstractmethod
    def names(self, crane: Crane, case: Any) -> tuple[str, ...]:
        """Names of the numbers of its summary."""

    @abstractmethod
    def as_bytes(self, cases: Sequence[Any]) -> list[bytes]:
        """What a result follows from, without names and sources."""

    @abstractmethod
    def dataset(
        self,
        crane: Crane | Sequence[Crane],
        cases: Sequence[Any],
        summaries: Sequence[Summary],
        *,
        step: float,
        single: bool,
        runs: Sequence[Run],
    ) -> xarray.Dataset:
        """Summaries of cases, and their runs where these have series, as a labelled Dataset; step [s]."""

    @abstractmethod
    def words(self, case: Any) -> str:
        """A case as events name it."""

    def sort(self, places: list[int], cases: Sequence[Any]) -> list[int]:
        """Places of a group in the order in which they are best run."""
        return places


class Task(NamedTuple):
    """Cases that one worker runs, with their places in the whole list; keep: what is kept of every run, made where it
    was run; ready: the cases packed, where that was done before; seconds simulated, of all cases; mark: a case that is
    refused when it is packed is a `Refused` run, rather than the end of all."""

    type: CaseType
    indices: list[int]
    cranes: list[Crane]
    cases: list[Any]
    n_sub: int
    lanes: int
    every: int
    keep: Callable[[Any], Any]
    seconds: float = 0.0
    ready: Sequence[Ready] | None = None
    mark: bool = False

    def light(self) -> Task:
        """The same without the sources of the cranes' numbers, which no run reads; cranes that are one stay one."""
        each = {id(c): c for c in self.cranes}
        bare = {key: c.model_copy(update={"sources": {}}) for key, c in each.items()}
        return self._replace(cranes=[bare[id(c)] for c in self.cranes], ready=None)

    def run(self, progress: Progress | None = None) -> list[Any]:
        """What is kept of the runs, made on one thread block by block."""
        results: list[Any] = []
        total = len(self.indices)
        for k in range(0, total, self.lanes):
            part = slice(k, k + self.lanes)
            count = len(self.indices[part])
            ready = self._packed(part) if self.ready is None else self.ready[part]
            runs = {j: r for j, r in enumerate(ready) if isinstance(r, Refused)}
            if sound := [r for r in ready if not isinstance(r, Refused)]:
                block = self.type.block(sound, lanes=self.lanes, n_sub=self.n_sub, every=self.every)
                for share in itertools.chain(block.steps(), (1.0,)):
                    if progress is not None:
                        progress((k + share * count) / total)
                made = iter(block.results())
                results += [self.keep(runs[j] if j in runs else next(made)) for j in range(len(ready))]
            else:
                results += map(self.keep, runs.values())
        return results

    def _packed(self, part: slice) -> Sequence[Ready | Refused]:
        """Cases of a block packed. Errors: those of the first that cannot be run, unless these are marked."""
        cranes, cases = self.cranes[part], self.cases[part]
        try:
            return self.type.ready(cranes, cases, self.n_sub, None if self.indices == [0] else self.indices[part])
        except StillhookError:
            if not self.mark:
                raise

        def each(crane: Crane, case: Any) -> Ready | Refused:
            try:
                return self.type.ready([crane], [case], self.n_sub)[0]
            except StillhookError as problem:
                return Refused.of(crane, case, self.type.names(crane, case), problem)

        return [each(crane, case) for crane, case in zip(cranes, cases, strict=True)]


def cut(
    type_: CaseType, cranes: Sequence[Crane], cases: Sequence[Any], missing: Sequence[int], lanes: int, workers: int
) -> list[list[int]]:
    """Places of the missing cases in tasks of full blocks of lanes: cases that can share a block are together."""
    groups: dict[Hashable, list[int]] = {}
    for i in missing:
        groups.setdefault((type_.kernel(cranes[i], cases[i]), type_.group(cranes[i], cases[i])), []).append(i)
    fair = math.ceil(len(missing) / (TASKS_EACH * workers) / lanes) * lanes
    out: list[list[int]] = []
    for group in groups.values():
        seconds, places = type_.seconds(cranes[group[0]], cases[group[0]]), type_.sort(group, cases)
        worth = math.ceil(max(TASK_SECONDS, TASK_SECONDS_EACH * workers) / seconds / lanes) * lanes
        size = max(lanes, min(fair, worth))
        out += [places[k : k + size] for k in range(0, len(places), size)]
    return out


Answers = Generator[tuple[Task, list[Any]], None, None]
"""Tasks with what is kept of their runs, as they finish; closing it stops the threads, or the cluster, at once."""


def on_threads(tasks: Sequence[Task], threads: int, meter: Meter) -> Answers:
    """Tasks run on threads of this machine."""
    if threads == 1 or len(tasks) < 2:
        for task in tasks:
            yield task, task.run(meter.part(task.seconds))
        return
    kernels = {task.type.kernel(task.cranes[0], task.cases[0]): task for task in tasks}
    for kernel, task in kernels.items():  # compiled before threads share it
        driver(task.cranes[0].plant.value, task.lanes, *kernel)
    with ThreadPoolExecutor(threads) as pool:
        waiting = {pool.submit(task.run, meter.part(task.seconds)): task for task in tasks}
        try:
            for done in as_completed(list(waiting)):
                yield waiting.pop(done), done.result()
        except BaseException:
            meter.stopped = True
            pool.shutdown(wait=False, cancel_futures=True)
            raise
