"""Each controller at its best: settings found by differential evolution on the whole twin, under limits, from a seed that repeats them.

A population's runs go sixteen lanes side by side (`stillhook.engine.many`). Settings whose margins or speed are not enough are not run at
all. What breaks a limit ranks behind all that breaks none, by how much it breaks (Deb 2000).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import differential_evolution, minimize
from scipy.stats import qmc

from stillhook.analysis.controllers import Controller
from stillhook.analysis.strong import lateness
from stillhook.analysis.tune_goal import (
    NEAR,
    Limits,
    Objective,
    Score,
    capacity_of,
    gain_allowed,
    linear_broken,
    loop_margins,
    relative,
    scenarios,
    scored,
)
from stillhook.analysis.tune_space import Setting, of_vector, present, space, to_vector, tuned_controller, with_settings
from stillhook.crane import Crane
from stillhook.engine.many import summaries
from stillhook.engine.run import Progress
from stillhook.errors import StillhookError
from stillhook.scenario import Mode, Scenario

BUDGET = 400
"""Evaluations of a tuning unless told otherwise. For NS and SSC of the library's 250 t crane they come within 1 % of the score (balanced)
and 3 % (error) of what 1500 find."""
LEAST_BUDGET = 20
POPULATION = 2
"""Members of the population for each free setting, LEAST_MEMBERS at least; more find the same more slowly."""
LEAST_MEMBERS = 12
NEAR_START = 0.08
"""Two thirds of the first population lie around the start and around a strong guess, within this part of each range; the others
everywhere (Latin hypercube)."""
SAFE = 0.999
"""Share of the gain that the margins allow in that guess: its displacement may be rounded."""
POLISH = 0.25
"""Part of the budget that Nelder and Mead's simplex has at the end."""
SIMPLEX = 0.02
"""Size of that simplex, as a part of each range."""
UNRUN, BROKEN = 1e6, 1e3
"""Ranks: what the linear limits forbid lies behind what a run forbids, and that behind what keeps all limits."""
STEP_ASIDE = 0.05
"""Part of a setting's range by which it is moved, one at a time, to see how flat the optimum is."""

FloatArray = NDArray[np.float64]


class Trial(NamedTuple):
    """One evaluation: settings [SI] and how they did."""

    values: tuple[float, ...]
    score: Score


class Change(NamedTuple):
    """One setting: before and after [SI], the ends of its search, and the score when it alone is moved down or up by 5 % of that range
    (NaN where it cannot be, or where a limit would break)."""

    name: str
    before: float
    after: float
    low: float
    high: float
    score_down: float
    score_up: float


@dataclass(frozen=True)
class Tuned:
    """A controller at its best. `met`: a setting that keeps all limits was found; else `controller` is the one that breaks least and
    `stops` names the limits in its way. `active`: limits and ends of search that the optimum leans on. `trials`: all that was run."""

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
    controller: Controller,
    *,
    free: Sequence[str] = (),
    objective: Objective | str = Objective.BALANCED,
    cases: Sequence[Scenario] | None = None,
    limits: Limits | None = None,
    seed: int = 0,
    budget: int = BUDGET,
    threads: int = 2,
    progress: Progress | None = None,
) -> Tuned:
    """The settings of a controller that make the objective least over the scenarios and keep all limits.

    Parameters
    ----------
    crane, controller: where the search starts; the tuned controller holds what differs from the crane. free: settings to tune, default
    all that the motor law knows (`tune_space.tunable`): K_1, K_2, K_p, t_lead, and u_thr, alpha_min, alpha_swl or alpha_ns or alpha_hs.
    objective: see `Objective`. cases: scenarios, run in the controller's mode; default `tune_goal.scenarios`. limits: see `Limits`.
    seed: the same seed gives the same settings. budget: evaluations at most, each in all scenarios. progress: called with the share done.

    The start is among what is tried, so where it keeps the limits the result is never worse. An interrupt (Ctrl-C) keeps the best found.

    Errors: StillhookError for a setting that there is not, a budget too small, scenarios that this crane cannot be asked.
    Source: Storn and Price 1997 (differential evolution, scipy), Nelder and Mead 1965; ranking of what breaks limits by Deb 2000.
    """
    goal = Objective(objective) if objective in tuple(Objective) else _no_objective(objective)
    if type(budget) is not int or budget < LEAST_BUDGET:
        raise StillhookError(f"budget = {budget!r}: give a whole number from {LEAST_BUDGET} on.")
    plain = controller.on(crane)
    mine = [c.with_mode(controller.mode) for c in (cases if cases is not None else scenarios(crane))]
    settings = space(plain, controller.mode, free, delay=max(c.sensors.delay for c in mine))
    if not settings:
        raise StillhookError(f'"{controller.name}": nothing is left to tune. Name other settings.')
    search = _Search(plain, controller.mode, mine, settings, goal, limits or Limits(), budget, threads, progress)
    search.begin()
    try:
        search.evolve(seed)
        search.polish()
    except _Spent:
        pass
    except KeyboardInterrupt:
        search.interrupted = True
    return _result(search, crane, controller, seed)


