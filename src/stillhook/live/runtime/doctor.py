"""How late this machine wakes a twin, measured before anyone trusts it."""

from __future__ import annotations

import math
import os
import platform
import time
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.engine.arguments import SERIES_STEP
from stillhook.engine.session import Session
from stillhook.engine.simulate import simulate
from stillhook.errors import LiveError
from stillhook.live.runtime.causes import STEAL, Cause
from stillhook.live.runtime.kernel import LATE, Task
from stillhook.live.runtime.twin import LiveTwin
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario

ALLOWED_P999, ALLOWED_WORST = LATE, 10.0e-3
"""Lateness that a machine may show: 99.9 % of the cycles, and the worst of them [s]."""
SHORT, LONG = 20.0, 80.0
"""Two runs whose difference is the machine code's time of a cycle [s]."""
FEWEST = 1000
"""Cycles from which one in a thousand is a cycle at all."""


OTHER_MACHINE = "Use a physical machine, or a host that gives this one processors of its own."
ADVICE = {
    Cause.HOST: OTHER_MACHINE,
    Cause.TIMER: OTHER_MACHINE,
    Cause.PROCESSOR: "Stop other processes of the real-time class, or raise the limit of its group (container).",
    Cause.PAGES: "Allow it to hold its memory: CAP_IPC_LOCK, or a memlock of unlimited.",
}
"""What to do about what delays most cycles."""


class Lateness(NamedTuple):
    """Lateness of cycles and what they cost [s].

    real_time: whether in the real-time class; scheduling: one sentence; cycles: how many; p50, p99, p999, worst: of the
    time from deadline to begin; cost_p50, cost_p99: from begin to the complete row; late, overrun, missed: counts of
    the runtime; lost: cycles that were not measured; causes: how many were late because of what, by names of `Cause`.
    """

    real_time: bool
    scheduling: str
    cycles: int
    p50: float
    p99: float
    p999: float
    worst: float
    cost_p50: float
    cost_p99: float
    late: int
    overrun: int
    missed: int
    lost: int
    causes: Mapping[str, int] = {}

    @property
    def good(self) -> bool:
        """Whether it is within what is allowed."""
        return self.p999 <= ALLOWED_P999 and self.worst <= ALLOWED_WORST and not self.missed


class Diagnosis(NamedTuple):
    """What the doctor found.

    measured: with the real-time class first, where it is allowed; kernel, session: cost of a cycle in machine code, and
    of `Session.step` around it, both without a clock and in the ordinary class [s]; cycle [s]; processors; load:
    processes that wanted to run in the last minute; stolen: time per processor that the host of a virtual machine took
    during the measurements, over theirs, NaN where the system does not say; system: its name; throttled: time for
    which the limit of a group of processes held this one's group up meanwhile, NaN likewise [s].
    """

    measured: tuple[Lateness, ...]
    kernel: float
    session: float
    cycle: float
    processors: int
    load: float
    stolen: float
    system: str
    throttled: float = math.nan

    @property
    def judged(self) -> Lateness:
        """The class that a twin would run in."""
        return self.measured[0]

    @property
    def good(self) -> bool:
        """Whether a twin may be trusted to keep time here."""
        return self.judged.good

    @property
    def reason(self) -> str:
        """The verdict in one sentence."""
        x = self.judged
        measured = (
            f"99.9 % of {x.cycles} cycles begin within {1e3 * x.p999:.2f} ms, the worst after {1e3 * x.worst:.2f} ms"
        )
        allowed = f"allowed are {1e3 * ALLOWED_P999:g} and {1e3 * ALLOWED_WORST:g} ms"
        if self.good:
            return f"This machine keeps time: {measured}; {allowed}."
        advice = "Stop what else runs on it, or use a machine with a real-time kernel."
        if not x.real_time:
            advice = "Allow the real-time class first."
        elif x.causes:
            advice = ADVICE.get(Cause[max(x.causes, key=lambda name: x.causes[name]).upper()], advice)
        return f"This machine does not keep time: {measured}; {allowed}. {advice}"


