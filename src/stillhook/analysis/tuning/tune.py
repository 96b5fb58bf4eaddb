"""Each controller with its best tuning: settings found by differential evolution on the full twin, under limits, from a
seed that repeats them.

A population's runs go sixteen lanes side by side (`stillhook.engine.simulate`). No candidate has more position
gain than the margins allow; one whose margins or speed are not enough all the same is not run at all. What breaks a
limit ranks behind all that breaks none, by how much it breaks (Deb 2000).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from stillhook.analysis.controllers import Controller
from stillhook.analysis.controllers import controller as controller_of
from stillhook.analysis.loop_stability.margins import margins
from stillhook.analysis.tuning.objective import (
    NEAR,
    Limits,
    Objective,
    Score,
    governing_loop,
    parse_limits,
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
from stillhook.errors import Cancelled, StillhookError
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario

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
    """A tuned controller. `met`: a setting that keeps all limits was found; else `controller` is the one that
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
        Settings to tune; empty: all those of the motor law (`parameters.tunable`): K_1, K_2, K_p, t_lead, and u_thr,
        alpha_min, alpha_swl or alpha_ns or alpha_hs. t_lead_ff where it is named.
    objective : Objective or str, default "balanced"
        See `Objective`.
    cases : sequence of Scenario, optional
        Run in the controller's mode; default `objective.scenarios`.
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
    required = limits if isinstance(limits, Limits) else parse_limits(limits or ())
    required.check(crane)
    mode_cases = [c.with_mode(start.mode) for c in (cases if cases is not None else scenarios(crane))]
    settings = space(plain, start.mode, free, delay=max(c.sensors.delay for c in mode_cases))
    if not settings:
        raise StillhookError(f'"{start.name}": no setting is free. Name other settings.')
    search = Search(plain, start.mode, mode_cases, settings, Objective(objective), required, budget, threads, progress)
    search.begin((start if reference is None else controller_of(reference)).on(crane))
    try:
        search.evolve(seed)
        search.polish()
    except BudgetUsed:
        pass
    except (KeyboardInterrupt, Cancelled):
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
        each, runs = [c for c in points for _ in range(n)], search.runs * len(points)
        rows = run_cases(each, runs, threads=search.threads, mark=True)
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
