"""A log as if it happened now: the twin moves with the logged tip, and is compared with what was measured."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.control.registry import Mode, mode_of_code
from stillhook.errors import LiveError
from stillhook.live.live_file import LivePlan
from stillhook.live.runtime import Event, LiveTwin, Row, Task, event
from stillhook.live.servers.served import MEASURED
from stillhook.live.servers.serving import serve
from stillhook.live.watch.comparison import Comparison, shown_names
from stillhook.live.watch.deviation import COMPARED, Deviation
from stillhook.live.watch.journal import CAUSE, Entry
from stillhook.live.watch.virtual import Reading
from stillhook.live.watch.windows.criteria import WindowResult
from stillhook.logs.types import Log
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Operator, Scenario
from stillhook.validate.data_set.signals import smooth_tip

SLOWEST, FASTEST = 0.1, 20.0
"""Speed of a replay over that of the clock: a processor steps a winch some 25 times as fast as it happens."""
SHORTEST = 10.0
"""Shortest stretch of a log that is replayed [s]."""
STICK = 1.0e-3
"""Operator's speed from which a joystick counts as moved, and by which it moves to count [m/s]."""
SETTLE = 10.0
"""Begin of a replay that is not compared [s]: pressures and pistons of the twin start at rest."""


class Stretch(NamedTuple):
    """A part of a log without a gap, on an even grid: times from its begin [s], where it begins in the log [s], and
    signals by name [SI], NaN where none was logged."""

    t: FloatArray
    start: float
    signals: Mapping[str, FloatArray]
    every: float


class Moment(NamedTuple):
    """A moment of the replay: the winch's time [s], deviations, and events since the one before."""

    time: float
    deviations: list[Deviation]
    events: list[Event]


class Replayed(NamedTuple):
    """What a replay found: seconds that were compared, alarms by signal with the winch's time of the first [s], root
    mean squares of the differences over all of them by signal [SI], late cycles, how the twin was scheduled.

    entries: what was wrong, from when to when; summary: the same, one for each name, with how often; criteria: every
    line at the end; not_judged: criteria without one, and why; cause: the last that was named, in a sentence; clock:
    offset of the encoder that was taken out and its half width [s], NaN where it was not found; virtual: sensors at
    the end.
    """

    compared: float
    alarms: Mapping[str, float]
    rms: Mapping[str, float]
    late: int
    scheduling: str
    entries: tuple[Entry, ...]
    summary: tuple[tuple[Entry, int], ...]
    criteria: tuple[WindowResult, ...]
    not_judged: Mapping[str, str]
    cause: str
    clock: tuple[float, float]
    virtual: tuple[Reading, ...]

    @property
    def failed(self) -> bool:
        """Whether a signal or a criterion was outside its limit at any time."""
        return any(e.sort != CAUSE for e in self.entries)


def longest_stretch(log: Log) -> Stretch:
    """The longest part of a log without a gap. Errors: LiveError where it lacks the tip or is too short."""
    if "s_tip" not in log.signals:
        raise LiveError(
            f"{log.source}: no s_tip: the twin has nothing to move with. Map the column of the tip's height."
        )
    t = log.t if log.at is None else log.at
    cuts = [0, *(int(np.searchsorted(t, end - 1e-9)) for _, end in log.gaps), len(t)]
    first, end = max(pairwise(cuts), key=lambda part: part[1] - part[0])
    if end - first < 2 or t[end - 1] - t[first] < SHORTEST:
        raise LiveError(f"{log.source}: no {SHORTEST:g} s without a gap. Give a longer log.")
    grid = np.arange(0.0, t[end - 1] - t[first] + 1e-9, log.every)
    signals = {name: _on_grid(grid, t[first:end] - t[first], x[first:end]) for name, x in log.signals.items()}
    return Stretch(grid, float(t[first]), signals, log.every)


def _on_grid(grid: FloatArray, t: FloatArray, x: FloatArray) -> FloatArray:
    """A signal on an even grid, NaN where it has no good value."""
    good = np.isfinite(x)
    if good.sum() < 2:
        return np.full(len(grid), np.nan)
    out: FloatArray = np.interp(grid, t[good], x[good])
    return out


