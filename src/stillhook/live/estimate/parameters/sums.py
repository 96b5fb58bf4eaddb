"""Balances that are linear in their parameters, as sums of products over half waves: fits, intervals, and steps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.statistics.estimate import t_factor

LAGS = 2
"""Half waves over which errors may be correlated: a wave group."""


class Sums(NamedTuple):
    """One half wave. t middle, seconds length [s]; sign of the motion; speed mean of the motor [rad/s]; G (k, k): sums
    of products of the columns of a balance."""

    t: float
    seconds: float
    sign: float
    speed: float
    G: FloatArray


class Fit(NamedTuple):
    """b (p,) coefficients; H (p, p) inverse normal matrix; influence (n,) of each half wave on the first coefficient; u
    its standard uncertainty from the scatter, t its 95 % factor."""

    b: FloatArray
    H: FloatArray
    influence: FloatArray
    u: float
    t: float


def scatter_of(scores: FloatArray, fitted: int) -> float:
    """Standard uncertainty of a coefficient whose scores (n,) are correlated over LAGS (Newey and West 1987); fitted:
    number of coefficients."""
    n = len(scores)
    variance = float(scores @ scores)
    for lag in range(1, min(LAGS, n - 1) + 1):
        variance += 2.0 * (1.0 - lag / (LAGS + 1.0)) * float(scores[lag:] @ scores[:-lag])
    variance = max(variance, float(scores @ scores) / n)
    return float(np.sqrt(variance * n / max(n - fitted, 1)))


def inverse(A: FloatArray) -> FloatArray | None:
    """Inverse of a normal matrix of columns of unlike sizes; None where a column is empty."""
    scale = np.sqrt(np.diag(A))
    if not (scale > 0.0).all():
        return None
    return np.asarray(np.linalg.pinv(A / np.outer(scale, scale)) / np.outer(scale, scale))


def fit(rows: Sequence[Sums], x: Sequence[int], y: FloatArray) -> Fit | None:
    """Least squares of a combination y (k,) of the columns on those with numbers x; None where it says nothing."""
    G = np.stack([r.G for r in rows])
    total = G.sum(axis=0)
    H = inverse(total[np.ix_(x, x)])
    if H is None:
        return None
    b = H @ (total[x] @ y)
    left = y.copy()
    left[list(x)] -= b
    influence = (G[:, x] @ left) @ H[0]
    n = len(rows)
    return Fit(b, H, influence, scatter_of(influence, len(x)), t_factor(max(n - len(x), 1)))


def effect(rows: Sequence[Sums], x: Sequence[int], found: Fit, error: FloatArray) -> float:
    """Change of the first coefficient per unit of an error of y, a combination (k,) of the columns."""
    total = np.sum([r.G for r in rows], axis=0)
    return float(found.H[0] @ (total[x] @ error))


def apart(rows: Sequence[Sums], x: Sequence[int], y: FloatArray) -> float:
    """Half of the difference between the first coefficients of strong and of weak half waves, with the others in
    common."""
    speed = np.array([r.speed for r in rows])
    G = np.stack([r.G for r in rows])
    strong = G[speed > np.median(speed)].sum(axis=0)
    total = G.sum(axis=0)
    p = len(x)
    A, c = np.zeros((p + 1, p + 1)), np.zeros(p + 1)
    A[:p, :p], c[:p] = total[np.ix_(x, x)], total[x] @ y
    A[0, 0], c[0] = (total - strong)[x[0], x[0]], (total - strong)[x[0]] @ y
    A[0, 1:p] = A[1:p, 0] = (total - strong)[x[0], x[1:]]
    A[p, p], c[p] = strong[x[0], x[0]], strong[x[0]] @ y
    A[p, 1:p] = A[1:p, p] = strong[x[0], x[1:]]
    H = inverse(A)
    if H is None:
        return 0.0
    b = H @ c
    return 0.5 * abs(float(b[p] - b[0]))


def series(rows: Sequence[Sums], x: Sequence[int], y: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """What every half wave says of the first coefficient once the others are taken off: m and y (n,) of y = b m, with
    like scatter (Frisch, Waugh and Lovell)."""
    G = np.stack([r.G for r in rows])
    total, others = G.sum(axis=0), list(x[1:])
    found, H = fit(rows, x, y), inverse(total[np.ix_(others, others)])
    if found is None or H is None:
        return None
    pure, left = np.zeros(len(total)), y.copy()
    pure[x[0]], pure[others] = 1.0, -H @ total[others, x[0]]
    left[others] -= found.b[1:]
    m = np.sqrt(np.maximum(np.einsum("i,nij,j->n", pure, G, pure), 1e-300))
    return m, np.einsum("i,nij,j->n", pure, G, left) / m
