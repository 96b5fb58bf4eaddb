"""Scatter between load cases: what one number over several of them has in its interval beside the sampling error of
each.

A twin's error is another one in each load case (load, wire, sea), and the next case of the crane is one more of the
kind. An interval from the samples alone, however many there are, leaves this out: 1500 s of one case tell nothing of
the next.
Source: Paule and Mandel 1982 (variance between groups); Hartung and Knapp 2001, Sidik and Jonkman 2002 (its interval by
Student's t).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import FloatArray
from stillhook.statistics.estimate import NORMAL_95, t_factor
from stillhook.statistics.series import dot

HALVINGS = 60
"""Steps by which the variance between cases is bracketed: to a part in 1e18 of the widest."""
LEAST = 1e-12
"""Least deviation within a case, so that one without any does not weigh without end."""


def between(values: ArrayLike, deviations: ArrayLike) -> float:
    """Standard deviation of the true values of cases about their mean; 0 where their own deviations explain that they
    differ.

    Parameters: values (k,) of the cases; deviations (k,) of their sampling errors, in the same unit. Found where the
    weighted sum of squares about the weighted mean is its expectation k - 1 (Paule and Mandel). Fewer than two cases:
    0.
    """
    y, s = np.asarray(values, dtype=np.float64), np.maximum(np.asarray(deviations, dtype=np.float64), LEAST)
    k = len(y)
    if k < 2 or _excess(y, s, 0.0) <= k - 1:
        return 0.0
    low, high = 0.0, float(np.ptp(y)) ** 2 * k
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _excess(y, s, middle) > k - 1 else (low, middle)
    return math.sqrt(high)


def _excess(y: FloatArray, s: FloatArray, variance: float) -> float:
    w = 1.0 / (s**2 + variance)
    off = y - dot(w, y) / w.sum()
    return dot(w, off**2)


def random_effects(values: ArrayLike, halves: ArrayLike) -> tuple[float, float]:
    """Mean of several cases and half of its 95 % interval, with the scatter between the cases; never narrower than
    fixed effects.

    Parameters: values (k,); halves (k,) of their own 95 % intervals. Cases are weighted by sampling variance and
    scatter together. One case: as it is, for it tells nothing of the scatter.
    """
    y, half = np.asarray(values, dtype=np.float64), np.maximum(np.asarray(halves, dtype=np.float64), NORMAL_95 * LEAST)
    s = half / NORMAL_95
    w = 1.0 / (s**2 + between(y, s) ** 2)
    return dot(w, y) / float(w.sum()), max(half_of_mean(y, half, w), NORMAL_95 / math.sqrt(float(np.sum(s**-2.0))))


def half_of_mean(values: ArrayLike, halves: ArrayLike, weights: ArrayLike) -> float:
    """Half of the 95 % interval of a mean of cases with these weights, such as their lengths, with the scatter between
    the cases.

    Parameters: values, halves (k,) of the cases and their own 95 % intervals (NaN: not known; what such a case differs
    by is scatter); weights (k,), of any sum. Student's t of k - 1 degrees of freedom on the deviation of the cases
    about their mean (Hartung, Knapp, Sidik and Jonkman), never less than the sampling errors alone give. One case: its
    own.
    """
    y, a, half = (np.asarray(x, dtype=np.float64) for x in (values, weights, halves))
    s, a, k = np.maximum(np.where(np.isfinite(half), half, 0.0) / NORMAL_95, LEAST), a / a.sum(), len(y)
    sampling = NORMAL_95 * math.sqrt(float(np.sum(a**2 * s**2)))
    if k < 2:
        return sampling
    variance = s**2 + between(y, s) ** 2
    w = 1.0 / variance
    apart = dot(w, (y - dot(w, y) / float(w.sum())) ** 2) / (k - 1)
    return max(t_factor(k - 1) * math.sqrt(min(apart, 1.0) * float(np.sum(a**2 * variance))), sampling)


def extremes(values: Mapping[str, float], words: Callable[[float], str]) -> str:
    """The smallest and the largest of several cases with their names, "1.08 (limits) to 1.16 (3)"; "" for one case."""
    if len(values) < 2:
        return ""
    low, high = min(values, key=lambda name: values[name]), max(values, key=lambda name: values[name])
    return f"{words(values[low])} ({low}) to {words(values[high])} ({high})"
