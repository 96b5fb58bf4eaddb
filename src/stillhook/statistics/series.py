"""Sums of products, trends and filters of series.

Products are summed on one thread, so that the last bit does not depend on the number of threads and a certificate
reproduces to the byte. They are long and narrow: a BLAS that spreads them over threads gains little, and on a machine
that others share its threads wait for one another (a year of sea states: 0.6 s on one thread, 0.5 to 11 s on two).
"""

from __future__ import annotations

import numpy as np

from stillhook.base.arrays import FloatArray

SMALL = 200_000
"""Multiplications in a product that OpenBLAS does not spread over threads (its threshold is 262,144)."""


def dot(a: FloatArray, b: FloatArray) -> float:
    """Sum of products of two columns (n,)."""
    return float(np.sum(a * b))


def over_frequency(a: FloatArray, b: FloatArray) -> FloatArray:
    """Sums over the last axis, (n, s): a (n, m), b (s, m)."""
    rows, out = max(1, SMALL // b.size), np.empty((len(a), len(b)))
    for i in range(0, len(a), rows):
        np.matmul(a[i : i + rows], b.T, out=out[i : i + rows])
    return out


def straightened(y: FloatArray) -> FloatArray:
    """A series less its mean and the straight line through it."""
    t = np.linspace(-1.0, 1.0, len(y))
    y = y - np.sum(y) / len(y)
    return np.asarray(y - t * (np.sum(t * y) / np.sum(t * t)))


def low_pass(x: FloatArray, k: float) -> FloatArray:
    """First-order lag of a sampled signal that starts settled, (n,); k part of the way that it goes in one sample."""
    from scipy.signal import lfilter  # heavy: only where logs are made or checked

    return np.asarray(lfilter([k], [1.0, k - 1.0], x, zi=[(1.0 - k) * x[0]])[0])
