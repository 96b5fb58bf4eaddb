"""Output-error fit: parameters of the twin that bring its outputs nearest to measured ones, with intervals that include
model errors."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray

ROUNDS = 6
"""Number of times that the weights of the signals are recomputed from their residuals."""
FIRST_ROUNDS, FIRST_RUNS = 3, 5
"""Rounds on the way, whose weights are far off still, and evaluations of the model in each."""
MOST_RUNS = 40
"""Evaluations of the model in one of the last rounds."""
TOLERANCE = 1e-5
"""Relative change of cost or parameters at which a round has converged: a hundredth of a deviation."""
FAR = 1e3
"""Residual, in the signal's noise, that stands for a run without numbers: the step that led there is refused."""


ALIKE = 100
"""Residuals are assumed correlated over at most this many samples (weights fall to none, as Bartlett's): a second at 10
ms, two periods of the winch's swing."""
SETTLED = 0.1
"""Relative change of a signal's deviation between rounds that counts as none."""
LEAST_CURVATURE = 1e-10
"""Least eigenvalue of the scaled curvature: a direction that the data leave quite open."""
ENDS = {
    -1: "the values diverged",
    0: "the number of runs was exhausted",
    1: "the gradient is zero",
    2: "the misfit settled",
    3: "the parameters settled",
    4: "misfit and parameters settled",
}
"""How a round of scipy's least_squares ended."""


class Model(NamedTuple):
    """evaluate(theta) -> outputs less measurements (n,) and derivatives (n, p), in SI, NaN where not compared; signal,
    cluster (n,) of each row; noise: least deviation of a signal [SI]; centre, spread (p,): parameters before any data,
    and deviation (inf: not known); varies (p,): deviation from transient to transient (0: none); low, high: bounds."""

    evaluate: Callable[[FloatArray], tuple[FloatArray, FloatArray]]
    signal: NDArray[np.int64]
    cluster: NDArray[np.int64]
    noise: FloatArray
    centre: FloatArray
    spread: FloatArray
    varies: FloatArray
    low: FloatArray
    high: FloatArray

    @property
    def prior(self) -> FloatArray:
        """Curvature of the misfit from what is known of the parameters before any data (p,)."""
        return self.spread**-2.0


@dataclass(frozen=True)
class Fit:
    """theta (p,); covariance (p, p) from leaving out one transient after the other; message of the optimiser; runs of
    the model; names (n,) of the clusters, and of each curvature H (n, p, p) and slope g (n, p) of the misfit at theta,
    in deviations; prior (p,) curvature of what was known beforehand, off (p,) theta less its centre."""

    theta: FloatArray
    covariance: FloatArray
    converged: bool
    message: str
    runs: int
    names: NDArray[np.int64]
    H: FloatArray
    g: FloatArray
    prior: FloatArray
    off: FloatArray

    @property
    def clusters(self) -> int:
        """Number of clusters."""
        return len(self.names)


def fit(model: Model, start: FloatArray) -> Fit:
    """Levenberg-Marquardt steps (scipy's trust region) on residuals over each signal's own deviation, found again each
    round: by what the model leaves of it, but never less than its noise; residuals that are alike over many samples
    count as one."""
    from scipy.optimize import least_squares

    samples, theta, message, converged = _Samples(model, start), start, "", False
    s = samples.deviations(theta)
    width = model.high - model.low
    scale = np.where(np.isfinite(model.spread), np.minimum(model.spread, 0.1 * width), 0.05 * width)
    for i in range(ROUNDS):
        result = least_squares(
            lambda x, s: _rows(samples, s, x)[0],
            theta,
            jac=lambda x, s: _rows(samples, s, x)[1],
            args=(s,),
            bounds=(model.low, model.high),
            x_scale=scale,
            ftol=TOLERANCE,
            xtol=TOLERANCE,
            gtol=1e-12,
            max_nfev=FIRST_RUNS if i < FIRST_ROUNDS else MOST_RUNS,
        )
        theta, converged, message = result.x, result.status > 0, ENDS[int(result.status)]
        samples.look_from(theta)
        new = samples.deviations(theta)
        settled = bool(np.all(np.abs(new - s) < SETTLED * s))
        s = new
        if settled and converged:
            break
    sums = samples.sums(theta)
    H, g, _ = sums.weighed(s, model.varies)
    return Fit(
        theta=theta,
        covariance=_covariance(model, H, g),
        converged=converged,
        message=message,
        runs=samples.runs,
        names=sums.names,
        H=H,
        g=g,
        prior=model.prior,
        off=theta - model.centre,
    )


