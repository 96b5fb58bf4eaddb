"""Between which position gains a loop dies out: the poles of the closed loop as K_p grows from 0.

A loop that is stable when cut has one limit, from above. One that oscillates when cut may be stable between two gains
(conditionally), or at none.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from stillhook.analysis.loop_stability.margins import (
    at_frequency,
    gain_and_frequency,
    grid_response,
    grows_alone,
    is_stable,
    root_between,
)
from stillhook.analysis.loop_stability.transfer import SampledLoop


class StableGains(NamedTuple):
    """The loop dies out for low < K_p < high [1/m]; omega_c its frequency at `high` [rad/s]. high is 0 where no gain
    stabilises it, low above 0 where it oscillates without feedback and a gain ends that."""

    low: float
    high: float
    omega_c: float

    @property
    def any(self) -> bool:
        """Whether any gain stabilises the loop."""
        return self.high > 0.0

    @property
    def alone(self) -> bool:
        """Whether the loop oscillates without feedback."""
        return self.low > 0.0 or not self.any

    def holds(self, K_p: float) -> bool:
        """Whether the loop dies out at a gain [1/m]."""
        return self.low < K_p < self.high


def stable_gains(loop: SampledLoop) -> StableGains:
    """The lowest range of gains at which a loop dies out, by crossings of the negative real axis (Nyquist) and the
    closed loop's poles between them.

    Source: Astrom and Murray, Feedback Systems, section 9.3 (conditional stability).
    """
    alone = grows_alone(loop)
    omega, L = grid_response(loop)
    if alone is None and loop.remembered is None:
        return StableGains(0.0, *gain_and_frequency(loop, omega, L))
    at = _crossings(loop, omega, L)
    edges = [0.0, *(K for K, _ in at), math.inf]
    frequency = dict(at) | {math.inf: math.inf}
    for low, high in pairwise(edges):
        if is_stable(loop, _between(low, high)):
            return StableGains(low, high, frequency[high])
    return StableGains(0.0, 0.0, math.nan if alone is None else alone)


def _crossings(loop: SampledLoop, omega: np.ndarray, L: np.ndarray) -> list[tuple[float, float]]:
    """Gains at which the response passes -1, rising, with their frequencies; the Nyquist frequency among them."""
    brackets = np.nonzero(
        (np.signbit(L.imag[:-1]) != np.signbit(L.imag[1:])) & (np.minimum(L.real[:-1], L.real[1:]) < 0)
    )
    result = []
    for i in brackets[0]:
        w = root_between(lambda w: at_frequency(loop, w).imag, omega[i], omega[i + 1])
        result.append((at_frequency(loop, w).real, w))
    result.append((float(L.real[-1]), float(omega[-1])))
    return sorted((-1.0 / x, w) for x, w in result if x < 0.0)


def _between(low: float, high: float) -> float:
    """A gain in a range [1/m]."""
    if math.isinf(high):
        return 2.0 * low if low > 0.0 else 1.0
    return 0.5 * high if low == 0.0 else math.sqrt(low * high)


__all__ = ["StableGains", "stable_gains"]
