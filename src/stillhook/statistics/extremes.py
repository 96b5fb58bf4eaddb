"""Largest values to be expected: of a Gaussian motion over a time, and of maxima that were simulated seed by seed."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import FloatArray
from stillhook.errors import SeaError
from stillhook.statistics.estimate import CONFIDENCE, Estimate

MPM = math.exp(-1.0)
"""Quantile that the most probable maximum is: the peak of the density of the largest of many."""
P90 = 0.9
FEWEST_MAXIMA = 5
DRAWS, DRAW_SEED = 20_000, 1958
"""Samples that intervals of a Gumbel fit come from, and their seed: two digits stand."""


def largest(sigma: float, n: float, quantile: float = MPM) -> float:
    r"""Level that the largest of n maxima of a narrow-banded Gaussian motion stays below with the probability
    `quantile`.

    .. math:: x_q = \sigma \sqrt{2 \ln\frac{n}{\ln(1/q)}}

    sigma standard deviation, any unit; n cycles in the time, duration/T_z; quantile above 0 and below 1, 1/e for the
    most probable maximum sigma sqrt(2 ln n). Source: Rayleigh maxima taken as independent, which is on the safe side;
    DNV-RP-C205 (check against your edition).
    Errors: SeaError for fewer cycles than have such a level, and a quantile that is none.
    """
    if not 0.0 < quantile < 1.0:
        raise SeaError(
            f"quantile {quantile:g} is not above 0 and below 1. Give 0.9 for the level that 90 % of all such times stay"
            " below."
        )
    ratio = n / math.log(1.0 / quantile)
    if not ratio >= 1.0:
        raise SeaError(
            f"duration: it holds {n:.3g} cycles of the motion, too few for a largest value. Give ten wave periods or"
            " more."
        )
    return sigma * math.sqrt(2.0 * math.log(ratio))


@dataclass(frozen=True)
class Gumbel:
    r"""Distribution of maxima, :math:`P(X \le x) = \exp(-e^{-(x - \mu)/\beta})`, fitted to n of them.

    mu the most probable maximum, beta the scale (standard deviation pi beta/sqrt(6)), both in the unit of the maxima.
    """

    mu: float
    beta: float
    n: int

    def quantile(self, q: float) -> float:
        """Level that a maximum stays below with probability q; 1/e gives mu."""
        return self.mu - self.beta * math.log(-math.log(q))

    def estimate(self, q: float, confidence: float = CONFIDENCE) -> Estimate:
        """`quantile(q)` with its interval.

        Exact but for the draws: (estimate - true)/beta has one distribution whatever mu and beta are; it is drawn with
        as many maxima.
        """
        low, high = _pivots(self.n, q, confidence)
        value = self.quantile(q)
        return Estimate(value, float(value - low * self.beta), float(value - high * self.beta), self.n)


def gumbel(maxima: ArrayLike) -> Gumbel:
    """Gumbel distribution of maximum likelihood, of the largest values of runs with different seeds, one each.

    Errors: SeaError for fewer than 5 maxima, for ones that are no numbers, and for ones that are all the same.
    """
    x = np.asarray(maxima, dtype=np.float64).ravel()
    if len(x) < FEWEST_MAXIMA:
        raise SeaError(f"{len(x)} maxima: a distribution takes {FEWEST_MAXIMA} or more. Run more seeds.")
    if not np.isfinite(x).all():
        raise SeaError("maxima: one of them is not a finite number. Leave failed runs out.")
    if np.ptp(x) <= 1e-12 * np.abs(x).max():
        raise SeaError(f"{len(x)} maxima are all {x[0]:.6g}: they do not scatter. Give runs of different seeds.")
    mu, beta = _fit(x[None, :])
    return Gumbel(float(mu[0]), float(beta[0]), len(x))


def _fit(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """mu and beta (k,) of maximum likelihood for samples (k, n): beta = mean(x) - sum(x e)/sum(e), e = exp(-x/beta), by
    Newton's method."""
    least = x.min(axis=1, keepdims=True)
    y = x - least
    mean = y.mean(axis=1)
    beta = np.maximum(y.std(axis=1) * math.sqrt(6.0) / math.pi, 1e-300)
    for _ in range(100):
        e = np.exp(-y / beta[:, None])
        s0, s1, s2 = e.sum(axis=1), (y * e).sum(axis=1), (y * y * e).sum(axis=1)
        f = beta - mean + s1 / s0
        slope = 1.0 + (s2 / s0 - (s1 / s0) ** 2) / beta**2
        step = f / slope
        beta = np.maximum(beta - step, 0.1 * beta)
        if np.all(np.abs(step) <= 1e-12 * beta):
            break
    mu = least[:, 0] - beta * np.log(np.exp(-y / beta[:, None]).mean(axis=1))
    return mu, beta


@functools.lru_cache(maxsize=256)
def _pivots(n: int, q: float, confidence: float) -> tuple[float, float]:
    """Quantiles of (estimate - true)/beta for the quantile q from n maxima: upper and lower end."""
    mu, beta = _fits_of_draws(n)
    pivot = (mu - math.log(-math.log(q)) * (beta - 1.0)) / beta
    low, high = np.quantile(pivot, [(1.0 + confidence) / 2.0, (1.0 - confidence) / 2.0])
    return float(low), float(high)


@functools.lru_cache(maxsize=32)
def _fits_of_draws(n: int) -> tuple[FloatArray, FloatArray]:
    """Fits of many samples of n from the distribution with mu 0 and beta 1."""
    draws = np.random.default_rng(DRAW_SEED).gumbel(size=(DRAWS, n))
    return _fit(draws)
