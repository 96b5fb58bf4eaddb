"""Headings of a plan's table about a direction of waves: which are next to it, and whether the table covers it."""

from __future__ import annotations

import math

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray

SAME = 1e-9
"""Part of a period or an angle by which two that are meant to be one may differ."""
FULL = 2.0 * math.pi


def _off(headings: FloatArray, beta: FloatArray) -> FloatArray:
    """Angle between headings and beta (n,), either way: (heading, n) [rad]."""
    return np.asarray(np.abs((beta[None] - headings[:, None] + math.pi) % FULL - math.pi))


def bracketed(headings: FloatArray, tolerance: float, beta: FloatArray) -> tuple[BoolArray, BoolArray]:
    """Which headings are next to beta (n,) on either side (heading, n), and whether a table covers it (n,): the two are
    no more than twice the tolerance apart, or beta is a heading. [rad], around the circle."""
    on = _off(headings, beta) <= SAME * FULL
    behind, ahead = ((sign * (beta[None] - headings[:, None])) % FULL for sign in (1.0, -1.0))
    rows = behind.argmin(axis=0), ahead.argmin(axis=0)
    gap = (headings[rows[1]] - headings[rows[0]]) % FULL
    neighbours = np.zeros_like(on)
    for row in rows:
        neighbours[row, np.arange(len(beta))] = True
    exact = on.any(axis=0)
    covered = exact | (np.isfinite(beta) & (gap > 0.0) & (gap <= 2.0 * tolerance * (1.0 + SAME) + SAME))
    return np.where(exact, on, neighbours), np.asarray(covered)


def counted(headings: FloatArray, tolerance: float, beta: FloatArray) -> tuple[BoolArray, BoolArray]:
    """Which headings of a table count for waves of beta (heading, n): those on either side and those within the
    tolerance; and whether it covers them (n,). [rad]"""
    between, covered = bracketed(headings, tolerance, beta)
    return between | _near(headings, tolerance, beta), covered


def cones(headings: FloatArray, tolerance: float) -> BoolArray:
    """Which headings count (heading, heading) for a vessel that keeps the second and is off it by the tolerance [rad]
    at most."""
    result = _near(headings, tolerance, headings)
    for end in (-tolerance, tolerance):
        result |= bracketed(headings, tolerance, headings + end)[0]
    return result


def _near(headings: FloatArray, tolerance: float, beta: FloatArray) -> BoolArray:
    """Which headings (heading, n) lie within the tolerance of beta (n,)."""
    return np.asarray(_off(headings, beta) <= tolerance * (1.0 + SAME) + SAME)


def holdable_headings(headings: FloatArray, tolerance: float) -> BoolArray:
    """Which headings (heading,) a vessel can keep: waves from `tolerance` [rad] on either side of them are covered by
    the table."""
    return np.asarray(
        np.all([bracketed(headings, tolerance, headings + end)[1] for end in (-tolerance, tolerance)], axis=0)
    )
