"""From what a phase asks and what its rules allow to limiting wave heights."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from stillhook.plan.alternatives import Alternative
from stillhook.plan.demand import Tier

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Limits:
    """Limiting significant wave heights of one phase under one alternative, from one tier, in c columns of (Tp, beta).

    Hs: rule -> (c,) [m]: inf where the highest sea that was asked stays inside, 0 where a calm is beyond, NaN where the tier does not tell;
    low, high: ends of the 95 % interval where there is one. Tp [s] and beta [rad] (c,).
    """

    phase: str
    alternative: Alternative
    tier: Tier
    Tp: FloatArray = field(repr=False)
    beta: FloatArray = field(repr=False)
    Hs: Mapping[str, FloatArray]
    low: Mapping[str, FloatArray] = field(default_factory=dict)
    high: Mapping[str, FloatArray] = field(default_factory=dict)
