"""A live twin without a clock and a process of its own: each look at it takes it far on."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, Self

import numpy as np

import stillhook
from stillhook.live.runtime import Event, Row, Task

LOOKS, CYCLES = 400, 10
"""Rows at each look, and cycles of the winch from row to row."""


class Beside:
    """What a replay uses of a `LiveTwin`."""

    inputs = ()
    alive = True
    face = SimpleNamespace(scheduling="none", streamed=0)

    def __init__(self, task: Task, sinks: Sequence[Any] = ()) -> None:
        self.session, self.sinks, self._left = stillhook.Session(task.crane, task.scenario), sinks, task.cycles or 0
        self.names = ("late_cycles", "time", *self.session.signals)
        self._number, self._row = 0, np.zeros(len(self.names))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *of: object) -> None:
        pass

    @property
    def ended(self) -> bool:
        return self._left <= 0

    def latest(self) -> Row:
        return Row(self._number, dict(zip(self.names, self._row.tolist(), strict=True)))

    def tell(self, happened: Event) -> None:
        for sink in self.sinks:
            sink.event(happened)

    def pump(self) -> None:
        rows = []
        while self._left > 0 and len(rows) < LOOKS:
            for _ in range(CYCLES):
                self.session.step()
            self._left -= CYCLES
            rows.append(np.array([0.0, self.session.time, *map(self.session.get, self.session.signals)]))
        for sink in self.sinks:
            sink.rows(self._number, self.names, rows)
        self._number += len(rows)
        self._row = rows[-1] if rows else self._row
