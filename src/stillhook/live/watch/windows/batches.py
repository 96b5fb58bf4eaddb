"""A stream of rows as batches of sums, and numbers with 95 % intervals over sliding windows of them.

A statistic is a function of sums over time. Its variance is that among the values that leave out one group of batches
each, so that samples may be autocorrelated within a group in any way; what groups still share is in the factor of a
first-order autoregression. Memory and cost are bounded by the longest window, at any number of rows.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.statistics.estimate import Estimate, t_factor

BATCH = 10.0
"""Length of a batch [s]: a wave."""
WINDOWS: Mapping[str, float] = {"30 s": 30.0, "5 min": 300.0, "1 h": 3600.0}
GROUPS: Mapping[str, int] = {"30 s": 3, "5 min": 10, "1 h": 30}
"""Groups of batches that a window is cut into: of one, three and twelve batches, so of 10, 30 and 120 s."""
FULL = 0.9
"""Part of a window's groups that must have data before it is judged."""
MOST_SHARED = 0.8
"""Largest correlation of neighbouring groups that is taken out [-]: beyond, a window holds one event and no sample."""


class Statistic(NamedTuple):
    """value: (..., k) sums to (...) values; back: from the scale on which the interval is even to that of the value."""

    value: Callable[[FloatArray], FloatArray]
    back: Callable[[float], float] = float


class Sums:
    """The sums of the last batches of one statistic, as long as the longest window."""

    def __init__(self, statistic: Statistic) -> None:
        self.statistic = statistic
        self._rows: deque[FloatArray] = deque(maxlen=round(max(WINDOWS.values()) / BATCH))

    @property
    def width(self) -> int:
        """Sums of a batch; 0 before there was one."""
        return len(self._rows[-1]) if self._rows else 0

    def add(self, sums: FloatArray) -> None:
        """Of one more batch (k,), zeros where it says nothing."""
        self._rows.append(sums)

    def estimate(self, window: str) -> Estimate:
        """Over the last batches of a window; NaN where the data say nothing."""
        count, groups = round(WINDOWS[window] / BATCH), GROUPS[window]
        if len(self._rows) < FULL * count:
            return Estimate(math.nan)
        rows = np.stack(list(self._rows)[-count:])
        rows = np.concatenate([np.zeros((count - len(rows), rows.shape[1])), rows])
        parts = rows.reshape(groups, count // groups, -1).sum(axis=1)
        used = parts[np.any(parts != 0.0, axis=1)]
        if len(used) < max(3, round(FULL * groups)):
            return Estimate(math.nan)
        return estimate_of(self.statistic, used)


def estimate_of(statistic: Statistic, parts: FloatArray) -> Estimate:
    """Of groups (g, k) in the order of time."""
    total, g = parts.sum(axis=0), len(parts)
    with np.errstate(all="ignore"):
        value = float(statistic.value(total))
        without = statistic.value(total - parts)
    if not (math.isfinite(value) and np.isfinite(without).all()):
        return Estimate(math.nan)
    score = without - without.mean()
    variance = (g - 1) / g * float(score @ score)
    if g > 3 and variance > 0.0:
        shared = float(score[1:] @ score[:-1]) / float(score @ score) + 1.0 / g
        shared = min(max(shared, 0.0), MOST_SHARED)
        variance *= (1.0 + shared) / (1.0 - shared)
    half = t_factor(g - 1) * math.sqrt(variance)
    ends = sorted(statistic.back(value + sign * half) for sign in (-1.0, 1.0))
    return Estimate(statistic.back(value), ends[0], ends[1], g)


def ratio(of: int, over: int, less: float = 0.0) -> Statistic:
    """One sum over another, less a number."""
    return Statistic(lambda s: s[..., of] / s[..., over] - less)


def share_below(edges: FloatArray, share: float) -> Statistic:
    """The value below which a share of the samples is, from counts between edges (k + 1,) and beyond the last."""

    def value(s: FloatArray) -> FloatArray:
        below = np.cumsum(s, axis=-1)
        wanted = share * below[..., -1:]
        k = np.minimum((below < wanted).sum(axis=-1), len(edges) - 2)
        before = np.where(k > 0, np.take_along_axis(below, np.maximum(k - 1, 0)[..., None], -1)[..., 0], 0.0)
        inside = np.take_along_axis(s, k[..., None], -1)[..., 0]
        part = np.clip((wanted[..., 0] - before) / np.where(inside > 0.0, inside, 1.0), 0.0, 1.0)
        out = edges[k] + part * (edges[k + 1] - edges[k])
        return np.where(below[..., -1] > 0.0, out, np.nan)

    return Statistic(value)


def fitted(k: int, of: Callable[[FloatArray], FloatArray]) -> Statistic:
    """`of` the coefficients (..., k) of a regression, from its sums: the k x k of the columns, then those with y."""
    n = k * k

    def value(s: FloatArray) -> FloatArray:
        return of(solved(s[..., :n].reshape(*s.shape[:-1], k, k), s[..., n : n + k]))

    return Statistic(value)


def solved(A: FloatArray, c: FloatArray) -> FloatArray:
    """Coefficients of normal equations A (..., k, k), c (..., k); NaN where the columns are not apart."""
    scale = np.sqrt(np.einsum("...ii->...i", A))
    size = np.where(scale > 0.0, scale, 1.0)
    scaled = A / (size[..., :, None] * size[..., None, :])
    apart = np.linalg.eigvalsh(np.where(np.isfinite(scaled), scaled, 0.0))[..., 0] > APART
    safe = np.where(apart[..., None, None], scaled, np.eye(A.shape[-1]))
    b = np.linalg.solve(safe, (c / size)[..., None])[..., 0] / size
    return np.where(apart[..., None], b, np.nan)


APART = 1e-8
"""Least eigenvalue of scaled normal equations from which columns are apart."""


def normal(columns: list[FloatArray], y: FloatArray, use: FloatArray | BoolArray) -> FloatArray:
    """Sums of a regression over the rows in use and known."""
    X = np.column_stack(columns)
    good = use.astype(bool) & np.isfinite(X).all(axis=1) & np.isfinite(y)
    X, y = X[good], y[good]
    return np.concatenate([(X.T @ X).ravel(), X.T @ y])
