"""Many runs for a page's tables, sixteen side by side with statistics alone, and waves of a given peak speed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from stillhook import Crane, Scenario, Sine
from stillhook.engine.simulate import run_cases
from stillhook.sea.motion.motion import Motion, Sum

Numbers = Mapping[str, Any]
SWELL_AND_ROLL = ((2.0, 13.0), (0.5, 6.0))
"""Amplitude [m] and period [s] of the only combined wave that the thesis prints: paper E scenario 3."""
LOOKED_AT = 1560.0  # s: 20 beats of swell and roll


def side_by_side(runs: Iterable[tuple[Crane, Scenario]]) -> list[Numbers]:
    """The summary of every run, in order, SI; runs of one length share blocks of sixteen. A run that diverges stops the
    page."""
    asked = list(runs)
    found = run_cases([crane for crane, _ in asked], [case for _, case in asked])
    failed = [i for i, one in enumerate(found) if one["status"] == "diverged"]
    assert not failed, f"{len(failed)} of {len(found)} runs lost their numbers, the first: {asked[failed[0]]}"
    return found


def wave(
    parts: Sequence[tuple[float, float]],
    v_peak: float,
    phase: float = 0.0,
    *,
    start: float = 0.0,
    end: float = LOOKED_AT,
) -> Motion:
    """Sines in these proportions, so large that the tip's highest speed from start to end [s] is v_peak [m/s]; each
    next one starts `phase` [rad] later."""
    t = np.arange(start, end, 0.01)

    def motion(scale: float) -> Motion:
        return Sum([Sine.from_si(scale * A, T, i * phase) for i, (A, T) in enumerate(parts)])

    return motion(v_peak / float(np.max(np.abs(motion(1.0).sample(t)[1]))))


def sine(v_peak: float, period: float) -> Sine:
    """A sine of this highest speed [m/s] and period [s]."""
    return Sine.from_si(v_peak * period / (2.0 * np.pi), period)
