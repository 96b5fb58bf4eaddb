"""A soft PLC: a controller at a fixed cycle, over a bus.

A cycle requests the process image, waits for at most a part of the cycle, acts on what it has then, and writes its
commands. An answer that is late serves the next cycle; a cycle is never stretched. An image that does not change any
more, or says that it is not good, makes every input bad: the guard of the controller then holds, ramps down and closes
the brake, as on a real PLC. Connections are made again; a stop stays until it is acknowledged.
"""

from __future__ import annotations

import asyncio
import contextlib
import gc
import math
import time
from collections import deque
from collections.abc import Callable, Coroutine
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import LiveError
from stillhook.live.hil.bus import COMMANDS, NOTHING, OVERRIDE, Bus, BusError, Image
from stillhook.live.hil.controller import OUTPUTS, SIGNALS, Controller
from stillhook.live.hil.plc_log import PlcLog
from stillhook.live.hil.script import Script
from stillhook.live.runtime.deadlines import Deadlines

WAIT = 0.6
"""Part of a cycle for which it waits for an answer."""
STALE_CYCLES, STALE = 5, 0.1
"""An image is stale when it is the same for so many cycles, or for this time where that is longer [s]."""
START, AGAIN = 10.0, 0.5
"""Time for the first image, and between two attempts to connect [s]."""
DEAD = 2.0
"""A connection over which nothing new came for this time is made again [s]."""
LATE = 2.0e-3
"""Lateness from which a cycle counts as late [s]."""
REPEATED = 100
"""Own commands among which one that is read back is looked for, and cycles in which foreign ones are counted."""
FOREIGN = 25
"""Foreign commands in those cycles at which the PLC yields."""
STOPPED = 1.5
"""State of the guard above which the winch is stopped."""
TOLERANCE = 1.0e-9
"""Between a command and what is read back, besides the rounding of the bus [-]."""


class Cycle(NamedTuple):
    """What a cycle saw of the plant: its time [s], its control error and tip [m]."""

    time: float
    e_c: float
    s_tip: float


class Outcome(NamedTuple):
    """What happened. cycles; late ones; without_answer: cycles without a new sample; unconfirmed: cycles that wrote
    nothing, since the write before was not confirmed; reconnected; ages of samples [s], NaN where the plant does not
    say; round trips of reading and writing [s]; stopped: whether the guard ever stopped the winch; seen."""

    cycles: int
    late: int
    without_answer: int
    unconfirmed: int
    reconnected: int
    ages: FloatArray
    reads: FloatArray
    writes: FloatArray
    stopped: bool
    seen: list[Cycle]


