"""One way through every run: cases checked and packed, those that are alike side by side in blocks of lanes, blocks
shared by threads, each from the first cycle to the last."""

from __future__ import annotations

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from enum import StrEnum
from typing import Any, Generic, NotRequired, Protocol, TypedDict, TypeVar

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.base.progress import Meter, Progress
from stillhook.engine.inputs import CycleInputs, filled, hermite_weights, scale_weights
from stillhook.engine.pack.winch import Packed
from stillhook.errors import StillhookError
from stillhook.kernels.build import Setup, driver
from stillhook.kernels.lanes import aligned, offset, size, unflatten
from stillhook.kernels.statistics.cycles import blank_window
from stillhook.physics.records import fields
from stillhook.variables import WINDOW


class Ending(StrEnum):
    """How a run ended."""

    DONE = "done"
    DIVERGED = "diverged"


class RunOptions(TypedDict):
    """How cases are run: n_sub steps per PLC cycle; blocks of lanes (1 or 16); a row of the series every so many
    cycles (0: statistics alone); threads that share the blocks; places: numbers of the cases in a longer list, for
    messages."""

    n_sub: int
    lanes: int
    every: int
    threads: int
    progress: Progress | None
    places: NotRequired[Sequence[int] | None]


class Ready(Protocol):
    """A case that was checked and packed: records of the winch, and what drives it from outside."""

    @property
    def winch(self) -> Packed: ...

    @property
    def drive(self) -> CycleInputs: ...


Case = TypeVar("Case")
T = TypeVar("T")
R = TypeVar("R", bound=Ready)


def each_case(
    cranes: Sequence[Any], cases: Sequence[Case], make: Callable[[Any, Case], T], places: Sequence[int] | None = None
) -> list[T]:
    """The results of `make` for every case; places: their numbers in a longer list, for messages.

    Errors: those of make for the first case that cannot be run, with its place among several.
    """
    results = []
    for i, (crane, case) in enumerate(zip(cranes, cases, strict=True)):
        try:
            results.append(make(crane, case))
        except StillhookError as e:
            named = places is not None or len(cases) > 1
            raise type(e)(f"case {i if places is None else places[i]}: {e}" if named else str(e)) from None
    return results


def run_blocks(
    ready: Sequence[R],
    block_type: type[Block[R]],
    *,
    n_sub: int,
    lanes: int,
    every: int,
    threads: int,
    progress: Progress | None,
    **of_block: Any,
) -> list[Any]:
    """Results of all cases, those that are alike in blocks of `lanes` (1 or 16) that threads share; see `RunOptions`. A
    failed case is marked and spoils no other. of_block: what blocks of this type take in addition."""
    groups: dict[Hashable, list[int]] = {}
    for i, r in enumerate(ready):
        groups.setdefault((r.winch.extra_controllers, block_type.setup(r), block_type.alike(r)), []).append(i)
    blocks = [g[i : i + lanes] for g in groups.values() for i in range(0, len(g), lanes)]
    kernels = {(r.winch.name, block_type.setup(r), r.winch.extra_controllers) for r in ready}
    for name, setup, extra_controllers in kernels:  # compiled before threads share it
        driver(name, lanes, setup, extra_controllers)
    meter = Meter(len(blocks), progress)
    meter.tell()
    results: dict[int, Any] = {}

    def work(indices: list[int]) -> None:
        block = block_type([ready[i] for i in indices], lanes=lanes, n_sub=n_sub, every=every, **of_block)
        reached = meter.part(1.0)
        for share in block.steps():
            reached(share)
        reached(1.0)
        results.update(zip(indices, block.results(), strict=True))

    if threads == 1 or len(blocks) == 1:
        for indices in blocks:
            work(indices)
    else:
        with ThreadPoolExecutor(threads) as pool:
            try:
                list(pool.map(work, blocks))
            except BaseException:
                meter.stopped = True
                raise
    return [results[i] for i in range(len(ready))]


