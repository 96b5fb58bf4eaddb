"""The friction estimator on the logs of the adaptation trial, kept in outcomes.json, which the page is made from.

    python -m trials.adaptation.run              run what is not in the file yet, in a single process
    python -m trials.adaptation.run --new        run also what was computed by other code
    python -m trials.adaptation.run file-step    run this group alone (several may be named)

It may be stopped at any time: what is done is in the file. Then `python docs/validation/make.py adaptation` writes the
page. Seeds from JUDGED on were not looked at while the estimator was written; those below were.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stillhook.library import load_crane
from stillhook.live.estimate import FrictionEstimator, FrictionState, follow_friction
from stillhook.live.estimate.balance import Balance
from stillhook.live.estimate.half_waves import AFTER, BEFORE, MOVING
from trials import store
from trials.adaptation.crane import CRANE_FILE, Run, Trial, simulate
from trials.adaptation.plant import FILE_FORM, OTHER_FORM
from trials.independent_crane.sea_trial import CYCLE

STORE = Path(__file__).resolve().parent / "outcomes.json"
JUDGED = 1000
"""First seed that the estimator is judged on."""
AGAIN = 1200
"""The same of two groups whose first outcomes led to a change of the estimator."""
RUNS, FEWER, QUIETS = 100, 15, 24
"""Runs with a step, the same with fewer signals, and runs without a step."""
QUIET_HOURS = 2.0
"""Length of a run without a step [h]."""
EVERY = 5.0
"""Time between two states that are looked at [s]."""
BEFORE_STEP, SOON, LATE = -2.0, 120.0, 400.0
"""Moments of a judgement, from the step [s]."""


class Group(NamedTuple):
    """Runs that differ by their seed alone. text for the page; left_out: signals that the estimator does not get; first
    seed."""

    text: str
    runs: int
    form: float = FILE_FORM
    step: bool = True
    left_out: tuple[str, ...] = ()
    first: int = JUDGED


GROUPS: Mapping[str, Group] = {
    "file-step": Group("law of the crane file's form", RUNS),
    "other-step": Group("law of another form", RUNS, OTHER_FORM),
    "quiet": Group("no step", QUIETS, step=False),
    "no-pump-reading": Group("pumps' setting not read (command alone)", FEWER, left_out=("alpha_p",)),
    "no-motor-speed": Group("motor speed not logged (wire counter alone)", FEWER, left_out=("omega_m",), first=AGAIN),
    "no-clock": Group(
        "neither setting nor command of the pumps: clock not found", FEWER, left_out=("alpha_p", "u_p"), first=AGAIN
    ),
}


class Case(NamedTuple):
    """One run of a group."""

    group: str
    seed: int

    @property
    def key(self) -> str:
        return f"{self.group}/{self.seed}"


CASES: Mapping[str, Case] = {
    case.key: case
    for name, group in GROUPS.items()
    for i in range(group.runs)
    for case in [Case(name, group.first + i)]
}


def trial_of(case: Case) -> Trial:
    """Its run of the crane; quiet ones have seeds of their own."""
    group = GROUPS[case.group]
    if group.step:
        return Trial(case.seed, group.form)
    return Trial(case.seed + RUNS, group.form, step=0.0, before=QUIET_HOURS * 3600.0, after=0.0)


def true_scales(run: Run, start: float, end: float, balance: Balance) -> tuple[float, float]:
    """All true losses over the crane file's at the true states, and the factor on the file's system friction that makes
    them up with the file's motor loss; over the moments between start and end [s] that a perfect cut keeps."""
    part = slice(round(start / CYCLE), round(end / CYCLE))
    x = {name: values[part] for name, values in run.truth.items()}
    omega = x["omega_m"]
    use = np.abs(omega) > MOVING
    for i in np.flatnonzero(np.diff(np.sign(omega)) != 0.0):
        use[max(0, i - round(BEFORE / CYCLE)) : i + round(AFTER / CYCLE) + 1] = False
    s = balance.samples(x, omega, balance.geometry(float(x["s_w"].mean())))
    sign = np.sign(omega)
    true, system, motors = (float(np.sum((sign * y)[use])) for y in (x["T_loss"], s.system, s.motors))
    return true / (system + motors), (true - motors) / system


def judged(state: FrictionState, run: Run, balance: Balance, since: float) -> dict[str, float] | None:
    """An estimate against the truth of its window, in parts of the truth; None where there is none."""
    found = state.estimate
    if found is None:
        return None
    loss, system = true_scales(run, max(found.start, since), found.end, balance)
    return {
        "loss": round(found.loss.value / loss - 1.0, 6),
        "loss_half": round(found.loss.half / loss, 6),
        "system": round(found.system.value / system - 1.0, 6),
        "system_half": round(found.system.half / system, 6),
        "clock": round(found.clock.offset - run.clock, 6),
        "structural": round(found.structural, 6),
        "random": round(found.random, 6),
    }


def outcome(case: Case) -> dict[str, Any]:
    """What the estimator makes of a run."""
    group, crane = GROUPS[case.group], load_crane(CRANE_FILE)
    run, balance = simulate(trial_of(case)), Balance(crane)
    rows = {name: x for name, x in run.rows.items() if name not in group.left_out}
    states = follow_friction(FrictionEstimator(crane), rows, EVERY)
    alarms = [
        [round(a.t - run.t_step, 1), round(a.onset - run.t_step, 1), round(a.rise.value, 4), round(a.rise.half, 4)]
        for a in states[-1].alarms
    ]
    conditions = {name: round(float(x), 4) for name, x in run.conditions.items()}
    if not group.step:
        errors = [judged(s, run, balance, 0.0) for s in states[:: round(600.0 / EVERY)]]
        hours = round(run.rows["time"][-1] / 3600.0, 2)
        known = [[e["loss"], e["loss_half"]] for e in errors if e is not None]
        return {"hours": hours, "alarms": [a[0] + run.t_step for a in alarms], "errors": known, **conditions}
    moments = {}
    anew = any(a[0] > 0.0 for a in alarms)  # else the window goes on across the step
    for name, at in (("before", BEFORE_STEP), ("soon", SOON), ("late", LATE)):
        state = next(s for s in reversed(states) if s.t <= run.t_step + at)
        moments[name] = judged(state, run, balance, run.t_step if anew and at > 0.0 else 0.0)
    whole = true_scales(run, run.t_step + 5.0, run.t_step + LATE, balance)[0]
    before = true_scales(run, run.t_step - LATE + 30.0, run.t_step - 5.0, balance)[0]
    return {**moments, "alarms": alarms, "rise": round(whole / before - 1.0, 4), **conditions}


def kept() -> dict[str, Any]:
    """Outcomes by key, each with the code that it was computed by."""
    return store.read(STORE)


def code() -> str:
    """The code that computes: twin, estimator and crane."""
    here, root = STORE.parent, STORE.parents[2]
    files = [
        *sorted((root / "src/stillhook/live/estimate").glob("*.py")),
        *(here / f"{n}.py" for n in ("crane", "plant")),
    ]
    files += [root / "trials/independent_crane" / f"{n}.py" for n in ("crane", "plant", "plc", "sea_trial")]
    return sha256(b"".join(f.read_bytes() for f in files)).hexdigest()[:16]


if __name__ == "__main__":
    store.run(STORE, CASES, outcome, code(), sys.argv[1:], group=lambda key: key.partition("/")[0], workers=1)
