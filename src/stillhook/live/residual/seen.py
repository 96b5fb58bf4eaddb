"""Conditions that a model has seen: a box around them, and how far from any of them is far."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.live.residual.terms import CONDITIONS

EDGE = 0.001
"""Part of the samples that are beyond each side of the box [-]."""
FAR = (0.99, 0.9)
"""Far is beyond the distance from all others within which so many samples of a log are, for so many logs [-]: as far as
the test of held-out logs goes."""
LANDMARKS = 400
"""Samples that stand for all others."""
LEAST = 1e-3
"""Least scale of a condition: one that hardly varied is held by the box alone."""


class Seen(NamedTuple):
    """low, high (features,) of the box; scale (features,); landmarks (k, features), in scales; far: distance from the
    nearest of them."""

    low: FloatArray
    high: FloatArray
    scale: FloatArray
    landmarks: FloatArray
    far: float

    def distance(self, x: FloatArray) -> FloatArray:
        """Distance (n,) of conditions (n, features) from the nearest landmark, in scales."""
        x, marks = x / self.scale, self.landmarks
        square = (x**2).sum(axis=1)[:, None] + (marks**2).sum(axis=1) - 2.0 * x @ marks.T
        return np.asarray(np.sqrt(np.maximum(square.min(axis=1), 0.0)))

    def outside(self, x: FloatArray) -> dict[str, BoolArray]:
        """Which of conditions (n, features) were not seen, by reason."""
        beyond = (x < self.low) | (x > self.high)
        reasons = {f"{name} not seen": beyond[:, k] for k, name in enumerate(CONDITIONS) if beyond[:, k].any()}
        far = self.distance(x) > self.far
        return {**reasons, "combination of conditions not seen": far} if far.any() else reasons


def seen_of(logs: list[FloatArray], seed: int = 1) -> Seen:
    """Of the conditions of several logs, (n, features) each. Every log gives as many landmarks."""
    rng = np.random.default_rng(seed)
    all_of = np.concatenate(logs)
    low, high = np.quantile(all_of, [EDGE, 1.0 - EDGE], axis=0)
    scale = np.maximum(all_of.std(axis=0), LEAST)
    each = max(1, LANDMARKS // len(logs))
    marks = [x[rng.choice(len(x), min(each, len(x)), replace=False)] / scale for x in logs]
    far = []
    for k, x in enumerate(logs):
        others = [m for j, m in enumerate(marks) if j != k] or marks
        far.append(np.quantile(Seen(low, high, scale, np.concatenate(others), 0.0).distance(x[::10]), FAR[0]))
    return Seen(low, high, scale, np.concatenate(marks), float(np.quantile(far, FAR[1])))
