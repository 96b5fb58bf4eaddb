"""Each controller at its best: settings found by differential evolution on the full twin, under limits, from a seed
that repeats them.

A population's runs go sixteen lanes side by side (`stillhook.engine.simulate`). No candidate has more position
gain than the margins allow; one whose margins or speed are not enough all the same is not run at all. What breaks a
limit ranks behind all that breaks none, by how much it breaks (Deb 2000).

Controllers at their best side by side: on waves they were not tuned on, on a winch that deviates from its file,
and as a trade of control error against pressure.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stillhook.analysis.controllers import Controller
from stillhook.analysis.controllers import controller as controller_of
from stillhook.analysis.effects import idle, scaled, with_value
from stillhook.analysis.loop_stability.margins import margins
from stillhook.analysis.tuning.objective import (
    NEAR,
    OURS,
    Limits,
    Objective,
    Score,
    governing_loop,
    parse_limits,
    pressure_of,
    scenarios,
    scored,
)
from stillhook.analysis.tuning.parameters import (
    DIGITS,
    DIGITS_AT_A_LIMIT,
    present,
    space,
    tunable,
    tuned_controller,
    with_settings,
)
from stillhook.analysis.tuning.search import BudgetUsed, Search, Trial
from stillhook.base.progress import Progress
from stillhook.engine.simulate import run_cases
from stillhook.errors import StillhookError
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario

if TYPE_CHECKING:
    import xarray


BUDGET = 400
"""Evaluations of a tuning by default. For NS and SSC of the library's 250 t crane they come within 1 % of
the score (balanced) and 3 % (error) of what 1500 find."""
LEAST_BUDGET = 20
STEP_ASIDE = 0.05
"""Part of a setting's range by which it is moved, one at a time, to see how flat the optimum is."""


class Change(NamedTuple):
    """One setting: before and after [SI], the ends of its search, and the score when it alone is moved down or up by 5
    % of that range (NaN where it cannot be, or where a limit would break)."""

    name: str
    before: float
    after: float
    low: float
    high: float
    score_down: float
    score_up: float


@dataclass(frozen=True)
class Tuned:
    """A controller at its best. `met`: a setting that keeps all limits was found; else `controller` is the one that
    breaks least and `stops` names the limits in its way. `active`: limits and ends of search that the optimum leans on.
    `trials`: all that was run.
    """

    start: Controller
    controller: Controller
    objective: Objective
    limits: Limits
    settings: tuple[Change, ...]
    before: Score
    after: Score
    active: tuple[str, ...]
    evaluations: int
    seed: int
    interrupted: bool
    trials: tuple[Trial, ...] = field(repr=False)

    @property
    def met(self) -> bool:
        return not self.after.broken

    @property
    def stops(self) -> tuple[str, ...]:
        return self.after.broken


def tune(
    crane: Crane,
    controller: Controller | Path | str,
    *,
    free: Sequence[str] = (),
    objective: Objective | str = Objective.BALANCED,
    cases: Sequence[Scenario] | None = None,
    limits: Limits | Sequence[str] | None = None,
    seed: int = 0,
    budget: int = BUDGET,
    reference: Controller | Path | str | None = None,
    threads: int = 2,
    progress: Progress | None = None,
) -> Tuned:
    """The settings of a controller that make the objective least over the scenarios and keep all limits.

    Parameters
    ----------
    crane : Crane
        The machine.
    controller : Controller, Path or str
        Where the search starts, by name, from a file, or one made; the tuned controller holds what differs from the
        crane.
    free : sequence of str, default ()
        Settings to tune; empty: all those of the motor law (`tune_space.tunable`): K_1, K_2, K_p, t_lead, and u_thr,
        alpha_min, alpha_swl or alpha_ns or alpha_hs.
    objective : Objective or str, default "balanced"
        See `Objective`.
    cases : sequence of Scenario, optional
        Run in the controller's mode; default `tune_goal.scenarios`.
    limits : Limits or sequence of str, optional
        Texts such as "p_max <= 300 bar", see `parse_limits`, or `Limits`.
    seed : int, default 0
        The same seed gives the same settings.
    budget : int, default 400
        Evaluations at most, each in all scenarios.
    reference : Controller, Path or str, optional
        Controller whose speed capacity and fast runs are kept; default `controller` itself.
    threads : int, default 2
        Threads that share the runs.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    Tuned
        The tuned controller and what it reaches.

    Raises
    ------
    StillhookError
        For a setting that there is not, a budget too small, scenarios that this crane cannot do.

    Notes
    -----
    The start is among what is tried, so where it keeps the limits the result is never worse. An interrupt (Ctrl-C)
    keeps the best found.

    Source: Storn and Price 1997 (differential evolution, scipy), Nelder and Mead 1965; ranking of what breaks limits by
    Deb 2000.
    """
    if objective not in tuple(Objective):
        raise StillhookError(f'objective "{objective}" is not one of {", ".join(Objective)}.')
    if type(budget) is not int or budget < LEAST_BUDGET:
        raise StillhookError(f"budget = {budget!r}: give a whole number from {LEAST_BUDGET} on.")
    start = controller_of(controller)
    tunable(start.mode)
    plain = start.on(crane)
    Objective(objective).check(crane)
    mode_cases = [c.with_mode(start.mode) for c in (cases if cases is not None else scenarios(crane))]
    settings = space(plain, start.mode, free, delay=max(c.sensors.delay for c in mode_cases))
    if not settings:
        raise StillhookError(f'"{start.name}": no setting is free. Name other settings.')
    required = limits if isinstance(limits, Limits) else parse_limits(limits or ())
    required.check(crane)
    search = Search(plain, start.mode, mode_cases, settings, Objective(objective), required, budget, threads, progress)
    search.begin((start if reference is None else controller_of(reference)).on(crane))
    try:
        search.evolve(seed)
        search.polish()
    except BudgetUsed:
        pass
    except KeyboardInterrupt:
        search.interrupted = True
    return result(search, crane, start, seed)


