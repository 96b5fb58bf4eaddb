"""One trajectory, or blocks of sixteen, from the first cycle to the last; progress, interruption, failure of a case."""

import itertools
import math
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.control.plc import Memory
from stillhook.engine.inputs import CycleInputs, filled, hermite_weights, scale_weights
from stillhook.engine.pack.winch import Packed, pack
from stillhook.engine.scenario.checks import check
from stillhook.engine.step_size import check_step
from stillhook.errors import StillhookError
from stillhook.kernels.build import driver
from stillhook.kernels.lanes import aligned, fields, flatten, offset, size, unflatten
from stillhook.kernels.moving_window import SIGNALS, blank_window
from stillhook.kernels.statistics import blank
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.variables import WINDOW
from stillhook.winches.records import Geometry, Tick, Tip

Pair = tuple[Packed, CycleInputs]


class Ending(StrEnum):
    """How a run ended."""

    DONE = "done"
    DIVERGED = "diverged"


class Result(NamedTuple):
    """What came out of one run: statistics, the three peak-to-peak values over the moving window [m], end state, series
    (or None) with one row of Signals every `dt` [s], number of samples in the window, step [s], time reached [s]."""

    stats: Any
    span: tuple[float, float, float]
    full_window: bool
    ending: Ending
    t_end: float
    state: Any
    memory: Memory
    series: FloatArray | None
    signals: tuple[str, ...]
    dt: float
    step: float
    t_cycle: float
    warm_up: float

    def column(self, name: str) -> FloatArray:
        """The time series of a signal. Errors: KeyError for one that this winch type has not."""
        if self.series is None or name not in self.signals:
            raise KeyError(name)
        return np.asarray(self.series[:, self.signals.index(name)])


class Interrupted(Exception):
    """The caller's stop flag was set; nothing is returned."""


def run_cases(
    crane: Crane | Sequence[Crane],
    cases: Sequence[Scenario],
    *,
    n_sub: int,
    lanes: int,
    every: int,
    threads: int = 2,
    progress: Progress | None = None,
    places: Sequence[int] | None = None,
) -> list[Result]:
    """Runs in blocks of `lanes` (1 or 16), the blocks shared by threads; a failed case is marked and spoils no other.

    crane that of all cases, or one for each; several are of one winch type and have one PLC cycle.
    n_sub steps per PLC cycle; a row of the series every `every` cycles (0: statistics alone). Cases of equal length,
    warm-up and drive share a block. places: their numbers in a longer list, for messages.
    Errors: ScenarioError of the first case that cannot be run; SpecError where the step is too long.
    """
    packs = _packs([crane] * len(cases) if isinstance(crane, Crane) else crane, cases, n_sub, places)
    groups: dict[Any, list[int]] = {}
    for i, (packed, drive) in enumerate(packs):
        groups.setdefault((packed.beside, drive.n_ticks, drive.first, drive.cols), []).append(i)
    blocks = [g[i : i + lanes] for g in groups.values() for i in range(0, len(g), lanes)]

    def make(indices: list[int]) -> Block:
        return Block([packs[i] for i in indices], lanes=lanes, n_sub=n_sub, every=every)

    if len(blocks) > 1:  # compiled before threads share it
        for packed in {packed.beside: packed for packed, _ in packs}.values():
            driver(packed.name, lanes, beside=packed.beside)
    results = shared(blocks, make, threads, progress)
    return [results[i] for i in range(len(cases))]


def shared(
    blocks: list[list[int]], make: Callable[[list[int]], Any], threads: int, progress: Progress | None
) -> dict[int, Any]:
    """Results of all cases, block by block, the blocks shared by threads; make gives a block (with `steps` and
    `results`) for its cases."""
    meter = Meter(len(blocks), progress)
    meter.tell()
    results: dict[int, Any] = {}

    def work(indices: list[int]) -> None:
        block = make(indices)
        reached = meter.part(1.0)
        for share in block.steps():
            reached(share)
        reached(1.0)
        results.update(zip(indices, block.results(), strict=True))

    if threads == 1 or len(blocks) == 1:
        for indices in blocks:
            work(indices)
        return results
    with ThreadPoolExecutor(threads) as pool:
        try:
            list(pool.map(work, blocks))
        except BaseException:
            meter.stopped = True
            raise
    return results


def _packs(
    cranes: Sequence[Crane], cases: Sequence[Scenario], n_sub: int, places: Sequence[int] | None = None
) -> list[Pair]:
    """Checked and packed cases."""
    packs = []
    for i, (crane, case) in enumerate(zip(cranes, cases, strict=True)):
        try:
            check(crane, case)
            packed, drive = pack(crane, case), CycleInputs(crane, case)
            check_step(packed, drive.t_cycle / n_sub)
        except StillhookError as e:
            named = places is not None or len(cases) > 1
            raise type(e)(f"case {i if places is None else places[i]}: {e}" if named else str(e)) from None
        packs.append((packed, drive))
    return packs


