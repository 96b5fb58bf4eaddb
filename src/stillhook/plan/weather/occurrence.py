"""How much weather there is about a limit: where an error of it costs days."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.weather.records import seas_of
from stillhook.weather.series import Weather

ALPHA = 0.75
"""Forecast factor by which a limit is lowered, about."""
HALF = 0.25
"""Half width of the window about a limit, in ln of the height."""
USUAL = 0.5
"""Share of the records of a period, for each unit of ln of the height, that counts as usual."""

Occurrence = Callable[[tuple[float, float], float], float]
"""Weather about a limiting height [m] in a column (Tp, beta), over the usual."""


def occurrence(plan: LiftPlan, weather: Weather) -> Occurrence:
    """Records whose period is nearest to that of a column and whose height is about what a limit leaves, over those of
    an even spread over the periods. Headings are alike, for the vessel may take any of them; weather without periods is
    about all of them alike."""
    seas, _ = seas_of(plan, weather)
    Tp, T = np.sort(np.array(plan.environment.Tp)), seas.periods[0]
    sound = np.isfinite(seas.Hs) & (seas.Hs > 0.0)
    timed = sound & np.isfinite(T) & (T > 0.0) & (Tp[-1] >= T)
    if timed.any() and len(Tp) > 1:
        nearest = np.abs(np.log(T[timed])[:, None] - np.log(Tp)).argmin(axis=1)
        rows = [np.sort(np.log(seas.Hs[timed][nearest == k])) for k in range(len(Tp))]
    else:
        rows = [np.sort(np.log(seas.Hs[sound]))] * len(Tp)
    even = sum(map(len, rows)) / len(Tp)

    def about(column: tuple[float, float], limit: float) -> float:
        if not 0.0 < limit < math.inf or even == 0.0:
            return 1.0
        row = rows[int(np.abs(Tp - column[0]).argmin())]
        middle = math.log(ALPHA * limit)
        n = int(np.searchsorted(row, middle + HALF) - np.searchsorted(row, middle - HALF))
        return n / (2.0 * HALF * USUAL * even)

    return about
