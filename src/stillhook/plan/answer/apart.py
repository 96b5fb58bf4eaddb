"""Two methods that disagree: where runs of the twin allow much higher seas than the frequency-domain method."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Tier
from stillhook.plan.table import TIERS, Axes, Chosen, Gathered
from stillhook.report.formatting import fixed

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


def apart_remarks(plan: LiftPlan, limits: Gathered, modelled: Chosen) -> list[str]:
    """A line for every phase and rule in which the frequency-domain method counts in place of runs."""
    axes = limits.axes
    taken = _apart(plan, limits) & (modelled.tier == BY_FREQUENCY)
    lines = []
    for k, r in zip(*np.nonzero(taken.any(axis=(0, 3, 4))), strict=True):
        of = taken[:, k, r]
        names = [a.label for a, each in zip(axes.alternatives, of, strict=True) if each.any()]
        cells = of[of.any(axis=(1, 2))].size
        lines.append(
            f"{axes.phases[k]}, {axes.rules[r]}, {', '.join(names)}: in {int(of.sum())} of {cells} cells"
            f" runs allow {_heights(limits.Hs[BY_RUNS, :, k, r][of])}, more than {APART:g} times the"
            f" {_heights(limits.Hs[BY_FREQUENCY, :, k, r][of])} of the frequency-domain method: the lower counts"
        )
    return lines


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


def _heights(Hs: FloatArray) -> str:
    """Heights in words [m]."""
    low, high = float(Hs.min()), float(Hs.max())
    ends = [fixed(low, 2), "any" if high == np.inf else fixed(high, 2)]
    return f"Hs {' to '.join(dict.fromkeys(ends))} m" if low < np.inf else "any Hs of the table"
