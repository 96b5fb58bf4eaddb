"""Least squares whose intervals are from leaving out groups of rows, one after the other.

Rows that are alike (one level of a map, one stretch of a log) deviate alike where the law is not quite right or a
sensor drifts. A group left out shows by how much the parameters depend on it, whatever the reason.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.statistics.estimate import Estimate, t_factor

Labels = NDArray[Any]
FEWEST_GROUPS = 3
RANK = 1e-9
"""Least eigenvalue of a scaled curvature that counts as determined."""


def spread_of_groups(J: FloatArray, r: FloatArray, groups: Labels) -> FloatArray | None:
    """Covariance of the parameters times the square of Student's t (p, p): the linear jackknife over groups (CR3).

    Parameters: J (n, p) derivatives, r (n,) residuals at the optimum, groups (n,) label of each row. None for fewer
    than three groups, or where one of them alone determines a parameter.
    Source: Bell and McCaffrey 2002, "Bias reduction in standard errors for linear regression with multi-stage samples".
    """
    names = np.unique(groups)
    if len(names) < FEWEST_GROUPS:
        return None
    scale = np.linalg.norm(J, axis=0)
    if not scale.all():
        return None
    S = J / scale
    H, shifts = S.T @ S, []
    for name in names:
        part = groups == name
        left = H - S[part].T @ S[part]
        if np.linalg.eigvalsh(left)[0] < RANK:
            return None
        shifts.append(np.linalg.solve(left, S[part].T @ r[part]) / scale)
    d, m = np.array(shifts), len(names)
    covariance: FloatArray = t_factor(m - 1) ** 2 * (m - 1) / m * (d.T @ d)
    return covariance


@dataclass(frozen=True)
class Linear:
    """A linear fit: parameters (p,), residuals (n,), and for each grouping of the rows that can be left out the
    covariance times t squared, by its name."""

    theta: FloatArray
    residual: FloatArray
    spreads: Mapping[str, FloatArray]

    def half(self, x: FloatArray) -> float:
        """Half of the 95 % interval of x times the parameters, the widest of all groupings; NaN without any."""
        return max((math.sqrt(max(float(x @ C @ x), 0.0)) for C in self.spreads.values()), default=math.nan)

    def estimate(self, i: int) -> Estimate:
        """A parameter with its 95 % interval."""
        return Estimate.around(float(self.theta[i]), self.half(np.eye(len(self.theta))[i]), len(self.residual))

    def estimates(self) -> list[Estimate]:
        """All of them."""
        return [self.estimate(i) for i in range(len(self.theta))]


def linear_fit(X: FloatArray, y: FloatArray, groupings: Mapping[str, Labels]) -> Linear:
    """Least squares of y (n,) on X (n, p), with the intervals of every grouping of its rows."""
    scale = np.where(np.linalg.norm(X, axis=0) > 0.0, np.linalg.norm(X, axis=0), 1.0)
    theta = np.linalg.lstsq(X / scale, y, rcond=None)[0] / scale
    residual = y - X @ theta
    found = {name: spread_of_groups(X, residual, of) for name, of in groupings.items()}
    return Linear(theta, residual, {name: C for name, C in found.items() if C is not None})


def held_out(X: FloatArray, y: FloatArray, groups: Labels) -> FloatArray | None:
    """What each row differs by from a fit without its group (n,); None where a group alone determines a parameter."""
    out = np.empty(len(y))
    names = np.unique(groups)
    norm = np.maximum(np.linalg.norm(X, axis=0), 1e-300)
    for name in names:
        part = groups == name
        if np.linalg.matrix_rank(X[~part] / norm, tol=RANK) < X.shape[1]:
            return None
        out[part] = y[part] - X[part] @ linear_fit(X[~part], y[~part], {}).theta
    return out if len(names) > 1 else None


def rms(x: FloatArray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(x**2)))


def rms_held_out(X: FloatArray, y: FloatArray, groupings: Mapping[str, Labels], over: float) -> dict[str, float]:
    """Root mean square of `held_out` over a number, by the name of each grouping that can be left out."""
    left = {name: held_out(X, y, of) for name, of in groupings.items()}
    return {name: rms(x) / over for name, x in left.items() if x is not None}


def stretches(n: int, most: int = 12, weight: Sequence[float] | FloatArray | None = None) -> Labels:
    """Label of the stretch of time that each of n rows is in, at most so many; of equal sums of `weight` (n,)."""
    w = np.ones(n) if weight is None else np.asarray(weight, dtype=float)
    total, count = np.cumsum(w), min(most, n)
    labels: Labels = np.minimum((total - 0.5 * w) / max(float(total[-1]), 1e-300) * count, count - 1).astype(np.intp)
    return labels
