"""The process of the kernel: a winch that is stepped at absolute deadlines, whoever watches.

A cycle that begins late is counted with its size, and the next deadline stays where it is. After a stall the cycles
that are due are calculated one after another, each with its own number and marked, so that the twin's time is that of
the wall again. A stall beyond `CATCH_UP` is not made up for: its cycles are counted as missed, their numbers are left
out, and the winch's own time stays behind by as much.
"""

from __future__ import annotations

import gc
import math
import multiprocessing
import os
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

import numpy as np

from stillhook.base.signals import let_through
from stillhook.control.registry import CONTROLLERS, code_of
from stillhook.engine.session import Session
from stillhook.errors import LiveError, SimulationError
from stillhook.live.runtime import memory
from stillhook.live.runtime.board import MOST_INPUTS, MOST_NAMES, SENSED, STATUS, Board, Face, Flag
from stillhook.live.runtime.causes import Cause, Stolen, Watch
from stillhook.live.runtime.deadlines import (
    Deadlines,
    ask_for_real_time,
    leave_real_time,
    ordinary,
    two_shares,
    yield_processor,
)
from stillhook.live.runtime.inputs import JETS, MODE, TIMEOUT, Inputs, ordered
from stillhook.live.runtime.sink import event
from stillhook.live.runtime.state import LiveState, lock_state, newest_state, write_state
from stillhook.sea.vessel.vessel_tip import LARGEST_ANGLE
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario

LATE = 2.0e-3
"""Lateness from which a cycle is counted as late [s]."""
CATCH_UP = 10.0
"""Longest stall that is made up for [s]."""
SAVE_EVERY = 1.0
"""Time between two states that are handed over for the file [s]."""
KEEP_EVERY = 10.0
"""Time between two states that are kept to go back to [s]. A state that was kept too late leads to the next fault: a
second one within this time goes back to the state of the start."""
WARM_UP = 50
"""Cycles before the first deadline, taken back again: first calls are slow."""
QUIET = 1.0
"""Least time between two events on lateness [s]."""
MOST_MOTION = {name: most for jet in JETS for name, most in zip(jet, (100.0, 50.0, 100.0), strict=True)}
"""Motion of a crane tip or a vessel at most [m, m/s, m/s^2, rad, ...]."""
MOST_MOTION |= dict.fromkeys(("roll", "pitch"), LARGEST_ANGLE)
PARENT_EVERY = 100
"""Cycles between two looks whether the parent is still there."""
BEHIND = 0.5e-3
"""Time by which a second thread, on another processor, waits longer for a deadline [s]. It takes a cycle that the
first has not begun then: a host often holds up one processor of a virtual machine alone."""


NEVER = 60.0
"""Time after which a thread may ask another one for the interpreter [s]: each gives it free when it waits, and one that
was asked would wait for a thread whose processor is held up."""


class Task(NamedTuple):
    """What a kernel's process runs.

    crane, scenario: as for a `Session`; step: of integration; state: file to resume from and to write at the end, and
    next to it a lock that keeps other twins away;
    timeout of streamed inputs [s]; real_time: whether to request that class; speed: the winch's time over that of the
    wall, 1 beside a PLC; cycles: after how many the kernel stops by itself, None: never; sensed: whether rows hold what
    a PLC reads of the winch.
    """

    crane: Crane
    scenario: Scenario
    step: str | None = None
    state: Path | None = None
    timeout: float = TIMEOUT
    real_time: bool = True
    speed: float = 1.0
    cycles: int | None = None
    sensed: bool = False


def run_kernel(task: Task, memory: str) -> None:
    """The process: until it is asked to stop, by the board, by SIGTERM, or because its parent is gone."""
    board = Board(memory)
    let_through(board.stop)
    try:
        Kernel(task, board).run()
    except (SimulationError, LiveError) as problem:
        board.events.add(event("kernel", "refused", str(problem)).to_json().encode())
        board.stop()
        raise SystemExit(2) from None
    finally:
        board.close()


