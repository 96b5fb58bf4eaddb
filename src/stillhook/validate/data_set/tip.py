"""The crane tip's motion from a log: one smooth curve through measured position and speed together.

Wire and tip of a record: as logged, or derived from other signals.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import drum_record
from stillhook.errors import ValidateError
from stillhook.physics.load_path.drum import layer_diameter, wire_to_layer
from stillhook.sea.motion.recorded import FEWEST_POINTS, Recorded
from stillhook.spec.crane import Crane
from stillhook.validate.criteria.notes import Note
from stillhook.validate.data_set.campaign import CraneTest, Kind
from stillhook.validate.data_set.record import filled

KNOTS = 0.4
"""Spacing of the curve's points [s]: waves of 2 s and longer pass with less than 0.1 % lost. Two samples where they are
slower."""
SLOWEST = 0.25
"""Longest spacing of samples that still allows a tip motion [s]: waves of 4 s pass with less than 0.1 % lost."""
ROUNDS = 3
"""Rounds of weighting position and speed by their spread, and of integrating the motors' speed with the diameter of the
last layer: wire over a few layers needs two."""


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
        raise ValidateError(Note("tip-too-short", place=place, n=len(t), seconds=t[-1]))
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
        raise ValidateError(Note("tip-gaps", place=place, longest=KNOTS)) from None
    return out


def _rms(x: FloatArray) -> float:
    return float(np.sqrt(np.mean(x**2))) if len(x) else np.inf


BEYOND = 0.5
"""Tolerance of wire out beyond the drum's range [m]: zero of an encoder."""
APART = 5.0
"""Difference between stated and logged wire out that is reported [m]: some turns of the drum."""


def completed(
    signals: Mapping[str, FloatArray], step: float, test: CraneTest, crane: Crane
) -> tuple[dict[str, FloatArray], frozenset[str], list[Note]]:
    """The signals with wire out and tip where they can be derived, the names of the derived ones, and statements about
    them.

    Errors: ValidateError where a test of heave compensation lacks the tip or the wire, another one every signal of the
    winch's motion, or the wire out is outside the drum's range.
    """
    out, derived, statements = dict(signals), set(), list[Note]()
    if "s_w" in out:
        _check_range(out["s_w"], test, crane)
        first = out["s_w"][np.isfinite(out["s_w"])][:1]
        if test.s_w is not None and len(first) and abs(first[0] - test.s_w) > APART:
            statements.append(Note("other-start", test=test.name, log=float(first[0]), stated=test.s_w))
    elif (made := _integrated(out, step, test, crane)) is not None:
        out["s_w"], source = made
        derived.add("s_w")
        statements.append(Note(f"wire-by-{source}", test=test.name, start=test.s_w))
    if "s_tip" not in out and {"e_c_measured", "s_w"} <= out.keys() and "s_w" not in derived and test.kind is Kind.AHC:
        out["s_tip"] = out["e_c_measured"] + out["s_w"]
        derived.add("s_tip")
        statements.append(Note("tip-derived", test=test.name))
    _check_needed(out, test)
    return out, frozenset(derived), statements


def _check_needed(signals: Mapping[str, FloatArray], test: CraneTest) -> None:
    of, needed = {"test": test.name, "log": test.log.name}, ("s_tip", "s_w") if test.kind is Kind.AHC else ()
    for name in needed:
        if name not in signals:
            raise ValidateError(Note(f"map-{name}", **of))
    if not {"s_w", "v_w", "omega_m"} & signals.keys():
        raise ValidateError(Note("map-motion", **of))
    for name in needed:
        if not np.isfinite(signals[name]).any():
            raise ValidateError(Note("no-values", signal=name, **of))


def _check_range(s_w: FloatArray, test: CraneTest, crane: Crane) -> None:
    L = drum_record(crane).L_full
    if not np.isfinite(s_w).any():
        return
    low, high = float(np.nanmin(s_w)), float(np.nanmax(s_w))
    if low < -BEYOND or high > L + BEYOND:
        of = {"test": test.name, "log": test.log.name, "crane": crane.name, "L": L}
        raise ValidateError(Note("wire-beyond-drum", low=low, high=high, **of))


def _integrated(
    signals: Mapping[str, FloatArray], step: float, test: CraneTest, crane: Crane
) -> tuple[FloatArray, str] | None:
    """Wire out from its start and a speed [m], and which."""
    if test.s_w is None:
        return None
    if "v_w" in signals:
        return test.s_w - _sum(signals["v_w"], step), "v_w"
    if "omega_m" not in signals:
        return None
    drum, s_w = drum_record(crane), np.full(len(signals["omega_m"]), test.s_w)
    layers = np.arange(1, crane.drum.layers + 1)
    ends = np.array([wire_to_layer(float(n), drum) for n in layers])
    radii = np.array([0.5 * layer_diameter(float(n), drum) for n in layers])
    for _ in range(ROUNDS):
        wire_on_drum = np.nan_to_num(drum.L_full - s_w)
        r_eff = radii[np.clip(np.searchsorted(ends, wire_on_drum - 1e-6), 0, len(layers) - 1)]
        s_w = test.s_w - _sum(signals["omega_m"] * r_eff / crane.i_hD, step)
    return s_w, "omega_m"


def _sum(speed: FloatArray, step: float) -> FloatArray:
    """Integral of a speed [m]; across a gap the speed is interpolated, and the result is NaN in it."""
    good = np.isfinite(speed)
    speeds = filled(speed)
    way = np.concatenate(([0.0], np.cumsum(0.5 * (speeds[1:] + speeds[:-1]) * step)))
    return np.where(good, way, np.nan)
