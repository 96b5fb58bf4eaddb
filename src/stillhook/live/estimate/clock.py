"""Offset of the encoder's clock against that of pressures and displacements, from the oil that the motors take in.

What the pumps give to the line under pressure, less compression and leakage, is what the motors take in at the same
moment: the lag between the two is that of the clocks. The line under low pressure is fed by valves and tells nothing.
Reversals are left out, because there the winch holds on its bristle while oil is compressed.
"""

from __future__ import annotations

import itertools
from collections import deque
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.live.estimate.parameters.balances import FLOW
from stillhook.live.estimate.parameters.sums import Sums, fit, window_of
from stillhook.statistics.estimate import t_factor

COLUMNS = [FLOW.index(name) for name in ("motors", "rate", "leak", "one")]
PUMPS = np.array([{"pumps": 1.0, "storage": -1.0}.get(name, 0.0) for name in FLOW])
"""Columns of the flow balance that explain what the pumps give less compression."""
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


class ClockTracker:
    """Offset over the last half waves; `offset` is the one that rows are put together with. rows: flow balances of the
    half waves; most: how many of them count."""

    def __init__(self, rows: deque[Sums], most: int) -> None:
        self.offset = 0.0
        self.rows, self._most = rows, most

    def remainder(self) -> Clock:
        """What the offset lacks."""
        rows = list(itertools.islice(reversed(self.rows), self._most))
        m = len(rows)
        unknown = Clock(0.0, np.inf, np.inf, m)
        if m < FEWEST:
            return unknown
        window = window_of(rows)
        line = fit(window, COLUMNS, PUMPS)
        if line is None or not line.b[0] > 0.0:
            return unknown
        left = PUMPS.copy()
        left[COLUMNS] -= line.b
        per_row = (window.G[:, COLUMNS] @ left) @ line.H.T
        lag_of = (per_row[:, 1] - line.b[1] / line.b[0] * per_row[:, 0]) / line.b[0]
        freedom = max(m - len(COLUMNS), 1)
        u = float(np.sqrt(np.sum(lag_of**2) * m / freedom))
        return Clock(float(line.b[1] / line.b[0]), float(np.hypot(u, FLOOR)), t_factor(freedom), m)

    def move(self, by: float) -> None:
        """Put the rows together with an offset that is larger by so much [s]: motor flow is then what it is so much
        later."""
        self.offset += by
        M = np.eye(len(FLOW))
        M[FLOW.index("motors"), FLOW.index("rate")] = by
        moved = [r._replace(G=M @ r.G @ M.T) for r in self.rows]
        self.rows.clear()
        self.rows.extend(moved)


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
