"""Limits as they are read on board: which headings of a plan's table count for a direction of waves, at each heading
that a vessel may keep through an operation.

A vessel whose heading is held has one. One that is free to turn keeps one heading from start to end, the best for that
window: where the weather gives the direction of waves, every `stillhook.weather.limit_text.FREE_STEP` of the compass is
tried; where it does not, waves are taken to come from one direction throughout, off by the heading tolerance at most,
and every heading of the table is tried. In neither case is a limit above that of the best heading of the table that can
be kept within the tolerance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray, IntArray
from stillhook.errors import PlanError
from stillhook.sea.spectra.directions import FULL, relative
from stillhook.weather.limit_text import free_headings

SAME = 1e-9
"""Part of a period or an angle by which two that are meant to be one may differ."""


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
    """Which headings count (heading, heading) for a vessel that keeps the second to within the tolerance [rad]."""
    result = _near(headings, tolerance, headings)
    for end in (-tolerance, tolerance):
        result |= bracketed(headings, tolerance, headings + end)[0]
    return result


def _near(headings: FloatArray, tolerance: float, beta: FloatArray) -> BoolArray:
    """Which headings (heading, n) lie within the tolerance of beta (n,)."""
    return np.asarray(_off(headings, beta) <= tolerance * (1.0 + SAME) + SAME)


def holdable_headings(headings: FloatArray, tolerance: float) -> BoolArray:
    """Which headings (heading,) a vessel can keep: the table covers waves from `tolerance` [rad] on both sides."""
    return np.asarray(
        np.all([bracketed(headings, tolerance, headings + end)[1] for end in (-tolerance, tolerance)], axis=0)
    )


def worst(by_heading: FloatArray, counts: BoolArray, known: BoolArray) -> FloatArray:
    """The least (n,) of limits (heading, n) over the headings that count; 0 where nothing is known (n or 1,)."""
    return np.asarray(np.where(known, np.where(counts, by_heading, np.inf).min(axis=0), 0.0))


@dataclass(frozen=True, eq=False)
class LimitTable:
    """Limits of one alternative as they are read on board: Hs (heading, period) [m], headings [rad] and periods [s]
    rising; heading_tolerance [rad]; Hs_highest, the highest sea state analysed [m]: a larger limit is never
    answered."""

    Hs: FloatArray = field(repr=False)
    headings: FloatArray = field(repr=False)
    periods: FloatArray = field(repr=False)
    heading_tolerance: float
    Hs_highest: float

    def __post_init__(self) -> None:
        if self.Hs.shape != (len(self.headings), len(self.periods)):
            raise PlanError(
                f"limit table of {self.Hs.shape}: not {len(self.headings)} headings by {len(self.periods)} periods."
            )

    def at(self, Tp: FloatArray, beta: FloatArray) -> FloatArray:
        """Limiting significant wave height [m] of seas of peak period Tp [s] that travel in beta [rad from the bow],
        (n,).

        Between two headings that are no more than twice the tolerance apart the worst of these and of all within the
        tolerance; at a heading itself the worst of those within the tolerance; elsewhere 0, for no such sea was looked
        at, and 0 where beta is NaN. Of the periods see `by_heading`. Limits not in the table are 0. Vessels free
        to turn: `stillhook.plan.weather.value`.
        """
        directions = np.asarray(beta, dtype=float)
        return worst(
            self.by_heading(np.asarray(Tp, dtype=float)), *counted(self.headings, self.heading_tolerance, directions)
        )

    def by_heading(self, Tp: FloatArray) -> FloatArray:
        """Limits (heading, n) of each heading alone: the worst of the two periods on either side of Tp (the one row
        where Tp is a row); below the lowest the first row holds, above the highest the limit is 0. Tp NaN: the worst of
        all periods."""
        Hs = np.minimum(np.nan_to_num(self.Hs, nan=0.0, posinf=np.inf), self.Hs_highest)
        slack = SAME * self.periods
        high = np.searchsorted(self.periods + slack, np.nan_to_num(Tp, nan=0.0))
        low = np.searchsorted(self.periods - slack, np.nan_to_num(Tp, nan=0.0), side="right") - 1
        beyond = high >= len(self.periods)
        rows = [np.clip(k, 0, len(self.periods) - 1) for k in (low, high)]
        result = np.minimum(Hs[:, rows[0]], Hs[:, rows[1]])
        result = np.where(beyond, 0.0, result)
        return np.where(np.isnan(Tp), Hs.min(axis=1, keepdims=True), result)


@dataclass(frozen=True, eq=False)
class KeptHeadings:
    """Which headings of a table count for the waves of a record, at each heading that a vessel may keep.

    counts (kept, heading, direction) and known (kept, direction), as `counted`; direction
    (n,): that of each record; best: the same for headings of the table, of which the best is the most that counts, None
    where nothing else does.
    """

    counts: BoolArray = field(repr=False)
    known: BoolArray = field(repr=False)
    direction: IntArray = field(repr=False)
    best: KeptHeadings | None = field(default=None, repr=False)

    @classmethod
    def of(cls, table: LimitTable, n: int, come_from: FloatArray | None, ship: float | None) -> KeptHeadings:
        """Headings for n records: come_from (n,) [rad from north] or None; ship [rad from north] or None where it is
        free to turn."""
        around = cones(table.headings, table.heading_tolerance).T[:, :, None]
        of_table = cls(
            around, holdable_headings(table.headings, table.heading_tolerance)[:, None], np.zeros(n, dtype=np.int64)
        )
        if come_from is None:
            return of_table
        directions, place = np.unique(come_from, return_inverse=True)
        ships = free_headings() if ship is None else np.array([ship])
        each = [
            counted(table.headings, table.heading_tolerance, np.asarray(relative(directions, float(s)))) for s in ships
        ]
        counts, known = np.stack([counts for counts, _ in each]), np.stack([known for _, known in each])
        return cls(counts, known, place.reshape(n).astype(np.int64), of_table if ship is None else None)

    def limits(self, table: LimitTable, periods: Sequence[FloatArray]) -> FloatArray:
        """Limiting Hs [m] of each record at each heading (kept, n), the worst over readings of its period (n,) [s]."""
        kinds = self.kinds(table, periods)
        return np.asarray(self.of_kinds(table, periods, kinds)[:, kinds.inverse])

    def kinds(self, table: LimitTable, periods: Sequence[FloatArray]) -> Kinds:
        """Records between the same periods of the table and of one direction: they have one limit."""
        rows = [
            np.searchsorted(table.periods + sign * SAME * table.periods, T) for T in periods for sign in (1.0, -1.0)
        ]
        keys = np.stack([self.direction, *rows, *(np.isnan(T).astype(np.int64) for T in periods)])
        _, first, inverse = np.unique(keys, axis=1, return_index=True, return_inverse=True)
        return Kinds(first, inverse.reshape(keys.shape[1]))

    def of_kinds(self, table: LimitTable, periods: Sequence[FloatArray], kinds: Kinds) -> FloatArray:
        """Limits (kept, k) of the kinds of records [m]."""
        at = kinds.first
        by_heading = np.min([table.by_heading(T_p[at]) for T_p in periods], axis=0)
        direction = self.direction[at]
        pairs = zip(self.counts, self.known, strict=True)
        limits = np.stack([worst(by_heading, counts[:, direction], known[direction]) for counts, known in pairs])
        return (
            limits if self.best is None else np.minimum(limits, self.best.of_kinds(table, periods, kinds).max(axis=0))
        )


class Kinds(NamedTuple):
    """Kinds of records: first (k,) record of each, and the kind of every record (n,)."""

    first: IntArray
    inverse: IntArray
