"""Where the frequency road looks in a phase: heights on its way, what hangs there, and how long the payload is about there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from stillhook.plan.lift_plan import LiftPlan
from stillhook.plan.phases import Phase, PhaseKind
from stillhook.response.hung import Hung, hung
from stillhook.response.rod import natural_periods

FloatArray = NDArray[np.float64]

EVERY = 150.0
"""Largest way between two heights at which is looked [m]: over it the load's natural period changes by less than a tenth below 600 m."""
NEAR = 20.0
"""Way within which a height is taken for another one [m]."""
BISECTIONS = 30
"""Halvings of the way in which a resonance is sought: a kilometre to a micrometre."""


@dataclass(frozen=True, eq=False)
class Situation:
    """The payload at one height of a phase's way.

    z of its underside above still water [m]; time [s] of the phase that it stands for, all of them together its duration; x, y of the crane
    tip from the vessel's reference point, forward and to port [m]; hung: what hangs there; T_0 natural period of the load on its wire, top
    held [s].
    """

    z: float
    time: float
    x: float
    y: float
    hung: Hung = field(repr=False)
    T_0: float


def situations(plan: LiftPlan, phase: Phase) -> tuple[Situation, ...]:
    """Situations of a phase in the order of its way: both ends, no more than 150 m between two, and where the load's natural period is a
    peak period of the seas that are asked. Empty for the splash zone: nothing is linear where the surface cuts the payload.

    Errors: LiftError where the payload cannot hang (`stillhook.response.hung`).
    """
    if phase.kind is PhaseKind.SPLASH:
        return ()
    heights = _heights(plan, phase)
    at = plan.tip_of(phase)
    assert phase.duration is not None
    shares = _shares(heights)
    found = []
    for z, share in zip(heights, shares, strict=True):
        what = _hung(plan, phase, z)
        found.append(Situation(z, float(share) * phase.duration, at.x, at.y, what, natural_period(what)))
    return tuple(found)


def resonance_depth(plan: LiftPlan, T: float) -> float:
    """Depth of the payload's underside at which its natural period on the wire, top held, is T [m]; NaN where it is so nowhere.

    The period grows with the wire that is out; hook, slings and the wire on the boom count.
    """
    top, bottom = -plan.payload.reach(plan.rho), -plan.depth
    return -_resonance(plan, None, T, top, bottom)


def natural_period(what: Hung) -> float:
    """First natural period of what hangs, top held [s]."""
    return float(natural_periods(what.rod, what.end, 1)[0])


def _heights(plan: LiftPlan, phase: Phase) -> list[float]:
    """Heights on the way, from start to end."""
    assert phase.start is not None
    assert phase.end is not None
    if phase.start == phase.end:
        return [phase.start]
    count = max(1, math.ceil(abs(phase.end - phase.start) / EVERY))
    heights = [float(z) for z in np.linspace(phase.start, phase.end, count + 1)]
    if max(phase.start, phase.end) > 0.0:
        return heights
    for T in plan.environment.Tp:
        z = _resonance(plan, phase, T, max(phase.start, phase.end), min(phase.start, phase.end))
        if not math.isnan(z) and min(abs(z - known) for known in heights) > NEAR:
            heights.append(z)
    return sorted(heights, reverse=phase.end < phase.start)


def _resonance(plan: LiftPlan, phase: Phase | None, T: float, top: float, bottom: float) -> float:
    """Height between two under water at which the natural period is T [m]; NaN where it is not."""
    if not natural_period(_hung(plan, phase, top)) <= T <= natural_period(_hung(plan, phase, bottom)):
        return math.nan
    for _ in range(BISECTIONS):
        middle = 0.5 * (top + bottom)
        if natural_period(_hung(plan, phase, middle)) < T:
            top = middle
        else:
            bottom = middle
    return 0.5 * (top + bottom)


def _hung(plan: LiftPlan, phase: Phase | None, z: float) -> Hung:
    h_tip = plan.h_tip if phase is None else plan.tip_of(phase).z
    return hung(plan.crane, plan.hanging(z, h_tip), z)


def _shares(heights: Sequence[float]) -> FloatArray:
    """Part of the way that is nearest to each height."""
    if len(heights) == 1:
        return np.ones(1)
    ways = np.abs(np.diff(np.array(heights)))
    near = np.concatenate((ways, [0.0])) + np.concatenate(([0.0], ways))
    return np.asarray(near / near.sum())
