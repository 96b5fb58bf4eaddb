"""Blocks of cases side by side, each from the first cycle to the last, and what comes back of each: a run."""

from __future__ import annotations

import functools
import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Generic, NamedTuple, Protocol, Self, TypeVar

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.control.plc import Memory
from stillhook.engine.inputs import COLUMNS, CycleInputs, filled, hermite_weights, scale_weights
from stillhook.engine.pack.winch import Packed
from stillhook.engine.store import Summary
from stillhook.errors import StillhookError
from stillhook.kernels.build import Setup, driver
from stillhook.kernels.drivers.loop import MOST
from stillhook.kernels.lanes import access, aligned, offset, paths, size, unflatten
from stillhook.kernels.statistics import blank_window
from stillhook.physics.records import fields
from stillhook.spec.crane import Crane
from stillhook.variables import WINDOW
from stillhook.winches.records import Tick

OK = "ok"
"""Status of a run that stayed inside every limit."""


class Ending(StrEnum):
    """How a run ended; refused: it never began."""

    DONE = "done"
    DIVERGED = "diverged"
    REFUSED = "refused"


FAILED = frozenset({Ending.DIVERGED.value, Ending.REFUSED.value})
"""Status of a case without numbers."""


class Loss(NamedTuple):
    """Where a run lost its numbers: time [s], and state or input that was not a number or beyond what a winch can
    reach, in words."""

    t: float
    cause: str


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
    [s], None where none was stored; step [s]; loss: what was no number at t_end, in words, "" of a sound run."""

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
    loss: str = ""

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
        """Whether it has no numbers: it lost them, or never began."""
        return self.ending is not Ending.DONE

    @property
    def loss_note(self) -> str:
        """When it lost its numbers, and which, in a sentence."""
        return f"lost its numbers at {self.t_end:.2f} s: {self.loss}"

    def column(self, name: str) -> FloatArray:
        """The time series of a signal. Errors: KeyError for one that this winch type has not."""
        if self.series is None or name not in self.signals:
            raise KeyError(name)
        return np.asarray(self.series[:, self.signals.index(name)])


@dataclass(frozen=True, eq=False, kw_only=True)
class Refused(Run):
    """A case that never began. names: of the numbers that its summary would have; loss: why it was refused."""

    names: tuple[str, ...]

    @classmethod
    def of(cls, crane: Crane, case: Any, names: tuple[str, ...], problem: StillhookError) -> Self:
        """A case without a state, a series or numbers."""
        ending: dict[str, Any] = {"ending": Ending.REFUSED, "t_end": 0.0, "state": None, "memory": None}
        rows: dict[str, Any] = {"series": np.empty((0, 0)), "signals": (), "dt": 0.0, "step": math.nan}
        return cls(crane=crane, case=case, names=names, loss=str(problem), **ending, **rows)

    @functools.cached_property
    def summary(self) -> dict[str, Any]:
        """Status, NaN for every number, and why it was refused."""
        return {"status": Ending.REFUSED.value, **dict.fromkeys(self.names, math.nan), "notes": [self.loss_note]}

    @property
    def loss_note(self) -> str:
        """Why it was refused, in a sentence."""
        return f"refused: {self.loss}"

    @property
    def row(self) -> Summary:
        """What a batch keeps of it."""
        return Summary(self.names, Ending.REFUSED, [math.nan] * len(self.names), [self.loss_note])


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
    inputs = COLUMNS  # inputs by name, with their columns in a row of the drive

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
        self.out, self.lost = np.empty((rows, len(self.d.columns), lanes)), np.full(1, -1.0)
        self.failed: dict[int, Loss] = {}
        self.ended: dict[int, Run] = {}
        self.ran = 0
        self.A = aligned(np.array(self.records()).T)
        self.d.at_rest(self.A.reshape(-1))

    @staticmethod
    def setup(r: Any) -> Setup:
        """What the kernel of a case runs besides a winch."""
        setup: Setup = r.winch.setup
        return setup

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
            "loss": self.failed[i].cause if i in self.failed else "",
        }

    def sound(self) -> BoolArray:
        """Lanes whose states are numbers that a winch can reach, (lanes,)."""
        return np.asarray((np.abs(self.A[: self.n_x]) <= MOST).all(axis=0))

    def reset(self, i: int) -> None:
        """Set a lane to rest again."""
        fresh = np.repeat(np.array(self.record(self.lanes[i]))[:, None], len(self.lanes), axis=1)
        self.d.at_rest(fresh.reshape(-1))
        self.A[:, i] = fresh[:, i]

    def steps(self) -> Iterator[float]:
        """Run to the end in pieces; yields the share done. What came out of a case is taken where it is over, or where
        it lost its numbers, wherever the others are."""
        for k, count in self.drive.pieces(self.short_from):
            self._advance(filled([r.drive for r in self.lanes], k, count + 1), k, k + count)
            for lane in set(self.over()) - self.ended.keys():
                self.ended[lane] = self.result(lane)
            if len(self.ended) == len(self.ready):
                break
            yield self.ran / self.drive.n_ticks

    def _advance(self, D: FloatArray, k: int, end: int) -> None:
        """Run cycles k .. end; D rows of the drive. The kernel stops where a lane loses its numbers, and goes on with
        the others from there."""
        at = self.ran = k
        self._take_lost(D, 0)
        while at < end or self.lost[0] == self.drive.n_ticks:  # the last cycle is still to be observed
            if len(self.ended) == len(self.ready):
                break
            self.piece(D[at - k :], at, end - at)
            at = self.ran = end if self.lost[0] < 0.0 else int(self.lost[0])
            self._take_lost(D, at - k)

    def _take_lost(self, D: FloatArray, count: int) -> None:
        """Mark cases that lost their numbers in the last `count` cycles of D; their lanes repeat a sound one from here
        on."""
        sound = self.sound() & (np.abs(D[count]) <= MOST).all(axis=0)
        if sound.all():
            return
        unsound = np.flatnonzero(~sound)
        for i in unsound.tolist():
            if i < len(self.ready) and i not in self.ended:
                self.failed[i] = Loss(self.ran * self.drive.t_cycle, self.cause(D[: count + 1, :, i], i))
                self.reset(i)
                self.ended[i] = self.result(i)
        if sound.any():
            other = int(np.argmax(sound))
            for each in (D, *self.side_by_side()):
                each[..., unsound] = each[..., [other]]
            for i in unsound.tolist():
                self.lanes[i] = self.lanes[other]

    def side_by_side(self) -> tuple[FloatArray, ...]:
        """All that lanes carry from cycle to cycle, the lane last."""
        return self.A, self.W.reshape(-1, len(self.lanes))

    def cause(self, rows: FloatArray, i: int) -> str:
        """What is no number in lane i, or beyond what a winch can reach, in words: what drives it, rows (cycles, cols),
        else the state that is farthest beyond."""
        if len(late := np.argwhere(~(np.abs(rows) <= MOST))):
            cycle, column = late[0]
            name = next((name for name, at in self.inputs.items() if column in at), Tick._fields[column])
            return f"its input {name} is {rows[cycle, column]:.3g}"
        names, values = paths(self.d.State), np.abs(self.A[: self.n_x, i])
        worst = int(np.argmax(np.where(np.isnan(values), -1.0, values)))
        if not values[worst] > MOST:
            worst = int(np.argmax(np.isnan(values)))
        return f"state {names[worst].rpartition('.')[2]} is {self.A[worst, i]:.3g}"

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
        """Series of lane i, as far as it was run; without numbers from where it failed."""
        if not self.every:
            return None
        if i in self.failed:
            series = self.out[:, :, i].copy()
            series[math.ceil(self.failed[i].t / (self.every * self.drive.t_cycle) - 1e-9) :] = np.nan
            return np.asarray(series)
        if self.ran < self.drive.n_ticks:  # its programme ended the run
            return np.asarray(self.out[: math.ceil(self.ran / self.every), :, i])
        return np.asarray(self.out[:, :, i])

    def ending(self, i: int) -> tuple[Ending, float]:
        """How lane i ended, and the time reached [s]."""
        if i in self.failed:
            return Ending.DIVERGED, self.failed[i].t
        return Ending.DONE, self.ran * self.drive.t_cycle


@functools.cache
def nothing(cls: type) -> Any:
    """A record of zeros."""
    return unflatten(cls, itertools.repeat(0.0))
