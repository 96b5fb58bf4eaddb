"""What limits are worth in the plan's weather: workable days of a year and waiting, with the sampling error of so many
years."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.table import Axes
from stillhook.plan.weather.records import weather_used
from stillhook.plan.weather.value import Workability
from stillhook.report.formatting import DAY
from stillhook.statistics.estimate import Estimate, t_factor
from stillhook.weather.hindcast import FOLLOWS, waiting, year_of
from stillhook.weather.persistence import Window, waits

YEAR = 365.25
"""Days of a year."""
FRACTILES = (0.5, 0.9)


class Worth(NamedTuple):
    """workable: whether each record is in a window (n,); days: of them in a year; waits for a window [days]."""

    workable: BoolArray
    days: Estimate
    wait_p50: Estimate
    wait_p90: Estimate


class Weather:
    """The weather of a plan, and its window [s]."""

    def __init__(self, plan: LiftPlan, window: float) -> None:
        assert plan.weather is not None
        self.records = weather_used(plan.weather)
        self.judge = Workability.of(plan, Axes.of(plan), self.records, math.nan)
        self.window = Window.of(self.records.time, self.records.step, window)
        self.valid = np.isfinite(self.judge.seas.Hs)
        self.year = year_of(self.records.time)

    def worth(self, op_wf: FloatArray) -> Worth:
        """What heights that a forecast may show (heading, period) [m], NaN for none, are worth."""
        some, start = self.judge.starts(np.nan_to_num(op_wf, nan=0.0), self.window)
        times = self.records.time, self.records.step
        days = [_in_days(e) for e in waiting(waits(start, times[0]), *times, FRACTILES)]
        return Worth(some, self.over_years(YEAR * some), *days)

    def gained(self, more: Worth, than: Worth) -> Estimate:
        """Workable days of a year that one has more than another, year by year of the same weather."""
        return self.over_years(YEAR * (more.workable.astype(float) - than.workable))

    def over_years(self, x: FloatArray) -> Estimate:
        """Mean of x (n,) with the 95 % interval that the difference of the years leaves, a correlation of `FOLLOWS`
        from year to year allowed for."""
        means = np.array([x[self.valid & (self.year == y)].mean() for y in np.unique(self.year[self.valid])])
        n, value = len(means), float(x[self.valid].mean())
        half = float(means.std(ddof=1)) / math.sqrt(n) * t_factor(n - 1.0) * math.sqrt((1 + FOLLOWS) / (1 - FOLLOWS))
        return Estimate(value, value - half, value + half, n)


def _in_days(e: Estimate) -> Estimate:
    return Estimate(e.value / DAY, e.low / DAY, e.high / DAY, e.n)


def plain(e: Estimate) -> list[Any]:
    """Value and ends for JSON."""
    return [round(x, 4) if math.isfinite(x) else None for x in (e.value, e.low, e.high)]
