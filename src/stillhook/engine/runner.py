"""Blocks of cases side by side, each from the first cycle to the last, and what comes back of each: a run."""

from __future__ import annotations

import functools
import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.control.plc import Memory
from stillhook.engine.inputs import CycleInputs, filled, hermite_weights, scale_weights
from stillhook.engine.pack.winch import Packed
from stillhook.engine.store import Summary
from stillhook.errors import StillhookError
from stillhook.kernels.build import Setup, driver
from stillhook.kernels.lanes import access, aligned, offset, size, unflatten
from stillhook.kernels.statistics import blank_window
from stillhook.physics.records import fields
from stillhook.spec.crane import Crane
from stillhook.variables import WINDOW

OK = "ok"
"""Status of a run that stayed inside every limit."""


class Ending(StrEnum):
    """How a run ended."""

    DONE = "done"
    DIVERGED = "diverged"


class Ready(Protocol):
    """A case that was checked and packed: records of the winch, and what drives it from outside."""

    @property
    def crane(self) -> Crane: ...

    @property
    def case(self) -> Any: ...

    @property
    def winch(self) -> Packed: ...

    @property
    def drive(self) -> CycleInputs: ...


@dataclass(frozen=True, eq=False, kw_only=True)
class Run(ABC):
    """What came back of a case. t_end time reached [s]; state, memory at the end; series: one row of `signals` every dt
    [s], None where none was stored; step [s]."""

    crane: Crane
    case: Any
    ending: Ending
    t_end: float
    state: Any
    memory: Memory
    series: FloatArray | None
    signals: tuple[str, ...]
    dt: float
    step: float

    @functools.cached_property
    @abstractmethod
    def summary(self) -> dict[str, Any]:
        """Status, numbers [SI] and notes; every number NaN where it diverged."""

    @property
    @abstractmethod
    def row(self) -> Summary:
        """What a batch keeps of it."""

    @property
    def ok(self) -> bool:
        """Whether it stayed inside every limit."""
        return bool(self.summary["status"] == OK)

    @property
    def diverged(self) -> bool:
        """Whether it lost its numbers."""
        return self.ending is Ending.DIVERGED

    def column(self, name: str) -> FloatArray:
        """The time series of a signal. Errors: KeyError for one that this winch type has not."""
        if self.series is None or name not in self.signals:
            raise KeyError(name)
        return np.asarray(self.series[:, self.signals.index(name)])


T = TypeVar("T")
R = TypeVar("R", bound=Ready)


def each_case(
    cranes: Sequence[Crane], cases: Sequence[Any], make: Callable[[Crane, Any], T], places: Sequence[int] | None = None
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


@functools.cache
def record_of(cls: type) -> Callable[[Sequence[float], int], Any]:
    """Makes a record of the numbers that begin at a place of a list."""
    return access(cls, 1).load


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
        self.ended: dict[int, Run] = {}
        self.ran = 0
        self.A = aligned(np.array(self.records()).T)
        self.d.at_rest(self.A.reshape(-1))

    @staticmethod
    def setup(r: Any) -> Setup:
        """What the kernel of a case runs besides a winch."""
        return guarded(r.crane, Setup(sensors=r.winch.sensors))

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
    def result(self, i: int) -> Run:
        """The run of one lane."""

    def common(self, i: int) -> dict[str, Any]:
        """What the run of lane i has of any model."""
        ending, t_end = self.ending(i)
        return {
            "crane": self.ready[i].crane,
            "case": self.ready[i].case,
            "ending": ending,
            "t_end": t_end,
            "state": self.part("x", i),
            "memory": self.part("m", i),
            "series": self.series(i),
            "signals": self.d.columns,
            "dt": self.every * self.drive.t_cycle,
            "step": self.drive.t_cycle / self.n_sub,
        }

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

    def results(self) -> list[Run]:
        """The run of every case."""
        return [self.ended[i] if i in self.ended else self.result(i) for i in range(len(self.ready))]

    def part(self, name: str, i: int) -> Any:
        """One record of lane i."""
        at, cls = offset(self.d.Lane, name, 1), dict(fields(self.d.Lane))[name]
        return record_of(cls)(self.A[at : at + size(cls), i].tolist(), 0)

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


def guarded(crane: Crane, setup: Setup) -> Setup:
    """What a kernel runs besides a winch, with guard and checks where the crane file has them."""
    return setup if crane.control.guard is None else setup._replace(guarded=True, checks=True)


@functools.cache
def nothing(cls: type) -> Any:
    """A record of zeros."""
    return unflatten(cls, itertools.repeat(0.0))
