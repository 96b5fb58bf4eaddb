"""Moments at which samples are missing without a gap in the time stamps, or a sensor was reset: detected as jumps of
signals that cannot jump."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.variables import PHYSICAL

TIP, WINCH = ("s_tip", "v_tip"), ("s_w", "v_w", "omega_m")
LENGTHS = ("s_tip", "s_w")
"""One of these alone shows a discontinuity. A speed of the winch jumps as friction breaks away; together with the tip
it is a discontinuity."""
NEIGHBOURS = 5
"""Samples on either side used to detect a jump, so that one bad sample does not count."""
BEYOND = 12.0
"""Times the median of such steps: noise reaches 6."""
LEAST_JUMP = {"s_tip": 0.03, "s_w": 0.03, "v_tip": 0.15, "v_w": 0.15, "omega_m": 0.0}
"""Smallest jump that counts [SI]: time-stamp errors of some milliseconds cause some millimetres."""
FASTEST = 3.0
"""Acceleration that neither tip nor wire exceeds [m/s^2]: curvature below it is no jump."""


def seams(t: FloatArray, signals: Mapping[str, FloatArray]) -> list[tuple[int, str]]:
    """First sample after each discontinuity and the signals that jump, in words. Parameters: t (n,) even [s]; signals
    (n,), NaN where not known."""
    step = float(t[1] - t[0]) if len(t) > 1 else 1.0
    reach = NEIGHBOURS * step
    bent = {"length": 0.5 * FASTEST * reach**2, "speed": FASTEST * reach}
    names = [name for name in (*TIP, *WINCH) if name in signals]
    jumps = {name: _jumps(signals[name], max(LEAST_JUMP[name], bent.get(PHYSICAL[name].kind, 0.0))) for name in names}
    result: list[tuple[int, str]] = []
    for i in sorted({int(k) for at in jumps.values() for k in at}):
        if result and i - result[-1][0] <= 2 * NEIGHBOURS:
            continue
        at = [name for name in names if np.any(np.abs(jumps[name] - i) <= NEIGHBOURS)]
        if set(at) & set(LENGTHS) or (set(at) & set(TIP) and set(at) & set(WINCH)):
            result.append((i, _seam_text(at)))
    return result


def _seam_text(names: list[str]) -> str:
    if len(names) == 1:
        return (
            f"{PHYSICAL[names[0]].meaning} jumps, and no other signal does: its sensor was reset, or it has its own"
            " clock"
        )
    return (
        f"{' and '.join(PHYSICAL[n].meaning.split(';')[0] for n in names[:2])} jump: samples are missing without a"
        " gap in the time stamps"
    )


def _jumps(x: FloatArray, floor: float) -> NDArray[np.intp]:
    """Samples at which a straight line through the BESIDE samples before misses the one through those after."""
    n = NEIGHBOURS
    if len(x) < 4 * n:
        return np.empty(0, np.intp)
    at = np.arange(n) - 0.5 * (n - 1)
    centre = np.convolve(x, np.full(n, 1.0 / n), mode="valid")
    slope = np.convolve(x, (at / np.sum(at * at))[::-1], mode="valid")
    before, after = slice(0, len(centre) - n), slice(n, len(centre))
    miss = np.abs((centre[after] - 0.5 * n * slope[after]) - (centre[before] + 0.5 * n * slope[before]))
    if not np.isfinite(miss).any():
        return np.empty(0, np.intp)
    peaks = np.flatnonzero(np.nan_to_num(miss) > max(BEYOND * float(np.nanmedian(miss)), floor))
    if not len(peaks):
        return np.empty(0, np.intp)
    groups = np.split(peaks, np.flatnonzero(np.diff(peaks) > n) + 1)
    return np.array([int(g[np.argmax(miss[g])]) + n for g in groups], dtype=np.intp)
