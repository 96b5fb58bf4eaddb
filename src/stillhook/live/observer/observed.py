"""The live twin with its observer: what servers show and take, and who starts whom again."""

from __future__ import annotations

import json
import math
import multiprocessing
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import atomic_file
from stillhook.base.gateway.parse import json_file
from stillhook.base.signals import held_back
from stillhook.errors import LiveError, SimulationError, StillhookError
from stillhook.live.estimate.bounds import PLAUSIBLE
from stillhook.live.observer.adaptation import CERTIFIED, Adaptation, Change, not_allowed
from stillhook.live.observer.observer import FACTOR, Task, shown_names
from stillhook.live.observer.panel import Panel, Proposal
from stillhook.live.observer.process import message_names, padded, run_observer
from stillhook.live.observer.received import Received
from stillhook.live.observer.settings import ObserverSettings
from stillhook.live.observer.signals import OF_INPUTS, implausible
from stillhook.live.runtime import Event, LiveTwin, Row, Sink, event
from stillhook.live.runtime import Task as TwinTask
from stillhook.live.runtime.sink import StateKeeper
from stillhook.live.servers.served import AGE, MEASURED, about

FILE = "adapted.json"
"""The factor that the twin was adapted to, beside the twin's state."""
HUNG = 60.0
"""Time without a word after which the observer's process is taken to hang [s]: on a busy machine it takes half of that
to start."""
FIRST_WAIT, LONGEST_WAIT, GOOD_LIFE = 1.0, 60.0, 120.0
"""Wait before a process that died is started again [s]: doubled each time, and from new after a good life."""
STOP = 5.0
RATE, BURST = 200.0, 400.0
"""Messages that are taken: a second, and at once."""
QUIET = 1.0
"""Least time between two events on what was left out [s]."""
AGAIN = 2.0
"""Time after which a factor that the kernel does not have is handed over again [s]."""


def factor_in(path: Path | None) -> float:
    """The factor of a file; the certified one where there is none, or it is damaged."""
    try:
        value = float(json_file(path, "a factor", "", LiveError)["value"]) if path is not None else CERTIFIED
    except (StillhookError, ValueError, KeyError, TypeError):
        return CERTIFIED
    return value if PLAUSIBLE[0] <= value <= PLAUSIBLE[1] else CERTIFIED


def names_of(settings: ObserverSettings) -> tuple[str, ...]:
    """Names of what a row of the twin is extended by."""
    signals = settings.signals
    return (*(f"{of}.{name}" for of in (MEASURED, AGE) for name in signals), *shown_names(settings))


def columns(settings: ObserverSettings) -> dict[str, tuple[str, str]]:
    """Unit and meaning of the same by their names in a history, which have no points."""
    return {name.replace(".", "_"): about(name) for name in names_of(settings)}