class _Sums(NamedTuple):
    """Sums over the samples of each cluster and signal: H (clusters, signals, p, p) of products of derivatives, g
    (clusters, signals, p) of derivatives and residuals, c (clusters, signals) of squared residuals, n their number;
    windows: of squared sums of residuals over ALIKE samples, which are as large as c where they are independent, and
    larger where they are alike; P, q, B as H, g and H with the directions in which clusters vary (clusters, signals, m,
    ...); names of the
    clusters."""

    H: FloatArray
    g: FloatArray
    c: FloatArray
    n: FloatArray
    windows: FloatArray
    P: FloatArray
    q: FloatArray
    B: FloatArray
    names: NDArray[np.int64]

    def weighed(self, s: FloatArray, varies: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The sums of each cluster over the deviations s of its signals, without what parameters that vary from cluster
        to cluster explain: H (clusters, p, p), g (clusters, p), c (clusters,).

        A parameter with a deviation in `varies` has in each cluster its own value in addition to the common one;
        taken out by its best value (the Schur complement), it leaves what the cluster shows of the common one.
        """
        w = s**-2.0
        H, g, c = np.einsum("k,gkpq->gpq", w, self.H), np.einsum("k,gkp->gp", w, self.g), np.sum(w * self.c, axis=1)
        P, q, B = (
            np.einsum("k,gkmp->gmp", w, self.P),
            np.einsum("k,gkm->gm", w, self.q),
            np.einsum("k,gkmn->gmn", w, self.B),
        )
        A = B + np.diag(varies[varies > 0.0] ** -2.0)
        for i in range(len(H)):
            x, X = np.linalg.solve(A[i], q[i]), np.linalg.solve(A[i], P[i])
            H[i], g[i], c[i] = H[i] - P[i].T @ X, g[i] - P[i].T @ x, c[i] - q[i] @ x
        return H, g, c


class _Samples:
    """Residuals and derivatives at the last place, and their sums: both are needed one after the other. The directions
    in which clusters vary are the derivatives where the round began: within a round the misfit is one function."""

    def __init__(self, model: Model, start: FloatArray) -> None:
        self.model, self.runs = model, 0
        self._at: bytes = b""
        self.r, self.J = np.empty(0), np.empty((0, 0))
        self._sums: _Sums | None = None
        self.look_from(start)

    def look_from(self, theta: FloatArray) -> None:
        """Take the directions in which clusters vary from here."""
        self._evaluate(theta)
        self.directions = self.J[:, self.model.varies > 0.0].copy()
        self._sums = None

    def _evaluate(self, theta: FloatArray) -> None:
        if self._at != theta.tobytes():
            self.r, self.J = self.model.evaluate(theta)
            self._at, self._sums = theta.tobytes(), None
            self.runs += 1

    def sums(self, theta: FloatArray) -> _Sums:
        """The sums at a place, by loops that round alike on any number of threads."""
        self._evaluate(theta)
        if self._sums is None:
            self._sums = self._summed()
        return self._sums

    def _summed(self) -> _Sums:
        m = self.model
        names = np.unique(m.cluster[np.isfinite(self.r)])
        rows = []
        for name in names:
            for k in range(len(m.noise)):
                rows_of = (m.cluster == name) & (m.signal == k) & np.isfinite(self.r)
                r, J, V = self.r[rows_of], self.J[rows_of], self.directions[rows_of]
                one = np.einsum("np,nq->pq", J, J), np.einsum("np,n->p", J, r), np.sum(r**2), rows_of.sum(), _windows(r)
                rows.append(
                    (*one, np.einsum("nm,np->mp", V, J), np.einsum("nm,n->m", V, r), np.einsum("nm,np->mp", V, V))
                )
        shape = len(names), len(m.noise)
        H, g, c, n, windows, P, q, B = (
            np.array(x, dtype=np.float64).reshape(*shape, *np.shape(x[0])) for x in zip(*rows, strict=True)
        )
        return _Sums(H=H, g=g, c=c, n=n, windows=windows, P=P, q=q, B=B, names=names)

    def deviations(self, theta: FloatArray) -> FloatArray:
        """Deviation of each signal's residuals: root mean square, at least the noise, times the root of the samples
        over which they are alike."""
        x = self.sums(theta)
        c = x.c.sum(axis=0)
        alike = x.windows.sum(axis=0) / np.maximum(c, 1e-300)
        rms = np.sqrt(c / np.maximum(x.n.sum(axis=0), 1.0))
        return np.asarray(np.maximum(self.model.noise, rms) * np.sqrt(np.maximum(alike, 1.0)))


def _windows(r: FloatArray) -> float:
    """Sum of squares of the sums of residuals over every window of ALIKE samples, over ALIKE."""
    ends = np.concatenate([np.zeros(ALIKE), np.cumsum(r), np.full(ALIKE - 1, r.sum())])
    return float(np.sum((ends[ALIKE:] - ends[:-ALIKE]) ** 2)) / ALIKE


def _rows(samples: _Samples, s: FloatArray, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The least-squares problem in as few rows as there are parameters: residuals and their derivatives with equal
    misfit, slope and curvature, from the sums alone.

    With H = V L V' the rows are L^1/2 V' and their residuals L^-1/2 V' g; one more row holds what of the misfit no
    parameter changes. What is known of the parameters beforehand is in H and g.
    """
    model = samples.model
    parts, off = samples.sums(theta).weighed(s, model.varies), theta - model.centre
    H, g = parts[0].sum(axis=0) + np.diag(model.prior), parts[1].sum(axis=0) + model.prior * off
    c = float(parts[2].sum() + np.sum(model.prior * off**2))
    d = _scale(H)
    values, vectors = np.linalg.eigh(H / np.outer(d, d))
    root = np.sqrt(np.maximum(values, LEAST_CURVATURE))
    f = (vectors.T @ (g / d)) / root
    remainder = math.sqrt(max(c - float(np.sum(f**2)), 0.0))
    return np.append(f, remainder), np.vstack([root[:, None] * vectors.T * d, np.zeros(len(theta))])


def _scale(H: FloatArray) -> FloatArray:
    """Root of the diagonal, 1 for a parameter that changes nothing."""
    d = np.sqrt(np.diag(H))
    return np.where(d > 0.0, d, 1.0)


def _covariance(model: Model, H_of: FloatArray, g_of: FloatArray) -> FloatArray:
    """Covariance of the parameters by leaving out each cluster (the linear jackknife, CR3), from curvature and slope of
    the clusters. Model errors are alike within a transient and differ between them; with few clusters the jackknife is
    conservative. What was known beforehand counts as one observation more of each parameter, with its own deviation.

    Source: Bell and McCaffrey 2002, "Bias reduction in standard errors for linear regression with multi-stage samples".
    """
    prior, n = np.diag(model.prior), len(H_of)
    H = H_of.sum(axis=0) + prior
    if n < 2:
        return np.full_like(H, np.inf)
    d = _scale(H)
    scale = np.outer(d, d)
    shifts = np.array(
        [
            np.linalg.lstsq((H - cluster) / scale, g / d, rcond=LEAST_CURVATURE)[0] / d
            for cluster, g in zip(H_of, g_of, strict=True)
        ]
    )
    inverse = np.linalg.pinv(H / scale, rcond=LEAST_CURVATURE) / scale
    covariance: FloatArray = (n - 1) / n * np.einsum("gp,gq->pq", shifts, shifts) + inverse @ prior @ inverse
    return covariance
