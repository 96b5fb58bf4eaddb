"""Where a command or a setting stands at its end: the ends themselves, and the stretches of time there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.statistics.dot import dot

FULL = 0.995
"""Share of the full command from which it counts as full: a log rounds to 0.1 to 0.4 %."""
FLAT = 2e-3  # of full command: samples this close to an extreme lie on one level
DWELL = 0.3  # s at an extreme that no wave or ramp dwells at within FLAT
BELOW = 0.8  # of the highest command: there the law is not limited
MORE = 0.02  # of full command that must be asked beyond a level that is an end
LOWEST = 0.3  # of full command: a plateau below is no end of a pump


def ends_of(u: FloatArray, asked: FloatArray, step: float) -> tuple[float, float]:
    """Ends between which a pump command was held [-], lower and upper: full command, or a lower level at which it
    visibly stops.

    Parameters: u logged command (n,), asked what the control law asks for without a limit (n,), as far as it is known.
    A command that stands still while no more is asked, as with a joystick at rest, is at no end.
    """
    return -_end(-u, -asked, step), _end(u, asked, step)


def _end(u: FloatArray, asked: FloatArray, step: float) -> float:
    good = np.isfinite(u) & np.isfinite(asked)
    top = float(u[good].max()) if good.any() else 0.0
    if top >= FULL or top < LOWEST:
        return FULL
    a, b = max(stretches_of(good & (u > top - FLAT)), key=lambda ab: ab[1] - ab[0])
    if (b - a) * step < DWELL:
        return FULL
    below = good & (np.abs(u) < BELOW * top)
    power = dot(asked[below], asked[below])
    gain = (
        dot(u[below], asked[below]) / power if power > 0.0 else 1.0
    )  # the log's own law may ask for more or less than ours
    return top - FLAT if gain * float(asked[a:b].max()) > top + MORE else FULL


def stretches_of(mask: NDArray[np.bool_], *, bridge: int = 0, shortest: int = 1) -> list[tuple[int, int]]:
    """Samples [a, b) of every unbroken stretch of a mask; gaps of up to `bridge` samples are bridged, shorter stretches
    left out."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    found: list[tuple[int, int]] = []
    for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if found and a - found[-1][1] <= bridge:
            found[-1] = (found[-1][0], b)
        else:
            found.append((a, b))
    return [(a, b) for a, b in found if b - a >= shortest]
