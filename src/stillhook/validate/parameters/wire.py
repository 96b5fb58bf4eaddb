"""Stiffness of the wire from the force of the hook's motion: a softer wire lets the hook swing further, the more so the
nearer the waves are to the eigenfrequency of load and wire.

At the shallow end, or with a light load, that is some per cent of a force of some kN: the data then detect no deviation
of the size of the limit, and the line says so.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.statistics.blocks import Fit, fit, pooled
from stillhook.statistics.estimate import Estimate
from stillhook.validate.parameters.segments import LogPart, by_test, stacked
from stillhook.validate.parameters.signals import EDGE, LEAST_PP, Sea, TipDelay, compensates, sea_of

WIDEST = 0.25
"""Half width of an interval from which a stiffness that agrees is not reported as shown [-]: the criteria's limit."""
WIRE_SHARE = 1.0 / 3.0
"""Part of the wire's own mass that moves with the load, which the twin leaves out (uniform wire, first mode)."""

ROUNDS = 8
MOST_CHANGE = 0.3
"""Largest change of the stiffness in a round [-]."""
LEAST, MOST = 0.2, 5.0
"""Stiffness over the twin's that is considered [-]."""


@dataclass(frozen=True)
class WireStiffness:
    """One test. error: stiffness over the twin's, less 1 [-]."""

    test: str
    error: Estimate


def wire_stiffnesses(parts: Sequence[LogPart], delays: Sequence[TipDelay]) -> tuple[WireStiffness, ...]:
    """Stiffness of the wire in every test with heave compensation and a logged load cell, with the tip ahead by its
    delay."""
    late = {d.test: d.delay.value for d in delays}
    usable = [p for p in parts if p.test in late and compensates(p, LEAST_PP) and p.knows("F_w", "s_tip", "s_w")]
    tests = by_test([p for p in usable if p.segment.duration > 4.0 * EDGE])
    return tuple(
        WireStiffness(test, error) for test, same in tests.items() if (error := _error(same, late[test])) is not None
    )


def overall(found: Sequence[WireStiffness]) -> Estimate | None:
    """The error over all tests; None where there are none."""
    return pooled([x.error for x in found]) if found else None


def _error(parts: Sequence[LogPart], delay: float) -> Estimate | None:
    """Force = g (hook + change by_stiffness), linearised again about each stiffness found: the gain g is free, for
    added mass and the wire's own mass are in it; next to friction of the sheaves, rest of the delay and lag of the load
    cell, as for the delay."""
    stiffness, fitted = 1.0, None
    for _ in range(ROUNDS):
        fitted = _fitted(parts, delay, stiffness)
        if fitted is None or fitted.b[0] <= 0.0:
            return None
        change, half = fitted.ratio(1, 0)
        before = stiffness
        stiffness = float(np.clip(stiffness * (1.0 + np.clip(change, -MOST_CHANGE, MOST_CHANGE)), LEAST, MOST))
    assert fitted is not None
    structural = WIRE_SHARE * max(_wire_mass(p) / float(p.params.hoist.load.m) for p in parts)
    return Estimate.around(stiffness - 1.0, math.hypot(before * half, structural), fitted.blocks, structural)


def _fitted(parts: Sequence[LogPart], delay: float, stiffness: float) -> Fit | None:
    hook, soft, speed, rate, force, way, block = stacked([_rows(sea_of(p, stiffness), delay) for p in parts])
    return fit((hook, soft, speed, way, rate), force, block)


def _rows(sea: Sea, delay: float) -> tuple[NDArray[Any], ...]:
    hook, speed, rate = sea.columns(delay)
    ahead = sea.tip * np.exp(1j * sea.w * delay) - sea.wire
    soft = np.fft.irfft(ahead * sea.by_stiffness, len(sea.way))
    return tuple(x[sea.inside] for x in (hook, soft, speed, rate, sea.force, sea.way, sea.block))


def _wire_mass(part: LogPart) -> float:
    """Mass of the wire paid out [kg]."""
    return float(part.crane.wire.mass_per_length) * float(np.nanmean(part["s_w"]))
