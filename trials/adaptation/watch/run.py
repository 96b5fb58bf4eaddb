"""The watch on logs of an independent crane, kept in outcomes.json, which the page is made from.

    python -m trials.adaptation.watch.run             run what is not in the file yet, two at a time
    python -m trials.adaptation.watch.run --new       run also what was computed by other code
    python -m trials.adaptation.watch.run coverage    run this group alone (a fault's name is a group, too)

It may be stopped at any time: what is done is in the file. Then `python docs/validation/make.py watch` writes the page.
Seeds from JUDGED on were not looked at while signs, bands, patterns and intervals were written; those below were.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stillhook.library import load_crane
from stillhook.live.watch.virtual import VirtualSensors
from stillhook.live.watch.watch import Watch, Watched
from stillhook.live.watch.windows.criteria import CriteriaWatch
from stillhook.live.watch.windows.measures import names_of
from stillhook.live.watch.windows.rows import RowBuffer
from trials import store
from trials.adaptation.crane import CRANE_FILE
from trials.adaptation.watch.faults import EVERY, FAULTS, Logs, logs_of

STORE = Path(__file__).resolve().parent / "outcomes.json"
JUDGED, FAULTS_FROM = 5000, 6000
"""First seeds that are judged: of intervals and virtual sensors; of faults, whose signs and patterns were changed by
what seeds from 5000 to 5010 showed."""
RUNS, SOUND, HARMLESS = 16, 40, 12
"""Runs of each fault; without one; and of those that no sign shows."""
SETTLE = 10.0
"""Begin of a run that is not watched [s], as in a replay."""
SOUND_FAULTS = ("none", "other-law")
COVERAGE, HOUR, VIRTUAL = "coverage", "coverage-hour", "virtual"
LONG = 3700.0
"""Length of a run that fills the window of an hour [s]."""


class Trial(NamedTuple):
    """Coverage of some windows: cranes; length of a run [s]; further runs of each crane, in other seas of the same
    height and period, whose mean is the truth."""

    windows: tuple[str, ...]
    cranes: int
    duration: float
    further: int


COVERAGES: Mapping[str, Trial] = {
    COVERAGE: Trial(("30 s", "5 min"), 100, 400.0, 4),
    HOUR: Trial(("1 h",), 30, LONG, 2),
}


class Case(NamedTuple):
    """One run of a fault, or one crane of the trials of intervals and virtual sensors."""

    group: str
    seed: int

    @property
    def key(self) -> str:
        return f"{self.group}/{self.seed}"


COUNTS = {name: RUNS if fault.cause else HARMLESS for name, fault in FAULTS.items()} | dict.fromkeys(
    SOUND_FAULTS, SOUND
)
COUNTS |= {group: trial.cranes for group, trial in COVERAGES.items()} | {VIRTUAL: 40}
CASES: Mapping[str, Case] = {  # seed by seed, so that all groups grow alike
    case.key: case
    for i in range(max(COUNTS.values()))
    for group, count in COUNTS.items()
    if i < count
    for case in [Case(group, (FAULTS_FROM if group in FAULTS else JUDGED) + i)]
}


def watched(logs: Logs) -> tuple[Watch, list[Watched]]:
    """The watch at the end of a log, and what it found on the way."""
    watch, found = Watch(load_crane(CRANE_FILE), every=EVERY), []
    for i in range(round(SETTLE / EVERY), len(logs.twin["time"])):
        crane, twin = ({name: x[i] for name, x in side.items()} for side in (logs.crane, logs.twin))
        now = watch.add(crane, twin)
        if now is not None:
            found.append(now)
    return watch, found


def outcome(case: Case) -> dict[str, Any]:
    """What the watch makes of it: at the end, and how many times on the way it named a cause or failed a criterion."""
    if case.group in COVERAGES:
        return covered(case)
    if case.group == VIRTUAL:
        return virtual(case)
    logs = logs_of(FAULTS[case.group], case.seed)
    _, found = watched(logs)
    last = found[-1]
    return {
        "candidates": list(last.diagnosis.candidates),
        "signs": [s.name + s.state for s in last.diagnosis.evidence],
        "window": last.diagnosis.window,
        "failed": sorted({r.key for r in last.failed}),
        "ever_failed": sorted({r.key for w in found for r in w.failed}),
        "ever_named": sorted({c for w in found for c in w.diagnosis.candidates}),
        "clock": [round(last.clock - logs.clock, 5), round(last.clock_half, 5)] if last.clock == last.clock else None,
    }


def without_errors(logs: Logs) -> CriteriaWatch:
    """The same sums where sensors and clock have no error, so that nothing is looked for."""
    crane = load_crane(CRANE_FILE)
    rows, criteria = RowBuffer(names_of(crane), EVERY), CriteriaWatch(crane)
    for i in range(round(SETTLE / EVERY), len(logs.twin["time"])):
        if rows.add(*({name: x[i] for name, x in side.items()} for side in (logs.crane, logs.twin))):
            criteria.add(rows.piece(0.0))
    return criteria


def covered(case: Case) -> dict[str, Any]:
    """Of every statistic, by window: error against the mean of further runs with sensors without error; half width that
    rows show, made wider for the finite number of these runs; and what is added to it where it is printed."""
    of, fault = COVERAGES[case.group], FAULTS["none"]
    watch, _ = watched(logs_of(fault, case.seed, 0, of.duration))
    seas = range(1, of.further + 1)
    truth = [without_errors(logs_of(fault, case.seed, k, of.duration, perfect=True)) for k in seas]
    out: dict[str, Any] = {}
    for window in of.windows:
        for key in watch.criteria.measures.statistics:
            e, true = (w.estimate(key, window) for w in (watch.criteria, truth[0]))
            if e is None or true is None or not e.half < np.inf:
                continue
            mean = float(np.mean([t.estimate(key, window).value for t in truth]))  # type: ignore[union-attr]
            more = watch.criteria.structural(key.partition("/")[0], window)
            numbers = (e.value - mean, e.half * np.sqrt(1.0 + 1.0 / of.further), more)
            if np.isfinite(numbers).all():
                out.setdefault(window, {})[key] = [float(f"{x:.3g}") for x in numbers]
    return out


def virtual(case: Case) -> dict[str, Any]:
    """Of every virtual sensor: share of the time in which the crane's own value is within the 95 %, bias, root mean
    square error, median half width, and root mean square of the value itself."""
    sensors, logs = VirtualSensors(load_crane(CRANE_FILE), every=EVERY), logs_of(FAULTS["none"], case.seed)
    read: dict[str, list[tuple[float, float, float]]] = {}
    for i in range(round(SETTLE / EVERY), len(logs.twin["time"])):
        m, s = ({n: x[i] for n, x in side.items()} for side in (logs.crane, logs.twin))
        sensors.add(m, s)
        for r in sensors.read(s):
            if r.valid and r.name in logs.truth:
                read.setdefault(r.name, []).append((r.value, r.half, logs.truth[r.name][i]))
    out = {}
    for name, rows in read.items():
        value, half, true = np.array(rows).T
        off = value - true
        numbers = (np.mean(np.abs(off) <= half), off.mean(), np.sqrt(np.mean(off**2)), np.median(half))
        out[name] = [float(f"{x:.3g}") for x in (*numbers, np.sqrt(np.mean(true**2)))]
    return out


def kept() -> dict[str, Any]:
    """Outcomes by key, each with the code that it was computed by."""
    return store.read(STORE)


def code() -> str:
    """The code that computes: watch and crane."""
    root = STORE.parents[3]
    of = root / "src/stillhook/live/watch"
    names = ("causes/diagnosis.py", "causes/causes.toml", "watch.py", "virtual.py", "virtual.toml")
    files = [f for f in (*sorted((of / "windows").iterdir()), *(of / name for name in names)) if f.is_file()]
    files += [STORE.with_name("faults.py"), root / "trials/adaptation/plant.py"]
    return sha256(b"".join(f.read_bytes() for f in files)).hexdigest()[:16]


if __name__ == "__main__":
    store.run(STORE, CASES, outcome, code(), sys.argv[1:], group=lambda key: key.partition("/")[0])
