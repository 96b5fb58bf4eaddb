"""What `stillhook live run` is, with a hundred numbers over OPC UA, which a crane's own are not:
`python -m trials.endurance.twin LIVE.toml SECONDS [SPEED [PUBLISH]]`. In time-lapse the winch runs SPEED times as fast
in the ordinary class, OPC UA publishes every PUBLISH seconds, and the history commits and begins files as often.

Each row that was published is in published.bin beside the twin's state, so that clients can be held against it.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import IO

import numpy as np

from stillhook.live.history import HistorySink, sink, writer
from stillhook.live.live_file import read_live_file
from stillhook.live.runtime import STATUS, Event, EventLog, LiveTwin, Row, Task
from stillhook.live.servers import opcua, serving

NUMBERS = 100


class Hundred:
    """A twin whose numbers are served twice until there are a hundred, and a record of what was published."""

    def __init__(self, twin: LiveTwin, published: IO[bytes]) -> None:
        self._twin, self._published, self._last = twin, published, -1
        more = NUMBERS - len(twin.names)
        self.names = (*twin.names, *(f"measured.{name}" for name in twin.names[1 : 1 + more]))
        self.inputs = twin.inputs

    @property
    def alive(self) -> bool:
        return self._twin.alive

    def latest(self) -> Row | None:
        """The newest row. It is published where its number is new: OPC UA alone asks here."""
        row = self._twin.latest()
        if row is None:
            return None
        values = {name: row.values[name.removeprefix("measured.")] for name in self.names}
        if row.number != self._last:
            self._last = row.number
            self._published.write(np.array([values[name] for name in self.names]).tobytes())
            self._published.flush()
        return Row(row.number, values)

    def write(self, values: Mapping[str, float], source: str, stamp: float = math.nan) -> None:
        self._twin.write(values, source, stamp)

    def tell(self, happened: Event) -> None:
        self._twin.tell(happened)


def main(live_file: Path, seconds: float, speed: float = 1.0, publish: float = opcua.EVERY) -> None:
    plan = read_live_file(live_file)
    state, real_time = plan.folder / "state.bin", speed == 1.0
    task = Task(plan.case.crane, plan.case.case, plan.case.step, state, plan.timeout, real_time, speed)
    lapse = publish / opcua.EVERY
    opcua.EVERY, serving.LOOK = publish, lapse * serving.LOOK
    sink.COMMIT, sink.HOUR, writer.HOUR = lapse * sink.COMMIT, round(lapse * sink.HOUR), lapse * writer.HOUR
    assert plan.history is not None
    history = HistorySink(plan.folder / "history", STATUS, every=plan.history[0], budget=plan.history[1])
    end = time.monotonic() + seconds
    with (
        LiveTwin(task, [EventLog(plan.folder / "events.jsonl"), history], history) as twin,
        (plan.folder / "published.bin").open("ab") as published,
    ):
        served = Hundred(twin, published)
        (plan.folder / "names.txt").write_text("\n".join(served.names), encoding="utf-8")
        (plan.folder / "kernel.pid").write_text(str(twin.pid), encoding="utf-8")
        serving.serve(twin, served, plan, lambda: time.monotonic() >= end, lambda line: print(line, flush=True))


if __name__ == "__main__":
    main(Path(sys.argv[1]), *map(float, sys.argv[2:]))
