"""Output-error fit: parameters of the twin that bring its outputs nearest to measured ones, with intervals that know of model errors."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook.validate.record import FloatArray

ROUNDS = 4
"""Times that the weights of the signals are found anew from what is left of them; they settle within three."""
MOST_RUNS = 40
"""Evaluations of the model in one round."""
TOLERANCE = 1e-5
"""Relative change of cost or parameters at which a round has converged: a hundredth of a deviation."""
FAR = 1e3
"""Residual, in the signal's noise, that stands for a run without numbers: the step that led there is refused."""


ENDS = {
    -1: "the numbers went bad", 0: "the runs were used up", 1: "the slope is nil", 2: "the misfit settled", 3: "the numbers settled",
    4: "misfit and numbers settled",
}  # fmt: skip
"""How a round of scipy's least_squares ended."""


class Model(NamedTuple):
    """What is fitted. evaluate(theta) -> outputs less measurements (n,) and their derivatives (n, p), in SI, NaN where not compared;
    signal (n,) which signal a row is of; cluster (n,) which transient it is of; noise least deviation that a signal can have [SI];
    spread (p,) deviation of the parameters before any data (inf: none); low, high their bounds."""

    evaluate: Callable[[FloatArray], tuple[FloatArray, FloatArray]]
    signal: NDArray[np.int64]
    cluster: NDArray[np.int64]
    noise: FloatArray
    spread: FloatArray
    low: FloatArray
    high: FloatArray


@dataclass(frozen=True)
class Fit:
    """theta (p,); covariance (p, p) from leaving out one transient after the other; known (p,) deviations if the residuals were white
    noise, what the data can tell at best; deviation of each signal's residuals [SI]; residuals (n,) [SI], NaN where not compared;
    converged, and what was said; runs of the model in all; clusters that it rests on."""

    theta: FloatArray
    covariance: FloatArray
    known: FloatArray
    deviation: FloatArray
    residuals: FloatArray
    converged: bool
    said: str
    runs: int
    clusters: int


def fit(model: Model, start: FloatArray) -> Fit:
    """Levenberg-Marquardt steps (scipy's trust region) on residuals over each signal's own deviation, which is found again each round.

    Parameters: start (p,). A signal counts by what the model leaves of it, but never by less than its noise.
    """
    from scipy.optimize import least_squares

    counter, theta, said, converged = _Counter(model), start, "", False
    s = _deviations(model, counter(theta)[0])
    for _ in range(ROUNDS):
        weighted = _Weighted(model, counter, s)
        found = least_squares(
            weighted.residuals, theta, jac=weighted.jacobian, bounds=(model.low, model.high), x_scale=_scales(model),
            ftol=TOLERANCE, xtol=TOLERANCE, gtol=1e-12, max_nfev=MOST_RUNS,
        )  # fmt: skip
        theta, converged, said = found.x, found.status > 0, ENDS[int(found.status)]
        new = _deviations(model, counter(theta)[0])
        settled = bool(np.all(np.abs(new - s) < 0.02 * s))
        s = new
        if settled:
            break
    r, J = counter(theta)
    covariance, known = _covariance(model, r, J, s)
    return Fit(theta, covariance, known, s, r, converged, said, counter.runs, len(np.unique(model.cluster[np.isfinite(r)])))


def _scales(model: Model) -> FloatArray:
    return np.where(np.isfinite(model.spread), np.minimum(model.spread, 0.1 * (model.high - model.low)), 0.05 * (model.high - model.low))


class _Counter:
    """Remembers the model's last values: residuals and derivatives are asked for one after the other at one place."""

    def __init__(self, model: Model) -> None:
        self.model, self.runs = model, 0
        self._at: bytes = b""
        self._last: tuple[FloatArray, FloatArray] = (np.empty(0), np.empty((0, 0)))

    def __call__(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        if self._at != theta.tobytes():
            self._last, self._at = self.model.evaluate(theta), theta.tobytes()
            self.runs += 1
        return self._last


class _Weighted:
    """Residuals in deviations of their signal, with a row for what is known of each parameter beforehand."""

    def __init__(self, model: Model, values: _Counter, s: FloatArray) -> None:
        self.values, self.weight = values, 1.0 / s[model.signal]
        self.prior = 1.0 / model.spread

    def residuals(self, theta: FloatArray) -> FloatArray:
        r = self.values(theta)[0] * self.weight
        return np.concatenate([np.where(np.isfinite(r), r, 0.0), self.prior * theta])

    def jacobian(self, theta: FloatArray) -> FloatArray:
        r, J = self.values(theta)
        rows = np.where(np.isfinite(r)[:, None], J * self.weight[:, None], 0.0)
        return np.vstack([rows, np.diag(self.prior)])


def _deviations(model: Model, r: FloatArray) -> FloatArray:
    """Root mean square of each signal's residuals, at least its noise."""
    out = model.noise.copy()
    for k in range(len(out)):
        own = r[(model.signal == k) & np.isfinite(r)]
        if len(own):
            out[k] = max(out[k], math.sqrt(float(np.mean(own**2))))
    return out


def _covariance(model: Model, r: FloatArray, J: FloatArray, s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Covariance of the parameters by leaving out each cluster (the linear jackknife, CR3), and their deviations if the residuals were
    white. Model errors are alike within a transient and differ between them; with few clusters the jackknife errs on the wide side.

    Source: Bell and McCaffrey 2002, "Bias reduction in standard errors for linear regression with multi-stage samples".
    """
    ok = np.isfinite(r)
    w = 1.0 / s[model.signal[ok]]
    Jw, rw, cluster = J[ok] * w[:, None], r[ok] * w, model.cluster[ok]
    prior = np.diag(model.spread**-2.0)
    H = Jw.T @ Jw + prior
    names = np.unique(cluster)
    shifts = []
    for g in names:
        own = cluster == g
        H_g = H - Jw[own].T @ Jw[own]
        shifts.append(np.linalg.lstsq(H_g, Jw[own].T @ rw[own], rcond=None)[0])
    d = np.array(shifts)
    n = len(names)
    covariance = (n - 1) / n * (d.T @ d) if n > 1 else np.full_like(H, np.inf)
    return covariance, np.sqrt(np.diag(np.linalg.pinv(H)))
