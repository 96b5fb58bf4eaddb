"""The live twin as the process of the servers has it: the kernel's process, what it gives, and what it is given."""

from __future__ import annotations

import math
import multiprocessing
import time
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from stillhook.base.arrays import FloatArray
from stillhook.base.signals import held_back
from stillhook.errors import LiveError, SimulationError
from stillhook.live.runtime.board import Board, Face
from stillhook.live.runtime.inputs import MOTION, InputWriter
from stillhook.live.runtime.kernel import Task, run_kernel
from stillhook.live.runtime.sink import Event, Sink, StateKeeper, event
from stillhook.live.runtime.state import write_state
from stillhook.sea.vessel.vessel_tip import VESSEL

START, STOP = 60.0, 20.0
"""Time for the kernel's process to be ready and to end [s]: the first start on a machine compiles kernels."""
RESTARTS, WITHIN = 5, 3600.0
"""How often a kernel's process that died is started again within a time [s]."""
LOOK = 0.01
"""Time between two looks while waiting [s]."""


class Row(NamedTuple):
    """One cycle: its number since the start of the twin, and its numbers by name [SI]."""

    number: int
    values: Mapping[str, float]


class LiveTwin:
    """A winch in real time in a process of its own. A context: it starts on entry, and ends on exit with its state
    saved.

    Parameters: task; sinks of rows and events, which `pump` feeds; keeper of states in addition to the task's file. A
    twin continues from the newer state of both; without the file it begins at the scenario.

    Errors: LiveError, one line, where crane, scenario or saved state are refused, or the process does not start.
    """

    def __init__(self, task: Task, sinks: Sequence[Sink] = (), keeper: StateKeeper | None = None) -> None:
        self.task, self.sinks, self._keeper = task, tuple(sinks), keeper
        self._board = Board()
        self._row = self._event = self._state = 0
        self.lost_rows = 0
        self._restarts: list[float] = []
        self._ending = self._unsaved = False
        self.events: list[Event] = []

    def __enter__(self) -> LiveTwin:
        try:
            state = self.task.state
            if (
                self._keeper is not None
                and state is not None
                and state.exists()
                and (kept := self._keeper.last_state())
            ):
                self._board.states.add(kept)
            self._start()
        except BaseException:
            self._end(at_once=True)
            raise
        self._inputs = InputWriter(self._board.inputs, self.face.inputs)
        return self

    def __exit__(self, *of: object) -> None:
        self.stop()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the numbers of a row: those of the runtime, then those of the winch."""
        return self.face.names

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names that `write` takes."""
        return self.face.inputs

    @property
    def pid(self) -> int:
        """Number of the kernel's process."""
        return self._process.pid or 0

    @property
    def memory(self) -> str:
        """Name of the shared memory with its rows."""
        return self._board.name

    @property
    def alive(self) -> bool:
        """Whether the kernel's process runs."""
        return self._process.is_alive()

    @property
    def ended(self) -> bool:
        """Whether the kernel's process came to its end as it was asked to."""
        return self._board.stopping and not self.alive

    def latest(self) -> Row | None:
        """The newest cycle; None before the first."""
        newest = self._board.rows.latest()
        if newest is None:
            return None
        number, row = newest
        return Row(number, dict(zip(self.names, row.tolist(), strict=False)))

    def write(self, values: Mapping[str, float], source: str, stamp: float = math.nan) -> None:
        """Hand inputs over to the next cycle, together [SI]. stamp: their own time, UTC [s], where they have one.

        Errors: LiveError for a name that is not an input, or a value that is not finite; nothing is written then.
        """
        for name, value in values.items():
            if name not in self.inputs:
                raise LiveError(f"{source}: {name} is not an input. Choose one of {', '.join(self.inputs)}.")
            if not math.isfinite(value):
                raise LiveError(f"{source}: {name} = {value}: give a finite number in SI units.")
        both = [next((name for name in values if name in of), "") for of in (MOTION, VESSEL)]
        if all(both):
            raise LiveError(f"{source}: {' and '.join(both)}: give the motion of the tip or that of the vessel.")
        self._inputs.write(values, time.monotonic(), stamp)

    def tell(self, happened: Event) -> None:
        """Pass an event of a server to the sinks."""
        self.events.append(happened)
        del self.events[:-200]
        for sink in self.sinks:
            sink.event(happened)

    def pump(self) -> None:
        """Pass new rows and events to the sinks, keep the file of the state fresh, and start a kernel again that died.
        To be called several times a second."""
        self._pass_on()
        dead = not self.alive and not self._board.stopping and not self._ending
        self._save()
        if dead:
            self._restart()

    def wait_for_end(self, duration: float = math.inf) -> None:
        """Pump until the kernel's process ends or the time is over [s]."""
        end = time.monotonic() + duration
        while time.monotonic() < end and not self.ended:
            self.pump()
            time.sleep(10 * LOOK)

    def stop(self) -> None:
        """Stop the kernel after its cycle, with its state saved, and release everything."""
        if self._ending:
            return
        self._board.stop()
        self._process.join(STOP)
        self._pass_on()
        self._save()
        self._end()
        for sink in self.sinks:
            sink.close()

    # What is behind it

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        ready = self._board.faces.count
        self._process = context.Process(target=run_kernel, args=(self.task, self._board.name), daemon=True)
        with held_back():
            self._process.start()
        end = time.monotonic() + START
        while self._board.faces.count == ready:
            if not self._process.is_alive() or time.monotonic() > end:
                raise LiveError(self._reason())
            time.sleep(LOOK)
        face = self._board.face()
        if face is None:
            raise LiveError("Live twin: the kernel's process is not ready. Start it again.")
        self.face: Face = face

    def _reason(self) -> str:
        """Why the kernel's process did not start."""
        _, records, _ = self._board.events.records(self._event)
        refused = [e.text for e in map(Event.from_json, records) if e.name == "refused"]
        return (
            refused[-1]
            if refused
            else (
                f"Live twin: the kernel's process ended with {self._process.exitcode} before it was ready. Its message"
                " is on standard error."
            )
        )

    def _save(self) -> None:
        """Write the newest state that the kernel handed over, then give it to the keeper: what that one has, the file
        has. Also after its end: what is written here last must not be older than what the kernel itself wrote then. A
        disk that does not take it holds the twin up no more than by an event."""
        newest = self._board.states.newest()
        if newest is None or newest[0] < self._state or self.task.state is None:
            return
        self._state = newest[0] + 1
        try:
            write_state(self.task.state, newest[1])
            self._unsaved = False
        except SimulationError as problem:
            if not self._unsaved:
                self.tell(event("twin", "state-not-saved", f"{problem} The twin continues."))
            self._unsaved = True
        if self._keeper is not None:
            self._keeper.save_state(newest[1])

    def _restart(self) -> None:
        code, now = self._process.exitcode, time.monotonic()
        self._restarts = [at for at in self._restarts if now - at < WITHIN]
        if len(self._restarts) >= RESTARTS:
            raise LiveError(
                f"Live twin: the kernel's process ended {RESTARTS + 1} times within {WITHIN:g} s, last with {code}."
            )
        self._restarts.append(now)
        self.tell(
            event("twin", "kernel-died", f"The kernel's process ended with {code} and is started again.", code or 0)
        )
        self._start()

    def _pass_on(self) -> None:
        first, records, lost = self._board.events.records(self._event)
        self._event = first + len(records)
        if lost:
            self.tell(event("twin", "lost-events", f"{lost} events of the kernel were lost.", lost))
        for record in records:
            self.tell(Event.from_json(record))
        first, rows, lost = self._board.rows.since(self._row)
        self._row = first + len(rows)
        self.lost_rows += lost
        if lost and self.sinks:
            self.tell(event("twin", "lost-rows", f"{lost} rows were lost: the sinks are too slow.", lost))
        if rows:
            width = len(self.names)
            cut: list[FloatArray] = [row[:width] for row in rows]
            for sink in self.sinks:
                sink.rows(first, self.names, cut)

    def _end(self, at_once: bool = False) -> None:
        """Release everything. at_once: the kernel is not ready, and has nothing to save."""
        self._ending = True
        process = getattr(self, "_process", None)
        if process is not None and process.pid is not None and process.is_alive():
            if at_once:
                process.kill()
            process.terminate()
            process.join(STOP)
            if process.is_alive():
                process.kill()
        self._board.close()
