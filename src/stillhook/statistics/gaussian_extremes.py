"""Largest values of a phase that goes through several situations: Gaussian motions, each for its part of the time."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import FloatArray

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
