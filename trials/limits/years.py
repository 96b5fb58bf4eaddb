"""How often the interval of waiting holds the truth, in made-up hindcasts of years that differ, hang together or drift.

    python -m trials.limits.years [repeats]

Heights are those of a seasonal log-normal sea with a memory of days; each year has an anomaly of its own, which may
follow that of the year before, and the climate may drift. The truth is the fractile of a record so long that its error
does not count, of the same climate.
"""

from __future__ import annotations

import sys
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.weather.hindcast import waiting
from stillhook.weather.persistence import Window, waits

STEP = 3.0 * 3600.0
PER_YEAR = 2920
MEAN, SEASON, SCATTER, MEMORY = 0.75, 0.35, 0.45, 12.0  # ln of m, its season and scatter, records
LIMIT, WINDOW = 1.8, 24.0 * 3600.0  # m, s
FRACTILES = (0.5, 0.9)
TRUTH = 3000
"""Years of the truth."""


class Climate(NamedTuple):
    """anomaly: standard deviation of ln Hs from year to year; follows: its correlation with the year before; drift of
    ln Hs in a year."""

    anomaly: float = 0.0
    follows: float = 0.0
    drift: float = 0.0


CLIMATES = {
    "years alike": Climate(),
    "years differ": Climate(0.08),
    "years hang together": Climate(0.08, 0.3),
    "years hang together strongly": Climate(0.08, 0.5),
    "drift of 1 % a year": Climate(0.08, 0.0, 0.01),
}


def record(climate: Climate, n_years: int, seed: int, *, drifting: int | None = None) -> tuple[FloatArray, np.ndarray]:
    """Heights (n,) [m] and times of so many years; drifting: after how many the drift starts anew."""
    rng = np.random.default_rng(seed)
    n = n_years * PER_YEAR
    rho = np.exp(-1.0 / MEMORY)
    from scipy.signal import lfilter

    noise = lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], rng.normal(size=n + 200))[200:]
    anomaly = lfilter([np.sqrt(1.0 - climate.follows**2)], [1.0, -climate.follows], rng.normal(size=n_years + 50))[50:]
    year = np.arange(n) // PER_YEAR
    phase = 2.0 * np.pi * (np.arange(n) % PER_YEAR) / PER_YEAR
    place = year % (drifting or n_years) - 0.5 * ((drifting or n_years) - 1)
    level = MEAN + SEASON * np.cos(phase) + climate.anomaly * anomaly[year] + climate.drift * place
    time = np.datetime64("1900-01-01T00:00:00") + np.arange(n) * np.timedelta64(int(STEP), "s")
    return np.exp(level + SCATTER * noise), time


def waited(Hs: FloatArray, time: np.ndarray) -> FloatArray:
    """Wait from each record [s]."""
    return waits(Window.of(time, STEP, WINDOW).starts(Hs <= LIMIT), time)


def truth(climate: Climate, n_years: int) -> FloatArray:
    """Fractiles of waiting in this climate [s]."""
    known = waited(*record(climate, TRUTH, 1, drifting=n_years))
    return np.percentile(known[np.isfinite(known)], [100.0 * f for f in FRACTILES])


def coverage(climate: Climate, n_years: int, repeats: int) -> FloatArray:
    """Share of repeats whose interval holds the truth, of each fractile."""
    true = truth(climate, n_years)
    inside = np.zeros((repeats, len(FRACTILES)))
    for k in range(repeats):
        Hs, time = record(climate, n_years, 1000 + k)
        estimates = waiting(waited(Hs, time), time, STEP, FRACTILES)
        inside[k] = [e.low <= t <= e.high for e, t in zip(estimates, true, strict=True)]
    return inside.mean(axis=0)


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    for name, climate in CLIMATES.items():
        for years in (5, 10, 20, 40):
            shares = coverage(climate, years, count)
            print(
                f"{name}, {years} years: P50 {shares[0]:.3f}, P90 {shares[1]:.3f}; truth {truth(climate, years) / 3600}"
            )
