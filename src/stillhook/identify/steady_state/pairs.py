"""Hoisting against lowering: stretches of about the same speed in pairs (Moslatt 2020 eqs 2.2-2.5)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.identify.steady_state.steps import Rejected, Window

LARGEST_DIFFERENCE = 0.35
"""Largest difference of speed within a pair, over its mean: leakage makes lowering up to 30 % faster than hoisting at
low speed."""
NEIGHBOUR = 120.0
"""Time apart that counts as much as the largest difference of speed [s]: neighbours in a staircase share load, layer
and oil."""
NOT_A_PAIR = 1e6
"""Cost of a pair that is not allowed, far above every allowed one (at most about 1 for the speed and some tens for the
time)."""


@dataclass(frozen=True)
class Pair:
    up: Window
    down: Window

    @property
    def speed(self) -> float:
        """Mean magnitude of both speeds [SI]."""
        return 0.5 * (abs(self.up.speed) + abs(self.down.speed))

    @property
    def friction(self) -> float:
        """Half the difference of effort (eq. 2.4) [SI of effort]."""
        return 0.5 * (self.up.effort - self.down.effort)

    @property
    def load(self) -> float:
        """Half the sum of effort (eqs 2.2, 2.3) [SI of effort]."""
        return 0.5 * (self.up.effort + self.down.effort)

    @property
    def u_friction(self) -> float:
        """Standard uncertainty of ``friction`` and of ``load``, the two stretches being independent [SI of effort]."""
        return 0.5 * float(np.hypot(self.up.u_effort, self.down.u_effort))


@dataclass(frozen=True)
class Pairs:
    """``pairs`` by speed; ``unpaired`` stretches that have no partner, with reasons."""

    pairs: tuple[Pair, ...]
    unpaired: tuple[Rejected, ...]


def pair_windows(windows: Sequence[Window], *, text: Callable[[float], str] = lambda v: f"{v:.4g} (SI)") -> Pairs:
    """Pair each hoisting stretch with a lowering one of about the same speed, each used once.

    As many pairs as the limit on the speed allows; among those the least sum of (difference of speed over the largest
    allowed) and (time apart over `NEIGHBOUR`). text: writes a speed with its unit in the reasons.
    """
    from scipy.optimize import linear_sum_assignment

    ups = [w for w in windows if w.direction > 0]
    downs = [w for w in windows if w.direction < 0]
    v_up, v_down = (np.array([abs(w.speed) for w in ws]) for ws in (ups, downs))
    apart = np.abs(v_up[:, None] - v_down[None, :]) / np.maximum(
        0.5 * (v_up[:, None] + v_down[None, :]), np.finfo(float).tiny
    )
    between = np.abs(np.array([w.middle for w in ups])[:, None] - np.array([w.middle for w in downs])[None, :])
    allowed = apart <= LARGEST_DIFFERENCE
    cost = np.where(allowed, apart / LARGEST_DIFFERENCE + between / NEIGHBOUR, NOT_A_PAIR)
    rows, columns = linear_sum_assignment(cost) if cost.size else ([], [])
    matched = [(int(i), int(j)) for i, j in zip(rows, columns, strict=True) if allowed[i, j]]
    pairs = sorted((Pair(ups[i], downs[j]) for i, j in matched), key=lambda p: p.speed)
    unmatched = [(w, v_down) for i, w in enumerate(ups) if i not in {i for i, _ in matched}]
    unmatched += [(w, v_up) for j, w in enumerate(downs) if j not in {j for _, j in matched}]
    unpaired = [_alone(w, others, text) for w, others in unmatched]
    return Pairs(tuple(pairs), tuple(sorted(unpaired, key=lambda r: r.start)))


def _alone(w: Window, others: FloatArray, text: Callable[[float], str]) -> Rejected:
    direction = "lowering" if w.direction > 0 else "hoisting"
    v = abs(w.speed)
    if len(others) == 0:
        reason = f"no {direction} stretch at all"
    else:
        nearest = float(others[np.argmin(np.abs(others - v))])
        if abs(nearest - v) > LARGEST_DIFFERENCE * 0.5 * (nearest + v):
            reason = (
                f"no {direction} within {100 * LARGEST_DIFFERENCE:.0f} % of {text(v)}; the nearest is {text(nearest)}"
            )
        else:
            reason = f"every {direction} stretch near {text(v)} has a closer partner"
    return Rejected(w.start, w.end, w.direction, w.speed, w.effort, reason, "unpaired")
