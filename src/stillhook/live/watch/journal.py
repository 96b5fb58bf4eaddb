"""What was wrong, from when to when: alarms of signals, criteria that were not met, and the causes that were named."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from stillhook.live.watch.deviation import Deviation, shown
from stillhook.live.watch.watch import Watched
from stillhook.live.watch.windows.criteria import Status

MOST = 1000
"""Entries that are kept: the oldest go first."""
ALARM, CRITERION, CAUSE = "alarm", "criterion", "cause"


class Entry(NamedTuple):
    """start, end by the winch's time [s], NaN while it lasts; sort: alarm, criterion or cause; name: signal or key;
    text: what it was at its start."""

    start: float
    end: float
    sort: str
    name: str
    text: str

    @property
    def event(self) -> str:
        """Name of the event of its start, or of its end where it has one."""
        return self.sort if math.isnan(self.end) else f"{self.sort}-over"


class Journal:
    """Entries in the order of their start; those that last have no end yet."""

    def __init__(self) -> None:
        self._over: deque[Entry] = deque(maxlen=MOST)
        self._on: dict[tuple[str, str], Entry] = {}

    @property
    def entries(self) -> tuple[Entry, ...]:
        """All that are kept."""
        return tuple(sorted([*self._over, *self._on.values()], key=lambda e: (e.start, e.sort, e.name)))

    @property
    def lasting(self) -> tuple[Entry, ...]:
        """Those that are on."""
        return tuple(self._on.values())

    def alarms(self, time: float, deviations: Sequence[Deviation]) -> list[Entry]:
        """Alarms of signals at a moment; those that began or ended."""
        now = {
            d.name: f"{d.name} deviates by {shown(d.name, d.rms)} rms, limit {shown(d.name, d.limit)}."
            for d in deviations
            if d.alarm
        }
        return self._update(time, ALARM, now)

    def watched(self, found: Watched) -> list[Entry]:
        """Criteria and causes at a moment; those that began or ended. A criterion that was not met is so until all of
        the interval is within its limit."""
        lines = {f"{r.key} {r.of}".strip() + f" over {r.window}": r for r in found.results}
        criteria = {
            name: f"{r.title}: {r.text} over {r.window}; limit: {r.limit}."
            for name, r in lines.items()
            if r.status is Status.NOT_OK or (r.status is Status.CANNOT_TELL and (CRITERION, name) in self._on)
        }
        causes = {" | ".join(found.diagnosis.candidates): found.diagnosis.text} if found.diagnosis.candidates else {}
        return [*self._update(found.time, CRITERION, criteria), *self._update(found.time, CAUSE, causes)]

    @property
    def summary(self) -> list[tuple[Entry, int]]:
        """One line for each name: from its first start to its last end, with what it was at first, and how often."""
        by_name: dict[tuple[str, str], list[Entry]] = {}
        for e in self.entries:
            by_name.setdefault((e.sort, e.name), []).append(e)
        return [(of[0]._replace(end=of[-1].end), len(of)) for of in by_name.values()]

    def _update(self, time: float, sort: str, now: Mapping[str, str]) -> list[Entry]:
        gone = [k for k in self._on if k[0] == sort and k[1] not in now]
        over = [self._on.pop(key)._replace(end=time) for key in gone]
        self._over.extend(over)
        new = [Entry(time, math.nan, sort, name, text) for name, text in now.items() if (sort, name) not in self._on]
        self._on |= {(sort, e.name): e for e in new}
        return [*over, *new]
