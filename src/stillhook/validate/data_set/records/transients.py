"""Transients in a test of the winch dynamics: quick changes of the pumps' command, each until the next change."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.validate.data_set.records.record import Record, Segment

RATE = 0.15
"""Change of the pumps' command that is quick [1/s]: full stroke in some 7 s; joystick ramps of a friction test are
slower."""
SPAN = 0.05
"""Time over which that rate is taken [s]: above the quantisation of a command, below any joystick's ramp."""
JOIN = 0.15
"""Pause within one change [s]."""
LEAST_CHANGE = 0.05
"""Change of the pumps' command that counts as a turn [-]: it moves the motors at full displacement by some 5 % of their
highest speed."""
LONGEST = 8.0
"""Longest time considered after a turn [s]: the oscillation of the winch has then long decayed."""
BEFORE = 0.1
"""Quiet time before a turn that belongs to it [s]."""


@dataclass(frozen=True)
class Transient:
    """A quick change of the pumps' command and the response to it.

    first, last: samples [first, last) of the record, from just before the change to the next one; turn: sample at which
    the change begins; start: its time [s]; took: how long the change lasts [s]; before, after: the command on both
    sides of it [-].
    """

    test: str
    first: int
    last: int
    turn: int
    start: float
    took: float
    before: float
    after: float

    @property
    def change(self) -> float:
        """Change of the pumps' command, hoisting positive [-]."""
        return self.after - self.before


def find_transients(record: Record, segment: Segment) -> tuple[Transient, ...]:
    """The quick changes of u_p in a segment, in order of time."""
    u = filled(record.part(segment, "u_p"))
    spans = quick_changes(u, record.step)
    n, pad = len(u), max(1, round(BEFORE / record.step))
    result = []
    for i, (a, b) in enumerate(spans):
        end = spans[i + 1][0] - pad if i + 1 < len(spans) else n
        last = min(end, a + round(LONGEST / record.step), n)
        before, after = float(np.median(u[max(0, a - pad) : a + 1])), float(np.median(u[b : min(n, b + pad + 1)]))
        k = segment.first + a
        result.append(
            Transient(
                test=record.test.name,
                first=max(segment.first, k - pad),
                last=segment.first + last,
                turn=k,
                start=float(record.t[k]),
                took=(b - a) * record.step,
                before=before,
                after=after,
            )
        )
    return tuple(result)


def quick_changes(u: FloatArray, step: float) -> list[tuple[int, int]]:
    """First and last sample of every quick change of a command u (n,) on an even grid of step [s]."""
    k = max(1, round(SPAN / step))
    if len(u) <= 2 * k:
        return []
    quick = np.flatnonzero(np.abs(u[k:] - u[:-k]) > RATE * k * step)
    if not len(quick):
        return []
    apart = np.flatnonzero(np.diff(quick) > max(1, round(JOIN / step)))
    firsts, lasts = quick[np.concatenate([[0], apart + 1])], quick[np.concatenate([apart, [len(quick) - 1]])] + k
    return [(int(a), int(b)) for a, b in zip(firsts, lasts, strict=True) if abs(u[b] - u[a]) >= LEAST_CHANGE]


def filled(x: FloatArray) -> FloatArray:
    """A signal with unknown samples interpolated linearly; zeros where nothing is known."""
    good = np.isfinite(x)
    if good.all():
        return x
    return np.interp(np.arange(len(x)), np.flatnonzero(good), x[good]) if good.any() else np.zeros_like(x)


def smoothed(x: FloatArray, step: float, over: float) -> FloatArray:
    """A signal's centred mean over a time [s], without lag; at its ends over the available samples."""
    k = max(1, round(over / step) | 1)
    weights = np.ones(k)
    out: FloatArray = np.convolve(x, weights, "same") / np.convolve(np.ones(len(x)), weights, "same")
    return out


def quick_enough(transients: Sequence[Transient], period: float) -> tuple[Transient, ...]:
    """The turns whose command changes within the period of the winch's oscillation [s]: a slower change hardly excites
    it."""
    return tuple(x for x in transients if x.took <= period + SPAN)
