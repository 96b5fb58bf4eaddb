"""Series of which only every so manieth record tells what is asked, such as buoys that report wind every 10 min and
waves every hour."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stillhook.weather.series import Weather, usual_step

MOSTLY = 0.8
"""Share of the ways from one known record to the next that must be alike, and of the known records that must lie on
that grid."""
AT_LEAST = 2
"""Steps between known records from which a series is thinned."""


def every(weather: Weather, known: NDArray[np.bool_]) -> tuple[NDArray[np.intp], float]:
    """Records (k,) that a question is about, and what each stands for [s]: all, unless known ones come regularly and
    further apart."""
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
