"""What a hindcast is good for: its length, gaps and resolution, in how much of each month a window of a length can
start and how that differs from year to year, and waiting with the sampling error of so many years.

Years are drawn with replacement, each as it was: within a year records hang together in any way. Years that follow
each other are allowed for by one number, a drift of the climate is not: `trials.limits.years` has how often intervals
hold the truth.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.statistics.estimate import ENDS, NORMAL_95, Estimate, t_factor
from stillhook.weather.persistence import gaps, month_of, seconds, stamp
from stillhook.weather.series import Weather

FEWEST_YEARS = 5
"""Years from which an interval is given."""
HALF_A_MONTH = 0.5
"""Share of a month's records that a year must have for the month to count."""
DRAWS, SEED = 400, 20261128
STEPS = (1.0, 0.5, 0.25, 0.2, 0.1, 0.05, 0.01)
"""Steps that numbers of a hindcast are rounded to, in its units (m, s)."""
FOLLOWS = 0.3
"""Correlation of a year with the one before that intervals allow for (assumed: too few years to determine it)."""
FAINT = 1e-6


def table_of(weather: Weather) -> dict[str, Any]:
    """Length, gaps, missing shares and resolution of a series [SI]; resolution None: finer than the last of `STEPS`."""
    apart = np.diff(seconds(weather.time))
    broken = gaps(weather.time, weather.step)
    span = float(seconds(weather.time)[-1]) + weather.step
    absent = float(np.sum(apart[broken] - weather.step))
    columns = {name: x[np.isfinite(x)] for name, x in weather.columns.items()}
    measured = {name: x for name, x in columns.items() if name in ("H_m0", "T_p", "T_m02")}
    return {
        "source": weather.source,
        "first": stamp(weather.time[0]),
        "last": stamp(weather.time[-1]),
        "span": span,
        "n_years": len(_years(weather.time, weather.step)),
        "step": weather.step,
        "n_records": len(weather),
        "n_gaps": int(np.count_nonzero(broken)),
        "absent": absent,
        "absent_share": absent / span,
        "missing": {name: 1.0 - len(x) / len(weather) for name, x in columns.items()},
        "resolution": {name: _resolution(x) for name, x in measured.items()},
        "n_values": {name: len(np.unique(x)) for name, x in measured.items()},
    }


def _resolution(x: FloatArray) -> float | None:
    """Step that all numbers are multiples of."""
    return next((q for q in STEPS if np.all(np.abs(x / q - np.round(x / q)) < FAINT / q * np.maximum(x, 1.0))), None)


def year_of(time: NDArray[np.datetime64]) -> NDArray[np.int64]:
    """Calendar year of each record (n,)."""
    return np.asarray(time.astype("datetime64[Y]").astype(np.int64) + 1970)


def _years(time: NDArray[np.datetime64], step: float) -> NDArray[np.int64]:
    """Calendar years of which at least half is there."""
    years, counts = np.unique(year_of(time), return_counts=True)
    return np.asarray(years[counts * step >= 0.5 * 365.0 * 86400.0])


def by_month_and_year(
    can_start: BoolArray, possible: BoolArray, time: NDArray[np.datetime64], step: float
) -> dict[str, list[Any]]:
    """Share of the possible starts (n,) of each month in which an operation can start: mean over years, least and most
    of a year (12,); NaN where no year has half of the month."""
    month, year = month_of(time), year_of(time)
    years = np.unique(year)
    shares = np.full((len(years), 12), np.nan)
    enough = HALF_A_MONTH * 28.0 * 86400.0 / step
    for i, y in enumerate(years):
        for m in range(12):
            rows = possible & (year == y) & (month == m + 1)
            if (n := np.count_nonzero(rows)) >= enough:
                shares[i, m] = np.count_nonzero(can_start & rows) / n
    known = np.isfinite(shares)
    none = ~known.any(axis=0)
    mean = np.where(none, np.nan, np.where(known, shares, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1))
    least, most = (
        np.where(none, np.nan, choose(np.where(known, shares, fill), axis=0))
        for choose, fill in ((np.min, np.inf), (np.max, -np.inf))
    )
    return {
        "mean": mean.tolist(),
        "least": least.tolist(),
        "most": most.tolist(),
        "n_years": known.sum(axis=0).tolist(),
    }


def waiting(
    waits: FloatArray, time: NDArray[np.datetime64], step: float, fractiles: Sequence[float] = (0.5, 0.9)
) -> list[Estimate]:
    """Fractiles of waits (n,) [s] (NaN: censored, left out) with their 95 % interval over years; no interval from fewer
    than `FEWEST_YEARS` years. Percentiles of the draws, stretched about the value for the few years that there are and
    for `FOLLOWS`, in logarithms: waiting has a long tail."""
    known = np.isfinite(waits)
    n = len(np.intersect1d(_years(time, step), year_of(time[known])))
    if not known.any():
        return [Estimate(math.nan) for _ in fractiles]
    order = np.argsort(waits[known], kind="stable")
    x = waits[known][order]
    values = np.percentile(x, [100.0 * f for f in fractiles])
    if n < FEWEST_YEARS:
        return [Estimate(float(value), n=n) for value in values]
    years, place = np.unique(year_of(time[known])[order], return_inverse=True)
    rng = np.random.default_rng(SEED)
    drawn = np.empty((DRAWS, len(fractiles)))
    for k in range(DRAWS):
        times_drawn = np.bincount(rng.integers(len(years), size=len(years)), minlength=len(years))
        up_to = np.cumsum(times_drawn[place])
        drawn[k] = x[np.searchsorted(up_to, np.array(fractiles) * up_to[-1])]
    few = math.sqrt((1.0 + FOLLOWS) / (1.0 - FOLLOWS) * n / (n - 1.0)) * t_factor(n - 1.0)
    middle = np.log(np.maximum(values, step))
    ends = np.log(np.maximum(np.quantile(drawn, ENDS, axis=0), step))
    low, high = (
        np.exp(middle + few / NORMAL_95 * (end - middle))
        for end in (np.minimum(ends[0], middle), np.maximum(ends[1], middle))
    )
    low = np.where(low > step, low, 0.0)
    rows = zip(values, np.minimum(low, values), np.maximum(high, values), strict=True)
    return [Estimate(float(value), float(a), float(b), n) for value, a, b in rows]
