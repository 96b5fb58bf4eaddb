"""Controllers at their best side by side: on waves they were not tuned on, on a winch that deviates from its file,
and as a trade of control error against pressure."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stillhook.analysis.controllers import Controller
from stillhook.analysis.controllers import controller as controller_of
from stillhook.analysis.tuning.objective import OURS, Limits, Objective, Score
from stillhook.analysis.tuning.search import Trial
from stillhook.analysis.tuning.tune import BUDGET, Tuned, tune
from stillhook.base.progress import Progress
from stillhook.engine.scenario.problem import summaries
from stillhook.errors import StillhookError
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario

if TYPE_CHECKING:
    import xarray

LATE = 0.1
"""Delay of the motion signal that no controller knows of, among the variations [s]: ten PLC cycles."""
FRICTION = 0.3
"""Change of all system friction among the variations [-]: the published sets of the thesis differ by more."""
WORN, NEW = 2.0, 0.5
"""Leak of pumps and active motors over that of their tables, among the variations [-]."""
SOFT = 0.7
"""Effective bulk modulus over that of the crane, among the variations [-]: 1 % of free air in the oil does as much."""


class Outcome(NamedTuple):
    """Result of a controller on some scenarios: mean and largest e_c_pp [m], highest pressure [Pa]; beyond: what of a
    status that is the controller's doing came up, and in how many scenarios."""

    e_c_pp_mean: float
    e_c_pp_worst: float
    p_max: float
    beyond: tuple[str, ...]


class Point(NamedTuple):
    """A setting that no other one beats in both: mean error [m], highest pressure [Pa], settings [SI]."""

    e_c_pp_mean: float
    p_max: float
    values: Mapping[str, float]


def outcomes(
    crane: Crane | Sequence[Crane], controllers: Sequence[Controller], cases: Sequence[Scenario], threads: int = 2
) -> list[Outcome]:
    """Every controller in all scenarios, in its own mode; crane that of all, or one for each controller. All runs side
    by side."""
    cranes = [crane] * len(controllers) if isinstance(crane, Crane) else list(crane)
    machines = [k.on(c) for k, c in zip(controllers, cranes, strict=True)]
    n = len(cases)
    results = summaries(
        [m for m in machines for _ in range(n)],
        [case.with_mode(k.mode) for k in controllers for case in cases],
        threads=threads,
    )
    return [_outcome(results[i * n : (i + 1) * n]) for i in range(len(controllers))]


def _outcome(rows: Sequence[Mapping[str, float | str]]) -> Outcome:
    e, p = np.array([float(r["e_c_pp"]) for r in rows]), np.array([float(r["p_max"]) for r in rows])
    counts = {name: sum(name in str(r["status"]).split(", ") for r in rows) for name in OURS}
    beyond = tuple(f"{name} in {count} of {len(rows)}" for name, count in counts.items() if count)
    return Outcome(float(np.mean(e)), float(np.max(e)), float(np.max(p)), beyond)


def _unchanged(crane: Crane) -> Crane:
    return crane


def _friction(scale: float) -> Callable[[Crane], Crane]:
    def change(crane: Crane) -> Crane:
        s = crane.friction.system
        system = s.model_copy(update={n: scale * getattr(s, n) for n in ("Y_1", "Y_2", "Y_3", "Y_5", "Y_6")})
        return crane.model_copy(update={"friction": crane.friction.model_copy(update={"system": system})})

    return change


def _leak(scale: float) -> Callable[[Crane], Crane]:
    def change(crane: Crane) -> Crane:
        a = crane.active
        motor = a.motor.model_copy(update={"C_1": scale * a.motor.C_1, "C_2": scale * a.motor.C_2})
        pump = a.pump.model_copy(update={"leak_scale": scale * (a.pump.leak_scale or 1.0)})
        return crane.model_copy(update={"active": a.model_copy(update={"motor": motor, "pump": pump})})

    return change


def _soft_oil(crane: Crane) -> Crane:
    line = crane.active.line.model_copy(update={"bulk_modulus": SOFT * crane.active.line.bulk_modulus})
    return crane.model_copy(update={"active": crane.active.model_copy(update={"line": line})})


VARIATIONS: Mapping[str, tuple[Callable[[Crane], Crane], float]] = {
    "as it should be": (_unchanged, 0.0),
    f"motion signal {LATE:g} s later": (_unchanged, LATE),
    f"friction {FRICTION:.0%} less".replace("%", " %"): (_friction(1.0 - FRICTION), 0.0),
    f"friction {FRICTION:.0%} more".replace("%", " %"): (_friction(1.0 + FRICTION), 0.0),
    f"leakage x {NEW:g}": (_leak(NEW), 0.0),
    f"leakage x {WORN:g}": (_leak(WORN), 0.0),
    f"bulk modulus x {SOFT:g}": (_soft_oil, 0.0),
}
"""What may be wrong about the winch, and by how much the motion signal is later than the controllers think [s]."""


