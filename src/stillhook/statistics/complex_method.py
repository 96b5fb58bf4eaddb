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
MOST_RETRACTIONS = 30  # halvings of one step: the point is then at the centre to the ninth digit
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
    variant, rng = Variant(variant), np.random.default_rng(seed)
    x = lower + rng.random((population, len(lower))) * (upper - lower)
    f = np.array([cost(design) for design in x])
    evaluations = population
    forget = 1.0 - (GAMMA / 2.0 / population) if variant is Variant.COMPLEX_RF else 1.0

    def spread() -> float:
        return float(np.max(np.ptp(x, axis=0) / (upper - lower)))

    while evaluations < most and spread() > tolerance:
        worst, best = int(np.argmax(f)), x[int(np.argmin(f))]
        centre = np.delete(x, worst, axis=0).mean(axis=0)
        point = centre + reflection * (centre - x[worst])
        if variant is Variant.COMPLEX_RF:
            point = point + R_FAC * np.ptp(x, axis=0) * (rng.random(len(point)) - 0.5)
        second = float(np.max(np.delete(f, worst)))
        for repeated in range(1, MOST_RETRACTIONS + 1):
            point = np.minimum(np.maximum(point, lower), upper)  # Box: a point beyond a bound is set on it
            value = cost(point)
            evaluations += 1
            if value < second or evaluations >= most:
                break
            if variant is Variant.BOX:
                point = 0.5 * (point + centre)
            else:
                point = _towards_best(point, centre, best, repeated, rng)
        if forget < 1.0:
            f = f + (1.0 - forget) * (np.max(f) - np.min(f))
        x[worst], f[worst] = point, value
    least = x[int(np.argmin(f))]
    return Optimum(least.copy(), float(cost(least)), evaluations, spread() <= tolerance)


def _towards_best(
    point: FloatArray, centre: FloatArray, best: FloatArray, repeated: int, rng: np.random.Generator
) -> FloatArray:
    """Krus: half way to a place between centre and best that nears the best with every try."""
    share = (N_R / (N_R + repeated - 1)) ** ((N_R + repeated - 1) / N_R)
    goal = share * centre + (1.0 - share) * best
    return np.asarray(0.5 * (point + goal) + (centre - best) * (1.0 - share) * (2.0 * rng.random() - 1.0))
