"""Sums whose last bit does not hang on the number of threads: a certificate reproduces to the byte."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def dot(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Sum of products of two columns (n,). BLAS, behind `a @ b`, shares long columns among threads and rounds by their
    number."""
    return float(np.sum(a * b))