class Block:
    """Runs of equal length side by side in one flat array; missing lanes repeat the first case."""

    def __init__(self, packs: list[Pair], *, lanes: int, n_sub: int, every: int) -> None:
        self.packs = packs
        self.lanes = [packs[i] if i < len(packs) else packs[0] for i in range(lanes)]
        self.drive, self.n_sub, self.every = packs[0][1], n_sub, every
        self.d = driver(packs[0][0].name, lanes, beside=packs[0][0].beside)
        self.n_x = size(self.d.State)
        self.H = scale_weights(hermite_weights(n_sub), self.drive.t_cycle)
        self.n_win = round(WINDOW / self.drive.t_cycle) + 1
        self.W = aligned(blank_window(self.n_win, lanes))
        rows = self.drive.n_ticks // every + 1 if every else 0
        self.out = np.empty((rows, size(self.d.Signals), lanes))
        self.failed: dict[int, float] = {}
        self.A = aligned(np.array([self._record(*lane) for lane in self.lanes]).T)
        self.d.at_rest(self.A.reshape(-1))

    def _record(self, packed: Packed, drive: CycleInputs) -> list[float]:
        """One lane before the first cycle: the reference lies where the wire is; state and memory await `at_rest`."""
        tick, d = Tick(*drive.first_row()), self.d
        memory = packed.memory._replace(datum=packed.s_w - tick.s_m, mode=tick.mode)
        x = nothing(d.State)
        x = x._replace(path=x.path._replace(s_w=packed.s_w))
        tip = Tip(tick.s, tick.v)
        lane = d.Lane(
            x,
            nothing(d.Command),
            nothing(d.Command),
            nothing(Geometry),
            memory,
            d.laws.blank(packed.settings),
            blank(d.Stats, packed.plant),
            nothing(d.Signals),
            tip,
            tip,
            tip,
            tick,
            packed.params,
        )
        return flatten(lane)

    def steps(self) -> Iterator[float]:
        """Run to the end in pieces; yields the share done. A case without numbers is marked and its lane set to
        rest."""
        n, first = self.drive.n_ticks, self.drive.first
        for k, count in self.drive.pieces():
            if k == first:
                self._count_from_now()
            self._piece(k, count, n, first)
            self._mark_failures((k + count) * self.drive.t_cycle)
            if len(self.failed) == len(self.packs):
                break
            yield (k + count) / n

    def _piece(self, k: int, count: int, n: int, first: int) -> None:
        D = filled([drive for _, drive in self.lanes], k, count + 1)
        self.d.run(
            self.A.reshape(-1),
            D.reshape(-1),
            self.drive.cols,
            self.H,
            self.W,
            self.out.reshape(-1),
            self.every,
            k,
            count,
            first,
            n,
            self.n_win,
            self.n_sub,
            self.drive.t_cycle,
        )

    def _count_from_now(self) -> None:
        """The warm-up is over: statistics start anew."""
        at = offset(self.d.Lane, "st", 1)
        fresh = np.array(flatten(blank(self.d.Stats, self.packs[0][0].plant)))
        self.A[at : at + len(fresh)] = fresh[:, None]

    def _mark_failures(self, t: float) -> None:
        for i in np.flatnonzero(~np.isfinite(self.A[: self.n_x]).all(axis=0)):
            self.failed.setdefault(int(i), t)
            fresh = np.array(self._record(*self.lanes[int(i)]))[:, None]
            self.d.at_rest(lane := np.repeat(fresh, len(self.lanes), axis=1).reshape(-1))
            self.A[:, i] = lane.reshape(self.A.shape)[:, i]

    def results(self) -> list[Result]:
        best = self.W.reshape(-1, SIGNALS, len(self.lanes))[2]
        return [self._result(i, best[:, i]) for i in range(len(self.packs))]

    def _part(self, name: str, i: int) -> Any:
        """One record of lane i."""
        at, cls = offset(self.d.Lane, name, 1), dict(fields(self.d.Lane))[name]
        return unflatten(cls, iter(self.A[at : at + size(cls), i].tolist()))

    def _result(self, i: int, best: FloatArray) -> Result:
        x, m, st = (self._part(name, i) for name in ("x", "m", "st"))
        span, full = _span(best, st.common, self.n_win)
        t_cycle, failed = self.drive.t_cycle, self.failed.get(i)
        if failed is not None and self.every:
            self.out[math.ceil(failed / (self.every * t_cycle) - 1e-9) :, :, i] = (
                np.nan
            )  # there the lane runs on from rest
        return Result(
            stats=st,
            span=span,
            full_window=full,
            ending=Ending.DONE if failed is None else Ending.DIVERGED,
            t_end=self.drive.n_ticks * t_cycle if failed is None else failed,
            state=x,
            memory=m,
            series=self.out[:, :, i] if self.every else None,
            signals=self.d.Signals._fields,
            dt=self.every * t_cycle,
            step=t_cycle / self.n_sub,
            t_cycle=t_cycle,
            warm_up=self.drive.first * t_cycle,
        )


def nothing(cls: type) -> Any:
    """A record of zeros."""
    return unflatten(cls, itertools.repeat(0.0))


def _span(best: FloatArray, st: Any, n_win: int) -> tuple[tuple[float, float, float], bool]:
    """Largest peak-to-peak over the window; over the whole counted run where that is shorter than the window."""
    if st.cycles >= n_win:
        return (float(best[0]), float(best[1]), float(best[2])), True
    return (st.e_max - st.e_min, st.em_max - st.em_min, st.tip_max - st.tip_min), False


class Meter:
    """Adds up what all parts of a work have done and tells the caller; also carries the stop flag to the worker
    threads.

    total and done in any weight, such as cases.
    """

    def __init__(self, total: float, progress: Progress | None, done: float = 0.0) -> None:
        self.total, self.progress, self.done, self.stopped = total, progress, done, False
        self.lock = threading.Lock()

    def tell(self) -> None:
        if self.progress is not None:
            self.progress(min(self.done / self.total, 1.0))

    def part(self, weight: float) -> Progress:
        """Progress of a part of this weight, called with its share done. Raises Interrupted once the meter is
        stopped."""
        before = 0.0

        def reached(share: float) -> None:
            nonlocal before
            if self.stopped:
                raise Interrupted
            if share == before:
                return
            with self.lock:
                self.done += (share - before) * weight
                before = share
                self.tell()

        return reached
