"""The crane tip's motion from a log: one smooth curve through measured position and speed together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import ValidateError
from stillhook.sea.motion.recorded import FEWEST_POINTS, Recorded

KNOTS = 0.4
"""Spacing of the curve's points [s]: waves of 2 s and longer pass with less than 0.1 % lost. Two samples where they are
slower."""
SLOWEST = 0.25
"""Longest spacing of samples that still allows a tip motion [s]: waves of 4 s pass with less than 0.1 % lost."""
ROUNDS = 3


@dataclass(frozen=True)
class Tip:
    """motion: smooth, t = 0 at the first sample; noise (n,): measured position less the curve [m], NaN where it was not
    measured; spread_s, spread_v: rms deviation of position and speed from the curve [m], [m/s], spread_v NaN
    without a measured speed.
    """

    motion: Recorded
    noise: FloatArray
    spread_s: float
    spread_v: float


def smooth_tip(t: FloatArray, s: FloatArray, v: FloatArray | None, *, place: str) -> Tip:
    """Quintic spline with a point every KNOTS seconds or so, least squares through position and speed, each weighted by
    its own spread.

    Parameters: t (n,) [s], even; s tip height [m], v its measured speed [m/s] or None, NaN where missing; place names
    it in errors. A speed that does not agree with the position gets a wide spread, and so little weight. Errors:
    ValidateError for too short a part.
    """
    from scipy.interpolate import BSpline  # heavy: only where data are at hand

    t = t - t[0]
    step = float(t[-1] / (len(t) - 1))
    count = int(t[-1] / max(KNOTS, 2.0 * step))
    grid = np.linspace(0.0, t[-1], count + 1)
    if count < 2 * FEWEST_POINTS or step > SLOWEST + 1e-9:
        raise ValidateError(
            f"{place}: {len(t)} samples over {t[-1]:.3g} s are too few for a tip motion. Log longer or faster."
        )
    # The knots of the curve through the points of the grid (not-a-knot ends), so that `Recorded` is this very curve.
    knots = np.concatenate((np.full(6, 0.0), grid[3:-3], np.full(6, t[-1])))
    shift = float(np.nanmean(s))
    known_s, known_v = np.isfinite(s), np.isfinite(v) if v is not None else np.zeros(len(t), dtype=bool)
    B = BSpline.design_matrix(t, knots, 5)
    dB = _slopes(t, knots) if v is not None else None
    spread_s, spread_v = 1.0, np.inf
    c = np.zeros(len(knots) - 6)
    for _ in range(ROUNDS if v is not None else 1):
        N, y = _normal(B, np.where(known_s, s - shift, 0.0), known_s / spread_s**2)
        if v is not None and dB is not None and np.isfinite(spread_v):
            more, z = _normal(dB, np.where(known_v, v, 0.0), known_v / spread_v**2)
            N, y = N + more, y + z
        c = _solved(N, y, place)
        spread_s = max(_rms((s - shift - B @ c)[known_s]), 1e-5)
        if v is not None and dB is not None:
            spread_v = max(_rms((v - dB @ c)[known_v]), 1e-5) if known_v.any() else np.inf
    noise = s - shift - B @ c
    heights = BSpline.design_matrix(grid, knots, 5) @ c + shift
    return Tip(Recorded(grid, heights, source=place), noise, spread_s, spread_v if np.isfinite(spread_v) else np.nan)


def _slopes(t: FloatArray, knots: FloatArray) -> Any:
    """Slopes of the quintic basis at t, as a sparse matrix."""
    from scipy.interpolate import BSpline
    from scipy.sparse import diags

    m = len(knots) - 6
    over = 5.0 / (knots[6 : m + 5] - knots[1:m])
    lower = BSpline.design_matrix(t, knots[1:-1], 4)
    return lower @ diags([-over, over], [0, 1], shape=(m - 1, m))


def _normal(A: Any, y: FloatArray, weight: FloatArray) -> tuple[Any, FloatArray]:
    from scipy.sparse import diags

    W = diags(weight)
    return A.T @ W @ A, A.T @ (weight * y)


def _solved(N: Any, y: FloatArray, place: str) -> FloatArray:
    """Banded, so quick for any length. Errors: ValidateError where a gap leaves the curve undetermined."""
    from scipy.linalg import LinAlgError, solveh_banded

    band = np.zeros((6, len(y)))
    for k in range(6):
        band[k, : len(y) - k] = N.diagonal(-k)
    try:
        out: FloatArray = solveh_banded(band, y, lower=True)
    except LinAlgError:
        raise ValidateError(
            f"{place}: s_tip has gaps longer than {KNOTS:g} s. State start and end of the test so that they are"
            " outside."
        ) from None
    return out


def _rms(x: FloatArray) -> float:
    return float(np.sqrt(np.mean(x**2))) if len(x) else np.inf