def variations(crane: Crane, controllers: Sequence[Controller], cases: Sequence[Scenario]) -> dict[str, list[Outcome]]:
    """Variation -> outcome of every controller, whose settings stay what they are: those of the crane of the file.

    Derived gains K_1 and K_2 come from numbers that no variation changes.
    """
    out = {}
    for name, (change, late) in VARIATIONS.items():
        machine = change(crane)
        sensed = [
            c.model_copy(update={"sensors": c.sensors.model_copy(update={"delay": c.sensors.delay + late})})
            for c in cases
        ]
        out[name] = outcomes([_fixed(k, crane, machine) for k in controllers], [_plain(k) for k in controllers], sensed)
    return out


def _plain(controller: Controller) -> Controller:
    return Controller(controller.name, controller.mode)


def _fixed(controller: Controller, crane: Crane, machine: Crane) -> Crane:
    """The changed machine under the settings that the controller has on the crane of the file."""
    tuned = controller.on(crane)
    motor = tuned.active.motor
    kept = {n: getattr(motor, n) for n in ("alpha_min", "servo", "variant", "offset", "hysteresis")}
    active = machine.active.model_copy(update={"motor": machine.active.motor.model_copy(update=kept)})
    return machine.model_copy(update={"control": tuned.control, "active": active})


def front(trials: Iterable[Trial], names: Sequence[str]) -> list[Point]:
    """The trials that keep all limits and that no other such trial beats in both mean error and highest pressure, by
    pressure."""
    kept = sorted((t.score.p_max, t.score.e_c_pp_mean, t.values) for t in trials if not t.score.broken)
    out: list[Point] = []
    for p, e, values in kept:
        if not out or e < out[-1].e_c_pp_mean:
            out.append(Point(e, p, dict(zip(names, values, strict=True))))
    return out


def pareto(
    crane: Crane,
    controller: Controller | Path | str,
    *,
    free: Sequence[str] = (),
    cases: Sequence[Scenario] | None = None,
    limits: Limits | None = None,
    seed: int = 0,
    budget: int = BUDGET,
    points: int = 3,
    progress: Progress | None = None,
) -> tuple[list[Point], list[Tuned]]:
    """The trade of mean control error against highest pressure: its front, and the tunings it is made of.

    The least pressure and the least error are tuned first, then the least error under `points` limits of pressure in
    between (epsilon constraint); the front is the non-dominated part of everything that was run. budget: evaluations of
    each of the points + 2 tunings.
    Errors: as `tune`; StillhookError where no setting keeps the limits.
    Source: Haimes 1971 (epsilon constraint).
    """
    common = {"free": free, "cases": cases, "budget": budget, "seed": seed}
    first = controller_of(controller)
    done: list[Tuned] = []
    report = progress or (lambda share: None)

    def part(share: float) -> None:
        report((len(done) + share) / (points + 2))

    def add(objective: Objective, start: Controller, within: Limits | None) -> Tuned:
        tuned = tune(crane, start, objective=objective, limits=within, reference=first, progress=part, **common)  # type: ignore[arg-type]
        done.append(tuned)
        return done[-1]

    low = add(Objective.PRESSURE, first, limits)
    kept = low.limits  # "speed capacity kept" is that of the start, whatever later searches start from
    if not low.met:
        raise StillhookError(f"{first.name}: no setting keeps the limits ({'; '.join(low.stops)}). Relax one of them.")
    high = add(Objective.ERROR, first, kept)
    if high.met and not (low.interrupted or high.interrupted):
        for p in np.linspace(low.after.p_max, high.after.p_max, points + 2)[1:-1]:
            bound = replace(kept, p_max=min(float(p), kept.p_max))
            add(Objective.ERROR, low.controller, bound)
            if done[-1].interrupted:
                break
    names = [c.name for c in done[0].settings]
    return front([t for d in done for t in d.trials if [c.name for c in d.settings] == names], names), done


def trials_dataset(tunings: Sequence[Tuned]) -> xarray.Dataset:
    """Every evaluation of some tunings over "trial": controller, settings (NaN where a controller has none), scores,
    limits broken."""
    import xarray  # heavy: only where results are written

    from stillhook.analysis.tuning.parameters import described

    rows = [(t, [c.name for c in t.settings], trial) for t in tunings for trial in t.trials]
    columns: dict[str, Any] = {}
    names = list(dict.fromkeys(n for _, settings, _ in rows for n in settings))
    for n in names:
        values = [dict(zip(settings, trial.values, strict=True)).get(n, np.nan) for _, settings, trial in rows]
        columns[n] = ("trial", values, dict(zip(("units", "long_name"), described(n)[1:], strict=True)))
    for n in ("score", "e_c_pp_mean", "e_c_pp_worst", "p_max", "u_p_max", "v_w_capacity"):
        columns[n] = (
            "trial",
            [getattr(trial.score, n) for *_, trial in rows],
            dict(zip(("units", "long_name"), described(n)[1:], strict=True)),
        )
    columns["broken"] = (
        "trial",
        ["; ".join(trial.score.broken) for *_, trial in rows],
        {"long_name": "limits that are not kept"},
    )
    return xarray.Dataset(columns, coords={"controller": ("trial", [t.start.name for t, *_ in rows])})


def numbers(score: Score) -> dict[str, object]:
    """A score as JSON has it (SI)."""
    keys = ("score", "e_c_pp_mean", "e_c_pp_worst", "p_max", "u_p_max", "v_w_capacity", "broken")
    return {k: getattr(score, k) if k != "broken" else list(score.broken) for k in keys}
