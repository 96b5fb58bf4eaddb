"""Moments at which samples are missing that the stamps do not show, or a sensor was set anew: what has mass jumps."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.variables import PHYSICAL

TIP, WINCH = ("s_tip", "v_tip"), ("s_w", "v_w", "omega_m")
LENGTHS = ("s_tip", "s_w")
"""One of these alone shows a seam. A speed of the winch jumps by itself as friction breaks away; with that of the tip
it is a seam."""
BESIDE = 5
"""Samples on either side from which a jump is seen, so that one bad sample is none."""
BEYOND = 12.0
"""Times the median of such steps: noise reaches 6."""
LEAST = {"s_tip": 0.03, "s_w": 0.03, "v_tip": 0.15, "v_w": 0.15, "omega_m": 0.0}
"""Smallest jump that counts [SI]: stamps that are wrong by some milliseconds make some millimetres."""
FASTEST = 3.0
"""Acceleration that neither tip nor wire exceeds [m/s^2]: what it bends within the samples is no jump."""


def seams(t: FloatArray, signals: Mapping[str, FloatArray]) -> list[tuple[int, str]]:
    """First sample after each seam and what jumps there, in words. Parameters: t (n,) even [s]; signals (n,), NaN where
    not known."""
    step = float(t[1] - t[0]) if len(t) > 1 else 1.0
    reach = BESIDE * step
    bent = {"length": 0.5 * FASTEST * reach**2, "speed": FASTEST * reach}
    names = [name for name in (*TIP, *WINCH) if name in signals]
    jumps = {name: _jumps(signals[name], max(LEAST[name], bent.get(PHYSICAL[name].kind, 0.0))) for name in names}
    found: list[tuple[int, str]] = []
    for i in sorted({int(k) for at in jumps.values() for k in at}):
        if found and i - found[-1][0] <= 2 * BESIDE:
            continue
        at = [name for name in names if np.any(np.abs(jumps[name] - i) <= BESIDE)]
        if set(at) & set(LENGTHS) or (set(at) & set(TIP) and set(at) & set(WINCH)):
            found.append((i, _said(at)))
    return found


def _said(names: list[str]) -> str:
    if len(names) == 1:
        return (
            f"{PHYSICAL[names[0]].meaning} jumps, and nothing else does: its sensor was set anew, or it has a clock of"
            " its own"
        )
    return (
        f"{' and '.join(PHYSICAL[n].meaning.split(';')[0] for n in names[:2])} jump: samples are missing that the"
        " stamps do not show"
    )


def _jumps(x: FloatArray, floor: float) -> NDArray[np.intp]:
    """Samples at which a straight line through the BESIDE samples before misses the one through those after."""
    n = BESIDE
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
