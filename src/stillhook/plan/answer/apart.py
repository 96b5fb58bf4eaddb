"""Two methods that disagree: where runs of the twin allow much higher seas than the frequency-domain method."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.plan.definition.failures import Cause, cause
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Tier
from stillhook.plan.table import TIERS, Axes, Chosen, Gathered

APART = 1.5
"""A limit by runs that is more than so many times that of the frequency-domain method does not count."""
TOLERATED = ("load_pp", "e_c_pp")
"""Quantities that a tolerance over the seabed limits, and that both methods determine from the same friction: motion of
the payload, control error of the wire."""
BY_RUNS, BY_FREQUENCY = TIERS.index(Tier.TIME), TIERS.index(Tier.FREQUENCY)


def lower_where_apart(plan: LiftPlan, limits: Gathered, modelled: Chosen) -> Chosen:
    """Limits that count, with those of the frequency-domain method in place of limits by runs far above them.

    The method takes what the winch leaves of a motion about rest. A run in which the wire always goes out has friction
    that never reverses, and says little of the same load as soon as it stops.
    """
    far = _apart(plan, limits)
    taken = far & (modelled.tier == BY_RUNS)
    Hs = np.where(taken, limits.Hs[BY_FREQUENCY], modelled.Hs)
    low, high = (np.where(taken, np.nan, ends) for ends in (modelled.low, modelled.high))
    return replace(modelled, Hs=Hs, low=low, high=high, tier=np.where(taken, BY_FREQUENCY, modelled.tier))


def apart_remarks(plan: LiftPlan, limits: Gathered, modelled: Chosen) -> list[Cause]:
    """A cause for every phase and rule in which the frequency-domain method counts in place of runs."""
    axes = limits.axes
    taken = _apart(plan, limits) & (modelled.tier == BY_FREQUENCY)
    return [
        cause(
            "apart",
            phase=axes.phases[k],
            rule=axes.rules[r],
            alternatives=[a.label for a, each in zip(axes.alternatives, taken[:, k, r], strict=True) if each.any()],
            n=int(taken[:, k, r].sum()),
            of=taken[:, k, r][taken[:, k, r].any(axis=(1, 2))].size,
            factor=APART,
            runs=_ends(limits.Hs[BY_RUNS, :, k, r][taken[:, k, r]]),
            frequency=_ends(limits.Hs[BY_FREQUENCY, :, k, r][taken[:, k, r]]),
        )
        for k, r in zip(*np.nonzero(taken.any(axis=(0, 3, 4))), strict=True)
    ]


def _apart(plan: LiftPlan, limits: Gathered) -> BoolArray:
    """Where both are known and too far apart, of compensated phases under a twin (alternative, phase, rule, heading,
    period)."""
    of_runs, other = limits.Hs[BY_RUNS], limits.Hs[BY_FREQUENCY]
    with np.errstate(invalid="ignore"):
        far = np.isfinite(other) & (of_runs > APART * other)
    return np.asarray(far & _where(plan, limits.axes)[..., None, None])


def _where(plan: LiftPlan, axes: Axes) -> BoolArray:
    quantity = {rule.key: rule.quantity for rule in plan.rules.rules}
    twin, follows = np.array([a.twin for a in axes.alternatives]), np.array([p.compensated for p in plan.phases])
    asks = np.array([quantity[key] in TOLERATED for key in axes.rules])
    return np.asarray(twin[:, None, None] & follows[:, None] & asks)


def _ends(Hs: FloatArray) -> list[float | None]:
    """Least and largest of heights [m]; None for any."""
    return [float(x) if np.isfinite(x) else None for x in (Hs.min(), Hs.max())]
