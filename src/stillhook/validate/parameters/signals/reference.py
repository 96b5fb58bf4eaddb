"""Whether the logged tip is the one used by the PLC: its own error, the wire and the tip must sum to a
constant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.statistics.estimate import Estimate
from stillhook.statistics.jackknife_regression import fit
from stillhook.validate.parameters.segments import LogPart, by_test
from stillhook.validate.parameters.slopes import bridged, integral, smoothed

EVERY = 0.1
"""Spacing of the samples [s]."""
LEAST_TIP_PP = 0.2
"""Least tip motion in a window from which a lag can be determined [m]."""


@dataclass(frozen=True)
class Reference:
    """One test. lag: of the PLC's tip behind the logged one [s]; spread: standard deviation of the
    reference once the lag is taken out [m]."""

    test: str
    lag: Estimate
    spread: float


def references(parts: Sequence[LogPart]) -> tuple[Reference, ...]:
    """The PLC's reference e_c + s_w - s_tip (+ the wire requested by the operator) in every compensating test with its
    error.

    A crane that extrapolates its tip by t_lead has that taken out. Where the PLC works with the tip of a time ago, the
    reference moves by that time against the tip's speed.
    """
    out = []
    for test, same in by_test([p for p in parts if _shows_reference(p)]).items():
        rows = [_rows(p) for p in same]
        rest, v, block = (np.concatenate(c) for c in zip(*rows, strict=True))
        fitted = fit((v,), rest, block)
        if fitted is not None:
            out.append(Reference(test, Estimate.around(-float(fitted.b[0]), fitted.half(0), fitted.blocks), fitted.sd))
    return tuple(out)


def _shows_reference(part: LogPart) -> bool:
    s = part.segment
    return s.mode.compensates and s.s_tip_pp >= LEAST_TIP_PP and part.has("e_c_measured", "s_w", "s_tip")


def _rows(part: LogPart) -> tuple[NDArray[Any], ...]:
    step, n = part.step, max(1, round(EVERY / part.step))
    requested = integral(part["v_op"], step) if part.has("v_op") else 0.0
    s_tip = bridged(part["s_tip"], step)
    v = smoothed(part["v_tip"] if part.has("v_tip") else np.gradient(smoothed(s_tip, step), step), step)
    lead = part.crane.control.t_lead or 0.0
    ahead = lead * (v + 0.5 * lead * np.gradient(v, step)) if lead else 0.0
    rest = smoothed(part["e_c_measured"] + part["s_w"] - s_tip + requested, step) - ahead
    use = np.isfinite(rest) & np.isfinite(v)
    centred = [np.where(use, x, np.nan) for x in (rest, v)]
    return (*((x - np.nanmean(x) if use.any() else x)[::n] for x in centred), part.blocks(part.t)[::n])
