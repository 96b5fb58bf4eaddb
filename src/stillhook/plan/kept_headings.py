"""Limits of a plan's table at each heading that a vessel may keep through an operation.

A vessel whose heading is held has one. One that is free to turn keeps one heading from start to end, the best for that window: where the
weather tells the direction of waves, every `stillhook.weather.limit_text.FREE_STEP` of the compass is tried; where it does not, waves are
taken to come from one direction throughout, off by the heading tolerance at most, and every heading of the table is tried.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from stillhook.plan.table import BoolArray, FloatArray, IntArray, LimitTable, cones, counted, kept, worst
from stillhook.sea.directions import relative
from stillhook.weather.limit_text import free_headings


@dataclass(frozen=True, eq=False)
class KeptHeadings:
    """Which headings of a table count for the waves of a record, at each heading that a vessel may keep.

    counts (kept, heading, direction) and told (kept, direction), as `stillhook.plan.table.counted`; direction (n,): that of each record.
    """

    counts: BoolArray = field(repr=False)
    told: BoolArray = field(repr=False)
    direction: IntArray = field(repr=False)

    @classmethod
    def of(cls, table: LimitTable, n: int, come_from: FloatArray | None, ship: float | None) -> KeptHeadings:
        """Headings for n records: come_from (n,) [rad from north] or None; ship [rad from north] or None where it is free to turn."""
        if come_from is None:
            counts = cones(table.headings, table.heading_tolerance).T[:, :, None]
            return cls(counts, kept(table.headings, table.heading_tolerance)[:, None], np.zeros(n, dtype=np.int64))
        directions, place = np.unique(come_from, return_inverse=True)
        ships = free_headings() if ship is None else np.array([ship])
        each = [counted(table.headings, table.heading_tolerance, np.asarray(relative(directions, float(s)))) for s in ships]
        return cls(np.stack([counts for counts, _ in each]), np.stack([told for _, told in each]), place.reshape(n).astype(np.int64))

    def limits(self, table: LimitTable, periods: Sequence[FloatArray]) -> FloatArray:
        """Limiting significant wave height [m] of each record at each heading (kept, n), the worst over readings of its period (n,) [s]."""
        by_heading = np.min([table.by_heading(T_p) for T_p in periods], axis=0)
        pairs = zip(self.counts, self.told, strict=True)
        return np.stack([worst(by_heading, counts[:, self.direction], told[self.direction]) for counts, told in pairs])
