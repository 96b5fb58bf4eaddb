"""Has a number that is followed drifted since the certificate, and when does it reach its limit?"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stillhook.live.condition.walk import Course, Mixture
from stillhook.statistics.estimate import ENDS, Estimate

FALSE_A_YEAR = 0.1
"""Chance of a withdrawal without drift that the test may take, a year and crane: one in ten years. A campaign has
the share of it of the days since the one before, so that frequent campaigns do not make more of them."""
MARGIN = 0.5
"""Part of the criterion's limit within which a change since the certificate is not drift."""
TESTS, SIDES = 2, 2
"""Of a number and date: level against margin, number against limit; upwards and downwards."""
LONGEST = 1.0
"""Years since the campaign before that count at most."""
HORIZON = 30.0
"""Years ahead that a limit is looked for."""
LOOKS = 240


@dataclass(frozen=True)
class Drift:
    """Change of the level since the certificate, without the yearly wave, and of the number itself, with it. chance:
    that the level is within the margin and the number within the limit, or either of the other sign, as the data have
    it; allowed: the chance at and below which drift is shown."""

    change: Estimate
    number: Estimate
    margin: float
    limit: float
    chance: float
    allowed: float

    @property
    def shown(self) -> bool:
        return self.chance <= self.allowed


def allowed_chance(gap: float, numbers: int) -> float:
    """Chance of a false alarm that one side of one test of one of several numbers may take; gap since the campaign
    before [yr]."""
    return FALSE_A_YEAR * min(max(gap, 0.0), LONGEST) / numbers / (TESTS * SIDES)


def drift_of(course: Course, since: float, limit: float, numbers: int) -> Drift:
    """Whether the level is shown to have left that of the certificate by more than the margin, or the number by more
    than the limit, regardless of the season's part in it.

    Parameters: since: date of the certificate [yr]; limit of the criterion [-]; numbers that are tested together.
    """
    now, before = float(course.t[-1]), course.t[course.t < course.t[-1]]
    level, number, margin = course.change(since, now), course.change(since, now, season=True), MARGIN * limit
    gap = now - float(before[-1] if len(before) else now)
    chance = min(
        1.0 - x for of, end in ((level, margin), (number, limit)) for x in (of.above(end), 1.0 - of.above(-end))
    )
    n = len(course.t)
    return Drift(level.estimate(n), number.estimate(n), margin, limit, max(chance, 0.0), allowed_chance(gap, numbers))


@dataclass(frozen=True)
class TimeToLimit:
    """When the level passes a limit, in years from the last campaign: earliest, middle and latest with 95 %; infinite
    where it is not within `HORIZON`. None where no trend is shown."""

    limit: float
    earliest: float
    middle: float
    latest: float


def time_to_limit(course: Course, trend: Mixture, limit: float) -> TimeToLimit | None:
    """Time until the level reaches the limit that the trend leads to; None where the data show no trend.

    The level of a later day has the uncertainties of today's level, of the trend and of the random walk until then. The
    earliest time is that at which it is beyond the limit with a chance of 2.5 %.
    """
    low, high = trend.quantile(ENDS[0]), trend.quantile(ENDS[1])
    if low <= 0.0 <= high:
        return None
    sign = math.copysign(1.0, low)
    now, ahead = float(course.t[-1]), np.concatenate([[0.0], np.geomspace(HORIZON / 1e4, HORIZON, LOOKS)])
    chances = []
    for dt in ahead:
        level = course.value(now + float(dt), season=False)
        chances.append(level.above(limit) if sign > 0.0 else 1.0 - level.above(-limit))
    passed = np.maximum.accumulate(chances)
    when = [float(np.interp(p, passed, ahead)) if passed[-1] >= p else math.inf for p in (ENDS[0], 0.5, ENDS[1])]
    return TimeToLimit(
        sign * limit, *(0.0 if passed[0] >= p else t for p, t in zip((ENDS[0], 0.5, ENDS[1]), when, strict=True))
    )
