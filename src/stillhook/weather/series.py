"""Weather over time: waves as height, period and direction, and wind; one table, from any file.

Series in which only every n-th record has the requested quantity, such as buoys that report wind every 10 min and
waves every hour.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray

SYSTEMS = ("wind_sea", "swell")
COLUMNS = (
    *("H_m0", "T_p", "T_m02", "come_from", "wind", "wind_from", "current"),
    *(f"{name}_{system}" for system in SYSTEMS for name in ("H_m0", "T_p", "come_from")),
)
"""What a weather table may know: height [m], periods [s], where waves and wind come from, clockwise from north [rad],
speeds [m/s]; height, peak period and direction of wind sea and of swell apart."""


@dataclass(frozen=True, eq=False)
class Weather:
    """n records of weather, one after the other, step [s] apart except at gaps.

    time UTC, ascending; columns: name of `COLUMNS` -> (n,), NaN where unknown; step [s] the usual spacing; source, the
    file; notes, what the reader had to say; headings, by name of `COLUMNS` and of "time", with units in brackets.
    """

    time: NDArray[np.datetime64] = field(repr=False)
    columns: dict[str, FloatArray] = field(repr=False)
    step: float
    source: str = "weather"
    notes: tuple[str, ...] = ()
    headings: Mapping[str, str] = field(default_factory=dict, repr=False)

    def __len__(self) -> int:
        return len(self.time)


HOUR = 3600.0


def usual_step(time: NDArray[np.datetime64]) -> float:
    """The most frequent time between records [s], the shortest of several; an hour of one record."""
    if len(time) < 2:
        return HOUR
    apart, count = np.unique(np.diff(time) / np.timedelta64(1, "ms"), return_counts=True)
    return float(apart[np.argmax(count)]) / 1000.0


MOSTLY = 0.8
"""Share of the ways from one known record to the next that must be alike, and of the known records that must lie on
that grid."""
AT_LEAST = 2
"""Steps between known records from which a series is thinned."""


def every(weather: Weather, known: NDArray[np.bool_]) -> tuple[NDArray[np.intp], float]:
    """Records (k,) that a question is about and what each stands for [s]: all, unless known ones come further apart."""
    everything = np.arange(len(weather)), weather.step
    rows = np.flatnonzero(known)
    if len(rows) < 3 or 2 * len(rows) > len(weather):
        return everything
    apart = usual_step(weather.time[rows])
    alike = np.diff(weather.time[rows]) / np.timedelta64(1, "ms") == 1000.0 * apart
    if apart < AT_LEAST * weather.step or np.mean(alike) < MOSTLY:
        return everything
    phase = (weather.time - weather.time[0]) / np.timedelta64(1, "ms") % (1000.0 * apart)
    phases, counts = np.unique(phase[rows], return_counts=True)
    if counts.max() < MOSTLY * len(rows):
        return everything
    return np.flatnonzero(phase == phases[np.argmax(counts)]), apart