class Block(ABC, Generic[R]):
    """Runs of equal length side by side in one flat array; missing lanes repeat the first case."""

    sampled = 1  # statistics are taken every so many cycles
    short_from: int | None = None  # cycle from which on pieces are short

    def __init__(self, ready: Sequence[R], *, lanes: int, n_sub: int, every: int) -> None:
        self.ready = list(ready)
        self.lanes = [self.ready[i] if i < len(self.ready) else self.ready[0] for i in range(lanes)]
        self.drive, self.n_sub, self.every = self.ready[0].drive, n_sub, every
        winch = self.ready[0].winch
        self.d = driver(winch.name, lanes, self.setup(self.ready[0]), winch.extra_controllers)
        self.n_x = size(self.d.State)
        self.H = scale_weights(hermite_weights(n_sub), self.drive.t_cycle)
        self.n_win = round(WINDOW / (self.sampled * self.drive.t_cycle)) + 1
        self.W = aligned(blank_window(self.n_win, lanes, self.d.parts.windows))
        rows = self.drive.n_ticks // every + 1 if every else 0
        self.out = np.empty((rows, len(self.d.columns), lanes))
        self.failed: dict[int, float] = {}
        self.ended: dict[int, Any] = {}
        self.ran = 0
        self.A = aligned(np.array(self.records()).T)
        self.d.at_rest(self.A.reshape(-1))

    @staticmethod
    def setup(r: Any) -> Setup:
        """What the kernel of a case runs besides a winch."""
        return Setup(sensors=r.winch.sensors)

    @staticmethod
    @abstractmethod
    def alike(r: Any) -> Hashable:
        """What cases must have alike to run side by side."""

    @abstractmethod
    def record(self, r: R) -> list[float]:
        """One lane before the first cycle; state and memory of the winch await `at_rest`."""

    def records(self) -> list[list[float]]:
        """Every lane before the first cycle."""
        return [self.record(r) for r in self.lanes]

    @abstractmethod
    def piece(self, D: FloatArray, k: int, count: int) -> None:
        """Run cycles k .. k + count; D rows of the drive."""

    @abstractmethod
    def result(self, i: int) -> Any:
        """What came out of one lane."""

    def sound(self) -> BoolArray:
        """Lanes whose numbers are finite, (lanes,)."""
        return np.asarray(np.isfinite(self.A[: self.n_x]).all(axis=0))

    def reset(self, i: int) -> None:
        """Set a lane to rest again."""
        fresh = np.repeat(np.array(self.record(self.lanes[i]))[:, None], len(self.lanes), axis=1)
        self.d.at_rest(fresh.reshape(-1))
        self.A[:, i] = fresh[:, i]

    def steps(self) -> Iterator[float]:
        """Run to the end in pieces; yields the share done. A case without numbers is marked and its lane set to
        rest. What came out of a case is taken where it is over, wherever the others are."""
        for k, count in self.drive.pieces(self.short_from):
            self.piece(filled([r.drive for r in self.lanes], k, count + 1), k, count)
            self.ran = k + count
            for i in np.flatnonzero(~self.sound()):
                if int(i) not in self.ended:
                    self.failed.setdefault(int(i), self.ran * self.drive.t_cycle)
                self.reset(int(i))
            for lane in set(self.over()) - self.ended.keys() - self.failed.keys():
                self.ended[lane] = self.result(lane)
            if len(self.failed) + len(self.ended) >= len(self.ready):
                break
            yield self.ran / self.drive.n_ticks

    def over(self) -> Iterable[int]:
        """Cases that need not be run on."""
        return ()

    def results(self) -> list[Any]:
        """What came out of every case."""
        return [self.ended[i] if i in self.ended else self.result(i) for i in range(len(self.ready))]

    def part(self, name: str, i: int) -> Any:
        """One record of lane i."""
        at, cls = offset(self.d.Lane, name, 1), dict(fields(self.d.Lane))[name]
        return unflatten(cls, iter(self.A[at : at + size(cls), i].tolist()))

    def series(self, i: int) -> FloatArray | None:
        """Series of lane i, as far as it was run; without numbers from where it failed, because there the lane runs on
        from rest."""
        if not self.every:
            return None
        if i in self.failed:
            self.out[math.ceil(self.failed[i] / (self.every * self.drive.t_cycle) - 1e-9) :, :, i] = np.nan
        elif self.ran < self.drive.n_ticks:  # its programme ended the run
            return np.asarray(self.out[: math.ceil(self.ran / self.every), :, i])
        return np.asarray(self.out[:, :, i])

    def ending(self, i: int) -> tuple[Ending, float]:
        """How lane i ended, and the time reached [s]."""
        if i in self.failed:
            return Ending.DIVERGED, self.failed[i]
        return Ending.DONE, self.ran * self.drive.t_cycle


def nothing(cls: type) -> Any:
    """A record of zeros."""
    return unflatten(cls, itertools.repeat(0.0))
