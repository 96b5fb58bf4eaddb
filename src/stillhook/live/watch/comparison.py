"""Crane and twin side by side, row after row: deviations, criteria of validation, their causes, virtual sensors."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from stillhook.live.estimate.accuracy import Accuracies
from stillhook.live.servers.served import ALARM, CRITERIA, DEVIATION, HALF, VIRTUAL, compared
from stillhook.live.watch.deviation import COMPARED, Deviation, Deviations
from stillhook.live.watch.journal import Entry, Journal
from stillhook.live.watch.virtual import Reading, VirtualSensors
from stillhook.live.watch.watch import Watch, Watched
from stillhook.spec.crane import Crane


def shown_names(signals: Iterable[str], virtual: Iterable[str]) -> tuple[str, ...]:
    """What servers show of a comparison of these measured signals, with these virtual sensors."""
    both = [name for name in COMPARED if name in tuple(signals)]
    sensors = tuple(virtual)
    return (
        *(f"{of}.{name}" for of in (DEVIATION, ALARM) for name in both),
        f"{ALARM}.{CRITERIA}",
        *(f"{of}.{name}" for of in (VIRTUAL, HALF) for name in sensors),
    )


class Comparison:
    """Rows of crane and twin, `every` seconds apart; accuracies: of the crane's sensors.

    After each `add`: deviations of signals; found by the watch, None before its first batch; readings of virtual
    sensors, which are not valid while something is wrong; shown: all of it as servers show it.
    """

    def __init__(self, crane: Crane, *, every: float = 0.1, accuracies: Accuracies | None = None) -> None:
        self.watch, self.journal = Watch(crane, every=every, accuracies=accuracies), Journal()
        self._deviations, self._virtual = Deviations(every=every), VirtualSensors(crane, every=every)
        self.deviations: list[Deviation] = []
        self.readings: tuple[Reading, ...] = ()
        self.shown: dict[str, float] = {}

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the virtual sensors."""
        return tuple(s.name for s in self._virtual.sensors)

    @property
    def found(self) -> Watched | None:
        """What the watch said last."""
        return self.watch.latest

    def add(self, measured: Mapping[str, float], simulated: Mapping[str, float]) -> list[Entry]:
        """One more row of each side; what began or ended with it: an entry that ended has an end."""
        time = simulated["time"]
        self.deviations = self._deviations.add(measured, simulated)
        self.shown |= compared(self.deviations)
        changes = self.journal.alarms(time, self.deviations)
        self._virtual.add(measured, simulated)
        found = self.watch.add(measured, simulated)
        if found is not None:
            changes += self.journal.watched(found)
            self.shown[f"{ALARM}.{CRITERIA}"] = float(bool(found.failed))
        lasting = self.journal.lasting
        self.readings = tuple(self._virtual.read(simulated, f"{lasting[0].sort} {lasting[0].name}" if lasting else ""))
        for r in self.readings:
            self.shown |= {f"{VIRTUAL}.{r.name}": r.value if r.valid else math.nan, f"{HALF}.{r.name}": r.half}
        return changes