def diagnose(
    crane: Crane, scenario: Scenario, duration: float, *, tell: Callable[[str], None] = lambda line: None
) -> Diagnosis:
    """Run a twin for a duration [s] in the real-time class and again without it; tell: receives what is being done.

    Errors: LiveError for a duration in which there are too few cycles for one in a thousand.
    """
    cycle = crane.control.t_cycle
    if duration < FEWEST * cycle:
        raise LiveError(
            f"--duration {duration:g} s: {duration / cycle:.0f} cycles, of which none is one in a thousand. Give"
            f" {FEWEST * cycle:g} s or more."
        )
    tell("Cost of a cycle.")
    kernel, session = kernel_cost(crane, scenario), session_cost(crane, scenario)
    measured = []
    taken, held, begun = stolen_time(), throttled_time(), time.monotonic()
    for real_time in (True, False):
        tell(f"{duration:g} s {'in the real-time class' if real_time else 'without it'}.")
        one = measure(Task(crane, scenario, real_time=real_time), duration)
        measured.append(one)
    if not measured[0].real_time:
        measured = measured[:1]
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    processors = os.cpu_count() or 1
    stolen = (stolen_time() - taken) / processors / (time.monotonic() - begun)
    system = f"{platform.system()} {platform.release()}"
    throttled = throttled_time() - held
    return Diagnosis(tuple(measured), kernel, session, cycle, processors, load, stolen, system, throttled)


def stolen_time() -> float:
    """Time that the host of a virtual machine took from its processors since the start [s]; NaN where the system does
    not say."""
    try:
        fields = Path("/proc/stat").read_text(encoding="ascii").split("\n", 1)[0].split()
        return int(fields[STEAL]) / os.sysconf("SC_CLK_TCK")
    except (OSError, ValueError, IndexError, AttributeError):
        return math.nan


def throttled_time(root: Path = Path("/")) -> float:
    """Time for which the limit of a group (cgroup, that of a container) held this process's group up [s]; NaN where the
    system does not say."""
    try:
        lines = (root / "proc/self/cgroup").read_text(encoding="utf-8").splitlines()
        group = {name: path for _, names, path in (line.split(":", 2) for line in lines) for name in names.split(",")}
        first, name, unit = ("", "throttled_usec", 1.0e-6) if "cpu" not in group else ("cpu", "throttled_time", 1.0e-9)
        file = root / "sys/fs/cgroup" / first / group[first].lstrip("/") / "cpu.stat"
        counts = dict(line.split() for line in file.read_text(encoding="ascii").splitlines())
        return unit * int(counts[name])
    except (OSError, ValueError, KeyError):
        return math.nan


def measure(task: Task, duration: float) -> Lateness:
    """Run a twin for a duration [s] and read every row of it."""
    lateness, cost, cause = _Column("lateness"), _Column("cost"), _Column("late_cause")
    with LiveTwin(task, (lateness, cost, cause)) as twin:
        twin.wait_for_end(duration)
        scheduling, last = twin.face, twin.latest()
    late, costs = lateness.values(), cost.values()
    if last is None or not len(late):
        raise LiveError("Live twin: no cycle was calculated. Start it again.")
    p50, p99, p999 = np.quantile(late, (0.5, 0.99, 0.999)).tolist()
    cost_p50, cost_p99 = np.quantile(costs, (0.5, 0.99)).tolist()
    overrun, missed = int(last.values["overrun_cycles"]), int(last.values["missed_cycles"])
    spread = (p50, p99, p999, float(late.max()), cost_p50, cost_p99)
    counts = int(last.values["late_cycles"]), overrun, missed, twin.lost_rows
    causes = Counter(Cause(int(each)).name.lower() for each in cause.values() if each)
    return Lateness(scheduling.real_time, scheduling.scheduling, len(late), *spread, *counts, dict(causes))


def kernel_cost(crane: Crane, scenario: Scenario) -> float:
    """Machine code of a cycle [s]: two runs of different length, the quicker of two tries each."""

    def quickest(duration: float) -> float:
        case = scenario.model_copy(update={"duration": duration, "warm_up": 0.0})
        times = []
        for _ in range(2):
            begun = time.perf_counter()
            simulate(crane, case, step=f"{SERIES_STEP!r} s")
            times.append(time.perf_counter() - begun)
        return min(times)

    quickest(SHORT)
    return max(0.0, quickest(LONG) - quickest(SHORT)) / ((LONG - SHORT) / crane.control.t_cycle)


def session_cost(crane: Crane, scenario: Scenario) -> float:
    """A cycle of `Session.step` [s]: median."""
    session, times = Session(crane, scenario), []
    for _ in range(FEWEST):
        begun = time.perf_counter()
        session.step()
        times.append(time.perf_counter() - begun)
    return float(np.median(times))


class _Column:
    """A sink that keeps one number of every row."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._parts: list[float] = []

    def rows(self, first: int, names: object, rows: object) -> None:
        at = list(names).index(self._name)  # type: ignore[call-overload]
        self._parts += [float(row[at]) for row in rows]  # type: ignore[attr-defined]

    def event(self, happened: object) -> None:
        """Not kept."""

    def close(self) -> None:
        """Nothing to close."""

    def values(self) -> FloatArray:
        return np.array(self._parts)
