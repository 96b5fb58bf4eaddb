"""A record cut into load cases: uninterrupted, one mode, one load."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from stillhook.base.arrays import FloatArray
from stillhook.sea.spectra.waves import wave_periods, window_spans
from stillhook.spec.scenario import Mode
from stillhook.validate.data_set.campaign import CraneTest, Kind
from stillhook.validate.data_set.records.record import Segment

LEAST: Mapping[Kind, float] = {Kind.AHC: 60.0, Kind.LIMITS: 5.0, Kind.DYNAMICS: 5.0}
"""Shortest usable part [s]: two windows of paper F; some moves of the joystick."""
SMOOTH = 0.5
"""Span of the mean that removes noise from the tip before its waves are counted [s]."""
MOVES = 0.02
"""Peak-to-peak tip motion from which the tip moves [m]: several times the noise of a motion reference unit."""


@dataclass(frozen=True)
class SegmentBounds:
    """Samples [first, last) of a record with one mode and one payload [kg]."""

    first: int
    last: int
    mode: Mode
    load: float


def unbroken(good: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Runs of True as [first, last)."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], good, [False])).astype(np.int8)))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def split(parts: Sequence[tuple[int, int]], at: Sequence[int]) -> list[tuple[int, int]]:
    """Runs cut at samples."""
    out = []
    for a, b in parts:
        cuts = [a, *sorted(c for c in set(at) if a < c < b), b]
        out += list(pairwise(cuts))
    return out


def segment(
    test: CraneTest, part: SegmentBounds, t: FloatArray, step: float, signals: Mapping[str, FloatArray], window: float
) -> Segment:
    """A segment with its ranges. Parameters: t (n,) [s] even by step; signals with s_w or without; window of the tip's
    range [s]."""
    cut = slice(part.first, part.last)
    s_w = signals["s_w"][cut] if "s_w" in signals else np.full(part.last - part.first, np.nan)
    known = s_w[np.isfinite(s_w)]
    tip = signals["s_tip"][cut] if "s_tip" in signals else np.zeros(part.last - part.first)
    pp, period = _tip(tip, step, window)
    low, high, first = (
        (float(known.min()), float(known.max()), float(known[0])) if len(known) else (np.nan, np.nan, np.nan)
    )
    return Segment(
        test=test.name,
        first=part.first,
        last=part.last,
        start=float(t[part.first]),
        duration=float(t[part.last - 1] - t[part.first]),
        load=part.load,
        s_w=first,
        s_w_min=low,
        s_w_max=high,
        s_tip_pp=pp,
        period=period,
        mode=part.mode,
    )


def _tip(tip: FloatArray, step: float, window: float) -> tuple[float, float]:
    """Largest peak-to-peak over a window [m] and mean period of its waves [s]; 0 and NaN where it does not move."""
    tip = tip[np.isfinite(tip)]
    if len(tip) < 3:
        return 0.0, np.nan
    smooth = uniform_filter1d(tip, max(1, round(SMOOTH / step)))
    pp = float(np.max(window_spans(smooth, round(window / step) + 1)))
    if pp < MOVES:
        return 0.0, np.nan
    periods = wave_periods(smooth, step)
    return pp, float(np.mean(periods)) if len(periods) else np.nan
