"""Where a limiting wave height is looked for: cells of a column placed about the height at which a rule is just met."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray


@dataclass(frozen=True)
class Search:
    """How closely a limit is looked for.

    seeds first given to a cell, and the step and most of them; width: half of the 95 % interval of what waves add to a
    utilisation, over it, at which the seeds of the cell next to the limit are enough; near: distance of a cell from the
    limit, over it, at which it is found; cells a column may have; growth exponents between which a utilisation's growth
    with height is believed.
    """

    seeds: int = 20
    more: int = 16
    most_seeds: int = 64
    width: float = 0.12
    near: float = 0.06
    cells: int = 6
    growth: tuple[float, float] = (0.7, 2.5)


LEAST_STEP, MOST_STEP = 1.08, 2.0
"""Factors between which the height grows where no sea was beyond yet."""
BEHIND = 1.04
"""Where the next height is placed behind a crossing that is foreseen, over it: a cell that is beyond ends a search, one
inside does not."""
STEEP, LEAST_PART = 1.5, 0.5
"""A cell that is so far beyond says little about the crossing: it is then not looked for below this part of the way to
that cell."""
USUAL_GROWTH = 1.3
"""Exponent of growth before two seas tell it: motions grow with the height, drag with its square."""
FINE, COARSE, TURN = 0.025, 0.05, 1.0
"""Heights are whole multiples of 2.5 cm below 1 m and of 5 cm above, so that alternatives meet in the same seas [m]."""


def snapped(Hs: float) -> float:
    """The nearest height that is run [m]."""
    step = FINE if Hs < TURN else COARSE
    return round(max(round(Hs / step), 1) * step, 6)


def next_height(Hs: FloatArray, u: FloatArray, guess: float, highest: float, search: Search) -> float | None:
    """Height that is run next in a column [m], or None where its limit is found.

    Parameters: Hs (k,) rising heights that were run, the calm (0) first; u (k,) their largest utilisation, 1 at the
    limit, NaN where no rule tells; guess: limit that another tier predicts (NaN: none), tried first; highest sea that
    is asked. The limit is the first crossing. Found is: a calm that is beyond, the highest sea inside, a cell within
    `near` of the crossing, or no room for another one.
    """
    if not u[0] < 1.0:
        return None
    if len(Hs) == 1:
        first = guess if guess > 0.0 and math.isfinite(guess) else highest if guess == math.inf else 0.5 * highest
        return snapped(min(first, highest))
    if np.isnan(u[1:]).any() or len(Hs) > search.cells:
        return None
    beyond = np.flatnonzero(u > 1.0)
    wanted = _higher(Hs, u, highest, search) if not len(beyond) else _between(Hs, u, int(beyond[0]), search)
    if wanted is None:
        return None
    wanted = snapped(min(wanted, highest))
    return None if bool(np.any(np.abs(Hs - wanted) < 1e-9)) else wanted


def crossing(Hs: FloatArray, u: FloatArray, search: Search) -> float:
    """Height at which the utilisation first passes 1 [m], by a power of the height between the cells beside it; inf
    where none does, 0 where a calm is beyond."""
    beyond = np.flatnonzero(u > 1.0)
    if not len(beyond):
        return math.inf
    k = int(beyond[0])
    if k == 0:
        return 0.0
    p = _growth(Hs, u, k, search)
    low, high = u[k - 1], u[k]
    if not math.isfinite(high):
        return 0.5 * float(Hs[k - 1] + Hs[k])
    part = (1.0 - low) / (high - low)
    return float((Hs[k - 1] ** p + part * (Hs[k] ** p - Hs[k - 1] ** p)) ** (1.0 / p))


def _growth(Hs: FloatArray, u: FloatArray, k: int, search: Search) -> float:
    """Exponent with which the utilisation grows over the calm's up to cell k."""
    i = max(k - 1, 1)
    if i == k or not (u[i] > u[0] and u[k] > u[i] and math.isfinite(u[k])):
        return USUAL_GROWTH
    return float(np.clip(math.log((u[k] - u[0]) / (u[i] - u[0])) / math.log(Hs[k] / Hs[i]), *search.growth))


def _higher(Hs: FloatArray, u: FloatArray, highest: float, search: Search) -> float | None:
    """Beyond the highest cell, all of them inside."""
    top = float(Hs[-1])
    if top >= highest - 1e-9:
        return None
    rise = u[-1] - u[0]
    if not rise > 0.0:
        return min(MOST_STEP * top, highest)
    factor = ((1.0 - u[0]) / rise) ** (1.0 / _growth(Hs, u, len(Hs) - 1, search))
    return top * float(np.clip(BEHIND * factor, LEAST_STEP, MOST_STEP))


def _between(Hs: FloatArray, u: FloatArray, k: int, search: Search) -> float | None:
    """Between a cell inside and one beyond."""
    at = crossing(Hs, u, search)
    if u[k] > STEEP:
        at = max(at, LEAST_PART * float(Hs[k]) + (1.0 - LEAST_PART) * float(Hs[k - 1]))
    neighbours = [float(h) for h in (Hs[k - 1], Hs[k]) if h > 0.0]
    if min(abs(at - h) for h in neighbours) <= search.near * at:
        return None
    return at


def nearest(Hs: FloatArray, at: float) -> int:
    """Number of the cell next to a height, the calm left out; of the highest one for inf."""
    if not math.isfinite(at):
        return len(Hs) - 1
    return 1 + int(np.argmin(np.abs(Hs[1:] - at))) if len(Hs) > 1 else 0
