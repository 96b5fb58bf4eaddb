"""A twin for servers without a kernel: a hundred numbers that count rows, and what was written and told."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping

from stillhook.live.runtime import Event, Row
from stillhook.variables import BY_NAME

SIGNALS = [name for name, v in BY_NAME.items() if v.unit and name != "time"][:98]


class Counting:
    """Each look is a new row, whose numbers are its own number."""

    names = ("time_utc", "cycle_number", *SIGNALS)
    inputs = ("s_tip", "v_tip", "a_tip", "v_op", "mode", "K_p")
    streamed = 4

    def __init__(self) -> None:
        self.alive = True
        self.count = 0
        self.written: list[dict[str, float]] = []
        self.stamps: list[float] = []
        self.events: list[Event] = []

    def latest(self) -> Row:
        self.count += 1
        return Row(self.count, {**dict.fromkeys(self.names, float(self.count)), "time_utc": time.time()})

    def write(self, values: Mapping[str, float], source: str, stamp: float = math.nan) -> None:
        self.written.append(dict(values))
        self.stamps.append(stamp)

    def tell(self, happened: Event) -> None:
        self.events.append(happened)

    def told(self, name: str) -> list[str]:
        return [e.text for e in self.events if e.name == name]