def result(search: Search, crane: Crane, start: Controller, seed: int) -> Tuned:
    """What a search has found, as a controller that a file holds."""
    names = [s.name for s in search.settings]
    best = search.best()
    values = dict(zip(names, best.values, strict=True))
    controller, after = start, search.before
    if best is not search.trials[0]:
        for digits in (DIGITS, DIGITS_AT_A_LIMIT):
            controller = tuned_controller(crane, start, values, f"{start.name}-tuned", digits)
            tuned = controller.on(crane)
            after = search.exact(tuned)
            if len(after.broken) <= len(best.score.broken):
                break
        values = {n: present(tuned)[n] for n in names}
    asides = [(0.0, 0.0)] * len(names) if search.interrupted else _asides(search, values)
    changes = tuple(
        Change(s.name, search.trials[0].values[i], values[s.name], s.low, s.high, *asides[i])
        for i, s in enumerate(search.settings)
    )
    active = _active(search, controller.on(crane), after, changes)
    return Tuned(
        start,
        controller,
        search.objective,
        search.limits,
        changes,
        search.before,
        after,
        active,
        search.evaluations,
        seed,
        search.interrupted,
        tuple(search.trials),
    )


def _asides(search: Search, optimum: dict[str, float]) -> list[tuple[float, float]]:
    """Score with one setting moved down and up; NaN where a limit breaks or the range ends."""
    points, places = [], []
    out = [[math.nan, math.nan] for _ in search.settings]
    for i, s in enumerate(search.settings):
        for k, way in enumerate((-1.0, 1.0)):
            value = optimum[s.name] + way * STEP_ASIDE * (s.high - s.low)
            crane = with_settings(search.crane, optimum | {s.name: value}) if s.low <= value <= s.high else None
            if crane is not None and search.linear_excess(crane) == 0.0:
                points.append(crane)
                places.append((i, k))
    n = len(search.runs)
    if points:
        rows = run_cases([c for c in points for _ in range(n)], search.runs * len(points), threads=search.threads)
        for j, ((i, k), crane) in enumerate(zip(places, points, strict=True)):
            results = rows[j * n : (j + 1) * n]
            score = search.weigh(scored(crane, search.mode, search.cases, results, search.limits, search.fast))
            out[i][k] = math.nan if score.broken else score.score
    return [(down, up) for down, up in out]


def _active(search: Search, crane: Crane, score: Score, changes: Sequence[Change]) -> tuple[str, ...]:
    """Limits within NEAR of being broken, and settings at an end of their search."""
    limits, out = search.limits, []
    most = governing_loop(crane, search.mode, limits)
    if most.loop is not None and crane.control.K_p >= (1.0 - NEAR) * most.K_p:
        m = margins(most.loop, crane.control.K_p)
        near = {
            "gain margin": m.gain_margin <= limits.gain_margin * (1.0 + 2.0 * NEAR),
            "phase margin": m.phase_margin <= limits.phase_margin * (1.0 + 2.0 * NEAR),
            "sensitivity peak": m.sensitivity_peak >= limits.sensitivity_peak * (1.0 - 2.0 * NEAR),
        }
        names = [name for name, is_near in near.items() if is_near] or ["margins"]
        out += [*names[:-1], f"{names[-1]} ({most.describe()})"]
    if score.v_w_capacity <= (limits.v_w_capacity or 0.0) * (1.0 + NEAR):
        out.append("speed capacity")
    if score.p_max >= (1.0 - NEAR) * limits.p_max:
        out.append("p_max")
    if score.u_p_max >= 1.0 - NEAR:
        out.append("pumps nearly full" if crane.circuits else "command nearly full")
    for c in changes:
        end = (
            "low"
            if c.after - c.low <= NEAR * (c.high - c.low)
            else "high"
            if c.high - c.after <= NEAR * (c.high - c.low)
            else ""
        )
        if end:
            out.append(f"{c.name} at the {end} end of its search")
    return tuple(out)