def _no_objective(text: object) -> Objective:
    raise StillhookError(f'objective "{text}" is not one of {", ".join(Objective)}.')


class _Spent(Exception):
    """The budget is used up."""


class _Search:
    """One tuning under way: what is asked, what was tried, and the best of it."""

    def __init__(
        self, crane: Crane, mode: Mode, cases: Sequence[Scenario], settings: tuple[Setting, ...], objective: Objective,
        limits: Limits, budget: int, threads: int, progress: Progress | None,
    ) -> None:  # fmt: skip
        self.crane, self.mode, self.cases, self.settings = crane, mode, list(cases), settings
        self.objective, self.limits, self.budget, self.threads, self.progress = objective, limits, budget, threads, progress
        self.trials: list[Trial] = []
        self.asked, self.interrupted = 0, False

    def weigh(self, score: Score) -> Score:
        """The score as a part of that of the start."""
        return relative(score, self.before, self.objective)

    def begin(self) -> None:
        """Run the start, which the scores are parts of; "speed capacity kept" becomes a number."""
        values = {s.name: present(self.crane)[s.name] for s in self.settings}
        kept = self.limits.v_w_capacity
        if kept is None:
            self.limits = replace(self.limits, v_w_capacity=min(capacity_of(self.crane, self.mode, self.cases)))
        found = summaries(self.crane, self.cases, threads=self.threads)
        self.before = scored(self.crane, self.mode, self.cases, found, self.limits)
        self.before = self.weigh(self.before)
        self.x_0 = np.clip(np.array(to_vector(self.settings, values)), 0.0, 1.0)
        self.trials.append(Trial(tuple(values[s.name] for s in self.settings), self.before))
        self.asked = 1

    def ranks(self, X: FloatArray) -> FloatArray:
        """Rank of every point of the unit cube (columns), least best; points beyond the budget are not tried."""
        points = np.atleast_2d(np.asarray(X, dtype=np.float64).T)
        room = self.budget - self.asked
        if room <= 0:
            raise _Spent
        out = np.full(len(points), math.inf)
        out[:room] = self._run(points[:room])
        self.asked += min(len(points), room)
        if self.progress is not None:
            self.progress(min(self.asked / self.budget, 1.0))
        return out

    def _run(self, points: FloatArray) -> FloatArray:
        values = [of_vector(self.settings, x) for x in points]
        cranes = [with_settings(self.crane, v) for v in values]
        excess = np.array([self._linear_excess(c) for c in cranes])
        out = UNRUN * (1.0 + excess)
        sound = [i for i, e in enumerate(excess) if e == 0.0]
        n = len(self.cases)
        if not sound:
            return out
        found = summaries([cranes[i] for i in sound for _ in range(n)], self.cases * len(sound), threads=self.threads)
        for k, i in enumerate(sound):
            rows = found[k * n : (k + 1) * n]
            score = self.weigh(scored(cranes[i], self.mode, self.cases, rows, self.limits))
            self.trials.append(Trial(tuple(values[i].values()), score))
            out[i] = score.score if not score.broken else BROKEN * (1.0 + self._run_excess(score))
        return out

    def _linear_excess(self, crane: Crane) -> float:
        """By how much a setting breaks what needs no run; 0 where it does not."""
        capacity = capacity_of(crane, self.mode, self.cases)
        if not linear_broken(crane, self.mode, self.limits, capacity):
            return 0.0
        gain = max(crane.control.K_p / gain_allowed(crane, self.mode, self.limits) - 1.0, 0.0)
        speed = max((self.limits.v_w_capacity or 0.0) / min(capacity) - 1.0, 0.0)
        return max(gain + speed, 1e-9)

    def _run_excess(self, score: Score) -> float:
        """By how much runs break limits: how many of them, and the pressure above its limit."""
        pressure = max(score.p_max / self.limits.p_max - 1.0, 0.0) if math.isfinite(score.p_max) else 1.0
        return len(score.broken) + pressure + max(score.u_p_max - 1.0, 0.0)

    def evolve(self, seed: int) -> None:
        """Differential evolution; a third of its first population lies around the start, a third around the strong guess."""
        n = len(self.settings)
        members = min(max(LEAST_MEMBERS, POPULATION * n), self.budget // 4)
        rng = np.random.default_rng(seed)
        spread = qmc.LatinHypercube(n, rng=rng).random(members)
        for k, centre in enumerate((self.x_0, self._strong())):
            near = np.arange(members) % 3 == k
            spread[near] = np.clip(centre + NEAR_START * (2.0 * spread[near] - 1.0), 0.0, 1.0)
            spread[k] = centre
        rounds = max(int((1.0 - POLISH) * self.budget) // members - 1, 1)
        differential_evolution(
            self.ranks, [(0.0, 1.0)] * n, init=spread, maxiter=rounds, tol=0.0, atol=0.0, mutation=(0.4, 0.9), recombination=0.8,
            vectorized=True, updating="deferred", polish=False, rng=rng,
        )  # fmt: skip

    def _strong(self) -> FloatArray:
        """The start with what strong SSC does to SSC, where those settings are free: a good guess for every motor law."""
        values = dict(zip((s.name for s in self.settings), self.trials[0].values, strict=True))
        delay = max(c.sensors.delay for c in self.cases)
        guess = {"K_p": SAFE * gain_allowed(self.crane, self.mode, self.limits), "t_lead": lateness(self.crane, delay=delay)}
        values |= {n: v for n, v in guess.items() if n in values}
        return np.asarray(np.clip(np.array(to_vector(self.settings, values)), 0.0, 1.0), dtype=np.float64)

    def polish(self) -> None:
        """The rest of the budget from the best point on: Nelder and Mead's simplex, held in the unit cube."""
        x = np.array(to_vector(self.settings, dict(zip((s.name for s in self.settings), self.best().values, strict=True))))
        corners = np.vstack([x, *[np.where(np.arange(len(x)) == i, x + (SIMPLEX if x[i] < 0.5 else -SIMPLEX), x) for i in range(len(x))]])
        options = {"initial_simplex": corners, "maxfev": self.budget, "xatol": 1e-4, "fatol": 1e-5}
        minimize(lambda y: float(self.ranks(y)[0]), x, method="Nelder-Mead", bounds=[(0.0, 1.0)] * len(x), options=options)

    def best(self) -> Trial:
        """Of all that was tried, the best that keeps all limits, else the one that breaks least."""
        return min(self.trials, key=lambda t: (len(t.score.broken), self._run_excess(t.score) if t.score.broken else 0.0, t.score.score))

    def exact(self, crane: Crane, cases: Sequence[Scenario] | None = None) -> Score:
        """The score of a crane run as it is."""
        found = summaries(crane, list(cases or self.cases), threads=self.threads)
        return self.weigh(scored(crane, self.mode, self.cases, found, self.limits))


def _result(search: _Search, crane: Crane, start: Controller, seed: int) -> Tuned:
    names = [s.name for s in search.settings]
    best = search.best()
    found = dict(zip(names, best.values, strict=True))
    controller, after = start, search.before
    if best is not search.trials[0]:
        controller = tuned_controller(crane, start, found, f"{start.name}-tuned")
        tuned = controller.on(crane)
        after, found = search.exact(tuned), {n: present(tuned)[n] for n in names}
    asides = [(0.0, 0.0)] * len(names) if search.interrupted else _asides(search, found)
    changes = tuple(
        Change(s.name, search.trials[0].values[i], found[s.name], s.low, s.high, *asides[i]) for i, s in enumerate(search.settings)
    )
    active = _active(search, controller.on(crane), after, changes)
    return Tuned(
        start, controller, search.objective, search.limits, changes, search.before, after, active,
        search.asked, seed, search.interrupted, tuple(search.trials),
    )  # fmt: skip


def _asides(search: _Search, found: dict[str, float]) -> list[tuple[float, float]]:
    """Score with one setting moved down and up; NaN where a limit breaks or the range ends."""
    points, places = [], []
    out = [[math.nan, math.nan] for _ in search.settings]
    for i, s in enumerate(search.settings):
        for k, way in enumerate((-1.0, 1.0)):
            value = found[s.name] + way * STEP_ASIDE * (s.high - s.low)
            crane = with_settings(search.crane, found | {s.name: value}) if s.low <= value <= s.high else None
            if crane is not None and search._linear_excess(crane) == 0.0:
                points.append(crane)
                places.append((i, k))
    n = len(search.cases)
    if points:
        rows = summaries([c for c in points for _ in range(n)], search.cases * len(points), threads=search.threads)
        for j, ((i, k), crane) in enumerate(zip(places, points, strict=True)):
            score = search.weigh(scored(crane, search.mode, search.cases, rows[j * n : (j + 1) * n], search.limits))
            out[i][k] = math.nan if score.broken else score.score
    return [(down, up) for down, up in out]


def _active(search: _Search, crane: Crane, score: Score, changes: Sequence[Change]) -> tuple[str, ...]:
    """Limits within NEAR of being broken, and settings at an end of their search."""
    limits, out = search.limits, []
    m = loop_margins(crane, search.mode)
    if crane.control.K_p >= (1.0 - NEAR) * gain_allowed(crane, search.mode, limits):
        near = {
            "gain margin": m.gain_margin <= limits.gain_margin * (1.0 + 2.0 * NEAR),
            "phase margin": m.phase_margin <= limits.phase_margin * (1.0 + 2.0 * NEAR),
            "sensitivity peak": m.sensitivity_peak >= limits.sensitivity_peak * (1.0 - 2.0 * NEAR),
        }
        out += [name for name, is_near in near.items() if is_near] or ["margins"]
    if score.v_w_capacity <= (limits.v_w_capacity or 0.0) * (1.0 + NEAR):
        out.append("speed capacity")
    if score.p_max >= (1.0 - NEAR) * limits.p_max:
        out.append("p_max")
    if score.u_p_max >= 1.0 - NEAR:
        out.append("pumps nearly full")
    for c in changes:
        end = "low" if c.after - c.low <= NEAR * (c.high - c.low) else "high" if c.high - c.after <= NEAR * (c.high - c.low) else ""
        if end:
            out.append(f"{c.name} at the {end} end of its search")
    return tuple(out)
