"""Limits of a plan's table at each heading that a vessel may keep through an operation.

A vessel whose heading is held has one. One that is free to turn keeps one heading from start to end, the best for that
window: where the weather tells the direction of waves, every `stillhook.weather.limit_text.FREE_STEP` of the compass is
tried; where it does not, waves are taken to come from one direction throughout, off by the heading tolerance at most,
and every heading of the table is tried. In neither case is a limit above that of the best heading of the table that can
be kept within the tolerance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray, IntArray
from stillhook.plan.table.table import LimitTable, cones, counted, holdable_headings, worst
from stillhook.sea.spectra.directions import relative
from stillhook.weather.limit_text import free_headings


@dataclass(frozen=True, eq=False)
class KeptHeadings:
    """Which headings of a table count for the waves of a record, at each heading that a vessel may keep.

    counts (kept, heading, direction) and told (kept, direction), as `stillhook.plan.table.table.counted`; direction
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
        """Limiting significant wave height [m] of each record at each heading (kept, n), the worst over readings of its
        period (n,) [s]."""
        by_heading = np.min([table.by_heading(T_p) for T_p in periods], axis=0)
        pairs = zip(self.counts, self.known, strict=True)
        limits = np.stack(
            [worst(by_heading, counts[:, self.direction], known[self.direction]) for counts, known in pairs]
        )
        return limits if self.best is None else np.minimum(limits, self.best.limits(table, periods).max(axis=0))
