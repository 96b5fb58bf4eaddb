"""The clock of a host that adds up its steps, `t += h`, after more of them than a test can wait for."""

import math

import numpy as np

LEAST = 2.0**-20
"""Times below which additions are made one by one."""


def added_up(n: int, h: float, start: float = 0.0) -> float:
    """What n additions of h to start >= 0 give, rounding by rounding: between two powers of two every addition adds the
    same multiple of the last digit, so they are made together."""
    t = start
    while n > 0 and t < max(LEAST, 8.0 * h):
        t, n = t + h, n - 1
    while n > 0:
        step = (t + h) - t
        top = 2.0 ** math.frexp(t)[1]
        many = min(n, int((top - t) / step) - 1)
        if many > 0 and (t + 0.5 * h) + 0.5 * h != t:
            t, n = t + many * step, n - many
        for _ in range(min(n, 4)):  # over the power of two
            t, n = t + h, n - 1
    return t


def one_by_one(n: int, h: float) -> float:
    """The same by n additions."""
    t, size = 0.0, 1_000_000
    while n > 0:
        steps = np.full(min(n, size) + 1, h)
        steps[0] = t
        t, n = float(np.add.accumulate(steps)[-1]), n - len(steps) + 1
    return t
