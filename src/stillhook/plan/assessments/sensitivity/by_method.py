"""Limits of a cell with one number of the plan otherwise, by the frequency-domain method or, where the surface cuts the
payload, the closed form: for phases and tiers without runs."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from stillhook.plan.assessments.sensitivity.factors import Cell
from stillhook.plan.definition.rules import Alternative, Seas, Tier
from stillhook.plan.limits import limited, limits_in, utilisation
from stillhook.plan.tiers.closed_form import closed_form
from stillhook.plan.tiers.frequency import demands, forcings, winches_of
from stillhook.plan.tiers.situations import situations
from stillhook.plan.tiers.winch_residual import Way


def limit_of(cell: Cell, tier: Tier, winch: Mapping[Alternative, Way] | None = None) -> tuple[float, str, float]:
    """Lowest limit of a cell [m], inf above the highest sea, its rule, and the most that the highest sea uses of a
    rule's limit [-]. winch: what it leaves of the tip's motion, identified on the cell's crane unless given, some
    seconds for a controller."""
    plan, phase, env = cell.plan, cell.phase, cell.plan.environment
    heights = np.array(env.heights)
    seas = Seas(heights, *(np.full_like(heights, x) for x in cell.column))
    if tier is Tier.CLOSED_FORM:
        demand = closed_form(plan, phase, seas, cell.alternative)
    else:
        at = [(phase, situations(plan, phase))]
        known = winches(cell) if winch is None else winch
        (demand,) = demands(plan, (cell.alternative,), seas, at, forcings(plan, seas, at), known)
    limits = limits_in(plan, demand)
    lowest = {rule: float(Hs[0]) for rule, Hs in limits.Hs.items() if not np.isnan(Hs[0])}
    rule = min(lowest, key=lambda key: lowest[key], default="")
    parts = [
        float(utilisation(each, demand.values[each.rule.quantity][-1:], heights[-1:])[0])
        for each in limited(plan, phase, cell.alternative)
        if each.rule.quantity in demand.values
    ]
    return lowest.get(rule, math.nan), rule, max((x for x in parts if math.isfinite(x)), default=math.nan)


def winches(cell: Cell) -> Mapping[Alternative, Way]:
    """What the winch leaves under the alternative of a cell."""
    return winches_of(cell.plan, [(cell.phase, situations(cell.plan, cell.phase))], (cell.alternative,))
