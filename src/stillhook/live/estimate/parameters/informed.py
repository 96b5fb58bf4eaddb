"""Fits with nuisances that have limits of error: laws of the leakage that rows can and cannot tell apart."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.live.estimate.parameters.balances import FLOW
from stillhook.live.estimate.parameters.sums import Window, inverse, scatter_of
from stillhook.validate.parameters.leak_laws import RISE

ROUNDS = 4
"""Rounds in which scatter, and what limits scale with, are found."""
LEAST_SIZE = 0.2
"""Least leakage over the file's that its shapes are limited by (as `stillhook.validate.parameters.leak_laws`)."""
WHOLE = 1.0
"""Limit of a shape: from a leakage that does not vary with stroke or speed to one that is proportional to it [-]."""
SHAPES = ("stroke", "speed", "pressure")
"""What a leakage may vary with otherwise than the file's."""


class Nuisance(NamedTuple):
    """A combination (k,) of the columns, and the limit of its coefficient."""

    column: FloatArray
    limit: float


class Informed(NamedTuple):
    """b (p,) coefficients, free ones first; answer (p, k): their change per error of a column; effects: change (p,)
    that a nuisance at its limit makes; influence (n, p) of each half wave; limited: what nuisances explain, a
    combination (k,) of the columns; free: number of free ones."""

    b: FloatArray
    answer: FloatArray
    effects: Mapping[str, FloatArray]
    influence: FloatArray
    limited: FloatArray
    free: int


def leak_shapes(total: FloatArray) -> dict[str, Nuisance]:
    """Laws of the leakage that pass the same oil as the file's in all, by the sums (k, k) of the flow balance: more
    with the pumps' stroke, the motors' speed or the pressure, and less without."""
    side = total[FLOW.index("side")]
    mean = {n: float(side[FLOW.index(n)] / side[FLOW.index("head")]) for n in ("leak", *SHAPES)}
    out = {}
    for name, limit in zip(SHAPES, (WHOLE / mean["stroke"], WHOLE / mean["speed"], RISE), strict=True):
        column = np.zeros(len(FLOW))
        column[FLOW.index(name)], column[FLOW.index("head")] = mean["leak"], -mean["leak"] * mean[name]
        out[name] = Nuisance(column, limit)
    return out


def informed(
    w: Window,
    X: FloatArray,
    nuisances: Mapping[str, Nuisance],
    y: FloatArray,
    scaled: Mapping[str, int],
    unclosed: FloatArray,
) -> Informed | None:
    """Least squares of a combination y (k,) of the columns on free ones X (n, p, k), which may differ by half wave, and
    on nuisances that are even within their limits; scaled: those whose limit is proportional to a free coefficient, by
    its number; unclosed: what the balance leaves open for any rows, a combination (k,). None where the rows say
    nothing.

    A limit a is a variance of a^2 / 3, which counts as much as the scatter of the half waves lets the rows count: the
    largest over the free columns, of scores that are correlated (`scatter_of`), and what is unclosed. Without the
    latter half waves that are all alike, of a regular sea, would show none.
    """
    n, p, k = X.shape
    limited = np.array([x.column for x in nuisances.values()]).reshape(-1, k)
    X = np.concatenate([X, np.broadcast_to(limited, (n, *limited.shape))], axis=1)
    XG = np.einsum("npk,nkl->npl", X, w.G)
    A, c = np.einsum("npl,nql->pq", XG, X), np.einsum("npl,l->p", XG, y)
    free = inverse(A[:p, :p])
    if free is None:
        return None
    H = np.zeros_like(A)
    H[:p, :p] = free
    size = np.sqrt(np.diag(A))
    least = float(np.max(np.sum((XG[:, :p] @ unclosed) ** 2, axis=0) / size[:p] ** 2))
    limits, weight, s2 = np.zeros(len(nuisances)), np.zeros(len(A)), 0.0
    for _ in range(ROUNDS if nuisances else 0):
        b = H @ c
        scores = np.einsum("npl,nl->np", XG, y - np.einsum("npk,p->nk", X, b))
        s2 = least + max(scatter_of(scores[:, i] / size[i], p) for i in range(p)) ** 2
        limits = np.array(
            [x.limit * (max(b[scaled[name]], LEAST_SIZE) if name in scaled else 1.0) for name, x in nuisances.items()]
        )
        weight[p:] = 3.0 * s2 / np.maximum(limits, 1e-9 * limits.max()) ** 2
        found = inverse(A + np.diag(weight))
        if found is None:
            return None
        H = found
    b = H @ c
    scores = np.einsum("npl,nl->np", XG, y - np.einsum("npk,p->nk", X, b))
    effects = {name: H[:, p + i] * weight[p + i] * limits[i] for i, name in enumerate(nuisances)}
    return Informed(b, H @ XG.sum(axis=0), effects, scores @ H.T, b[p:] @ limited, p)