class SoftPlc:
    """One run. Parameters: bus; controller; script of the inputs; log; tell: what happens, a line each."""

    def __init__(
        self, bus: Bus, controller: Controller, script: Script, log: PlcLog, tell: Callable[[str], None]
    ) -> None:
        self._bus, self._controller, self._script, self._log, self._tell = bus, controller, script, log, tell
        self._cycle = controller.t_cycle
        self._image, self._changed = NOTHING, -math.inf
        self._pending: dict[str, asyncio.Task[Any]] = {}
        self._trips: dict[str, list[float]] = {"read": [], "write": []}
        self._own: deque[float] = deque(maxlen=REPEATED)
        self._foreign: deque[bool] = deque(maxlen=REPEATED)
        self._ages: list[float] = []
        self._seen: list[Cycle] = []
        self._connected, self._attempt = False, -math.inf
        self._late = self._without = self._unconfirmed = self._reconnected = 0
        self._state, self._stopped = 0.0, False

    async def run(self, done: Callable[[], bool]) -> Outcome:
        """Until it is done. Errors: LiveError where the plant refuses, or another PLC commands it."""
        n = 0
        gc.collect()
        gc.freeze()
        gc.disable()
        try:
            await self._bus.connect()
            self._connected = True
            await self._first_image()
            deadlines = Deadlines(self._cycle)
            while not done():
                await asyncio.sleep(max(0.0, -deadlines.lateness(n)))
                await self._one(n, max(0.0, deadlines.lateness(n)))
                if n % round(1.0 / self._cycle) == 0:
                    self._log.flush()
                    gc.collect(0)
                n += 1
                if (behind := int(deadlines.lateness(n) / self._cycle)) > 0:  # cycles that a stall took are left out
                    n, self._late = n + behind, self._late + behind
        finally:
            gc.enable()
            gc.unfreeze()
            await self._hand_back()
        return Outcome(
            len(self._seen),
            self._late,
            self._without,
            self._unconfirmed,
            self._reconnected,
            np.array(self._ages),
            np.array(self._trips["read"]),
            np.array(self._trips["write"]),
            self._stopped,
            self._seen,
        )

    async def _first_image(self) -> None:
        end = time.monotonic() + START
        while not self._image.good or not np.isfinite(self._image.sensed).all():
            with contextlib.suppress(BusError):
                self._image = await self._bus.read()
            if time.monotonic() > end:
                raise LiveError(
                    f"{self._bus.label}: no complete process image within {START:g} s. Is the twin running?"
                )
            await asyncio.sleep(self._cycle)
        self._changed = time.monotonic()

    async def _one(self, n: int, lateness: float) -> None:
        """One cycle."""
        self._late += lateness > LATE
        new = await self._read()
        now = time.monotonic()
        image = self._image
        good = image.good and now - self._changed < max(STALE, STALE_CYCLES * self._cycle)
        age = time.time() - image.get("time_utc")
        seen = np.where(np.isfinite(image.sensed), image.sensed, math.nan)
        quality = np.isfinite(image.sensed) & good
        inputs = self._script.apply(n * self._cycle, np.concatenate([seen, quality.astype(float), [0.0]]))
        outputs = self._controller.cycle(inputs)
        self._write(dict(zip(OUTPUTS, outputs.tolist(), strict=True)))
        trip = self._trips["read"][-1] if new and self._trips["read"] else math.nan
        status = (len(self._seen), n * self._cycle, lateness, image.get("cycle_number"), age, trip)
        self._log.add(status, inputs, outputs)
        self._ages.append(age)
        self._without += not new
        self._seen.append(Cycle(image.get("time"), image.get("e_c"), float(image.sensed[0])))
        self._report(float(outputs[OUTPUTS.index("state")]), float(outputs[OUTPUTS.index("cause")]))
        if new:
            self._look_for_another(image)
        if now - self._changed > DEAD and self._connected:
            self._lost("nothing new came")
        if not self._connected and now - self._attempt > AGAIN and "connect" not in self._pending:
            self._attempt = now
            self._start("connect", self._bus.connect())
        self._collect("connect")

    # The bus

    def _start(self, name: str, request: Coroutine[Any, Any, Any]) -> asyncio.Task[Any]:
        started = time.monotonic()
        task = asyncio.create_task(request)
        task.add_done_callback(lambda ended: ended.cancelled() or ended.exception())  # nobody may ask for it any more
        if name in self._trips:
            task.add_done_callback(lambda _: self._trips[name].append(time.monotonic() - started))
        self._pending[name] = task
        return task

    def _collect(self, name: str) -> Any:
        """The result of a request that ended; None where there is none, or its connection was lost."""
        task = self._pending.get(name)
        if task is None or not task.done():
            return None
        del self._pending[name]
        try:
            result = task.result()
        except BusError as problem:
            if name != "connect":
                self._lost(str(problem))
            return None
        if name == "connect":
            self._connected, self._changed = True, time.monotonic()
            self._reconnected += 1
            self._tell(f"{self._bus.label}: connected again.")
        return result

    async def _read(self) -> bool:
        """Request the image, and take over what came; whether that is new."""
        if not self._connected:
            return False
        task = self._pending.get("read") or self._start("read", self._bus.read())
        await asyncio.wait([task], timeout=WAIT * self._cycle)
        image: Image | None = self._collect("read")
        if image is None:
            return False
        number = image.get("cycle_number")
        new = math.isfinite(number) and number != self._image.get("cycle_number")
        if new:
            self._changed = time.monotonic()
        self._image = image
        return new

    def _write(self, outputs: dict[str, float]) -> None:
        """Send the commands, unless the ones before are not confirmed yet."""
        self._collect("write")
        if not self._connected or "write" in self._pending:
            self._unconfirmed += 1
            return
        self._own.append(outputs["u_p"])
        self._start("write", self._bus.write({OVERRIDE: 1.0, **{name: outputs[name] for name in COMMANDS}}))

    def _lost(self, reason: str) -> None:
        """The connection is gone: what it was asked for is forgotten."""
        self._connected = False
        for task in self._pending.values():
            task.cancel()
        self._pending.clear()
        self._tell(f"{self._bus.label}: connection lost ({reason})")

    async def _hand_back(self) -> None:
        """The twin's own controller takes the winch over again, where it still answers."""
        for task in self._pending.values():
            task.cancel()
        if self._connected and self._own:
            with contextlib.suppress(LiveError, asyncio.TimeoutError):
                await asyncio.wait_for(self._bus.write({OVERRIDE: 0.0}), 1.0)
        await self._bus.close()

    # What is to be said

    def _report(self, state: float, cause: float) -> None:
        """Say when the guard stops the winch, and when it lets it go again."""
        if (state > STOPPED) != (self._state > STOPPED):
            names = [name for i, name in enumerate(SIGNALS) if int(cause) >> i & 1] or ["memory or law"]
            bad = "all inputs" if len(names) == len(SIGNALS) else ", ".join(names)
            stop = f"The guard stopped the winch ({bad}): acknowledge with reset, mode manual and joystick released."
            self._tell(stop if state > STOPPED else "The stop was acknowledged.")
        self._state, self._stopped = state, self._stopped or state > STOPPED

    def _look_for_another(self, image: Image) -> None:
        """Errors: LiveError where the commands in force are not among the last own ones: another client writes."""
        u_p = image.get("u_p")
        if len(self._own) < REPEATED or not math.isfinite(u_p) or not image.good:
            return
        near = self._bus.resolution("u_p") + TOLERANCE
        self._foreign.append(u_p != 0.0 and min(abs(u_p - own) for own in self._own) > near)
        if sum(self._foreign) > FOREIGN:
            raise LiveError(
                f"{self._bus.label}: the commands in force are not those of this PLC: another client commands the winch"
                " as well, or the twin refuses them (see its events). Stop the other one."
            )
