"""Mean of a few cases, each with its own true value about it: an interval that stays usable with two to four cases.

Random-effects model: y_i = mu + tau e_i + s_i f_i with e_i, f_i ~ N(0, 1), a flat prior of mu and a half-normal prior
of the scatter tau. Two or three cases hardly determine tau: a method that estimates it from them alone (Hartung, Knapp,
Sidik and Jonkman) multiplies its deviation by Student's t of one or two degrees of freedom (12.7, 4.3). What is known
of tau beforehand takes the place of that factor.
Source: Friede, Rover, Wandel and Neuenschwander 2017, "Meta-analysis of few small studies in orphan diseases",
Research Synthesis Methods 8, 79-91.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import FloatArray
from stillhook.statistics.estimate import ENDS, LEAST, Estimate

GRID = 400
"""Values of tau that are summed over."""
REACH = 5.0
"""Largest tau of the sum, in scales of its prior: beyond are 6e-7 of it."""
BEYOND = 12.0
"""Reach of the bracket of an end of the interval, in standard deviations."""
HALVINGS = 60


def mean_of_few(values: ArrayLike, deviations: ArrayLike, scatter: float) -> Estimate:
    """Mean mu of the cases' true values and its 95 % interval.

    Parameters: values (k,) of the cases, deviations (k,) of their sampling errors and scatter, the scale of the
    half-normal prior of tau, all in one unit. Ends: quantiles of the posterior of mu. n: the number of cases.
    """
    y, s = np.asarray(values, dtype=np.float64), np.maximum(np.asarray(deviations, dtype=np.float64), LEAST)
    tau = REACH * scatter * (np.arange(GRID) + 0.5) / GRID
    variance = s**2 + tau[:, None] ** 2
    w = 1.0 / variance
    total = w.sum(axis=1)
    mu = (w * y).sum(axis=1) / total
    misfit = (w * (y - mu[:, None]) ** 2).sum(axis=1) + np.log(variance).sum(axis=1) + np.log(total)
    log_weight = -0.5 * (misfit + (tau / scatter) ** 2)
    weight = np.exp(log_weight - log_weight.max())
    weight /= weight.sum()
    sd = total**-0.5
    low, high = (_quantile(weight, mu, sd, end) for end in ENDS)
    return Estimate(float(np.sum(weight * mu)), low, high, len(y))


def _quantile(weight: FloatArray, mu: FloatArray, sd: FloatArray, share: float) -> float:
    """Quantile of a mixture of normal distributions."""
    from scipy.special import ndtr  # heavy: only where logs are compared

    low, high = float(np.min(mu - BEYOND * sd)), float(np.max(mu + BEYOND * sd))
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        below = float(np.sum(weight * ndtr((middle - mu) / sd)))
        low, high = (middle, high) if below < share else (low, middle)
    return 0.5 * (low + high)
