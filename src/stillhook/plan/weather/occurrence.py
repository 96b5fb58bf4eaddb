"""How much weather there is about each column of a plan's table: where an error of a limit costs days."""

from __future__ import annotations

import numpy as np

from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.weather.value import seas_of
from stillhook.weather.series import Weather


def occurrence(plan: LiftPlan, weather: Weather) -> dict[tuple[float, float], float]:
    """(Tp, beta) -> share of the records whose period is nearest to that of the column, over the mean of all columns;
    headings alike, for the vessel may take any of them. All 1 for weather without periods."""
    seas, _ = seas_of(plan, weather)
    Tp = np.sort(np.array(plan.environment.Tp))
    T = seas.periods[0]
    inside = np.isfinite(T) & (T > 0.0) & (Tp[-1] >= T)
    share = np.ones(len(Tp))
    if inside.any() and len(Tp) > 1:
        apart = np.abs(np.log(T[inside])[:, None] - np.log(Tp))
        counts = np.bincount(apart.argmin(axis=1), minlength=len(Tp))
        share = counts / counts.mean()
    return {
        (float(period), float(beta)): float(s)
        for period, s in zip(Tp, share, strict=True)
        for beta in plan.environment.headings
    }
