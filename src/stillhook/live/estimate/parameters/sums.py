"""Balances that are linear in their parameters, as sums of products over half waves: fits, intervals, and steps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray, IntArray
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


EVEN = 1e-13
"""Ridge by which columns that change together are distinguished, of columns of unit length [-]."""


class Window(NamedTuple):
    """Half waves side by side (n,), and their sums G (n, k, k)."""

    t: FloatArray
    sign: FloatArray
    speed: FloatArray
    G: FloatArray


def window_of(rows: Sequence[Sums]) -> Window:
    """Half waves side by side."""
    return Window(*(np.array([getattr(r, name) for r in rows]) for name in ("t", "sign", "speed", "G")))


def inverse(A: FloatArray) -> FloatArray | None:
    """Inverse of a normal matrix of columns of unlike sizes; None where a column is empty."""
    scale = np.sqrt(np.diag(A))
    if not (scale > 0.0).all():
        return None
    unit = scale[:, None] * scale
    return np.asarray(np.linalg.inv(A / unit + EVEN * np.eye(len(A))) / unit)


def fit(w: Window, x: Sequence[int], y: FloatArray) -> Fit | None:
    """Least squares of a combination y (k,) of the columns on those with numbers x; None where it says nothing."""
    total = w.G.sum(axis=0)
    H = inverse(total[np.ix_(x, x)])
    if H is None:
        return None
    b = H @ (total[x] @ y)
    left = y.copy()
    left[list(x)] -= b
    influence = (w.G[:, x] @ left) @ H[0]
    n = len(w.t)
    return Fit(b, H, influence, scatter_of(influence, len(x)), t_factor(max(n - len(x), 1)))


def apart(w: Window, x: Sequence[int], y: FloatArray) -> float:
    """Half of the difference between the first coefficients of strong and of weak half waves, as many hoisting as
    lowering, with the others in common; 0 where one of both cannot be fitted."""
    fast = np.zeros(len(w.t), dtype=bool)
    for way in (w.sign > 0.0, w.sign <= 0.0):
        fast |= way & (w.speed > np.median(w.speed[way]) if way.any() else False)
    total, strong = w.G.sum(axis=0), w.G[fast].sum(axis=0)
    p = len(x)
    A, c = np.zeros((p + 1, p + 1)), np.zeros(p + 1)
    A[:p, :p], c[:p] = total[np.ix_(x, x)], total[x] @ y
    for i, part in ((0, total - strong), (p, strong)):
        A[i, :] = A[:, i] = 0.0
        A[i, i], c[i] = part[x[0], x[0]], part[x[0]] @ y
        A[i, 1:p] = A[1:p, i] = part[x[0], x[1:]]
    H = inverse(A)
    if H is None:
        return 0.0
    b = H @ c
    return 0.5 * abs(float(b[p] - b[0]))


class Sides(NamedTuple):
    """First coefficient before and after each place (P,), u standard uncertainty of the difference, and sum of squares
    that is left."""

    before: FloatArray
    after: FloatArray
    u: FloatArray
    left: FloatArray


def sides(w: Window, x: Sequence[int], y: FloatArray, places: IntArray, floor: float) -> Sides | None:
    """The first coefficient on both sides of half waves with numbers `places` (P,), which belong to neither; the others
    in common. floor: least scatter of a half wave. None where one side cannot be fitted."""
    G, p, first, others = w.G, len(x), x[0], list(x[1:])
    cumulative = np.concatenate([np.zeros((1, *G.shape[1:])), np.cumsum(G, axis=0)])
    old, new = cumulative[places], cumulative[-1] - cumulative[places + 1]
    both = old + new
    A, c = np.zeros((len(places), p + 1, p + 1)), np.zeros((len(places), p + 1))
    A[:, 1:p, 1:p], c[:, 1:p] = both[np.ix_(range(len(places)), others, others)], both[:, others] @ y
    for i, side in ((0, old), (p, new)):
        A[:, i, i], c[:, i] = side[:, first, first], side[:, first] @ y
        A[:, i, 1:p] = A[:, 1:p, i] = side[:, first][:, others]
    scale = np.sqrt(np.einsum("nii->ni", A))
    rest = inverse(G.sum(axis=0)[np.ix_(others, others)])
    if rest is None or not (scale > 0.0).all():
        return None
    unit = scale[:, :, None] * scale[:, None, :]
    H = np.linalg.inv(A / unit + EVEN * np.eye(p + 1)) / unit
    b = np.einsum("nij,nj->ni", H, c)
    pure = np.zeros(len(y))
    pure[first], pure[others] = 1.0, -rest @ G.sum(axis=0)[others, first]
    said = pure @ G  # (n, k)
    size = np.sqrt(np.maximum(said @ pure, 1e-300))
    explained = np.zeros((len(places), 2, len(y)))
    explained[:, :, others] = b[:, None, 1:p]
    explained[:, 0, first], explained[:, 1, first] = b[:, 0], b[:, p]
    residual = np.einsum("nk,psk->psn", said, y - explained) / size
    n = len(w.t)
    later = np.arange(n) > places[:, None]
    r = np.where(later, residual[:, 1], residual[:, 0]) * (np.arange(n) != places[:, None])
    scatter = np.maximum(np.sqrt(np.sum(r**2, axis=1) / (n - 2 - p)), floor * float(size.mean()))
    u = scatter * np.sqrt(H[:, 0, 0] + H[:, p, p] - 2.0 * H[:, 0, p])
    left = np.einsum("i,nij,j->n", y, both, y) - np.sum(b * c, axis=1)
    return Sides(b[:, 0], b[:, p], u, left)
