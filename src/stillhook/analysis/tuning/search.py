"""The search behind a tuning: differential evolution from a seeded population, then a simplex; what is tried, ranked
and kept."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy

from stillhook.analysis.controllers import lateness
from stillhook.analysis.tuning.objective import (
    Fast,
    Limits,
    Objective,
    Score,
    attributed_limits,
    capacity_of,
    fast_candidates,
    gain_allowed,
    linear_broken,
    relative,
    scored,
)
from stillhook.analysis.tuning.parameters import Setting, of_vector, present, to_vector, with_settings
from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.engine.runner import FAILED
from stillhook.engine.simulate import run_cases
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode, Scenario

POPULATION = 2
"""Members of the population for each free setting, LEAST_MEMBERS at least; more find the same more slowly."""
LEAST_MEMBERS = 12
NEAR_START = 0.08
"""Two thirds of the first population lie around the start and around a strong guess, within this part of each range;
the others everywhere (Latin hypercube)."""
SAFE = 0.999
"""Share of the gain that the margins allow in that guess: its displacement may be rounded."""
LEAST_GAIN = 1e-6
"""Replaces an allowed gain of 0 where excesses are compared [1/m]."""
POLISH = 0.25
"""Part of the budget that Nelder and Mead's simplex has at the end."""
SIMPLEX = 0.02
"""Size of that simplex, as a part of each range."""
UNRUN, BROKEN = 1e6, 1e3
"""Ranks: candidates that keep all limits come first, then those that break a limit in a run, then those that break a
linear limit."""


class Trial(NamedTuple):
    """One evaluation: settings [SI] and their result."""

    values: tuple[float, ...]
    score: Score


class BudgetUsed(Exception):
    """The budget is used up."""