def scenario_of(stretch: Stretch, base: Scenario, source: str) -> Scenario:
    """The scenario that a stretch of a log describes: tip, wire out, modes and operator of the log, load, water and
    sensors of `base`. Errors: StillhookError."""
    s = stretch.signals
    tip = smooth_tip(stretch.t, s["s_tip"], s.get("v_tip"), place=source).motion
    fields: dict[str, object] = {"name": source, "tip": tip, "duration": f"{tip.duration!r} s", "ramp": "0 s"}
    fields["warm_up"] = f"{min(SETTLE, 0.5 * tip.duration)!r} s"
    if "s_w" in s and np.isfinite(s["s_w"]).any():
        fields["s_w"] = f"{float(s['s_w'][np.isfinite(s['s_w'])][0])!r} m"
    if "mode" in s and np.isfinite(s["mode"]).any():
        first, *later = _modes(stretch.t, s["mode"], source)
        fields |= {"mode": first[1], "modes": tuple(later)}
    if "v_op" in s and np.nanmax(np.abs(s["v_op"]), initial=0.0) > STICK:
        fields["operator"] = Operator(profile=_stick(stretch.t, s["v_op"]))
    kept = {name: getattr(base, name) for name in ("load", "s_w", "mode", "water", "sensors", "friction")}
    kept = {"load": f"{kept.pop('load')!r} kg", "s_w": f"{kept.pop('s_w')!r} m", **kept}
    return Scenario(**{**kept, **fields})


def _modes(t: FloatArray, codes: FloatArray, source: str) -> list[tuple[str, Mode]]:
    """Modes with the times from which they hold. Errors: LiveError for a number that is not a mode."""
    changes: list[tuple[str, Mode]] = []
    for time, code in zip(t.tolist(), np.round(codes).tolist(), strict=True):
        if not math.isfinite(code):
            continue
        if not 0 <= code < len(Mode):
            raise LiveError(f"{source}: mode {code:g}: give the numbers of modes, 0 to {len(Mode) - 1}.")
        mode = mode_of_code(code)
        if not changes or changes[-1][1] is not mode:
            changes.append((f"{time!r} s", mode))
    return changes


def _stick(t: FloatArray, v: FloatArray) -> tuple[tuple[str, str], ...]:
    """The operator's speed as straight lines through the points where it moves."""
    v = np.nan_to_num(v)
    keep = [0]
    for i in range(1, len(v) - 1):
        if abs(v[i] - v[keep[-1]]) >= STICK or (v[i] != v[i + 1] and v[i] == v[i - 1]):
            keep.append(i)
    keep.append(len(v) - 1)
    return tuple((f"{float(t[i])!r} s", f"{float(v[i])!r} m/s") for i in keep)


def replay(
    crane: Crane,
    base: Scenario,
    log: Log,
    speed: float,
    watch: Callable[[Moment], None],
    *,
    plan: LivePlan | None = None,
    ready: Callable[[str], None] = lambda line: None,
) -> Replayed:
    """Drive the twin with a log in scaled real time, and compare.

    Parameters: crane; base: load, water and sensors; log; speed over that of the clock; watch: receives every bin of
    the log; plan: servers that show the twin with the measured values and deviations next to it; ready: receives
    addresses.

    Errors: StillhookError of one line: a log without a tip, a speed beyond what is allowed, a twin that fell behind.
    """
    if not SLOWEST <= speed <= FASTEST:
        raise LiveError(f"--speed {speed:g}: give {SLOWEST:g} to {FASTEST:g} times that of the clock.")
    stretch = longest_stretch(log)
    case = scenario_of(stretch, base, log.source)
    cycles = int(case.duration / crane.control.t_cycle)
    task = Task(crane, case, speed=speed, real_time=speed == 1.0, cycles=cycles)
    comparison = _Comparison(crane, stretch, watch)
    with LiveTwin(task, (comparison,)) as twin:
        comparison.twin = twin
        serve(twin, comparison, plan, comparison.over, ready)
        late = int(row.values["late_cycles"]) if (row := twin.latest()) else 0
        scheduling = twin.face.scheduling
    if comparison.missed:
        raise LiveError(f"--speed {speed:g}: the twin fell behind by more than 10 s. Give a lower speed.")
    c, of = comparison, comparison.of
    return Replayed(
        compared=c.compared,
        alarms=c.alarms,
        rms=c.rms(),
        late=late,
        scheduling=scheduling,
        entries=of.journal.entries,
        summary=tuple(of.journal.summary),
        criteria=() if of.found is None else of.found.results,
        not_judged=of.watch.criteria.not_judged,
        cause=next((e.text for e in reversed(of.journal.entries) if e.sort == CAUSE), ""),
        clock=(math.nan, math.nan) if of.found is None else (of.found.clock, of.found.clock_half),
        virtual=of.readings,
    )


