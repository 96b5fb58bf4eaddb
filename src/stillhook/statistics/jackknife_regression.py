"""Least squares on logs whose errors are autocorrelated: for the intervals, blocks of time are left out in turn (the
jackknife)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray, IntArray
from stillhook.statistics.estimate import NORMAL_95, Estimate, random_effects, t_factor
from stillhook.statistics.time_lag import dot

FEWEST_BLOCKS = 4
"""Least number of blocks for an interval: with fewer, the t factor on a variance of two values is
meaningless."""
SAFE = 1e-10
"""Least eigenvalue of the scaled normal matrix, over the largest, from which columns count as different."""


@dataclass(frozen=True)
class Fit:
    """b (k,) coefficients; cov (k, k) their covariance from the blocks; blocks (m,) coefficients without each block; sd
    of the residuals; rows used."""

    b: FloatArray
    cov: FloatArray
    leave_out: FloatArray
    sd: float
    rows: int

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return len(self.leave_out)

    @property
    def u(self) -> FloatArray:
        """Standard errors (k,)."""
        return np.sqrt(np.diag(self.cov))

    def half(self, i: int) -> float:
        """Half of the 95 % interval of coefficient i."""
        return t_factor(self.blocks - 1) * float(self.u[i])

    def estimate(self, i: int, offset: float = 0.0) -> Estimate:
        """Coefficient i plus an offset."""
        return Estimate.around(float(self.b[i]) + offset, self.half(i), self.blocks)

    def ratio(self, i: int, j: int) -> tuple[float, float]:
        """Coefficient i over j, and half of its 95 % interval."""
        value = self.b[i] / self.b[j]
        return float(value), t_factor(self.blocks - 1) * _jackknife(self.leave_out[:, i] / self.leave_out[:, j])


def fit(columns: Sequence[FloatArray], y: FloatArray, block: IntArray) -> Fit | None:
    """Least squares of y on the columns; rows with a NaN are left out. None where blocks or differences between columns
    are too few.

    Parameters: columns k times (n,); y (n,); block (n,) number of the block of time that a row is in. A coefficient's
    variance is that among the fits which leave out one block each, so that errors may be autocorrelated within a block
    in any way.
    """
    X = np.column_stack(columns)
    good = np.isfinite(X).all(axis=1) & np.isfinite(y)
    X, y, block = X[good], y[good], block[good]
    names, place = np.unique(block, return_inverse=True)
    m, k = len(names), X.shape[1]
    if m < FEWEST_BLOCKS or len(y) < 2 * k:
        return None
    A, c = np.zeros((m, k, k)), np.zeros((m, k))
    np.add.at(A, place, X[:, :, None] * X[:, None, :])
    np.add.at(c, place, X * y[:, None])
    return _solved(A, c, X, y)


def _solved(A: FloatArray, c: FloatArray, X: FloatArray, y: FloatArray) -> Fit | None:
    total, right = A.sum(axis=0), c.sum(axis=0)
    scale = np.sqrt(np.diag(total))
    if (scale == 0.0).any() or _singular(total, scale):
        return None
    rests = total - A
    if any(_singular(rest, scale) for rest in rests):
        return None
    b = np.linalg.solve(total / np.outer(scale, scale), right / scale) / scale
    leave_out = np.stack(
        [
            np.linalg.solve(r / np.outer(scale, scale), (right - ci) / scale) / scale
            for r, ci in zip(rests, c, strict=True)
        ]
    )
    m, apart = len(A), leave_out - leave_out.mean(axis=0)
    residual = y - np.sum(X * b, axis=1)
    sd = math.sqrt(dot(residual, residual) / max(1, len(y) - len(b)))
    return Fit(b, (m - 1) / m * apart.T @ apart, leave_out, sd, len(y))


def _singular(A: FloatArray, scale: FloatArray) -> bool:
    values = np.linalg.eigvalsh(A / np.outer(scale, scale))
    return bool(values[0] <= SAFE * values[-1])


def _jackknife(values: FloatArray) -> float:
    m = len(values)
    return math.sqrt((m - 1) / m * float(np.sum((values - values.mean()) ** 2)))


def pooled(estimates: Sequence[Estimate]) -> Estimate:
    """The mean of one quantity over tests, each with its own true value about it: the scatter between the tests is in
    its interval (`stillhook.statistics.estimate`), and the largest structural error of them stays."""
    if len(estimates) == 1:
        return estimates[0]
    value, half = random_effects([e.value for e in estimates], [e.half for e in estimates])
    structural = max(e.structural for e in estimates)
    return Estimate.around(value, max(half, structural), sum(e.n for e in estimates), structural)


def one_number(estimates: Sequence[Estimate]) -> Estimate:
    """The mean of several readings of one and the same number, weighted by their intervals, which grow where the
    readings differ by more than they allow.

    Source: the ratio of Birge 1932, as for physical constants.
    """
    half, value = np.array([e.half for e in estimates]), np.array([e.value for e in estimates])
    if len(estimates) == 1:
        return estimates[0]
    w = 1.0 / np.maximum(half, 1e-12) ** 2
    mean = dot(w, value) / float(w.sum())
    spread = math.sqrt(dot(w, (value - mean) ** 2) * NORMAL_95**2 / (len(estimates) - 1))
    return Estimate.around(mean, max(1.0, spread) / math.sqrt(float(w.sum())), sum(e.n for e in estimates))