class Search:
    """State of a tuning: objective and limits, trials, and the best candidate."""

    def __init__(
        self,
        crane: Crane,
        mode: Mode,
        cases: Sequence[Scenario],
        settings: tuple[Setting, ...],
        objective: Objective,
        limits: Limits,
        budget: int,
        threads: int,
        progress: Progress | None,
    ) -> None:
        self.crane, self.mode, self.cases, self.settings = crane, mode, list(cases), settings
        self.objective, self.limits, self.budget = objective, limits, budget
        self.threads, self.progress = threads, progress
        self.trials: list[Trial] = []
        self.evaluations, self.interrupted = 0, False
        self.fast: list[Fast] = []

    def weigh(self, score: Score) -> Score:
        return relative(score, self.before, self.objective)

    def begin(self, reference: Crane) -> None:
        """Run the start, which the scores are parts of; "speed capacity kept" becomes a number, and a fast run for each
        period, both from the crane that is the reference."""
        values = {s.name: present(self.crane)[s.name] for s in self.settings}
        capacity = self.limits.v_w_capacity
        if capacity is None:
            self.limits = replace(self.limits, v_w_capacity=min(capacity_of(reference, self.mode, self.cases)))
        ladders = fast_candidates(reference, self.mode, self.cases[0])
        results = run_cases(reference, [c for ladder in ladders for c in ladder], threads=self.threads)
        for i, ladder in enumerate(ladders):
            passed = [attributed_limits(str(s["status"])) for s in results[i * len(ladder) : (i + 1) * len(ladder)]]
            self.fast += [
                Fast(c, reasons)
                for c, reasons in zip(ladder, passed, strict=True)
                if not reasons & {"saturated", *FAILED}
            ][:1]
        self.runs = [*self.cases, *(f.case for f in self.fast)]
        results = run_cases(self.crane, self.runs, threads=self.threads)
        start = scored(self.crane, self.mode, self.cases, results, self.limits, self.fast)
        self.before = relative(start, start, self.objective)
        self.x_0 = np.clip(np.array(to_vector(self.settings, values)), 0.0, 1.0)
        self.trials.append(Trial(tuple(values[s.name] for s in self.settings), self.before))
        self.evaluations = 1

    def ranks(self, X: FloatArray) -> FloatArray:
        """Rank of every point of the unit cube (columns), least best; points beyond the budget are not tried."""
        points = np.atleast_2d(np.asarray(X, dtype=np.float64).T)
        room = self.budget - self.evaluations
        if room <= 0:
            raise BudgetUsed
        out = np.full(len(points), math.inf)
        out[:room] = self._run(points[:room])
        self.evaluations += min(len(points), room)
        if self.progress is not None:
            self.progress(min(self.evaluations / self.budget, 1.0))
        return out

    def _run(self, points: FloatArray) -> FloatArray:
        values = [self.within_margins(of_vector(self.settings, x)) for x in points]
        cranes = [with_settings(self.crane, v) for v in values]
        excess = np.array([self.linear_excess(c) for c in cranes])
        out = UNRUN * (1.0 + excess)
        sound = [i for i, e in enumerate(excess) if e == 0.0]
        n = len(self.runs)
        if not sound:
            return out
        each, runs = [cranes[i] for i in sound for _ in range(n)], self.runs * len(sound)
        results = run_cases(each, runs, threads=self.threads, mark=True)
        for k, i in enumerate(sound):
            rows = results[k * n : (k + 1) * n]
            score = self.weigh(scored(cranes[i], self.mode, self.cases, rows, self.limits, self.fast))
            self.trials.append(Trial(tuple(values[i].values()), score))
            out[i] = score.score if not score.broken else BROKEN * (1.0 + self.run_excess(score))
        return out

    def within_margins(self, values: dict[str, float]) -> dict[str, float]:
        """The settings with no more position gain than the margins allow, or the least of its search: where the margins
        end far below the end of its search, as for HS under load, hardly any other candidate would keep them."""
        if "K_p" not in values:
            return values
        most = SAFE * gain_allowed(with_settings(self.crane, values), self.mode, self.limits)
        least = next(s.low for s in self.settings if s.name == "K_p")
        return values | {"K_p": min(values["K_p"], max(most, least))}

    def linear_excess(self, crane: Crane) -> float:
        """Excess of a setting over the limits that need no run; 0 where it keeps them."""
        capacity = capacity_of(crane, self.mode, self.cases)
        if not linear_broken(crane, self.mode, self.limits, capacity):
            return 0.0
        allowed = max(gain_allowed(crane, self.mode, self.limits), LEAST_GAIN)
        gain = max(crane.control.K_p / allowed - 1.0, 0.0)
        speed = max((self.limits.v_w_capacity or 0.0) / min(capacity) - 1.0, 0.0)
        return max(gain + speed, 1e-9)

    def run_excess(self, score: Score) -> float:
        """Excess of runs over limits: number of broken limits, and the pressure above its limit."""
        pressure = max(score.p_max / self.limits.p_max - 1.0, 0.0) if math.isfinite(score.p_max) else 1.0
        return len(score.broken) + pressure + max(score.u_p_max - 1.0, 0.0)

    def evolve(self, seed: int) -> None:
        """Differential evolution; a third of its first population is around the start, a third around the strong
        guess."""
        n = len(self.settings)
        members = min(max(LEAST_MEMBERS, POPULATION * n), self.budget // 4)
        rng = np.random.default_rng(seed)
        spread = scipy.stats.qmc.LatinHypercube(n, rng=rng).random(members)
        for k, centre in enumerate((self.x_0, self._strong())):
            near = np.arange(members) % 3 == k
            spread[near] = np.clip(centre + NEAR_START * (2.0 * spread[near] - 1.0), 0.0, 1.0)
            spread[k] = centre
        rounds = max(int((1.0 - POLISH) * self.budget) // members - 1, 1)
        scipy.optimize.differential_evolution(
            self.ranks,
            [(0.0, 1.0)] * n,
            init=spread,
            maxiter=rounds,
            tol=0.0,
            atol=0.0,
            mutation=(0.4, 0.9),
            recombination=0.8,
            vectorized=True,
            updating="deferred",
            polish=False,
            rng=rng,
        )

    def _strong(self) -> FloatArray:
        """The start with what strong SSC does to SSC, where those settings are free: a good first guess for every motor
        law."""
        values = dict(zip((s.name for s in self.settings), self.trials[0].values, strict=True))
        delay = max(c.sensors.delay for c in self.cases)
        guess = {
            "K_p": SAFE * gain_allowed(self.crane, self.mode, self.limits),
            **dict.fromkeys(("t_lead", "t_lead_ff"), lateness(self.crane, delay=delay)),
        }
        values |= {n: v for n, v in guess.items() if n in values}
        return np.asarray(np.clip(np.array(to_vector(self.settings, values)), 0.0, 1.0), dtype=np.float64)

    def polish(self) -> None:
        """The rest of the budget from the best point on: Nelder and Mead's simplex, held in the unit cube."""
        best = dict(zip((s.name for s in self.settings), self.best().values, strict=True))
        x = np.array(to_vector(self.settings, best))
        corners = np.vstack([x, x + np.diag(np.where(x < 0.5, SIMPLEX, -SIMPLEX))])
        options = {"initial_simplex": corners, "maxfev": self.budget, "xatol": 1e-4, "fatol": 1e-5}
        scipy.optimize.minimize(
            lambda y: float(self.ranks(y)[0]), x, method="Nelder-Mead", bounds=[(0.0, 1.0)] * len(x), options=options
        )

    def best(self) -> Trial:
        """Of all that was tried, the best that keeps all limits, else the one that breaks least."""
        return min(
            self.trials,
            key=lambda t: (len(t.score.broken), self.run_excess(t.score) if t.score.broken else 0.0, t.score.score),
        )

    def exact(self, crane: Crane) -> Score:
        """The score of a crane run as it is."""
        results = run_cases(crane, self.runs, threads=self.threads)
        return self.weigh(scored(crane, self.mode, self.cases, results, self.limits, self.fast))
