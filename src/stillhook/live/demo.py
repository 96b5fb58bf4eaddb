"""A twin beside a soft PLC, and an alarm: what the rooms of the live twin do together."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import NamedTuple

from stillhook.engine.session import Session
from stillhook.live.runtime import Event, LiveTwin, Task, event
from stillhook.live.runtime.deadlines import Deadlines
from stillhook.live.watch.deviation import COMPARED, LIMITS, Deviation, Deviations, shown
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario

SCENARIO: Mapping[str, str] = {"load": "100 t", "s_w": "100 m", "tip": "sine 1 m 9 s", "mode": "ssc"}
GROWN = 1.3
"""System friction of the crane after the change, over that of the twin."""
CHANGE = 1.0 / 3.0
"""Part of the demonstration after which the crane's friction has grown."""
EVERY = 0.1
"""Time between two comparisons [s]."""
WINDOW = 9.0
"""Window of the deviations: a period of the tip [s]."""
SHARE = 0.2
"""Window of a short demonstration, as part of its duration."""
MOTION = ("s_tip", "v_tip", "a_tip")
SHORTEST = 15.0
"""Shortest demonstration [s]."""
LIMIT_P = 4.0e5
"""Alarm for pressures: tighter than for a real crane, whose friction has another law than its file [Pa]."""


class Moment(NamedTuple):
    """A moment of the demonstration: seconds since its begin, the newest numbers of the twin's runtime, deviations, and
    events since the moment before."""

    time: float
    status: Mapping[str, float]
    deviations: list[Deviation]
    events: list[Event]


class Outcome(NamedTuple):
    """What happened: time of the change and of the first alarm [s], NaN where none came; false alarms before the
    change; late and overrun cycles of the twin, and of the soft PLC; how the twin was scheduled."""

    changed: float
    alarm: float
    false_alarms: int
    late: int
    overrun: int
    plc_late: int
    scheduling: str

    @property
    def reason(self) -> str:
        """In one sentence."""
        kept = f"{self.late} late cycles of the twin"
        if self.alarm != self.alarm:
            return f"The crane's friction grew at {self.changed:.1f} s, and no alarm came; {kept}."
        after = self.alarm - self.changed
        grew = f"The crane's friction grew by {GROWN - 1.0:.0%} at {self.changed:.1f} s"
        return f"{grew}, the alarm came {after:.1f} s later; {kept}."


def with_friction(crane: Crane, factor: float) -> Crane:
    """The crane with its system friction times a factor."""
    f = crane.friction.system
    grown = {name: factor * getattr(f, name) for name in ("Y_1", "Y_2", "Y_3", "Y_5", "Y_6")}
    system = f.model_copy(update=grown)
    return crane.model_copy(update={"friction": crane.friction.model_copy(update={"system": system})})


def demonstrate(crane: Crane, duration: float, watch: Callable[[Moment], None]) -> Outcome:
    """Run a soft PLC with its crane in this process, and the twin parallel to it, for a duration [s].

    The soft PLC steps a winch of its own at the PLC's cycle. The twin gets the tip's motion from it, and nothing else.
    From a third of the duration on, the crane that the PLC drives has more friction than the twin's file says.
    """
    case = Scenario(**SCENARIO)
    cranes = {"as filed": Session(crane, case), "grown": Session(with_friction(crane, GROWN), case)}
    window = min(WINDOW, SHARE * duration)
    deviations = Deviations({**LIMITS, "p_a": LIMIT_P, "p_b": LIMIT_P}, window=window, every=EVERY)
    alarms: dict[str, float] = {}
    false_alarms = plc_late = 0
    with LiveTwin(Task(crane, case)) as twin:
        cycle = cranes["as filed"].cycle
        deadlines, n, seen, changed = Deadlines(cycle), 0, 0, float("nan")
        per_sample = round(EVERY / cycle)
        while n * cycle < duration:
            plc_late += deadlines.wait(n) > cycle
            for session in cranes.values():
                session.step()
            grown = n * cycle >= CHANGE * duration
            plc = cranes["grown" if grown else "as filed"]
            if grown and changed != changed:
                changed = n * cycle
                twin.tell(
                    event("plc", "friction", f"The crane's system friction is {GROWN:g} times the file's.", GROWN)
                )
            twin.write({name: plc.get(name) for name in MOTION}, "plc", time.time())
            if n % per_sample == 0 and (row := twin.latest()) is not None:
                twin.pump()
                now = deviations.add({name: plc.get(name) for name in COMPARED}, row.values)
                for d in now:
                    if d.alarm and d.name not in alarms:
                        alarms[d.name] = n * cycle
                        false_alarms += not grown
                        rms, limit = shown(d.name, d.rms), shown(d.name, d.limit)
                        text = f"{d.name} deviates by {rms} (rms over {window:.3g} s), limit {limit}."
                        twin.tell(event("twin", "alarm", text, d.rms))
                    elif not d.alarm and not grown:
                        alarms.pop(d.name, None)
                watch(Moment(n * cycle, row.values, now, twin.events[seen:]))
                seen = len(twin.events)
            n += 1
        last = twin.latest()
        scheduling = twin.face.scheduling
    values = {} if last is None else last.values
    late, overrun = int(values.get("late_cycles", 0)), int(values.get("overrun_cycles", 0))
    first = min((t for t in alarms.values() if t >= changed), default=float("nan"))
    return Outcome(changed, first, false_alarms, late, overrun, plc_late, scheduling)
