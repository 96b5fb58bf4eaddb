"""A winch as the plant of a PLC: behind a bus that is a function call, and behind the servers."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Mapping

import numpy as np

from stillhook import Scenario, Session, load_crane
from stillhook.live.hil.bus import PLACE, BusError, Image
from stillhook.live.runtime import Event, Row
from stillhook.live.runtime.board import IMAGE, SENSED, STATUS
from stillhook.live.runtime.inputs import ordered

CRANE = load_crane("nov-250t")
CASE = Scenario(load="100 t", s_w="100 m", tip="sine 1.5 m 9 s", mode="ssc", ramp="1 s")


def image_of(session: Session, number: int) -> Image:
    """The process image of a session's present cycle."""
    head = {"cycle_number": float(number), "time": session.time, "time_utc": time.time()}
    head |= {name: session.get(name) for name in ("e_c", "u_p")}
    return Image(np.array([*(head[name] for name in IMAGE[: len(head)]), *session.sensed()]), True)


class Direct:
    """A bus that is a call: each read is the next cycle of the winch. What tests do to it: `dead`, `frozen`, `slow` [s],
    `lost` names of what is NaN, `foreign` a command of another client, `refusing` what it says to a write."""

    label = "direct"

    def __init__(self) -> None:
        self.session, self.number = Session(CRANE, CASE), 0
        self.image = image_of(self.session, 0)
        self.written: list[dict[str, float]] = []
        self.connections = self.waiting = self.most_waiting = 0
        self.dead = self.frozen = False
        self.slow, self.refusing = 0.0, None
        self.lost: tuple[str, ...] = ()
        self.foreign = math.nan

    async def connect(self) -> None:
        if self.dead:
            raise BusError("direct: no connection.")
        self.connections += 1

    async def read(self) -> Image:
        self.waiting += 1
        self.most_waiting = max(self.most_waiting, self.waiting)
        try:
            if self.slow:
                await asyncio.sleep(self.slow)
            if self.dead:
                raise BusError("direct: no answer.")
        finally:
            self.waiting -= 1
        if not self.frozen:
            self.number += 1
            self.session.step()
            self.image = image_of(self.session, self.number)
        values = self.image.values.copy()
        for name in self.lost:
            values[PLACE[name]] = math.nan
        if not math.isnan(self.foreign):
            values[PLACE["u_p"]] = self.foreign
        return Image(values, True)

    async def write(self, values: Mapping[str, float]) -> None:
        if self.refusing is not None:
            raise self.refusing
        if self.dead:
            raise BusError("direct: no answer.")
        self.written.append(dict(values))
        for name, value in values.items():
            self.session.set(name, value)

    async def close(self) -> None:
        pass

    def resolution(self, name: str) -> float:
        return 0.0


class PlantServed:
    """The same winch for the servers: a `Served` whose rows are what a PLC reads, a new one at every look."""

    def __init__(self, *, sensed: bool = True) -> None:
        self.session = Session(CRANE, CASE)
        self.inputs, self.streamed = ordered(self.session.inputs, self.session.parameters)
        own = (*self.session.signals, *(n for n in self.inputs if n not in self.session.signals))
        self.names = (*STATUS, *own, *(SENSED if sensed else ()))
        self.alive, self.number = True, 0
        self.written: list[dict[str, float]] = []
        self.events: list[Event] = []
        self.newest: dict[str, float] = {}

    def latest(self) -> Row:
        self.number += 1
        self.session.step()
        row = dict.fromkeys(self.names, 0.0)
        row |= {name: self.session.get(name) for name in self.names if name in self.session.signals}
        row |= dict(zip(IMAGE, image_of(self.session, self.number).values.tolist(), strict=True))
        self.newest = {name: row[name] for name in self.names}
        return Row(self.number, self.newest)

    def write(self, values: Mapping[str, float], source: str, stamp: float = math.nan) -> None:
        self.written.append(dict(values))
        for name, value in values.items():
            self.session.set(name, value)

    def tell(self, happened: Event) -> None:
        self.events.append(happened)
