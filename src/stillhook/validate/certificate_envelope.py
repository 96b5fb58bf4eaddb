"""The envelope of a validation: what the stretches covered on which the whole twin was compared with the crane."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.sea.waves import wave_periods, window_spans
from stillhook.validate.ahc_twin import SETTLE, usable
from stillhook.validate.record import Record, Segment
from stillhook.variables import WINDOW

FloatArray = NDArray[np.float64]

WAVES = (0.05, 0.95)
"""Shares of all waves between which the periods of the envelope lie: one odd wave in twenty at either end is no range that was tested."""


def envelope_of(records: Sequence[Record], window: float) -> dict[str, Any] | None:
    """Ranges [SI] of load, wire out, 30 s peak-to-peak of the tip and period of its waves, and modes, over the stretches that step 5 used.

    window: that of the criteria [s], which says what is long enough for step 5. None where no stretch has a moving tip.
    """
    used = [part for part in usable(records, window)[0] if part[1].s_tip_pp > 0.0]
    tips = [_tip(*part) for part in used]
    periods = [p for (record, _), s in zip(used, tips, strict=True) for p in wave_periods(s, record.step)]
    if not periods:
        return None
    spans = np.concatenate([window_spans(s, round(WINDOW / r.step) + 1) for (r, _), s in zip(used, tips, strict=True)])
    segments = [s for _, s in used]
    return {
        "load": _ends([s.load for s in segments]),
        "s_w": [float(min(s.s_w_min for s in segments)), float(max(s.s_w_max for s in segments))],
        "s_tip_pp": _ends(spans),
        "period": [float(x) for x in np.quantile(periods, WAVES)],
        "modes": sorted({s.mode.value for s in segments}),
    }


def _tip(record: Record, segment: Segment) -> FloatArray:
    """Height of the tip as logged, over what of a segment counts [m]; single missing samples are bridged."""
    s = record.part(segment, "s_tip")[round(SETTLE / record.step) :]
    known = np.isfinite(s)
    return np.interp(np.arange(len(s)), np.flatnonzero(known), s[known])


def _ends(values: Any) -> list[float]:
    return [float(np.min(values)), float(np.max(values))]
