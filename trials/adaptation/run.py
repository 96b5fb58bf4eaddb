"""The friction estimator on the logs of the adaptation trial, kept in outcomes.json, which the page is made from.

    python -m trials.adaptation.run              run what is not in the file yet, in a single process
    python -m trials.adaptation.run --new        run also what was computed by other code
    python -m trials.adaptation.run file-step    run this group alone (several may be named)

It may be stopped at any time: what is done is in the file. Then `python docs/validation/make.py adaptation` writes the
page. Seeds from JUDGED on were not looked at while the estimator was written; those below were.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.library import load_crane
from stillhook.live.estimate import FrictionEstimator, FrictionState, follow_friction
from stillhook.live.estimate.balance import Balance
from stillhook.live.estimate.half_waves import AFTER, BEFORE, MOVING, SHORTEST, SLOWER, reversals
from stillhook.physics.hydraulics.lines import external_leakage, internal_leakage
from stillhook.physics.hydraulics.motor import motor_leakage
from stillhook.physics.hydraulics.pump import LEAK_KNOTS
from trials import store
from trials.adaptation.crane import CRANE_FILE, FAULTS, Run, Trial, simulate
from trials.adaptation.plant import FILE_FORM, OTHER_FORM
from trials.independent_crane.sea_trial import CYCLE

STORE = Path(__file__).resolve().parent / "outcomes.json"
JUDGED = 2000
"""First seed that the estimator is judged on."""
AGAIN = 6000
"""The same of faults, whose first outcomes led to a change of the gas balance, and the next to laws of the leakage that
are fitted."""
RUNS, FEWER, QUIETS = 100, 15, 24
"""Runs with a step or faults, the same with fewer signals, and runs without a step."""
QUIET_HOURS = 2.0
"""Length of a run without a step [h]."""
EVERY, EVERY_QUIET = 10.0, 20.0
"""Time between two states that are looked at [s]."""
LATE_FAULT = 300.0
"""Last moment of a judgement of a fault, from it [s]."""
BEFORE_STEP, SOON, LATE = -2.0, 120.0, 400.0
"""Moments of a judgement, from the step [s]."""


class Group(NamedTuple):
    """Runs that differ by their seed alone. text for the page; left_out: signals that the estimator does not get;
    first seed."""

    text: str
    runs: int
    form: float = FILE_FORM
    step: bool = True
    faults: bool = False
    left_out: tuple[str, ...] = ()
    first: int = JUDGED


GROUPS: Mapping[str, Group] = {
    "file-step": Group("law of the crane file's form", RUNS),
    "other-step": Group("law of another form", RUNS, OTHER_FORM),
    "file-faults": Group("faults; laws of the crane file's form", RUNS, step=False, faults=True, first=AGAIN),
    "other-faults": Group("faults; laws of another form", RUNS, OTHER_FORM, step=False, faults=True, first=AGAIN),
    "quiet": Group("no step", QUIETS, step=False),
    "no-pump-reading": Group("pumps' setting not read (command alone)", FEWER, left_out=("alpha_p",)),
    "no-motor-speed": Group("motor speed not logged (wire counter alone)", FEWER, left_out=("omega_m",)),
    "no-clock": Group("neither setting nor command of the pumps: clock not found", FEWER, left_out=("alpha_p", "u_p")),
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
    if group.step or group.faults:
        return Trial(case.seed, group.form, faults=group.faults)
    return Trial(case.seed + RUNS, group.form, step=0.0, before=QUIET_HOURS * 3600.0, after=0.0)


def sliding(omega: FloatArray, *, whole: bool) -> BoolArray:
    """Moments at which a perfect cut finds the winch sliding; whole: of half waves alone that are long and fast enough
    for the estimator."""
    use = np.zeros(len(omega), dtype=bool)
    for first, last in reversals(omega):
        part = np.arange(first + round(AFTER / CYCLE), last - round(BEFORE / CYCLE))
        moving = part[np.abs(omega[part]) > MOVING]
        if not len(moving):
            continue
        one = slice(moving[0], moving[-1] + 1)
        enough = len(omega[one]) >= SHORTEST / CYCLE and np.abs(omega[one]).min() > (1.0 - SLOWER) * MOVING
        if enough or not whole:
            use[moving if not whole else one] = True
    return use


def true_scales(run: Run, start: float, end: float, balance: Balance, *, whole: bool = True) -> tuple[float, float]:
    """All true losses over the crane file's at the true states, and the factor on the file's system friction that makes
    them up with the file's motor loss; over the half waves between start and end [s]."""
    part = slice(round(max(start, 0.0) / CYCLE), round(end / CYCLE))
    x = {name: run.truth[name][part] for name in (*balance.needed, "omega_m", "T_loss")}
    omega = x["omega_m"]
    use, sign = sliding(omega, whole=whole), np.sign(omega)
    s = balance.samples(x, omega, balance.geometry(float(x["s_w"].mean())))
    true, system, motors = (float(np.sum((sign * y)[use])) for y in (x["T_loss"], s.system, s.motors))
    return true / (system + motors), (true - motors) / system


def true_parameter(name: str, run: Run, start: float, end: float, balance: Balance) -> float:
    """A parameter's true mean between two moments [s]; of the leakage the oil that leaks over that of the file's law at
    the true states."""
    part = slice(round(start / CYCLE), round(end / CYCLE))
    x = {n: run.truth[n][part] for n in ("p_a", "p_b", "alpha_p", "omega_m")}
    use = sliding(x["omega_m"], whole=True)
    if name != "leakage":
        return float(run.truth[name.replace("_", " ")][part][use].mean())
    A, dp = balance.params.active, x["p_a"] - x["p_b"]
    C = np.interp(np.abs(x["alpha_p"]), LEAK_KNOTS, A.pumps.leak) + motor_leakage(x["omega_m"], A.motors)
    of_file = internal_leakage(C, dp) + external_leakage(C, np.sign(dp) * np.maximum(x["p_a"], x["p_b"]))
    return float(np.abs(run.truth["leak"][part][use]).sum() / np.abs(of_file[use]).sum())


