"""Peak-to-peak over a moving window, exactly, without branches or stored series (van Herk, Gil and Werman).

The window trails and includes both ends: N = T / t_cycle + 1 samples. Samples are taken in runs of N; within a run the
extreme of the last N samples is that of the running extreme of this run and of the suffix extreme of the run before.
"""

import numpy as np
from numpy.typing import NDArray

from stillhook.physics.scalar import fmax, fmin, scalar

SIGNALS = 3
"""Windowed signals: control error against the true tip, against the measured tip, and the tip itself."""


def window_length(n: int, lanes: int, signals: int = SIGNALS) -> int:
    """Floats that a window of n samples needs for all signals on a number of lanes."""
    return (3 + 2 * (n + 1)) * signals * lanes


def blank_window(n: int, lanes: int, signals: int = SIGNALS) -> NDArray[np.float64]:
    """Layout: running lo, running hi, best peak-to-peak, then n + 1 suffix lows and n + 1 suffix highs, each signals *
    lanes wide."""
    w = signals * lanes
    W = np.empty(window_length(n, lanes, signals))
    rows = W.reshape(-1, w)
    rows[0] = np.inf
    rows[1] = -np.inf
    rows[2] = 0.0
    rows[3 : 3 + n + 1] = np.inf
    rows[3 + n + 1 :] = -np.inf
    return W


@scalar
def window_add(W, w, j, i, n, full, y):
    """Take sample y as number i of a run (0..n-1) for signal and lane j; w = signals * lanes; full: n samples were
    seen."""
    low = W[(3 + i) * w :]
    high = W[(3 + n + 1 + i) * w :]
    lo, hi = fmin(W[j], y), fmax(W[w + j], y)
    W[j] = lo
    W[w + j] = hi
    span = fmax(hi, high[w + j]) - fmin(lo, low[w + j])
    W[2 * w + j] = fmax(W[2 * w + j], span * full)
    low[j] = y
    high[j] = y


@scalar
def window_turn(W, w, n):
    """End of a run: suffix extremes of what was seen, running extremes start anew."""
    for i in range(n - 2, -1, -1):
        low = W[(3 + i) * w :]
        high = W[(3 + n + 1 + i) * w :]
        for j in range(w):
            low[j] = fmin(low[j], low[w + j])
        for j in range(w):
            high[j] = fmax(high[j], high[w + j])
    for j in range(w):
        W[j] = np.inf
        W[w + j] = -np.inf
