"""Years of a crane as numbers: what each campaign's fit would say, drawn around a truth that wears, goes with the
seasons and is repaired.

A campaign's own fit costs a minute of processor, so that hundreds of cranes over years cannot go through logs. Here the
interface is the same (a value, its interval, and which part of that is calibration), and the errors are drawn as that
interval says. `trials.condition.logs` holds the intervals themselves against logs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.live.condition.followed import FOLLOWED
from stillhook.live.condition.walk import Point

YEARS = 5.0
CERTIFIED = 2
"""Number of the campaign that the certificate is of."""
LIMITS = {"friction": 0.25, "leakage": 0.25, "gas": 0.05, "inertia": 0.10}
"""Of the criteria set paper-f."""


@dataclass(frozen=True)
class Ageing:
    """How a number of a crane behaves. half, common: half widths of a campaign's interval and of what of it is
    calibration; wear: largest trend a year, in the direction of wear; season: largest amplitude; slow, weeks: deviation
    and memory of what oil and weather leave; day: the same without memory; repair: largest step."""

    half: float
    common: float
    wear: float
    season: float
    slow: float
    weeks: float
    day: float
    repair: float


AGEING = {
    "friction": Ageing(0.016, 0.006, 0.12, 0.06, 0.012, 3.0, 0.012, -0.2),
    "leakage": Ageing(0.08, 0.06, 0.4, 0.2, 0.04, 3.0, 0.03, -0.4),
    "gas": Ageing(0.008, 0.007, -0.03, 0.02, 0.003, 3.0, 0.003, 0.04),
    "inertia": Ageing(0.035, 0.02, 0.0, 0.003, 0.002, 3.0, 0.003, 0.0),
}


@dataclass(frozen=True)
class Life:
    """One number of one crane: t (n,) of the campaigns [yr]; points; level (n,) without season; season (n,); slope now
    (n,) [1/yr]; repair: time of a step, NaN without; stated: whether people have stated it."""

    t: FloatArray
    points: tuple[Point, ...]
    level: FloatArray
    season: FloatArray
    slope: FloatArray
    repair: float
    stated: bool


def dates(rng: np.random.Generator, every: float) -> FloatArray:
    """Times of campaigns [yr], `every` years apart within a third."""
    gaps = every * rng.uniform(0.67, 1.33, int(1.5 * YEARS / every) + 2)
    t = np.concatenate([[0.0], np.cumsum(gaps)])
    return np.round(t[t < YEARS] * 365.25) / 365.25


def life(name: str, t: FloatArray, rng: np.random.Generator, *, wears: bool, repaired: bool, changed: bool) -> Life:
    """A number over the years: wears: with a trend from some day on; repaired: with a step back; changed: the sensor is
    changed once, unnoticed where no repair is stated."""
    a = AGEING[name]
    stated = bool(rng.random() < 0.5)
    begin = float(rng.choice([0.0, rng.uniform(0.5, 2.5)]))
    rate = a.wear * float(rng.uniform(0.2, 1.0)) if wears else 0.0
    level = float(rng.normal(0.0, 0.05)) + rate * np.maximum(t - begin, 0.0)
    slope = np.where(t > begin, rate, 0.0)
    repair = float(rng.uniform(1.5, 4.0)) if repaired and a.repair else np.nan
    if repaired and a.repair:
        level = level + np.where(t > repair, a.repair * float(rng.uniform(0.4, 1.0)), 0.0)
    season = a.season * float(rng.uniform(0.0, 1.0)) * np.cos(2.0 * np.pi * t + float(rng.uniform(0.0, 2.0 * np.pi)))
    keep = np.exp(-np.diff(t, prepend=-1.0) * 52.0 / a.weeks)
    slow = np.zeros_like(t)
    for i in range(len(t)):
        slow[i] = (keep[i] * slow[i - 1] if i else 0.0) + a.slow * np.sqrt(1.0 - keep[i] ** 2) * rng.standard_normal()
    z = 1.96
    own, common = np.sqrt(a.half**2 - a.common**2) / z, a.common / z
    calibration = np.full_like(t, common * rng.standard_normal())
    period = np.zeros(len(t), dtype=int)
    if changed:
        when = float(rng.uniform(1.0, 4.0))
        calibration[t >= when] = common * rng.standard_normal()
        period[t >= when] = int(stated)
    y = level + season + slow + a.day * rng.standard_normal(len(t)) + calibration + own * rng.standard_normal(len(t))
    table = FOLLOWED[name].calibration
    in_points = min(max(a.common, table), a.half)
    split = (max(a.half**2 - in_points**2, (0.05 * a.half) ** 2) ** 0.5 / z, in_points / z)
    points = tuple(Point(float(x), float(v), *split, int(p)) for x, v, p in zip(t, y, period, strict=True))
    return Life(t, points, level, season, slope, repair, stated)
