"""Elongation of the wire under load from the force of the hook's motion: a softer wire lets the hook swing further, the
more so the nearer the waves are to the eigenfrequency of load and wire.

The force is nearly linear in the elongation (compliance), not in the stiffness: where the data hardly show it, a fit of
the stiffness runs to a soft wire whose interval shrinks with it (a healthy 20 t crane read -53 %). At the shallow end,
or with a light load, the elongation is some per cent of a force of some kN: the data then detect no deviation of the
size of the limit, and the line says so.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.statistics.blocks import Fit, fit
from stillhook.statistics.estimate import Estimate
from stillhook.validate.parameters.segments import ByTest, LogPart, by_test, stacked
from stillhook.validate.parameters.signals import Sea, in_band, sea_of

WIDEST = 0.25
"""Half width of an interval up to which an elongation that agrees is reported as shown [-]: the criteria's limit."""
SOFTER = 1.0 / 0.7 - 1.0
"""Elongation of a wire 30 % softer over the twin's, less 1 [-]. Where the interval reaches that far
towards the twin's, one that differs is judged only where all of the interval is beyond the limit."""
ROUNDS = 8
MOST_CHANGE = 0.3
"""Largest change of the elongation in a round [-]."""
LEAST, MOST = 0.2, 5.0
"""Elongation over the twin's that is considered [-]."""
TINY = 1e-9
"""Least force that counts as one [N]."""


@dataclass(frozen=True)
class WireElongation:
    """errors: elongation under load over the twin's, less 1, of a wire without mass [-]; lighter: what a uniform wire
    shows whose mass is part of the stated load, over one without mass, least of the tests [-]."""

    errors: ByTest
    lighter: float

    @property
    def open_to_mass(self) -> float:
        """How much softer the wire may be than this elongation because of its own mass [-]."""
        return max((1.0 + self.errors.all.value) * (1.0 / self.lighter - 1.0), 0.0)

    @property
    def overall(self) -> Estimate:
        """The error over all tests. The load of a test may include the wire (paper F table 3): then less hangs at the
        end than the twin has there, and the wire elongates by more than it seems. So much is left open towards a softer
        wire."""
        e = self.errors.all
        return Estimate(e.value, e.low, e.high + self.open_to_mass, e.n)


def wire_elongations(parts: Sequence[LogPart], delays: ByTest | None) -> WireElongation | None:
    """Elongation of the wire in every test with heave compensation whose force determines it, the tip ahead by its
    delay."""
    late = {test: d.value for test, d in delays.tests.items()} if delays is not None else {}
    tests = by_test([p for p in in_band(parts) if p.test in late])
    errors = {test: e for test, same in tests.items() if (e := _error(same, late[test])) is not None}
    by = ByTest.of(errors)
    lighter = [shown_with_mass(max(map(_share, tests[test]))) for test in errors]
    return None if by is None else WireElongation(by, min(lighter))


def detected(error: Estimate) -> bool:
    """Whether the data detect a deviation of the size of the limit, or this one."""
    near, far = (error.low, error.value) if error.value > 0.0 else (-error.high, -error.value)
    return error.half <= WIDEST or near > WIDEST or (near > 0.0 and far - near <= SOFTER)


def _error(parts: Sequence[LogPart], delay: float) -> Estimate | None:
    """Force = g (hook + change by elongation), linearised about each elongation found: the gain g is free, for added
    mass and the wire's own mass are in it; next to friction of the sheaves, rest of the delay and lag of the load cell.
    None at `LEAST` or `MOST`. The interval is never narrower than the same noise makes it about the twin's elongation:
    a softer wire shows more, so that noise which looks like one would narrow its own interval."""
    about, value, half, blocks = 1.0, 0.0, math.inf, 0
    for _ in range(ROUNDS):
        fitted = _fitted(parts, delay, about)
        if fitted is None or fitted.b[0] <= 0.0:
            return None
        change, u = fitted.ratio(1, 0)
        value, half, blocks = about * (1.0 - change) - 1.0, about * u, fitted.blocks
        about = about * (1.0 + float(np.clip(-change, -MOST_CHANGE, MOST_CHANGE)))
        if not LEAST < about < MOST:
            return None
    wider = _shown(parts, delay, about) / max(_shown(parts, delay, 1.0), TINY)
    return Estimate.around(value, max(1.0, wider) * half, blocks)


def _shown(parts: Sequence[LogPart], delay: float, elongation: float) -> float:
    """What of the force shows the elongation and nothing else, per part of the twin's (root of the sum of squares)."""
    hook, soft, speed, rate, _, way, _ = _columns(parts, delay, elongation)
    X = np.column_stack((hook, speed, way, rate))
    left = soft - X @ np.linalg.lstsq(X, soft, rcond=None)[0]
    return math.sqrt(float(np.sum(left * left))) / elongation


def _fitted(parts: Sequence[LogPart], delay: float, elongation: float) -> Fit | None:
    hook, soft, speed, rate, force, way, block = _columns(parts, delay, elongation)
    return fit((hook, soft, speed, way, rate), force, block)


def _columns(parts: Sequence[LogPart], delay: float, elongation: float) -> tuple[NDArray[Any], ...]:
    return stacked([_rows(sea_of(p, 1.0 / elongation), delay) for p in parts])


def _rows(sea: Sea, delay: float) -> tuple[NDArray[Any], ...]:
    hook, speed, rate = sea.columns(delay)
    ahead = sea.tip * np.exp(1j * sea.w * delay) - sea.wire
    soft = np.fft.irfft(ahead * sea.by_stiffness, len(sea.way))
    return tuple(x[sea.inside] for x in (hook, soft, speed, rate, sea.force, sea.way, sea.block))


def shown_with_mass(share: float) -> float:
    """What a uniform wire whose mass is this share of the stated load shows of its elongation, over one without mass,
    lifted and lowered at its top (first order in frequency^2) [-]."""
    w = min(share, 1.0)
    return 1.0 - w + w**2 / 3.0


def _share(part: LogPart) -> float:
    """Mass of the wire paid out over the twin's load [-]."""
    return float(part.crane.wire.mass_per_length) * float(np.nanmean(part["s_w"])) / float(part.params.hoist.load.m)
