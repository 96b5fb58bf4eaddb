"""Whether the logged tip is the one that the PLC controlled against: its own error, the wire and the tip must add up to
a constant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.spec.scenario import Mode
from stillhook.statistics.jackknife_regression import Estimate, fit
from stillhook.validate.parameters.segments import Part, by_test
from stillhook.validate.parameters.slopes import bridged, integral, smoothed

EVERY = 0.1
"""Spacing of the samples [s]."""
LEAST_PP = 0.2
"""Tip motion in a window from which a lag can be told [m]."""


@dataclass(frozen=True)
class Reference:
    """One test. lag: by which the PLC's tip comes later than the logged one [s]; spread: standard deviation of the
    reference once the lag is taken out [m]."""

    test: str
    lag: Estimate
    spread: float


def references(parts: Sequence[Part]) -> tuple[Reference, ...]:
    """The PLC's reference e_c + s_w - s_tip (+ what the operator asked for) in every compensating test with its error.

    A crane that extrapolates its tip by t_lead has that taken out. Where the PLC works with the tip of a time ago, the
    reference moves by that time against the tip's speed.
    """
    out = []
    for test, mine in by_test([p for p in parts if _can_tell(p)]).items():
        rows = [_rows(p) for p in mine]
        rest, v, block = (np.concatenate(c) for c in zip(*rows, strict=True))
        found = fit((v,), rest, block)
        if found is not None:
            out.append(Reference(test, Estimate(-float(found.b[0]), found.half(0), found.blocks), found.sd))
    return tuple(out)


def _can_tell(part: Part) -> bool:
    s = part.segment
    return s.mode is not Mode.MANUAL and s.s_tip_pp >= LEAST_PP and part.has("e_c_measured", "s_w", "s_tip")


def _rows(part: Part) -> tuple[NDArray[Any], ...]:
    step, n = part.step, max(1, round(EVERY / part.step))
    asked = integral(part["v_op"], step) if part.has("v_op") else 0.0
    s_tip = bridged(part["s_tip"], step)
    v = smoothed(part["v_tip"] if part.has("v_tip") else np.gradient(smoothed(s_tip, step), step), step)
    lead = part.crane.control.t_lead or 0.0
    ahead = lead * (v + 0.5 * lead * np.gradient(v, step)) if lead else 0.0
    rest = smoothed(part["e_c_measured"] + part["s_w"] - s_tip + asked, step) - ahead
    use = np.isfinite(rest) & np.isfinite(v)
    centred = [np.where(use, x, np.nan) for x in (rest, v)]
    return (*((x - np.nanmean(x) if use.any() else x)[::n] for x in centred), part.blocks(part.t)[::n])
