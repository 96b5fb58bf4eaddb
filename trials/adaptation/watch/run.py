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

import numpy as np

from stillhook.library import load_crane
from stillhook.live.estimate.balance import Balance
from stillhook.live.watch.virtual import VirtualSensor, VirtualSensors
from stillhook.live.watch.watch import Watch, Watched
from trials import store
from trials.adaptation.crane import CRANE_FILE
from trials.adaptation.watch.faults import EVERY, FAULTS, Logs, logs_of

STORE = Path(__file__).resolve().parent / "outcomes.json"
JUDGED, AGAIN, SOUND_FROM = 1000, 2000, 3000
"""First seeds that are judged: of faults; of intervals and hidden signals, and of runs without a
fault, both run again after changes that their first outcomes led to: nothing
is judged before the clock is known, 2b has no interval over 30 s, and 6-piston is not judged."""
RUNS, SOUND, HARMLESS = 8, 8, 4
"""Runs of each fault; without one; and of those that no sign shows."""
CRANES, REPEATS = 6, 5
"""Cranes of the coverage trial, and repeats of sea and noise on each."""
SETTLE = 10.0
"""Begin of a run that is not watched [s], as in a replay."""
SOUND_FAULTS = ("none", "other-law")
COVERAGE, HIDDEN = "coverage", "hidden"
HIDE = {
    "p_a": VirtualSensor("p_a", "pressure", "p_a", "p_b", ("p_b",), ""),
    "p_b": VirtualSensor("p_b", "pressure", "p_b", "p_a", ("p_a",), ""),
    "F_w": VirtualSensor("F_w", "force", "F_w", "wire", ("p_hp", "alpha_pm"), ""),
    "alpha_p": VirtualSensor("alpha_p", "", "alpha_p", "u_p", ("u_p",), ""),
    "omega_m": VirtualSensor("omega_m", "rotation", "omega_m", "turns", ("u_p",), ""),
}
"""Signals that are left out, and the virtual sensor that gives each: from the signals beside it."""
WINDOWS = ("30 s", "5 min")


class Case(NamedTuple):
    """One run of a fault, or all repeats of a crane of the coverage trial."""

    group: str
    seed: int

    @property
    def key(self) -> str:
        return f"{self.group}/{self.seed}"


HARMLESS_FAULTS = tuple(name for name, fault in FAULTS.items() if not fault.cause and name not in SOUND_FAULTS)
RUN_AGAIN = (COVERAGE, HIDDEN, *SOUND_FAULTS, *HARMLESS_FAULTS)
COUNTS = dict.fromkeys(FAULTS, RUNS) | dict.fromkeys(SOUND_FAULTS, SOUND) | dict.fromkeys(HARMLESS_FAULTS, HARMLESS)
COUNTS |= {COVERAGE: CRANES, HIDDEN: CRANES}
CASES: Mapping[str, Case] = {  # seed by seed, so that all groups grow alike
    case.key: case
    for groups in (RUN_AGAIN, tuple(name for name in FAULTS if name not in RUN_AGAIN))
    for i in range(max(COUNTS.values()))
    for name in groups
    if i < COUNTS[name]
    for case in [Case(name, (AGAIN if name in (COVERAGE, HIDDEN) else SOUND_FROM if name in RUN_AGAIN else JUDGED) + i)]
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
    if case.group in (COVERAGE, HIDDEN):
        return covered(case) if case.group == COVERAGE else hidden(case)
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


def hidden(case: Case) -> dict[str, Any]:
    """Share of the time in which a signal that was left out is within the 95 % of the virtual sensor that gives it, and
    the median half width over the rms of the signal."""
    crane, logs = load_crane(CRANE_FILE), logs_of(FAULTS["none"], case.seed)
    params = Balance(crane).params
    P, D = params.passive, params.passive.motors.count * params.passive.motors.D_max
    r_eff = Balance(crane).geometry(float(logs.twin["s_w"][0])).r_eff
    full = (
        params.active.pumps.D_max
        * params.active.pumps.omega_p
        / (params.active.motors.count * params.active.motors.D_max)
    )
    more = {
        "wire": lambda x: D * x["alpha_pm"] * (x["p_hp"] - P.settings.p_lp) / r_eff,
        "turns": lambda x: full * x["u_p"] / x["alpha_m"],
    }
    out = {}
    t, offset = logs.twin["time"], logs.clock  # what the encoder shows late is not what the twin is to give
    for name in ("omega_m", "s_w"):
        logs.crane[name] = np.interp(t + offset, t, logs.crane[name])
    for name, sensor in HIDE.items():
        virtual, inside, halves = VirtualSensors(crane, every=EVERY, sensors=(sensor,), formulas=more), [], []
        for i in range(round(SETTLE / EVERY), len(logs.twin["time"])):
            m, s = ({n: x[i] for n, x in side.items()} for side in (logs.crane, logs.twin))
            virtual.add({n: x for n, x in m.items() if n != name}, s)
            (now,) = virtual.read(s)
            if now.valid:
                inside.append(abs(m[name] - now.value) <= now.half)
                halves.append(now.half)
        size = float(np.sqrt(np.mean(logs.crane[name] ** 2)))
        out[name] = [round(float(np.mean(inside)), 4), round(float(np.median(halves)) / size, 4)]
    return out


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
