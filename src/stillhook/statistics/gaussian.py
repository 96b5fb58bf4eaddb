"""What a Gaussian tension does over a time: its largest value, how often and how long it falls to nothing."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import FloatArray
from stillhook.statistics.extremes import largest


def zero_crossing_period(sigma: ArrayLike, sigma_rate: ArrayLike) -> FloatArray:
    """Mean time from one upward crossing of the mean to the next, 2 pi sigma/sigma_rate [s]; NaN for what stands
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