class Kernel:
    """One run of the loop."""

    def __init__(self, task: Task, board: Board) -> None:
        self.task, self.board = task, board
        self.session = Session(task.crane, task.scenario, step=task.step)
        names, streamed = ordered((*self.session.inputs, *self.session.vessel_inputs), self.session.parameters)
        self.inputs = Inputs(board.inputs, names, streamed, task.timeout, task.speed)
        held = tuple(name for name in names if name not in self.session.signals)
        self._read = (*self.session.signals, *held)
        self.names = (*STATUS, *self._read, *(SENSED if task.sensed else ()))
        if len(self.names) > MOST_NAMES or len(names) > MOST_INPUTS:
            raise LiveError(f"Live twin: {len(self.names)} signals; at most {MOST_NAMES} are served.")
        self._input_names, self._streamed = names, streamed
        self._wall = self.session.cycle / task.speed
        self._modes = {code_of(name): str(name) for name in CONTROLLERS}
        self._row = np.zeros(MOST_NAMES)
        self._kept = self._first = self.session.keep()
        self._was_reset = False
        self._n, self._turn = 0, threading.Lock()
        self._over, self._number = False, 0
        self._problem: BaseException | None = None
        self.late = self.overrun = self.missed = self.refused = 0
        self.worst = 0.0
        self._flags = Flag(0)
        self._stale: frozenset[str] = frozenset()
        self._reported = -math.inf
        self._unreported: list[tuple[float, Cause]] = []
        self._lateness, self._cause, self._chain, self._stolen = 0.0, Cause.NONE, Cause.NONE, Stolen()

    def run(self) -> None:
        """Until the end: rows, events and states on the board, and the last state in its file."""
        self._lock = None if self.task.state is None else lock_state(self.task.state)
        saved = self._resumed()
        kept = self.session.keep()
        self.session.step(cycles=WARM_UP)
        self._values()
        self.session.go_back(kept)
        kept_in_memory = memory.hold()
        scheduling = ask_for_real_time() if self.task.real_time else ordinary()
        line = f"{scheduling.line} {kept_in_memory}"
        modes = {name: code for code, name in self._modes.items()}
        face = Face(
            self.names,
            self._input_names,
            self._streamed,
            self.session.cycle,
            modes,
            line,
            scheduling.real_time,
        )
        self.board.faces.add(face.to_json())
        self._event("started", f"At {self.session.time:.2f} s of the winch. {line}")
        deadlines = Deadlines(self._wall)
        if saved is not None:
            self.inputs.resume(saved.inputs, deadlines.at(0))
        self._kept = self._first = self.session.keep()
        begin = self._state(deadlines.at(0))
        self.board.states.add(begin)
        if self.task.state is not None and saved is None:
            write_state(self.task.state, begin)
        try:
            self._run_loops(deadlines, two_shares() if scheduling.real_time else ())
        finally:
            leave_real_time()
        data = self._state(deadlines.at(self._n))
        self.board.states.add(data)
        if self.task.state is not None:
            write_state(self.task.state, data)
        self._event(
            "stopped", f"At {self.session.time:.2f} s of the winch, {self.late} late cycles.", self.session.time
        )

    def _run_loops(self, deadlines: Deadlines, shares: Sequence[frozenset[int]]) -> None:
        """Cycle after cycle until the end, in a thread for each share of the processors, this one the first."""
        second = threading.Thread(target=self._second_loop, args=(deadlines, *shares[1:])) if shares else None
        try:
            if second is not None:
                sys.setswitchinterval(NEVER)
                second.start()
                os.sched_setaffinity(0, shares[0])
            self._loop(deadlines)
        finally:
            self._over = True
            if second is not None:
                second.join()
            self._stolen.close()
        if self._problem is not None:
            raise self._problem

    def _second_loop(self, deadlines: Deadlines, processors: frozenset[int]) -> None:
        try:
            os.sched_setaffinity(0, processors)
            self._loop(deadlines, BEHIND)
        except BaseException as problem:
            self._problem, self._over = problem, True

    def _loop(self, deadlines: Deadlines, behind: float = 0.0) -> None:
        """Wait for each cycle, `behind` longer [s], and calculate it where no other thread has begun it."""
        parent = multiprocessing.parent_process()  # may have died before this process was ready
        with closing(Watch()) as watch:
            while not (self.board.stopping or self._over):
                n = self._n
                over = deadlines.lateness(n) > 0.0
                watch.begin(over)
                if over:
                    yield_processor()
                deadlines.wait(n, behind)
                with self._turn:
                    if self._n == n and not self.board.stopping:
                        self._due(n, deadlines, watch)
                        if parent is not None and self._n % PARENT_EVERY == 0:
                            self._over |= not parent.is_alive()

    def _due(self, n: int, deadlines: Deadlines, watch: Watch) -> None:
        """The cycle that is due, and what is due with it."""
        lateness = deadlines.lateness(n)
        if lateness > CATCH_UP:
            left_out = int(lateness / self._wall)
            n, self.missed = n + left_out, self.missed + left_out
            self._flags |= Flag.MISSED
            self._event("missed", f"{left_out} cycles were left out after a stall of {lateness:.1f} s.", lateness)
            lateness = deadlines.lateness(n)
        cause = watch.look(lateness) if lateness > LATE else Cause.NONE
        self._cycle(n, deadlines, lateness)
        self._cause = cause
        self._n = n = n + 1
        if n % round(SAVE_EVERY / self._wall) == 0:
            self.board.states.add(self._state(deadlines.at(n)))
            gc.collect(0)
            self._stolen.more()
        if n % round(KEEP_EVERY / self._wall) == 0:
            self._kept, self._was_reset = self.session.keep(), False
        if self.task.cycles is not None and n >= self.task.cycles:
            self.board.stop()

    def _resumed(self) -> LiveState | None:
        """Continue from the newest state, of the file or handed over; None where there is no file. Errors:
        LiveError."""
        path, handed = self.task.state, self.board.states.newest()
        if path is None:
            return None
        saved, problem = newest_state(path, None if handed is None else handed[1])
        self._number = 0 if saved is None else saved.number
        if saved is None or not path.exists():
            return None
        if problem:
            self._event("damaged-state", f"{problem} The state that is not damaged was taken.")
        try:
            self.session.restore(saved.session)
        except SimulationError as refused:
            reason = str(refused).removeprefix("saved state: ")
            raise LiveError(f"{path}: {reason} Or start without it: move the file away.") from None
        return saved

    def _cycle(self, n: int, deadlines: Deadlines, lateness: float) -> None:
        """One cycle and its row."""
        now, utc = deadlines.at(n), time.time()
        self.inputs.read()
        for name, value in self.inputs.due(now, utc - time.monotonic()).items():
            self._set(name, value)
        self._step(self.inputs.motion(now + self._wall))
        if self.inputs.partial:
            self._flags |= Flag.PARTIAL
        self._report_stale()
        self.late += lateness > LATE
        if lateness > LATE:
            self._flags |= Flag.LATE
        self.worst = max(self.worst, lateness)
        values = self._values()
        done = deadlines.lateness(n)
        if done > self._wall:
            self.overrun += 1
            self._flags |= Flag.OVERRUN
        flags = int(self._flags)
        counts = (self.late, self.overrun, self.missed, self.worst, len(self._stale), self.refused)
        ages = self.inputs.age, self.inputs.source_delay
        before = self._cause_before()
        status = (n, self.session.time, utc, lateness, done - lateness, flags, *counts, *ages, before)
        self._row[: len(self.names)] = (*status, *values)
        self.board.rows.publish(self._row)
        self._flags = Flag(0)
        self._report_late(now, before)
        self._lateness = lateness

    def _step(self, motion: dict[str, float]) -> None:
        """One cycle of the winch. A motion that no tip makes is forgotten, and the cycle goes without it; from a state
        that is not a number the twin goes back to the last one that was kept."""
        for name, value in motion.items():
            if not abs(value) <= MOST_MOTION[name]:
                self.inputs.refuse([*motion])
                self._refuse(f"{name} = {value:g}: give a value within +-{MOST_MOTION[name]:g}.")
                motion = {}
                break
        try:
            self.session.step(motion or None)
        except SimulationError as problem:
            self._event("reset", f"{problem} The twin went back to an earlier state.")
            self.session.go_back(self._first if self._was_reset else self._kept)
            self._was_reset = True
            self._flags |= Flag.RESET

    def _set(self, name: str, value: float) -> None:
        """Hold an input or change a setting; what the winch does not take is refused and counted."""
        try:
            self.session.set(name, self._modes.get(value, value) if name == MODE else value)
        except SimulationError as problem:
            self.inputs.refuse([name])
            self._refuse(str(problem))

    def _values(self) -> list[float]:
        """The winch's numbers at the present time."""
        get = self.session.get
        return [*map(get, self._read), *(self.session.sensed() if self.task.sensed else ())]

    def _state(self, now: float) -> bytes:
        self._number += 1
        return LiveState(self.session.save(), self.inputs.saved(now), self._number).to_bytes()

    # Events

    def _event(self, name: str, text: str, value: float = math.nan) -> None:
        self.board.events.add(event("kernel", name, text, value).to_json().encode())

    def _refuse(self, reason: str) -> None:
        self.refused += 1
        self._flags |= Flag.REFUSED
        self._event("refused-input", reason)

    def _report_stale(self) -> None:
        """Say which inputs went stale, and which are back."""
        now = self.inputs.stale
        if now:
            self._flags |= Flag.STALE
        if gone := sorted(now - self._stale):
            text = f"{', '.join(gone)}: nothing came for {self.task.timeout:g} s."
            self._event("stale", text, self.inputs.age)
        if back := sorted(self._stale - now):
            self._event("fresh", f"{', '.join(back)}: comes again.")
        self._stale = now

    def _cause_before(self) -> Cause:
        """Why the cycle before was late. What the host took is known a while later; a cycle that is late because of a
        late one has the cause of that."""
        cause = self._cause
        if cause in (Cause.TIMER, Cause.CYCLE) and self._stolen.more():
            cause = Cause.HOST
        elif cause is Cause.CYCLE:
            cause = self._chain or cause
        self._chain = cause
        return cause

    def _report_late(self, now: float, cause: Cause) -> None:
        """Say how many cycles before this one were late since the last such event, at most once in `QUIET`."""
        if self._lateness > LATE:
            self._unreported.append((self._lateness, cause))
        if self._unreported and now - self._reported >= QUIET:
            worst, reason = max(self._unreported)
            text = f"{len(self._unreported)} late cycles, the latest by {1e3 * worst:.1f} ms: {reason.text}."
            self._event("late", text, worst)
            self._reported, self._unreported = now, []