LATE = 0.1
"""Delay of the motion signal that no controller compensates, among the variations [s]: ten PLC cycles."""
FRICTION = 0.3
"""Change of all system friction among the variations [-]: the published sets of the thesis differ by more."""
WORN, NEW = 2.0, 0.5
"""Leak of pumps and active motors over that of their tables, among the variations [-]."""
SYSTEM_FRICTION = tuple(f"friction.system.{Y}" for Y in ("Y_1", "Y_2", "Y_3", "Y_5", "Y_6"))
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
    results = run_cases(
        [m for m in machines for _ in range(n)],
        [case.with_mode(k.mode) for k in controllers for case in cases],
        threads=threads,
    )
    return [_outcome(results[i * n : (i + 1) * n]) for i in range(len(controllers))]


def _outcome(rows: Sequence[Mapping[str, float | str]]) -> Outcome:
    e, p = np.array([float(r["e_c_pp"]) for r in rows]), np.array([pressure_of(r) for r in rows])
    counts = {name: sum(name in str(r["status"]).split(", ") for r in rows) for name in OURS}
    beyond = tuple(f"{name} in {count} of {len(rows)}" for name, count in counts.items() if count)
    return Outcome(float(np.mean(e)), float(np.max(e)), float(np.max(p)), beyond)


LEAKS = ("active.motor.C_1", "active.motor.C_2", "active.pump.leak_scale")
VARIATIONS: Mapping[str, tuple[Mapping[str, float], float]] = {
    "as it should be": ({}, 0.0),
    f"motion signal {LATE:g} s later": ({}, LATE),
    f"friction {FRICTION:.0%} less".replace("%", " %"): (dict.fromkeys(SYSTEM_FRICTION, 1.0 - FRICTION), 0.0),
    f"friction {FRICTION:.0%} more".replace("%", " %"): (dict.fromkeys(SYSTEM_FRICTION, 1.0 + FRICTION), 0.0),
    f"leakage x {NEW:g}": (dict.fromkeys(LEAKS, NEW), 0.0),
    f"leakage x {WORN:g}": (dict.fromkeys(LEAKS, WORN), 0.0),
    f"bulk modulus x {SOFT:g}": ({"active.line.bulk_modulus": SOFT}, 0.0),
}
"""What may be wrong about the winch, as factors on its numbers, and by how much the motion signal is later than the
controllers assume [s]."""


def variations(crane: Crane, controllers: Sequence[Controller], cases: Sequence[Scenario]) -> dict[str, list[Outcome]]:
    """Variation -> outcome of every controller, whose settings stay what they are: those of the crane of the file.
    Variations of numbers that the winch type does not have are left out.

    Derived gains K_1 and K_2 come from numbers that no variation changes.
    """
    out = {}
    for name, (factors, late) in VARIATIONS.items():
        if (not crane.circuits and any(path.startswith("active.") for path in factors)) or (
            factors and idle(crane, factors)
        ):
            continue
        machine = scaled(crane, factors)
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
    if not crane.circuits:
        drive = {path: operator.attrgetter(path)(tuned) for path in crane.plant.type.tuned}
        machine = machine.model_copy(update={"control": tuned.control})
        for path, value in drive.items():
            machine = with_value(machine, path, value)
        return machine
    motor = tuned.active.motor
    settings = {n: getattr(motor, n) for n in ("alpha_min", "servo", "variant", "offset", "hysteresis")}
    active = machine.active.model_copy(update={"motor": machine.active.motor.model_copy(update=settings)})
    return machine.model_copy(update={"control": tuned.control, "active": active})


def front(trials: Iterable[Trial], names: Sequence[str]) -> list[Point]:
    """The trials that keep all limits and that no other such trial beats in both mean error and highest pressure, by
    pressure."""
    sound = sorted((t.score.p_max, t.score.e_c_pp_mean, t.values) for t in trials if not t.score.broken)
    out: list[Point] = []
    for p, e, values in sound:
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
    required = low.limits  # "speed capacity kept" is that of the start, whatever later searches start from
    if not low.met:
        raise StillhookError(f"{first.name}: no setting keeps the limits ({'; '.join(low.stops)}). Relax one of them.")
    high = add(Objective.ERROR, first, required)
    if high.met and not (low.interrupted or high.interrupted):
        for p in np.linspace(low.after.p_max, high.after.p_max, points + 2)[1:-1]:
            bound = replace(required, p_max=min(float(p), required.p_max))
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

    rows = [(t, dict(zip([c.name for c in t.settings], k.values, strict=True)), k) for t in tunings for k in t.trials]
    scores = ("score", "e_c_pp_mean", "e_c_pp_worst", "p_max", "u_p_max", "v_w_capacity")
    columns = {n: [v.get(n, np.nan) for _, v, _ in rows] for n in dict.fromkeys(n for _, v, _ in rows for n in v)}
    columns |= {n: [getattr(k.score, n) for *_, k in rows] for n in scores}
    data: dict[str, Any] = {
        n: ("trial", column, dict(zip(("units", "long_name"), described(n)[1:], strict=True)))
        for n, column in columns.items()
    }
    broken = ["; ".join(trial.score.broken) for *_, trial in rows]
    data["broken"] = ("trial", broken, {"long_name": "limits that are not kept"})
    return xarray.Dataset(data, coords={"controller": ("trial", [t.start.name for t, *_ in rows])})
