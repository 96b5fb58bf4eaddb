"""The envelope of a validation: ranges covered by the segments on which the complete twin was compared with the
crane."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.sea.spectra.waves import wave_periods
from stillhook.validate.ahc.replay import SETTLE, usable
from stillhook.validate.data_set.check import RESTS, tip_ranges
from stillhook.validate.data_set.records.record import Record, Segment
from stillhook.variables import WINDOW

WAVES = (0.05, 0.95)
"""Shares of all waves that bound the periods of the envelope: one exceptional wave in twenty at either end is not a
tested range."""


def envelope_of(records: Sequence[Record], window: float) -> dict[str, Any] | None:
    """Ranges [SI] of load, wire out, 30 s peak-to-peak of the tip and period of its waves, and modes, over the
    segments used by step 5.

    window: that of the criteria [s], which sets the least length for step 5. Windows without tip motion do not count,
    as in step 0. None where the tip moves in no segment.
    """
    used = [
        (record, _counted(record, segment)) for record, segment in usable(records, window)[0] if segment.s_tip_pp > 0.0
    ]
    periods = [p for record, segment in used for p in wave_periods(_tip(record, segment), record.step)]
    spans = np.concatenate([np.zeros(0), *(tip_ranges(*part, WINDOW) for part in used)])
    spans = spans[spans >= RESTS]
    if not periods or not len(spans):
        return None
    segments = [segment for _, segment in used]
    return {
        "load": _ends([s.load for s in segments]),
        "s_w": [float(min(s.s_w_min for s in segments)), float(max(s.s_w_max for s in segments))],
        "s_tip_pp": _ends(spans),
        "period": [float(x) for x in np.quantile(periods, WAVES)],
        "modes": sorted({s.mode.value for s in segments}),
    }


def _counted(record: Record, segment: Segment) -> Segment:
    """The part of a segment that counts in step 5."""
    skipped = round(SETTLE / record.step)
    start, duration = segment.start + skipped * record.step, segment.duration - skipped * record.step
    return replace(segment, first=segment.first + skipped, start=start, duration=duration)


def _tip(record: Record, segment: Segment) -> FloatArray:
    """Height of the tip as logged [m]; single missing samples are bridged."""
    s = record.part(segment, "s_tip")
    known = np.isfinite(s)
    return np.interp(np.arange(len(s)), np.flatnonzero(known), s[known])


def _ends(values: Any) -> list[float]:
    return [float(np.min(values)), float(np.max(values))]
