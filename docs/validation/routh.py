"""Routh's table: how many roots of a polynomial lie in the right half plane, without finding any of them.

Floats are taken as the exact fractions that they are, and the table is worked out in fractions: whether an element is
zero is then no question of tolerance.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from stillhook.errors import StillhookError

Number = int | float | Fraction
Row = list[Fraction]
LARGEST = 1e12
"""Gain beyond which no limit is looked for, in the unit of the loop."""
GRID = 1.1
"""Factor between the gains at which a limit is first looked for."""
DIGITS = 1e-13
"""Relative width to which a limit is closed in."""


class Routh(NamedTuple):
    """table: rows of Routh's array, highest power first; unstable: roots in the open right half plane; on_axis: roots
    on the imaginary axis; stable: all roots in the open left half plane; special: what the table needed ("zero row at
    s^3", "zero first element at s^2").
    """

    table: tuple[tuple[Fraction, ...], ...]
    unstable: int
    on_axis: int
    special: tuple[str, ...]

    @property
    def stable(self) -> bool:
        return self.unstable == 0 and self.on_axis == 0


def routh(coefficients: Sequence[Number]) -> Routh:
    """Routh's array of a polynomial with real coefficients, highest power first.

    Zero row: the polynomial has roots that lie symmetrically about the origin, which divide it; the row is replaced by
    the derivative of the auxiliary polynomial above it. Zero first element in a row that is not zero: roots on the left
    are added until no such zero is left; the table is then that of the longer polynomial (the limit epsilon -> 0 of
    textbooks fails where both cases meet).

    Errors: StillhookError for no polynomial, or coefficients that are not finite.
    Source: Routh 1877; Gantmacher, The Theory of Matrices, vol. 2, chapter 15, sections 3 and 4.
    """
    p = _exact(coefficients)
    zeros = 0
    while len(p) > 1 and p[-1] == 0:
        p, zeros = p[:-1], zeros + 1
    result = _count(p)
    return result._replace(on_axis=result.on_axis + zeros)


def _exact(coefficients: Sequence[Number]) -> Row:
    if not all(isinstance(c, Fraction) or math.isfinite(c) for c in coefficients):
        raise StillhookError("Routh: a coefficient is not finite.")
    p = [Fraction(c) if not isinstance(c, np.generic) else Fraction(c.item()) for c in coefficients]
    while p and p[0] == 0:
        p = p[1:]
    if not p:
        raise StillhookError("Routh: no polynomial. Give at least one coefficient that is not 0.")
    return p


def _count(p: Row) -> Routh:
    """The table of p, continued by that of the auxiliary polynomial and its derivative where a row vanishes."""
    rows, power = _rows(p)
    if power == 0:
        return Routh(_frozen(rows), _changes(rows), 0, ())
    if any(rows[-1]):
        return _cleared(p, f"zero first element at s^{power - 1}")
    even = _aux(rows[-2], power)
    below = _count([a + b for a, b in zip(even, [Fraction(0), *_derivative(even)], strict=True)])
    above = rows[:-1]
    return Routh(
        _frozen(above) + below.table[1:],
        _changes(above) + below.unstable,
        power - 2 * below.unstable,
        (f"zero row at s^{power - 1}", *below.special),
    )


def _rows(p: Row) -> tuple[list[Row], int]:
    """Rows down to the first one whose first element is zero, and the power above that row; 0 where the table is
    complete."""
    degree = len(p) - 1
    rows = [p[0::2]]
    for power in range(degree - 1, -1, -1):
        rows.append(p[1::2] if power == degree - 1 else _next(rows[-2], rows[-1], power // 2 + 1))
        if rows[-1][0] == 0:
            return rows, power + 1
    return rows, 0


def _next(above: Row, row: Row, length: int) -> Row:
    def at(r: Row, i: int) -> Fraction:
        return r[i] if i < len(r) else Fraction(0)

    return [(row[0] * at(above, i + 1) - above[0] * at(row, i + 1)) / row[0] for i in range(length)]


def _aux(row: Row, power: int) -> Row:
    """All coefficients of the auxiliary polynomial whose every second one is the row of s^power."""
    p = [Fraction(0)] * (power + 1)
    p[0::2] = row[: power // 2 + 1]
    return p


def _derivative(p: Row) -> Row:
    return [c * (len(p) - 1 - i) for i, c in enumerate(p[:-1])]


def _changes(rows: list[Row]) -> int:
    """Changes of sign down the first column."""
    first = [r[0] > 0 for r in rows]
    return sum(a != b for a, b in pairwise(first))


def _frozen(rows: list[Row]) -> tuple[tuple[Fraction, ...], ...]:
    return tuple(tuple(r) for r in rows)


def _cleared(p: Row, reason: str) -> Routh:
    """The count of p with roots added on the left, at -1, -2, ..., as few as clear the zero (s^5 - 5 s^3 + 14 s - 20
    needs two)."""
    longer = p
    for a in range(1, len(p) + 1):
        longer = [x + a * y for x, y in zip([*longer, Fraction(0)], [Fraction(0), *longer], strict=True)]
        rows, power = _rows(longer)
        if power == 0 or not any(rows[-1]):
            result = _count(longer)
            return result._replace(special=(reason, *result.special))
    raise StillhookError("Routh: no roots added on the left clear the zero in the first column.")


def gain_limit_by_routh(num: Sequence[Number], den: Sequence[Number]) -> float:
    """Least gain K > 0 at which den + K num loses its stability, by Routh's table alone; infinite if it never does.

    num, den: the cut loop at K = 1, highest power first; the closed loop is stable at small gains.
    """
    numerator = np.concatenate([np.zeros(len(den) - len(num)), np.asarray(num, dtype=np.float64)])

    def stable(K: float) -> bool:
        return routh(
            [Fraction(float(d)) + Fraction(K) * Fraction(float(n)) for d, n in zip(den, numerator, strict=True)]
        ).stable

    return _first_loss(stable)


def gain_limit_by_poles(poles: Callable[[float], Sequence[complex]], *, sampled: bool = False) -> float:
    """The same from the poles of the closed loop at a gain: eigenvalues, in the s-plane or, sampled, in the z-plane."""

    def stable(K: float) -> bool:
        p = np.asarray(poles(K), dtype=np.complex128)
        return bool(np.max(np.abs(p)) < 1.0) if sampled else bool(np.max(p.real) < 0.0)

    return _first_loss(stable)


def _first_loss(stable: Callable[[float], bool]) -> float:
    """The least gain at which stability is lost: sought upwards in small factors, then closed in by halving."""
    low = 1e-3
    while not stable(low):
        low /= 100.0
        if low < 1e-12:
            raise StillhookError("the loop is unstable at any gain: there is no limit to find.")
    high = low
    while stable(high):
        low, high = high, high * GRID
        if high > LARGEST:
            return math.inf
    while high - low > DIGITS * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stable(middle) else (low, middle)
        if middle in (low, high) and not low < 0.5 * (low + high) < high:
            break
    return 0.5 * (low + high)
