"""A step of the losses: when, by how much, and what may be behind it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from stillhook.live.estimate.half_waves import HalfWave
from stillhook.statistics.estimate import Estimate, t_factor

LEAST_STEP = 0.05
"""Smallest step of all losses that raises an alarm [-]: warming oil changes them by some per cent in minutes."""
SIGNIFICANCE = 6.0
"""Standard errors that a step must be: a day has some 17,000 half waves, with ten moments tried at each."""
AFTER_FEWEST, AFTER_MOST = 3, 12
"""Half waves since the step that are looked at."""
BEFORE_FEWEST, BEFORE_MOST = 10, 60
"""Half waves before it that are compared with."""
LEAST_SCATTER = 0.01
"""Scatter of a half wave over its loss that is taken at least [-]: a quiet stretch is no measure of what follows."""


class FrictionAlarm(NamedTuple):
    """A step of all losses. t: moment that it was found [s]; onset: middle of the half wave in which it fell [s]; rise:
    change over what they were before, with its 95 % interval."""

    t: float
    onset: float
    rise: Estimate

    @property
    def message(self) -> str:
        """One line: what was measured, and its cause as far as it can be told."""
        word = "risen" if self.rise.value > 0.0 else "fallen"
        low, high = sorted((abs(self.rise.low), abs(self.rise.high)))
        return (
            f"Total loss has {word} by {100.0 * abs(self.rise.value):.0f} % ({100.0 * low:.0f} to {100.0 * high:.0f} %)"
            f" since {self.onset:.0f} s; friction, if leakage and displacement are as in the file. Check temperature of"
            " the oil, brake, sheaves and bearings."
        )


class Split(NamedTuple):
    """A step between half waves: number of the half wave in which it fell, rise with its interval [-], standard errors
    that it is, and sum of squares that it leaves [N^2 m^2]."""

    place: int
    rise: Estimate
    significance: float
    left: float


def step_of(waves: Sequence[HalfWave]) -> Split | None:
    """The step that fits the last half waves of a stream best, among those that are significant; None without one.

    The half wave in which it fell belongs to neither side. A standing torque is common to both sides, so that an error
    of load cell or pressures raises none; so is a slope with the strength of the half waves, so that a sea that grows
    under a law of another form raises none.
    """
    n = len(waves)
    most = min(AFTER_MOST, n - BEFORE_FEWEST - 1)
    model = np.array([w.system + w.motors for w in waves])
    torque = np.array([w.torque for w in waves])
    speed = np.array([w.speed for w in waves])
    best: Split | None = None
    for after in range(AFTER_FEWEST, most + 1):
        place = n - after - 1
        use = np.arange(n) != place
        later = (np.arange(n) > place)[use]
        m, y = model[use], torque[use]
        if not (m[later].min() < 0.0 < m[later].max() and m[~later].min() < 0.0 < m[~later].max()):
            continue
        stronger = m * (speed[use] / speed.mean() - 1.0)
        X = np.column_stack([np.where(later, 0.0, m), np.where(later, m, 0.0), stronger, np.ones(n - 1)])
        inverse = np.linalg.pinv(X.T @ X)
        b = inverse @ (X.T @ y)
        residual = y - X @ b
        left, freedom = float(residual @ residual), n - 5
        scatter = max(float(np.sqrt(left / freedom)), LEAST_SCATTER * float(np.abs(model).mean()))
        u = scatter * float(np.sqrt(inverse[0, 0] + inverse[1, 1] - 2.0 * inverse[0, 1]))
        rise, significance = float(b[1] / b[0] - 1.0), abs(float(b[1] - b[0])) / u
        if significance < SIGNIFICANCE or abs(rise) < LEAST_STEP or not b[0] > 0.0:
            continue
        if best is None or left < best.left:
            half = t_factor(freedom) * u / float(b[0])
            best = Split(place, Estimate.around(rise, half, after), significance, left)
    return best
