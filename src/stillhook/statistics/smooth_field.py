r"""A field over periods and directions, from estimates of some columns that have errors of their own.

Model of small areas (Fay and Herriot 1979) whose areas are correlated (kriging): estimate = mean + smooth part + part
of the column alone + sampling error of known variance. How large and how far-reaching the smooth part is, and how large
the columns' own, is not chosen: every combination of a grid counts by its marginal likelihood, so that the interval
holds what they differ by.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from stillhook.base.arrays import FloatArray

AMPLITUDES = (0.05, 0.1, 0.2, 0.4)
"""Standard deviations of the smooth part, in ln of the height."""
OWN = (0.03, 0.06, 0.12)
"""Standard deviations of the part of a column alone."""
OF_PERIOD = (0.12, 0.25, 0.5)
"""Correlation lengths in ln of the period."""
OF_ANGLE = (0.15, 0.5, 1.5)
"""Correlation lengths in the direction [rad]."""
MEAN_SD = 1.0
"""Standard deviation of the unknown mean, in ln of the height."""
DRAWS, SEED = 200, 1979
"""Draws of a field, and their seed."""


@dataclass(frozen=True, eq=False)
class Field:
    """Value (c,) in every column, its variance, and draws (m, c) of the whole field: errors of neighbours go
    together."""

    value: FloatArray = field(repr=False)
    var: FloatArray = field(repr=False)
    draws: FloatArray = field(repr=False)


def smooth_field(
    period: FloatArray,
    angle: FloatArray,
    value: FloatArray,
    var: FloatArray,
    *,
    expected: FloatArray | None = None,
    scale: FloatArray | None = None,
    seed: int = SEED,
    draws: int = DRAWS,
) -> Field:
    """Field from estimates value (c,) in ln of the height with variances var (c,).

    period [s], angle [rad] of the columns; expected (c,): what a cheaper method gives, about which the field may be
    smooth (None, or NaN somewhere: nothing), but for a factor; scale (c,): how much more than usual a column may differ
    from its neighbours (None: 1). seed of the draws, and how many there are.
    """
    flat = np.zeros_like(value)
    bases = [flat] if expected is None or not np.isfinite(expected).all() else [expected, flat]
    C = covariances(period, angle, np.ones_like(value) if scale is None else scale)
    K = C + np.diag(var)
    L = np.linalg.cholesky(K)
    ln_det = 2.0 * np.log(np.diagonal(L, axis1=1, axis2=2)).sum(axis=1)
    gain = np.swapaxes(np.linalg.solve(K, C), 1, 2)
    residuals = np.stack([value - base for base in bases])
    solved = np.linalg.solve(K, np.broadcast_to(residuals.T, (len(K), len(value), len(bases))))
    ln_weight = -0.5 * (np.einsum("bi,gib->bg", residuals, solved) + ln_det)
    weight = np.exp(ln_weight - ln_weight.max())
    weight /= weight.sum()
    means = np.stack(bases)[:, None] + np.einsum("gij,bj->bgi", gain, residuals)
    left = C - gain @ C
    mean = np.einsum("bg,bgi->i", weight, means)
    own = np.einsum("bg,gii->i", weight, left) + np.einsum("bg,bgi->i", weight, (means - mean) ** 2)
    return Field(mean, np.maximum(own, 0.0), _draws(weight, means, left, seed, draws))


def covariances(
    period: FloatArray,
    angle: FloatArray,
    scale: FloatArray,
    amplitudes: Sequence[float] = AMPLITUDES,
    own: Sequence[float] = OWN,
    of_period: Sequence[float] = OF_PERIOD,
    of_angle: Sequence[float] = OF_ANGLE,
) -> FloatArray:
    """Covariance between columns (g, c, c) of every combination of a grid; scale (c,) as in `smooth_field`."""
    ln_T = np.log(period)
    apart = ln_T[:, None] - ln_T
    turned = np.abs((angle[:, None] - angle + math.pi) % (2.0 * math.pi) - math.pi)
    lengths = itertools.product(of_period, of_angle)
    alike = np.array([np.exp(-0.5 * ((apart / T) ** 2 + (turned / b) ** 2)) for T, b in lengths])
    alone = np.eye(len(period))
    parts = np.concatenate([alike * A**2 + alone * N**2 for A, N in itertools.product(amplitudes, own)])
    return np.asarray(parts * np.outer(scale, scale) + MEAN_SD**2)


def _draws(weight: FloatArray, means: FloatArray, left: FloatArray, seed: int, draws: int) -> FloatArray:
    """Draws (m, c) of the field: a combination by its weight, then its field."""
    rng = np.random.default_rng(seed)
    chosen = rng.choice(weight.size, size=draws, p=weight.ravel())
    drawn = np.empty((draws, means.shape[2]))
    for each in np.unique(chosen):
        b, g = divmod(int(each), weight.shape[1])
        rows = np.flatnonzero(chosen == each)
        values, vectors = np.linalg.eigh(0.5 * (left[g] + left[g].T))
        root = (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T  # the one root that changes little with `left`
        drawn[rows] = means[b, g] + rng.standard_normal((len(rows), len(values))) @ root.T
    return drawn
