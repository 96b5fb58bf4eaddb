"""Progress of long work: its share done, from 0 to 1, over all its parts; as events for a listener, with a
token that stops it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from typing import NamedTuple, Protocol

from stillhook.errors import Cancelled

Progress = Callable[[float], None]
"""Is called with the share of the work that is done, 0 to 1, never falling. A `Monitor` is one as well."""


KEPT = 0.1
"""Part of its expected time below which a part of the work is taken not to have been done, its results being kept from
before: no machine is so much faster."""


class Parts:
    """Progress of work in parts, one after another, of which each is expected to take so many seconds; never goes back.

    Only ratios of the times matter: a slower machine is slower in all parts. A part that takes next to no time leaves
    its share to the parts that follow. progress None: no listener.
    """

    def __init__(
        self, progress: Progress | None, expected: Mapping[str, float], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.progress, self.ahead, self.clock = progress, dict(expected), clock
        self.done, self.share = 0.0, -1.0
        self.size, self.begin = 0.0, clock()

    def __call__(self, name: str) -> Progress:
        """Progress of the part of this name, which has begun now."""
        self.done += self.size if self.clock() - self.begin > KEPT * self.size else 0.0
        total = self.done + sum(self.ahead.values())
        self.size, self.begin = self.ahead.pop(name), self.clock()
        low, high = self.done / total, (self.done + self.size) / total
        begin(self.progress, name)
        self.at(low)
        return Relay(lambda share: self.at(low + (high - low) * min(max(share, 0.0), 1.0)), self.progress, stage=name)

    def at(self, share: float) -> None:
        """All parts together are done up to this share."""
        if share > self.share:
            self.share = share
            if self.progress is not None:
                self.progress(share)


class TimeLeft:
    """Time that work still takes, from the shares that it has reported, which are in proportion to computing time.

    The speed is the mean since the first report: what was done before it, such as results that were kept from an
    earlier run, says nothing about it. Between reports the time counts down. clock gives seconds.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.clock = clock
        self.first: tuple[float, float] | None = None
        self.last = (0.0, 0.0)

    def report(self, share: float) -> None:
        """The share that is done now, never falling."""
        if self.first is None:
            self.first = self.last = (self.clock(), share)
        elif share > self.last[1]:
            self.last = (self.clock(), share)

    @property
    def seconds(self) -> float | None:
        """Time left [s]; None until more is done than at the first report."""
        if self.first is None or self.last == self.first:
            return None
        (t_0, share_0), (t_1, share_1) = self.first, self.last
        left = (1.0 - share_1) * (t_1 - t_0) / (share_1 - share_0)
        return max(left - (self.clock() - t_1), 0.0)

    def __str__(self) -> str:
        if self.seconds is None:
            return "-:--:--"
        minutes, seconds = divmod(round(self.seconds), 60)
        return f"{minutes // 60}:{minutes % 60:02d}:{seconds:02d}"


RUNS = "runs"
"""Stage of work that has no other."""


class Event(NamedTuple):
    """What long work reports of itself.

    A stage whose parts are not counted has 0 of 0; total may be an estimate that changes. Neither done within a stage
    nor share ever falls.
    """

    stage: str  # what is being done, such as "runs", "map", "time domain"
    cell: str  # part of it that was finished last, such as the name of a case; empty where none has a name
    done: int  # parts of the stage that are finished, such as cases
    total: int  # parts of the stage
    remaining: float | None  # time that all work still takes [s]; None until that is known
    share: float  # part of all work that is done, 0 to 1


class Cancel(Protocol):
    """What can stop long work: a `CancelToken`, or a threading.Event."""

    def is_set(self) -> bool: ...


class CancelToken:
    """Stops long work that was given it, from any thread: see `Monitor`.

    Examples
    --------
    >>> import stillhook
    >>> token = stillhook.CancelToken()
    >>> token.cancel()
    >>> token.is_set()
    True
    """

    def __init__(self) -> None:
        self._set = threading.Event()

    def cancel(self) -> None:
        """Stop the work at its next report of progress."""
        self._set.set()

    def is_set(self) -> bool:
        """Whether the work is to stop."""
        return self._set.is_set()


