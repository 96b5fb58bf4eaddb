"""Offset of the encoder's clock against that of pressures and displacements, from the oil that the motors swallow.

What the pumps give to the line under pressure, less compression and leakage, is what the motors swallow at the same
moment: the lag between the two is that of the clocks. The line under low pressure is fed by valves and tells nothing.
Reversals are left out, because there the winch holds on its bristle while oil is compressed.
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.statistics.estimate import t_factor

COLUMNS = 4
"""Of the flow balance: motor flow, its rate, pressure drop, one."""
FEWEST = 6
"""Half waves from which a standard error is stated: four columns are fitted."""
FLOOR = 4e-3
"""Least uncertainty that is stated [s]: what compression and slip leave, and less than half a cycle of 10 ms."""
CLEAR = 0.9
"""Correlation of flow and speed from which an offset counts as found [-]."""


class Clock(NamedTuple):
    """offset: the encoder's rows are so much later than those of the pressures [s]; u its standard uncertainty [s],
    without end where it is not found; t: factor of the 95 % interval; half_waves that it is from."""

    offset: float
    u: float
    t: float
    half_waves: int

    @property
    def found(self) -> bool:
        """Whether the log tells the offset."""
        return bool(np.isfinite(self.u))


class FlowRow(NamedTuple):
    """Sums of one half wave: A = X'X, c = X'y of the flow balance."""

    A: FloatArray
    c: FloatArray


def flow_row(Q: FloatArray, q: FloatArray, q_rate: FloatArray, dp: FloatArray) -> FlowRow:
    """Sums of the samples of a half wave: Q of the pumps less compression, q of the motors [m^3/s], its rate [m^3/s^2],
    dp [Pa]."""
    X = np.column_stack([q, q_rate, dp * 1e-9, np.full(len(q), 1e-2)])  # scaled to like sizes
    return FlowRow(X.T @ X, X.T @ Q)


class ClockTracker:
    """Offset over the last half waves; `offset` is the one that rows are put together with."""

    def __init__(self, most: int) -> None:
        self.offset = 0.0
        self._rows: deque[FlowRow] = deque(maxlen=most)

    def add(self, row: FlowRow) -> None:
        """One more half wave, put together with `offset`."""
        self._rows.append(row)

    def remainder(self) -> Clock:
        """What the offset lacks, from all half waves that are kept."""
        m = len(self._rows)
        if m < FEWEST:
            return Clock(0.0, np.inf, np.inf, m)
        A, c = np.stack([r.A for r in self._rows]), np.stack([r.c for r in self._rows])
        total = A.sum(axis=0)
        scale = np.sqrt(np.diag(total))
        if not (scale > 0.0).all():
            return Clock(0.0, np.inf, np.inf, m)
        inverse = np.linalg.pinv(total / np.outer(scale, scale)) / np.outer(scale, scale)
        b = inverse @ c.sum(axis=0)
        if not b[0] > 0.0:
            return Clock(0.0, np.inf, np.inf, m)
        scores = c - np.einsum("ijk,k->ij", A, b)
        per_row = scores @ inverse.T
        lag_of = (per_row[:, 1] - b[1] / b[0] * per_row[:, 0]) / b[0]
        freedom = max(m - COLUMNS, 1)
        u = float(np.sqrt(np.sum(lag_of**2) * m / freedom))
        return Clock(float(b[1] / b[0]), float(np.hypot(u, FLOOR)), t_factor(freedom), m)

    def move(self, by: float) -> None:
        """Put the rows together with an offset that is larger by so much [s]: motor flow is then what it is so much
        later."""
        self.offset += by
        M = np.eye(COLUMNS)
        M[0, 1] = by  # new q = q + by q_rate
        self._rows = deque((FlowRow(M @ r.A @ M.T, M @ r.c) for r in self._rows), self._rows.maxlen)


def coarse_offset(t: FloatArray, Q: FloatArray, q: FloatArray, reach: float, step: float = 0.02) -> float | None:
    """Offset at which flow of the pumps Q and of the motors q (n,), both at times t [s], correlate best, within reach
    [s]; None where they do not clearly."""
    good = np.isfinite(Q) & np.isfinite(q)
    if good.sum() < 10:
        return None
    t, Q, q = t[good], Q[good], q[good]
    best, offset = CLEAR, None
    inner = (t > t[0] + reach) & (t < t[-1] - reach)
    if inner.sum() < 10:
        return None
    for tried in np.arange(-reach, reach + 0.5 * step, step):
        moved = np.interp(t[inner] + tried, t, q)
        size = float(np.std(moved) * np.std(Q[inner]))
        match = float(np.mean((moved - moved.mean()) * (Q[inner] - Q[inner].mean()))) / size if size > 0.0 else 0.0
        if match > best:
            best, offset = match, float(tried)
    return offset