def judged_parameter(name: str, state: FrictionState, run: Run, balance: Balance, since: float) -> list[float] | None:
    """Error of a parameter and half of its interval, of a factor in parts of the truth; None where there is none."""
    found = state.parameters[name].estimate
    if found is None:
        return None
    truth = true_parameter(name, run, max(found.start - 3.0, since), found.end + 3.0, balance)
    size = truth if name in ("leakage", "gas") else 1.0
    return [round(x / size, 6) for x in (found.value.value - truth, found.value.half, found.value.structural)]


def parameters_outcome(run: Run, states: Sequence[FrictionState], balance: Balance) -> dict[str, Any]:
    """What is made of the parameters before and after the fault of each, and their alarms."""
    out: dict[str, Any] = {}
    for fault, (moment, _) in FAULTS.items():
        name, moments = fault.replace(" ", "_"), {}
        alarms = states[-1].parameters[name].alarms
        anew = any(0.0 < a.t - moment < SOON for a in alarms)
        for when, at in (("before", BEFORE_STEP), ("soon", SOON), ("late", LATE_FAULT)):
            state = next(s for s in reversed(states) if s.t <= moment + at)
            moments[when] = judged_parameter(name, state, run, balance, moment if anew and at > 0.0 else 0.0)
        a, b = (true_parameter(name, run, moment + i, moment + i + 60.0, balance) for i in (-60.0, 0.0))
        rise = b - a if name in ("displacement", "pump_delay") else b / a - 1.0
        rise = FAULTS[fault][1] - 1.0 if name == "leakage" else rise  # at the same states, as that of friction
        listed = [[round(x, 4) for x in (a.t, a.onset, a.rise.value, a.rise.half)] for a in alarms]
        out[name] = {**moments, "rise": round(rise, 5), "alarms": listed}
    return {**out, "friction": [round(a.t, 1) for a in states[-1].alarms]}


def judged(state: FrictionState, run: Run, balance: Balance, since: float) -> dict[str, float] | None:
    """An estimate against the truth of its window, in parts of the truth; None where there is none."""
    found = state.estimate
    if found is None:
        return None
    since = max(found.start - 3.0, since)
    loss, system = true_scales(run, since, found.end + 3.0, balance)
    return {
        "loss": round(found.loss.value / loss - 1.0, 6),
        "loss_all": round(found.loss.value / true_scales(run, since, found.end, balance, whole=False)[0] - 1.0, 6),
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
    states = follow_friction(FrictionEstimator(crane), rows, EVERY if group.step else EVERY_QUIET)
    alarms = [
        [round(a.t - run.t_step, 1), round(a.onset - run.t_step, 1), round(a.rise.value, 4), round(a.rise.half, 4)]
        for a in states[-1].alarms
    ]
    conditions = {name: round(float(x), 4) for name, x in run.conditions.items()}
    if group.faults:
        return {**parameters_outcome(run, states, balance), **conditions}
    others = {n: [round(a.t, 1) for a in p.alarms] for n, p in states[-1].parameters.items() if p.alarms}
    if not group.step:
        errors = [judged(s, run, balance, 0.0) for s in states[:: round(600.0 / EVERY_QUIET)]]
        hours = round(run.rows["time"][-1] / 3600.0, 2)
        known = [[e["loss"], e["loss_half"]] for e in errors if e is not None]
        return {
            "hours": hours,
            "alarms": [a[0] + run.t_step for a in alarms],
            "errors": known,
            "others": others,
            **conditions,
        }
    moments = {}
    anew = any(a[0] > 0.0 for a in alarms)  # else the window goes on across the step
    for name, at in (("before", BEFORE_STEP), ("soon", SOON), ("late", LATE)):
        state = next(s for s in reversed(states) if s.t <= run.t_step + at)
        moments[name] = judged(state, run, balance, run.t_step if anew and at > 0.0 else 0.0)
    part = slice(round((run.t_step + 1.0) / CYCLE), round((run.t_step + 60.0) / CYCLE))
    use, T = sliding(run.truth["omega_m"][part], whole=True), np.abs(run.truth["T_loss"][part])
    rise = float(T[use].sum() / (T / run.truth["rise"][part])[use].sum()) - 1.0
    return {**moments, "alarms": alarms, "rise": round(rise, 4), "others": others, **conditions}


def kept() -> dict[str, Any]:
    """Outcomes by key, each with the code that it was computed by."""
    return store.read(STORE)


def code() -> str:
    """The code that computes: twin, estimator and crane."""
    here, root = STORE.parent, STORE.parents[2]
    files = [
        *sorted((root / "src/stillhook/live/estimate").rglob("*.py")),
        *(here / f"{n}.py" for n in ("crane", "plant")),
    ]
    files += [root / "trials/independent_crane" / f"{n}.py" for n in ("crane", "plant", "plc", "sea_trial")]
    return sha256(b"".join(f.read_bytes() for f in files)).hexdigest()[:16]


if __name__ == "__main__":
    store.run(STORE, CASES, outcome, code(), sys.argv[1:], group=lambda key: key.partition("/")[0], workers=1)
