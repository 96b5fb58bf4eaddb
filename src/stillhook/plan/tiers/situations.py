"""Heights at which the frequency-domain method analyses a phase: suspended load and time of each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.plan.definition.capacities import at_deck
from stillhook.plan.definition.lift_plan import LiftPlan, remembered
from stillhook.response.suspended_load import SuspendedLoad, natural_periods, suspended_load
from stillhook.spec.lift.phase import Phase, PhaseKind

EVERY = 150.0
"""Largest way between two heights at which is looked [m]: over it the load's natural period changes by a tenth at 600
m, and less below."""
NEAR = 20.0
"""Way within which a height is taken for another one [m]."""
EXACT = 0.01
"""Height to which a resonance is sought [m]."""


KEPT = 3
"""Places of a phase that are looked at where all of them would take long: its ends and its middle."""


@dataclass(frozen=True, eq=False)
class Situation:
    """The payload at one height of a phase's way.

    z of its underside above still water [m]; time [s] of the phase that it stands for, all of them together its
    duration; x, y of the crane tip from the vessel's reference point, forward and to port [m]; load: the suspended
    load; T_0 natural period of the load on its wire, top held [s].
    """

    z: float
    time: float
    x: float
    y: float
    load: SuspendedLoad = field(repr=False)
    T_0: float


@remembered
def situations(plan: LiftPlan, phase: Phase) -> tuple[Situation, ...]:
    """Situations of a phase in the order of its way: both ends, no more than 150 m between two, and where the load's
    natural period is a peak period of the seas analysed. Empty for the splash zone: nothing is linear where the
    surface cuts the payload.

    Errors: LiftError where the payload cannot hang (`stillhook.response.suspended_load`).
    """
    if phase.kind is PhaseKind.SPLASH:
        return ()
    at = plan.tip_of(phase)
    assert phase.duration is not None
    looked = _looked(plan, phase)
    shares = _shares([z for z, _ in looked])
    return tuple(
        Situation(z, float(share) * phase.duration, at.x, at.y, load, natural_period(load))
        for (z, load), share in zip(looked, shares, strict=True)
    )


def resonance_depth(plan: LiftPlan, T: float) -> float:
    """Depth of the payload's underside at which its natural period on the wire, top held, is T [m]; NaN where it is so
    nowhere.

    The period grows with the wire that is out; hook, slings and the wire on the boom count.
    """
    top, bottom = -plan.payload.reach(plan.rho), -plan.depth
    if not natural_period(_load_at(plan, None, top)) <= T <= natural_period(_load_at(plan, None, bottom)):
        return math.nan
    return -_resonance(plan, None, T, top, bottom)


def natural_period(load: SuspendedLoad) -> float:
    """First natural period of the suspended load, top held [s]."""
    return float(natural_periods(load.rod, load.end, 1)[0])


def _looked(plan: LiftPlan, phase: Phase) -> list[tuple[float, SuspendedLoad]]:
    """Heights on the way from start to end, and what hangs there."""
    assert phase.z_start is not None
    assert phase.z_end is not None
    if phase.z_start == phase.z_end:
        return [(phase.z_start, _load_at(plan, phase, phase.z_start))]
    count = max(1, math.ceil(abs(phase.z_end - phase.z_start) / EVERY))
    places = [(float(z), _load_at(plan, phase, float(z))) for z in np.linspace(phase.z_start, phase.z_end, count + 1)]
    if max(phase.z_start, phase.z_end) > 0.0:
        return places
    periods = [natural_period(load) for _, load in places]
    for T in plan.environment.Tp:
        ends = next((i for i in range(count) if min(periods[i : i + 2]) <= T <= max(periods[i : i + 2])), None)
        if ends is None:
            continue
        z = _resonance(
            plan, phase, T, max(places[ends][0], places[ends + 1][0]), min(places[ends][0], places[ends + 1][0])
        )
        if min(abs(z - height) for height, _ in places) > NEAR:
            places.append((z, _load_at(plan, phase, z)))
    return sorted(places, key=lambda pair: pair[0], reverse=phase.z_end < phase.z_start)


def _resonance(plan: LiftPlan, phase: Phase | None, T: float, top: float, bottom: float) -> float:
    """Height between two under water at which the natural period, less than T above and more below, is T [m]."""
    while top - bottom > EXACT:
        middle = 0.5 * (top + bottom)
        if natural_period(_load_at(plan, phase, middle)) < T:
            top = middle
        else:
            bottom = middle
    return 0.5 * (top + bottom)


def _load_at(plan: LiftPlan, phase: Phase | None, z: float) -> SuspendedLoad:
    h_tip = plan.h_tip if phase is None else plan.tip_of(phase).z
    return suspended_load(plan.crane, plan.hanging(z, h_tip), z)


def _shares(heights: Sequence[float]) -> FloatArray:
    """Part of the way that is nearest to each height."""
    if len(heights) == 1:
        return np.ones(1)
    ways = np.abs(np.diff(np.array(heights)))
    near = np.concatenate((ways, [0.0])) + np.concatenate(([0.0], ways))
    return np.asarray(near / near.sum())


Looks = Sequence[tuple[Phase, Sequence[Situation]]]
"""Phases that the method covers, with the heights on their way."""


def looked_at(plan: LiftPlan) -> Looks:
    """Phases that the method covers: those that do not cut the surface, nor are at a deck that moves on its own."""
    pairs = ((phase, situations(plan, phase)) for phase in plan.phases if not at_deck(plan, phase))
    return [(phase, parts) for phase, parts in pairs if parts]


def thinned(parts: Sequence[Situation]) -> list[Situation]:
    """Ends and middle of a phase's places, each for the time of those nearest to it."""
    if len(parts) <= KEPT:
        return list(parts)
    indices = np.linspace(0, len(parts) - 1, KEPT).round().astype(int)
    near = np.argmin(np.abs(np.arange(len(parts))[:, None] - indices[None, :]), axis=1)
    return [
        replace(parts[i], time=sum(p.time for p, at in zip(parts, near, strict=True) if at == k))
        for k, i in enumerate(indices)
    ]
