"""Saturation of a command or setting: the limits themselves, and the time spans at them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.statistics.series import dot

FULL = 0.995
"""Share of the full command that counts as full: a log rounds to 0.1 to 0.4 %."""
FLAT = 2e-3  # of full command: samples this close to an extreme are on one level
DWELL = 0.3  # s at an extreme that no wave or ramp dwells at within FLAT
BELOW = 0.8  # of the highest command: there the law is not limited
MORE = 0.02  # of full command that must be requested beyond a level that is a limit
LOWEST = 0.3  # of full command: a plateau below is no limit of a pump


def ends_of(u: FloatArray, requested: FloatArray, step: float) -> tuple[float, float]:
    """Limits of a pump command [-], lower and upper: full command, or a lower level at which it visibly
    saturates.

    Parameters: u logged command (n,), requested: output of the control law without a limit (n,), as far as it is known.
    A constant command while no more is requested, as with a joystick at rest, is not saturated.
    """
    return -_end(-u, -requested, step), _end(u, requested, step)


def _end(u: FloatArray, requested: FloatArray, step: float) -> float:
    good = np.isfinite(u) & np.isfinite(requested)
    top = float(u[good].max()) if good.any() else 0.0
    if top >= FULL or top < LOWEST:
        return FULL
    a, b = max(stretches_of(good & (u > top - FLAT)), key=lambda ab: ab[1] - ab[0])
    if (b - a) * step < DWELL:
        return FULL
    below = good & (np.abs(u) < BELOW * top)
    power = dot(requested[below], requested[below])
    gain = (
        dot(u[below], requested[below]) / power if power > 0.0 else 1.0
    )  # the log's own law may request more or less than the twin's
    return top - FLAT if gain * float(requested[a:b].max()) > top + MORE else FULL


def stretches_of(mask: NDArray[np.bool_], *, bridge: int = 0, shortest: int = 1) -> list[tuple[int, int]]:
    """Samples [a, b) of every uninterrupted span of a mask; gaps of up to `bridge` samples are bridged, shorter spans
    left out."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    spans: list[tuple[int, int]] = []
    for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if spans and a - spans[-1][1] <= bridge:
            spans[-1] = (spans[-1][0], b)
        else:
            spans.append((a, b))
    return [(a, b) for a, b in spans if b - a >= shortest]