class _Comparison:
    """A sink that puts the log next to the rows; and what servers show: the twin's numbers and the comparison."""

    twin: LiveTwin

    def __init__(self, crane: Crane, stretch: Stretch, watch: Callable[[Moment], None]) -> None:
        self._stretch, self._watch = stretch, watch
        self.of = Comparison(crane, every=stretch.every)
        self._names = [name for name in COMPARED if name in stretch.signals]
        self._next, self._seen = 0, 0
        self._sums = dict.fromkeys(self._names, 0.0)
        self._counts = dict.fromkeys(self._names, 0)
        self._measured: dict[str, float] = {}
        self.alarms: dict[str, float] = {}
        self.compared = 0.0
        self.missed = False
        self._events: list[Event] = []

    # A sink

    def rows(self, first: int, names: Sequence[str], rows: Sequence[FloatArray]) -> None:
        """Compare the rows at the times of the log's bins."""
        at, end = list(names).index("time"), self._stretch.t[-1]
        for row in rows:
            while self._next < len(self._stretch.t) and row[at] >= self._stretch.t[self._next] - 1e-9:
                self._compare(self._next, dict(zip(names, row.tolist(), strict=True)))
                self._next += 1
            if row[at] >= end:
                break

    def event(self, happened: Event) -> None:
        """Keep it for the next moment."""
        self.missed |= happened.name == "missed"
        if happened.name != "late":  # of a clock that runs faster
            self._events.append(happened)

    def close(self) -> None:
        """Nothing to close."""

    # What servers need

    @property
    def names(self) -> tuple[str, ...]:
        """The twin's, then those of the comparison."""
        measured = (f"{MEASURED}.{name}" for name in self._names)
        return (*self.twin.names, *measured, *shown_names(self._names, self.of.sensors))

    @property
    def inputs(self) -> tuple[str, ...]:
        """Those of the twin, so that register maps fit; every write is refused, for the log drives the twin."""
        return self.twin.inputs

    @property
    def alive(self) -> bool:
        """Whether the kernel's process runs."""
        return self.twin.alive

    def latest(self) -> Row | None:
        """The newest cycle, with the newest comparison."""
        row = self.twin.latest()
        blank = dict.fromkeys(self.names[len(self.twin.names) :], math.nan)
        return None if row is None else Row(row.number, {**row.values, **blank, **self._measured, **self.of.shown})

    def write(self, values: Mapping[str, float], source: str, stamp: float = math.nan) -> None:
        """Errors: LiveError: the log drives the twin."""
        raise LiveError(f"{source}: the log drives the twin. Write to: stillhook live run.")

    def tell(self, happened: Event) -> None:
        """Pass an event on."""
        self.twin.tell(happened)

    def pump(self) -> None:
        """Pass rows and events of the twin on."""
        self.twin.pump()

    # The comparison

    def over(self) -> bool:
        """Whether the log is through, or the kernel is gone."""
        return self._next >= len(self._stretch.t) or self.missed

    def rms(self) -> dict[str, float]:
        """Root mean squares of the differences over all that was compared, by signal."""
        return {name: math.sqrt(self._sums[name] / n) for name, n in self._counts.items() if n}

    def _compare(self, i: int, simulated: Mapping[str, float]) -> None:
        if self._stretch.t[i] < SETTLE:
            return
        measured = {name: float(x[i]) for name, x in self._stretch.signals.items()}
        time = simulated["time"]
        changes = self.of.add(measured, simulated)
        self.compared += self._stretch.every
        for d in self.of.deviations:
            difference = d.measured - d.simulated
            if math.isfinite(difference):
                self._sums[d.name] += difference**2
                self._counts[d.name] += 1
            self._measured[f"{MEASURED}.{d.name}"] = d.measured
            if d.alarm:
                self.alarms.setdefault(d.name, time)
        for entry in changes:
            self.tell(event("replay", entry.event, entry.text))
        self._watch(Moment(time, self.of.deviations, self._events))
        self._events = []