class Monitor:
    """Follows long work: give it as `progress` to `simulate`, a map, a plan or a response.

    Parameters
    ----------
    listener : callable, optional
        Called with each event: (stage, cell, done, total, remaining [s], share), from the thread that works.
    cancel : CancelToken or threading.Event, optional
        Stops the work once it is set: it ends in `stillhook.Cancelled`, whose `partial` holds what was finished.

    Examples
    --------
    >>> import stillhook
    >>> crane = stillhook.load_crane("nov-250t")
    >>> case = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 12 s", duration="40 s", warm_up="20 s")
    >>> events = []
    >>> run = stillhook.simulate(crane, [case, case], progress=stillhook.Monitor(events.append))
    >>> events[-1].stage, events[-1].done, events[-1].total, events[-1].share
    ('runs', 2, 2, 1.0)
    """

    def __init__(self, listener: Callable[[Event], object] | None = None, *, cancel: Cancel | None = None) -> None:
        self.listener, self.cancel, self.left = listener, cancel, TimeLeft()
        self.stage, self.cell, self.done, self.total, self.share = RUNS, "", 0, 0, 0.0
        self.lock = threading.RLock()

    def __call__(self, share: float) -> None:
        """The share of all work that is done now [1]. Errors: Cancelled once the token is set."""
        with self.lock:
            self.share = max(self.share, min(share, 1.0))
            self.left.report(self.share)
            self._tell()

    def begin(self, stage: str) -> None:
        """A stage of the work begins."""
        with self.lock:
            if stage != self.stage:
                self.stage, self.cell, self.done, self.total = stage, "", 0, 0
                self._tell()

    def count(self, cell: str, done: int, total: int) -> None:
        """So many parts of the stage are finished, this one last."""
        with self.lock:
            self.cell = cell
            self.done, self.total = max(self.done, done), max(self.done, done, total)
            self._tell()

    def _tell(self) -> None:
        if self.cancel is not None and self.cancel.is_set():
            raise Cancelled
        if self.listener is not None:
            self.listener(Event(self.stage, self.cell, self.done, self.total, self.left.seconds, self.share))


class Relay:
    """Progress of a part of the work, which passes what it counts to the `Monitor` of all work; before, total: parts
    that were finished before it, and all of the stage, where they are known; stage: whose stages are named after
    it."""

    def __init__(
        self, report: Progress, monitor: Progress | None, before: int = 0, total: int = 0, *, stage: str = ""
    ) -> None:
        self.report, self.before, self.total, self.stage = report, before, total, stage
        self.monitor: Monitor | Relay | None = monitor if isinstance(monitor, Monitor | Relay) else None

    def __call__(self, share: float) -> None:
        self.report(share)

    def begin(self, stage: str) -> None:
        """A stage begins."""
        if self.monitor is not None:
            self.monitor.begin(f"{self.stage}: {stage}" if self.stage else stage)

    def count(self, cell: str, done: int, total: int) -> None:
        """So many parts are finished, this one last."""
        if self.monitor is not None:
            self.monitor.count(cell, self.before + done, max(self.total, self.before + total))


def begin(progress: Progress | None, stage: str) -> None:
    """A stage of the work begins, for a `Monitor`."""
    if isinstance(progress, Monitor | Relay):
        progress.begin(stage)


class Meter:
    """Adds up the work done by all parts and reports it to the caller; also carries the stop flag to the worker
    threads.

    total and done in any weight, such as simulated seconds; of, finished: number of parts, and of those that were there
    before.
    """

    def __init__(
        self, total: float, progress: Progress | None, done: float = 0.0, of: int = 0, finished: int = 0
    ) -> None:
        self.total, self.progress, self.done, self.stopped = total, progress, done, False
        self.of, self.finished = of, finished
        self.lock = threading.Lock()

    def finish(self, cell: str, number: int = 1) -> None:
        """So many more parts are finished, this one last."""
        with self.lock:
            self.finished += number
            if isinstance(self.progress, Monitor | Relay):
                self.progress.count(cell, self.finished, self.of)

    def tell(self) -> None:
        if self.progress is not None:
            self.progress(min(self.done / self.total, 1.0))

    def part(self, weight: float) -> Progress:
        """Progress of a part of this weight, called with its share done. Raises Cancelled once the meter is
        stopped."""
        before = 0.0

        def reached(share: float) -> None:
            nonlocal before
            if self.stopped:
                raise Cancelled
            if share == before:
                return
            with self.lock:
                self.done += (share - before) * weight
                before = share
                self.tell()

        return reached
