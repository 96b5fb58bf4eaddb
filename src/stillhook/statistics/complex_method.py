"""Box's complex method, as the thesis used it: the worst of a population of designs is mirrored through the centre of
the others.

Three variants of one loop: Box (1965); Krus, Jansson and Palmberg (1991), where a point that stays the worst is drawn
towards the best one, with some chance in it; and complex-RF, which adds a little randomness to every new point and lets
old values fade, so that a population does not settle too early. The least-squares fit finds the same optimum surely and
faster; this one makes no use of the model's shape, so that each can check the other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import IdentifyError

POPULATION = 36
REFLECTION = 1.3
"""Population and reflection of the thesis (section 2.3.3, paper D section 2.4)."""
N_R = 4
"""Krus: how soon a point that stays the worst is drawn to the best one instead of the centre."""
R_FAC, GAMMA = 0.1, 0.3
"""Complex-RF: size of the random step over the spread of the population, and forgetting, after Krus."""
MOST_RETRACTIONS = 30  # halvings of one step: the point then lies on the centre to the ninth digit
MOST_EVALUATIONS = 60_000
TOLERANCE = 1e-7
"""Spread of the population over its bounds at which it counts as one point."""


class Variant(StrEnum):
    """Box (1965); Krus et al. (1991); complex-RF (Krus)."""

    BOX = "box"
    KRUS = "krus"
    COMPLEX_RF = "complex-rf"


@dataclass(frozen=True)
class Optimum:
    """Best design, its cost, number of evaluations of the cost, and whether the population converged (else the
    evaluations were exhausted)."""

    x: FloatArray
    cost: float
    evaluations: int
    converged: bool


def complex_method(
    cost: Callable[[FloatArray], float],
    lower: FloatArray,
    upper: FloatArray,
    *,
    population: int = POPULATION,
    reflection: float = REFLECTION,
    variant: Variant = Variant.KRUS,
    seed: int = 0,
    most: int = MOST_EVALUATIONS,
    tolerance: float = TOLERANCE,
) -> Optimum:
    """Least cost inside bounds.

    Parameters: cost of a design x (shape (n,)); lower, upper bounds; population designs, drawn evenly inside the bounds
    from seed; reflection distance of the mirrored point over that of the worst one; most evaluations; tolerance on the
    spread.
    Errors: IdentifyError for bounds that are not in order or a population not above n + 1.
    """
    if not np.all(lower < upper):
        raise IdentifyError("complex method: a lower bound is not below its upper bound. Give bounds in order.")
    if population < len(lower) + 2:
        raise IdentifyError(
            f"complex method: a population of {population} for {len(lower)} parameters. Take {len(lower) + 2} or more."
        )
    run = _Run(cost, lower, upper, population, reflection, Variant(variant), np.random.default_rng(seed))
    while run.evaluations < most and run.spread() > tolerance:
        run.step(most)
    best = int(np.argmin(run.f))
    return Optimum(run.x[best].copy(), float(cost(run.x[best])), run.evaluations, run.spread() <= tolerance)


class _Run:
    """The population while it moves."""

    def __init__(
        self,
        cost: Callable[[FloatArray], float],
        lower: FloatArray,
        upper: FloatArray,
        k: int,
        alpha: float,
        variant: Variant,
        rng: np.random.Generator,
    ) -> None:
        self.cost, self.lower, self.upper, self.alpha, self.variant, self.rng = cost, lower, upper, alpha, variant, rng
        self.x = lower + rng.random((k, len(lower))) * (upper - lower)
        self.f = np.array([cost(x) for x in self.x])
        self.evaluations = k
        self.forget = 1.0 - (GAMMA / 2.0 / k) if variant is Variant.COMPLEX_RF else 1.0

    def spread(self) -> float:
        return float(np.max(np.ptp(self.x, axis=0) / (self.upper - self.lower)))

    def step(self, most: int) -> None:
        """Replace the worst point; while it stays the worst, draw it in."""
        worst = int(np.argmax(self.f))
        others = np.delete(self.x, worst, axis=0)
        centre, best = others.mean(axis=0), self.x[int(np.argmin(self.f))]
        x = self._shaken(centre + self.alpha * (centre - self.x[worst]))
        second = float(np.max(np.delete(self.f, worst)))
        for repeated in range(1, MOST_RETRACTIONS + 1):
            x = np.minimum(np.maximum(x, self.lower), self.upper)  # Box: a point beyond a bound is set on it
            f = self.cost(x)
            self.evaluations += 1
            if f < second or self.evaluations >= most:
                break
            x = self._retracted(x, centre, best, repeated)
        if self.forget < 1.0:
            self.f = self.f + (1.0 - self.forget) * (np.max(self.f) - np.min(self.f))
        self.x[worst], self.f[worst] = x, f

    def _shaken(self, x: FloatArray) -> FloatArray:
        if self.variant is not Variant.COMPLEX_RF:
            return x
        return np.asarray(x + R_FAC * np.ptp(self.x, axis=0) * (self.rng.random(len(x)) - 0.5))

    def _retracted(self, x: FloatArray, centre: FloatArray, best: FloatArray, repeated: int) -> FloatArray:
        """Box: half way to the centre. Krus: half way to a place between centre and best that nears the best with every
        try."""
        if self.variant is Variant.BOX:
            return 0.5 * (x + centre)
        share = (N_R / (N_R + repeated - 1)) ** ((N_R + repeated - 1) / N_R)
        goal = share * centre + (1.0 - share) * best
        return np.asarray(0.5 * (x + goal) + (centre - best) * (1.0 - share) * (2.0 * self.rng.random() - 1.0))
