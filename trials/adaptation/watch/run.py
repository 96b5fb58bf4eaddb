"""The watch on logs of an independent crane, kept in outcomes.json, which the page is made from.

    python -m trials.adaptation.watch.run             run what is not in the file yet, in a single process
    python -m trials.adaptation.watch.run --new       run also what was computed by other code
    python -m trials.adaptation.watch.run coverage    run this group alone (a fault's name is a group, too)

It may be stopped at any time: what is done is in the file. Then `python docs/validation/make.py watch` writes the page.
Seeds from JUDGED on were not looked at while signs, bands and patterns were written; those below were.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

from stillhook.library import load_crane
from stillhook.live.watch.watch import Watch, Watched
from trials import store
from trials.adaptation.crane import CRANE_FILE
from trials.adaptation.watch.faults import EVERY, FAULTS, Logs, logs_of

STORE = Path(__file__).resolve().parent / "outcomes.json"
JUDGED = 1000
"""First seed that is judged."""
RUNS, SOUND = 8, 24
"""Runs of each fault, and without one."""
CRANES, REPEATS = 8, 5
"""Cranes of the coverage trial, and repeats of sea and noise on each."""
SETTLE = 10.0
"""Begin of a run that is not watched [s], as in a replay."""
SOUND_FAULTS = ("none", "other-law")
COVERAGE = "coverage"
WINDOWS = ("30 s", "5 min")


class Case(NamedTuple):
    """One run of a fault, or all repeats of a crane of the coverage trial."""

    group: str
    seed: int

    @property
    def key(self) -> str:
        return f"{self.group}/{self.seed}"


CASES: Mapping[str, Case] = {  # seed by seed, so that all groups grow alike
    case.key: case
    for i in range(SOUND)
    for name in (*FAULTS, COVERAGE)
    if i < (CRANES if name == COVERAGE else SOUND if name in SOUND_FAULTS else RUNS)
    for case in [Case(name, JUDGED + i)]
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
    if case.group == COVERAGE:
        return covered(case)
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
        "clock_error": round(last.clock - logs.clock, 5) if last.clock == last.clock else None,
    }


def covered(case: Case) -> dict[str, Any]:
    """Value and half width of every statistic, by window, in each repeat."""
    out: dict[str, Any] = {window: {} for window in WINDOWS}
    for repeat in range(REPEATS):
        watch, _ = watched(logs_of(FAULTS["none"], case.seed, repeat))
        for window in WINDOWS:
            for key in watch.criteria.measures.statistics:
                e = watch.criteria.estimate(key, window)
                if e is not None and e.half == e.half:
                    out[window].setdefault(key, []).append([e.value, e.low, e.high])
    return {window: {k: v for k, v in of.items() if len(v) == REPEATS} for window, of in out.items()}


def kept() -> dict[str, Any]:
    """Outcomes by key, each with the code that it was computed by."""
    return store.read(STORE)


def code() -> str:
    """The code that computes: watch and crane."""
    root = STORE.parents[3]
    of = root / "src/stillhook/live/watch"
    files = [
        *sorted((of / "windows").iterdir()),
        of / "causes/diagnosis.py",
        of / "causes/causes.toml",
        of / "watch.py",
    ]
    files = [f for f in files if f.is_file()] + [STORE.with_name("faults.py"), root / "trials/adaptation/plant.py"]
    return sha256(b"".join(f.read_bytes() for f in files)).hexdigest()[:16]


if __name__ == "__main__":
    store.run(STORE, CASES, outcome, code(), sys.argv[1:], group=lambda key: key.partition("/")[0], workers=1)
