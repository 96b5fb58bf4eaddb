"""Largest values: of Gaussian motions and tensions over a time, and of maxima that were simulated."""

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
"""Samples that intervals of a Gumbel fit come from, and their seed: two digits are certain."""


def largest(sigma: float, n: float, quantile: float = MPM) -> float:
    r"""Level that the largest of n maxima of a narrow-banded Gaussian motion stays below with the probability
    `quantile`.

    .. math:: x_q = \sigma \sqrt{2 \ln\frac{n}{\ln(1/q)}}

    sigma standard deviation, any unit; n cycles in the time, duration/T_z; quantile above 0 and below 1, 1/e for the
    most probable maximum sigma sqrt(2 ln n). Source: Rayleigh maxima taken as independent, which is on the safe side;
    DNV-RP-C205 (check against your edition).
    Errors: SeaError for fewer cycles than have such a level, and an impossible quantile.
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

        Exact but for the draws: (estimate - true)/beta has one distribution for any mu and beta; it is drawn with
        as many maxima.
        """
        low, high = _pivots(self.n, q, confidence)
        value = self.quantile(q)
        return Estimate(value, float(value - low * self.beta), float(value - high * self.beta), self.n)


def gumbel(maxima: ArrayLike) -> Gumbel:
    """Gumbel distribution of maximum likelihood, of the largest values of runs with different seeds, one each.

    Errors: SeaError for fewer than 5 maxima, for ones that are not numbers, and for ones that are all the same.
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


def zero_crossing_period(sigma: ArrayLike, sigma_rate: ArrayLike) -> FloatArray:
    """Mean time from one upward crossing of the mean to the next, 2 pi sigma/sigma_rate [s]; NaN for what is at rest
    still."""
    s, r = np.broadcast_arrays(np.asarray(sigma, dtype=np.float64), np.asarray(sigma_rate, dtype=np.float64))
    return np.asarray(2.0 * np.pi * np.divide(s, r, out=np.full(s.shape, np.nan), where=r > 0.0), dtype=np.float64)


def most_probable_maximum(sigma: ArrayLike, T_z: ArrayLike, duration: float) -> FloatArray:
    """Most probable largest value over a time, above the mean, sigma sqrt(2 ln(duration/T_z)), unit of sigma; 0 where
    nothing moves.

    duration [s], at least T_z. See `stillhook.statistics.extremes.largest`.
    """
    s, T = np.broadcast_arrays(np.asarray(sigma, dtype=np.float64), np.asarray(T_z, dtype=np.float64))
    out = np.where(np.isnan(s), np.nan, 0.0)
    moving = (s > 0.0) & np.isfinite(T)
    out[moving] = [a * largest(1.0, duration / b) for a, b in zip(s[moving], T[moving], strict=True)]
    return out


def share_below_zero(mean: ArrayLike, sigma: ArrayLike) -> FloatArray:
    """Share of the time in which a Gaussian tension of this mean and deviation is below 0 [-]: a linear wire would
    push, a real one is slack."""
    from scipy.special import ndtr  # heavy: only where tensions are judged

    m, s = np.broadcast_arrays(np.asarray(mean, dtype=np.float64), np.asarray(sigma, dtype=np.float64))
    ratio = np.divide(m, s, out=np.where(m > 0.0, np.inf, -np.inf), where=s > 0.0)
    return np.where(np.isnan(s), np.nan, ndtr(-ratio))


def rate_below_zero(mean: ArrayLike, sigma: ArrayLike, T_z: ArrayLike) -> FloatArray:
    r"""How often such a tension falls through 0 [1/s]: Rice's :math:`\exp(-m^2/2\sigma^2)/T_z`; 0 where nothing
    moves."""
    m, s, T = np.broadcast_arrays(*(np.asarray(v, dtype=np.float64) for v in (mean, sigma, T_z)))
    ratio = np.divide(m, s, out=np.full(m.shape, np.inf), where=s > 0.0)
    rate = np.exp(-0.5 * ratio**2) / np.where(np.isfinite(T), T, np.inf)
    return np.where(np.isnan(s), np.nan, rate)


def chance_below_zero(rate: ArrayLike, duration: float) -> FloatArray:
    """Chance that a tension falls through 0 at least once in a time, 1 - exp(-rate duration) [-]: crossings taken as
    independent."""
    return np.asarray(-np.expm1(-np.asarray(rate, dtype=np.float64) * duration))


HALVINGS = 26
"""Halvings of the bracket that a level is looked for in: right to 1e-8 of it."""


def largest_of_parts(mean: ArrayLike, sigma: ArrayLike, cycles: ArrayLike, quantile: float) -> FloatArray:
    r"""Level that the largest of all parts of a phase stays below with the probability `quantile`, (n,).

    .. math:: \sum_i N_i \exp\frac{-(x - m_i)^2}{2\sigma_i^2} = \ln\frac{1}{q}

    Parameters: mean m_i, standard deviation sigma_i, number of cycles N_i = time/T_z, each (k, n) for k parts and n
    seas, or what broadcasts to it. Maxima are taken as Rayleigh distributed and independent, as in
    `stillhook.statistics.extremes.largest`, which this is for one part. Where nothing moves, or the parts hold too few
    cycles for such a level, the largest mean. NaN where a part is unknown.
    """
    m, s, N = np.broadcast_arrays(*(np.asarray(v, dtype=np.float64) for v in (mean, sigma, cycles)))
    target = math.log(1.0 / quantile)
    with np.errstate(divide="ignore", invalid="ignore"):
        alone = np.where((target < N) & (s > 0.0), m + s * np.sqrt(2.0 * np.log(np.maximum(N, target) / target)), m)
        if len(m) == 1:
            return np.where(np.isnan(s[0]), np.nan, alone[0])
        total = np.maximum(N.sum(axis=0), target)
        low, high = alone.max(axis=0), (m + s * np.sqrt(2.0 * np.log(total / target))).max(axis=0)
    scale = np.where(s > 0.0, s, 1.0)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        over = np.maximum(middle - m, 0.0) / scale
        beyond = (np.where(s > 0.0, N, 0.0) * np.exp(-0.5 * over**2)).sum(axis=0) > target
        low, high = np.where(beyond, middle, low), np.where(beyond, high, middle)
    unknown = np.isnan(m + s).any(axis=0)
    return np.where(unknown, np.nan, 0.5 * (low + high))


def share_beyond(level: float, sigma: ArrayLike) -> FloatArray:
    """Share of the time in which a Gaussian motion of deviation sigma is further from its mean than a level, to either
    side [-]."""
    from scipy.special import ndtr  # heavy: only where a stroke is judged

    s = np.asarray(sigma, dtype=np.float64)
    return np.asarray(2.0 * ndtr(-np.divide(level, s, out=np.full_like(s, np.inf), where=s > 0.0)) + 0.0 * s)


def speed_at_crossing(drift: float, sigma: ArrayLike, quantile: float) -> FloatArray:
    r"""Speed with which a load that sinks at `drift` and swings with a Gaussian speed passes a level, at a quantile,
    shape of sigma [m/s].

    Speeds at downward crossings have the density :math:`p(w) \sim w\,\exp(-(w - V)^2/2\sigma^2)`, w > 0 (Rice): fast
    ones pass more often. All passages of a level count alike; the first one, at which a load lands, is slower where the
    swing is much faster than the drift, so that this is on the safe side. Parameters: drift V, 0 or more; sigma of the
    speed [m/s]; NaN stays NaN.
    """
    from scipy.special import ndtr  # heavy: only where a landing is judged

    s = np.asarray(sigma, dtype=np.float64)
    moving = np.where(s > 0.0, s, 1.0)
    V = drift / moving

    def passed(w: FloatArray) -> FloatArray:
        """Integral of the density up to w, in units of sigma, but for its scale."""
        y = w - V
        return np.asarray(
            (np.exp(-0.5 * V**2) - np.exp(-0.5 * y**2)) / math.sqrt(2.0 * math.pi) + V * (ndtr(y) - ndtr(-V))
        )

    low, high = np.zeros_like(moving), V + 10.0
    total = passed(high)
    for _ in range(2 * HALVINGS):
        middle = 0.5 * (low + high)
        more = passed(middle) < quantile * total
        low, high = np.where(more, middle, low), np.where(more, high, middle)
    return np.where(np.isnan(s), np.nan, np.where(s > 0.0, 0.5 * (low + high) * moving, drift))


INDEX, INDEX_SD = 0.6, 0.4
"""Extremal index of parts of a run before any is known, and the standard deviation of its ln."""


def extremal_index(z: FloatArray, w: FloatArray) -> tuple[float, float]:
    """How many independent parts one part counts for in a largest value, 0 to 1, for large ones come in groups; and the
    standard deviation of its ln.

    By how often a run, of weight w (n,), stays below a level that half of the runs pass, against how often its parts
    z (n, k) do; with what is usual where there are few runs.
    """
    n, k = z.shape
    if k == 1:
        return 1.0, 0.0
    most = z.max(axis=1)
    order = np.argsort(most)
    total = float(w.sum())
    share = np.cumsum(w[order]) / total
    level = most[order][min(int(np.searchsorted(share, 0.5)), n - 1)]
    runs = float((most <= level) @ w) / total
    parts = float((z <= level).mean(axis=1) @ w) / total
    certainty = INDEX_SD**-2
    about = certainty * math.log(INDEX)
    if 0.0 < runs < 1.0 and 0.0 < parts < 1.0:
        effective = total**2 / float(np.sum(w**2))
        of_runs = effective * runs * math.log(runs) ** 2 / (1.0 - runs)
        about += of_runs * math.log(math.log(runs) / (k * math.log(parts)))
        certainty += of_runs
    return min(math.exp(about / certainty), 1.0), 1.0 / math.sqrt(certainty)