class ObservedTwin:
    """A `LiveTwin` that takes measured values, and its observer. A context, and what servers serve.

    Parameters: task of the twin; sinks, which get the comparison beside the twin's rows; settings; folder for the
    adapted factor, None to keep none; keeper of states, as of a `LiveTwin`.

    Errors: LiveError as of a `LiveTwin`.
    """

    def __init__(
        self,
        task: TwinTask,
        sinks: Sequence[Sink],
        settings: ObserverSettings,
        folder: Path | None = None,
        keeper: StateKeeper | None = None,
    ) -> None:
        self.settings = settings
        self.twin = LiveTwin(task, [_ObservedSink(sinks, self)] if sinks else [], keeper)
        self._file = None if folder is None else folder / FILE
        self._crane = task.crane
        self._shown = dict.fromkeys(shown_names(settings), math.nan)
        self._received = Received(settings.signals, settings.timeout)
        self._tokens, self._filled = BURST, time.monotonic()
        self._left_out: dict[str, int] = {}
        self._reported = -math.inf
        self._wait, self._start_at = FIRST_WAIT, 0.0
        self._values = self._events = 0
        self._proposal: Proposal | None = None
        self._adaptation: Adaptation | None = None
        self._written = -math.inf
        self.restarts = 0

    def __enter__(self) -> ObservedTwin:
        self.twin.__enter__()
        self._panel = Panel()
        try:
            self._task = Task(self._crane, self.twin.names, self.settings, self.twin.task.speed)
            self._begin_factor()
            self._start()
        except BaseException:
            self.twin.stop()
            self._panel.close()
            raise
        return self

    def __exit__(self, *of: object) -> None:
        self._panel.stop()
        self._process.join(STOP)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        self._listen()
        self.twin.stop()
        self._panel.close()

    # What servers need

    @property
    def names(self) -> tuple[str, ...]:
        """The twin's, measured values with their ages, and what the observer says."""
        return (*self.twin.names, *names_of(self.settings))

    @property
    def inputs(self) -> tuple[str, ...]:
        """Those of the twin, without the factor where that follows the crane; and what is measured."""
        own = [name for name in self.twin.inputs if name != FACTOR or self.settings.adapt is None]
        return (*own, *(f"{MEASURED}.{name}" for name in self.settings.signals))

    @property
    def alive(self) -> bool:
        """Whether the kernel's process runs."""
        return self.twin.alive

    @property
    def observer(self) -> int:
        """Number of the observer's process."""
        return self._process.pid or 0

    def latest(self) -> Row | None:
        """The newest cycle, with what is measured and compared with it."""
        row = self.twin.latest()
        return None if row is None else Row(row.number, {**row.values, **self.observations()})

    def observations(self) -> dict[str, float]:
        """Measured values (NaN once they are stale) with their ages, and the numbers of the observer."""
        numbers = [*self._received.newest(time.monotonic()).tolist(), *self._shown.values()]
        return dict(zip(names_of(self.settings), numbers, strict=True))

    def passed(self, utc: float) -> FloatArray:
        """The same for a row of the twin that is passed on, as known at its time [s]."""
        return np.concatenate([self._received.passed(utc), list(self._shown.values())])

    def write(self, values: Mapping[str, float], source: str, stamp: float = math.nan) -> None:
        """Inputs to the twin, all or none of them; measured values to the observer, each by itself: what no sensor
        shows is left out, with an event. stamp: of both, UTC [s]. Errors: LiveError."""
        measured = {n.partition(".")[2]: x for n, x in values.items() if n.startswith(f"{MEASURED}.")}
        inputs = {n: x for n, x in values.items() if not n.startswith(f"{MEASURED}.")}
        if self.settings.adapt is not None and FACTOR in inputs:
            raise LiveError(f"{source}: {FACTOR} follows the crane. Leave the table [adapt] out to set it.")
        if inputs:
            self.twin.write(inputs, source, stamp)
        taken = {name: inputs[name] for name in OF_INPUTS if name in inputs}
        for name, value in measured.items():
            if name not in self.settings.signals:
                self._leave_out(f"{source}: {name} is not among the signals of [measured]")
            elif reason := implausible(name, value):
                self._leave_out(f"{source}: {reason}")
            else:
                taken[name] = value
        if taken and self._may():
            now = time.time()
            self._received.take(now, time.monotonic(), taken)
            row = [now, stamp, *(taken.get(name, math.nan) for name in message_names(self._task))]
            self._panel.messages.publish(padded(row, self._panel.messages.width))

    def tell(self, happened: Event) -> None:
        """Pass an event on."""
        self.twin.tell(happened)

    def pump(self) -> None:
        """Rows and events of the twin and of the observer, its factor, and its process again where that ended."""
        self._listen()
        self._adapt()
        self.twin.pump()
        self._report()
        self._watch_process()

    # The observer's process

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        args = (self._task, self.twin.memory, self._panel.name)
        self._process = context.Process(target=run_observer, args=args, daemon=True)
        with held_back():
            self._process.start()
        self._heard = self._began = time.monotonic()

    def _watch_process(self) -> None:
        now = time.monotonic()
        if self._process.is_alive() and now - self._heard > HUNG:
            self._process.kill()
            self._process.join(STOP)
        if self._process.is_alive():
            return
        if not self._start_at:
            self._wait = FIRST_WAIT if now - self._began > GOOD_LIFE else min(2.0 * self._wait, LONGEST_WAIT)
            self._start_at = now + self._wait
            self._shown, self._proposal = dict.fromkeys(self._shown, math.nan), None
            if self._adaptation is not None:
                self._adaptation.begin_again(time.monotonic())
            code = self._process.exitcode
            text = f"The observer's process ended with {code} and is started again in {self._wait:g} s."
            self.tell(event("twin", "observer-died", text, code or 0))
        elif now >= self._start_at:
            self._start_at, self.restarts = 0.0, self.restarts + 1
            self._start()

    def _listen(self) -> None:
        first, records, lost = self._panel.events.records(self._events)
        self._events = first + len(records)
        for record in records:
            self.tell(Event.from_json(record))
        if lost:
            self.tell(event("twin", "lost-events", f"{lost} events of the observer were lost.", lost))
        newest, proposal = self._panel.values.latest(), self._panel.proposals.newest()
        if newest is not None and newest[0] >= self._values:
            self._values, self._heard = newest[0] + 1, time.monotonic()
            self._shown = dict(zip(self._shown, newest[1].tolist(), strict=False))
            self._proposal = None if proposal is None else Proposal.from_json(proposal[1])

    # The factor

    def _begin_factor(self) -> None:
        """The factor from before the start, where it may still be applied; else the certified one."""
        before, against = factor_in(self._file), not_allowed(self._crane)
        adapt = self.settings.adapt
        reason = "[adapt] is left out" if adapt is None else against
        if before != CERTIFIED and reason:
            self._apply(Change(before, CERTIFIED, math.nan, math.nan, f"withdrawn at the start, {reason}"))
        if adapt is not None and not reason:
            self._adaptation = Adaptation(adapt, before, time.monotonic())
        level = f"level 1: {against}" if against else f"level {2 if adapt is None else 3}"
        self.tell(event("twin", "observed", f"Compared with measured {', '.join(self.settings.signals)} ({level})."))

    def _adapt(self) -> None:
        if self._adaptation is None:
            return
        now = time.monotonic()
        if (change := self._adaptation.next(self._proposal, now)) is not None:
            self._apply(change)
            return
        row = self.twin.latest()
        late = time.monotonic() - self._written > AGAIN
        if row is not None and late and row.values[FACTOR] != self._adaptation.value:
            self._hand_over(self._adaptation.value)  # a kernel that was started again, from a state before the change

    def _apply(self, change: Change) -> None:
        if self._file is not None:
            data = {"value": change.new, "low": change.low, "high": change.high, "time": time.time()}
            try:
                with atomic_file(self._file) as part:
                    part.write_text(json.dumps(data), encoding="utf-8")
            except SimulationError as problem:
                self.tell(event("twin", "factor-not-saved", f"{problem} The twin continues."))
        self._hand_over(change.new)
        self.tell(event("twin", "adapted", change.text, change.new))

    def _hand_over(self, value: float) -> None:
        self.twin.write({FACTOR: value}, "twin", time.time())
        self._written = time.monotonic()

    # What is left out

    def _may(self) -> bool:
        """Whether one more message is taken now."""
        now = time.monotonic()
        self._tokens = min(BURST, self._tokens + RATE * (now - self._filled))
        self._filled = now
        if self._tokens < 1.0:
            self._leave_out(f"more than {RATE:g} messages a second")
            return False
        self._tokens -= 1.0
        return True

    def _leave_out(self, reason: str) -> None:
        if reason in self._left_out or len(self._left_out) < 8:
            self._left_out[reason] = self._left_out.get(reason, 0) + 1

    def _report(self) -> None:
        if self._left_out and time.monotonic() - self._reported >= QUIET:
            count = sum(self._left_out.values())
            text = f"{count} measured values left out: {'; '.join(self._left_out)}."
            self.tell(event("twin", "refused-measured", text, count))
            self._left_out, self._reported = {}, time.monotonic()


class _ObservedSink:
    """Sinks that get what is measured and compared with each row; a history has no points in its names."""

    def __init__(self, sinks: Sequence[Sink], of: ObservedTwin) -> None:
        self._sinks, self._of = sinks, of

    def rows(self, first: int, names: Sequence[str], rows: Sequence[FloatArray]) -> None:
        """Pass them on, longer."""
        at = list(names).index("time_utc")
        wider = [np.concatenate([row, self._of.passed(float(row[at]))]) for row in rows]
        for sink in self._sinks:
            sink.rows(first, (*names, *columns(self._of.settings)), wider)

    def event(self, happened: Event) -> None:
        """Pass it on."""
        for sink in self._sinks:
            sink.event(happened)

    def close(self) -> None:
        """Nothing more comes."""
        for sink in self._sinks:
            sink.close()
