"""From what a phase asks and what its rules allow to limiting wave heights."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.plan.definition.capacities import CAPACITIES, CapacityValue, calm, off_other_vessel
from stillhook.plan.definition.lift_plan import LiftPlan, remembered
from stillhook.plan.definition.rules import QUANTITIES, Alternative, Demand, Limited, Rule, Sense, Tier
from stillhook.plan.definition.rules_file import rules_of
from stillhook.spec.lift.phase import Phase


@dataclass(frozen=True, eq=False)
class Limits:
    """Limiting significant wave heights of one phase under one alternative, from one tier, in c columns of (Tp, beta).

    Hs: rule -> (c,) [m]: inf where the highest sea state analysed stays inside, 0 where a calm is beyond, NaN where the
    tier does not determine it; low, high: ends of the 95 % interval where there is one; low where Hs is NaN: up to
    there the tier shows seas inside, and no further. Tp [s] and beta [rad] (c,). draws: rule -> (m, c) heights [m] that
    are as likely as the runs make them, errors of neighbours together; NaN where there is no interval. low_weight:
    rule -> (c,) whether the limit is that of the low weight case.
    """

    phase: str
    alternative: Alternative
    tier: Tier
    Tp: FloatArray = field(repr=False)
    beta: FloatArray = field(repr=False)
    Hs: Mapping[str, FloatArray]
    low: Mapping[str, FloatArray] = field(default_factory=dict)
    high: Mapping[str, FloatArray] = field(default_factory=dict)
    draws: Mapping[str, FloatArray] = field(default_factory=dict)
    low_weight: Mapping[str, BoolArray] = field(default_factory=dict)


def utilisation(limited: Limited, values: FloatArray, Hs: FloatArray | float) -> FloatArray:
    r"""How much of a limit values in seas of Hs [m] use [-]: 1 at the limit, more beyond; NaN for NaN.

    At most: value over limit. At least: limit over value; for what falls from its value in still water what is lost
    of it over what may be lost,

    .. math:: \frac{1 - r}{1 - r_{limit}} = \frac{F_{hyd}}{0.9 F_{static,min}} \text{ for a limit of 0.1.}

    Where the limit is 0, values of 0 use nothing and all others are beyond by inf.
    """
    x = np.asarray(values, dtype=np.float64)
    limit = np.broadcast_to(limited.at(np.asarray(Hs, dtype=np.float64)), x.shape)
    if limited.rule.sense is Sense.AT_LEAST:
        still = QUANTITIES[limited.rule.quantity].still
        if still is not None and np.all(limit < still):
            return np.asarray((still - x) / (still - limit))
        top, bottom = np.where(np.isnan(x), np.nan, limit), np.maximum(x, 0.0)
    else:
        top, bottom = x, limit
    out = np.where(np.isnan(top), np.nan, np.where(top > 0.0, np.inf, 0.0))
    return np.divide(top, bottom, out=out, where=bottom > 0.0)


def limits_of(demand: Demand, limited: Sequence[Limited], calm: Mapping[str, float] | None = None) -> Limits:
    """Limiting heights of every rule in every (Tp, beta) of a demand.

    calm: what the phase asks in still water (`stillhook.plan.definition.capacities.calm`), used below the lowest sea
    unless the demand includes a calm (Hs 0). The limit is the first crossing from below: a demand that falls
    again in higher seas does not open them. Between two heights it is read from the parabola through them and a third,
    which is exact for what grows with the height, its square, or both. A sea without a value of the tier, above one
    with a value, counts as beyond; so does a column whose lowest sea is beyond and whose calm is not known: its limit
    is 0. Ends of the interval are the limits of the demand's own interval.
    """
    columns = demand.seas.columns
    Tp, beta = (np.array([column[i] for column in columns], dtype=np.float64) for i in (0, 1))
    Hs: dict[str, FloatArray] = {}
    low: dict[str, FloatArray] = {}
    high: dict[str, FloatArray] = {}
    for each in limited:
        key, q = each.rule.key, each.rule.quantity
        still = None if calm is None else calm.get(q)
        missing = np.full(len(demand.seas), np.nan)
        Hs[key] = _of_rule(demand, each, demand.values.get(q, missing), still)
        if q in demand.low and q in demand.high:
            ends = [_of_rule(demand, each, side[q], still) for side in (demand.low, demand.high)]
            low[key], high[key] = np.fmin(*ends), np.fmax(*ends)
    return Limits(demand.phase, demand.alternative, demand.tier, Tp, beta, Hs, low, high)


def _of_rule(demand: Demand, limited: Limited, values: FloatArray, still: float | None) -> FloatArray:
    """Limiting heights of a rule in every column. A limit that falls in steps of the height is that of each step
    within it, and the height of a step where the next one is beyond at once."""
    result = _of_limit(demand, replace(limited, limit=limited.bands[0][1], by_Hs=()), values, still)
    if not limited.by_Hs:
        return result
    result, bottom = np.where(result <= limited.bands[0][0], result, np.inf), limited.bands[0][0]
    for top, limit in limited.bands[1:]:
        crossing = np.maximum(_of_limit(demand, replace(limited, limit=limit, by_Hs=()), values, still), bottom)
        result = np.where(np.isposinf(result) & (crossing <= top), crossing, result)
        bottom = top
    columns = [rows for _, _, rows in demand.seas.columns]
    last = np.array([demand.seas.Hs[rows[-1]] for rows in columns], dtype=np.float64)
    known = np.array([np.isfinite(values[rows]).any() for rows in columns])
    return np.where(known, np.where(result > last * (1.0 + ROUNDING), np.inf, result), np.nan)


def _of_limit(demand: Demand, limited: Limited, values: FloatArray, still: float | None) -> FloatArray:
    """Limiting heights in every column by one limit for all heights."""
    used = utilisation(limited, values, demand.seas.Hs) - 1.0
    zero = None if still is None or math.isnan(still) else float(utilisation(limited, np.array([still]), 0.0)[0]) - 1.0
    result = np.full(len(columns := demand.seas.columns), math.inf)
    counts = (np.isnan(used) | (used > ROUNDING)).tolist()  # columns that are inside all the way need no search
    for i, (_, _, rows) in enumerate(columns):
        if any(counts[row] for row in rows) or (zero is not None and zero > ROUNDING):
            result[i] = first_crossing(demand.seas.Hs[rows], used[rows], zero)
    return result


def first_crossing(H: FloatArray, y: FloatArray, zero: float | None = None) -> float:
    """Height at which y first rises above 0 [m], of heights H (n,) that ascend; zero: y at a height of 0, where it is
    known and H has none.

    A height whose y is NaN, above one that is known, ends the curve: where y is not above 0 by then, the last known
    height is the answer.
    Errors: none; NaN where no y is known, inf where none is above 0.
    """
    finite = ~np.isnan(y)
    if not finite.any():
        return math.nan
    H, y = H[int(np.argmax(finite)) :], y[int(np.argmax(finite)) :]
    n_known = int(np.argmax(np.isnan(y))) if np.isnan(y).any() else len(y)
    unknown_above = n_known < len(y)
    H, y = H[:n_known], y[:n_known]
    if H[0] > 0.0 and zero is not None:
        H, y = np.concatenate(([0.0], H)), np.concatenate(([zero], y))
    above = y > ROUNDING
    if not above.any():
        return float(H[-1]) if unknown_above else math.inf
    i = int(np.argmax(above))
    if i == 0:
        return 0.0
    return _between(H, y, i)


ROUNDING = 1e-9
"""Utilisation beyond 1 that counts as none: a demand that is its limit to the last digits is inside."""


def _between(H: FloatArray, y: FloatArray, i: int) -> float:
    """Where the parabola through H[i-1], H[i] and a neighbour crosses 0, between the two; y[i-1] <= 0 < y[i]."""
    a, b = float(H[i - 1]), float(H[i])
    if not math.isfinite(y[i]) or not math.isfinite(y[i - 1]):
        return a
    third = next((k for k in (i - 2, i + 1) if 0 <= k < len(H) and math.isfinite(y[k])), None)
    slope = float(y[i] - y[i - 1]) / (b - a)
    bend = 0.0 if third is None else (float(y[third] - y[i - 1]) / float(H[third] - a) - slope) / float(H[third] - b)
    # y = y[i-1] + slope (x - a) + bend (x - a)(x - b), with one root in (a, b] as it changes sign there
    p, c = slope - bend * (b - a), float(y[i - 1])
    root = math.sqrt(max(p * p - 4.0 * bend * c, 0.0))
    step = -2.0 * c / (p + root) if p + root > 0.0 else (-p + root) / (2.0 * bend)
    return min(max(a + step, a), b)


def limited(plan: LiftPlan, phase: Phase, alternative: Alternative) -> tuple[Limited, ...]:
    """The rules of a phase with their limits in SI, in the order of the rule set.

    Left out are: rules that the phase turns off; in compensated phases those of the winch for none and phc (it rests
    on its brake), and those of the hydraulics for the flat cap (it has none); outside of compensation those of
    compensation; those of a passive heave compensator but for phc; shares of time with an open relief valve in a
    `passage`, but where the phase gives a limit of its own; quantities and capacities that the winch type does not
    have, such as an accumulator's on a pure active winch. Errors: PlanError, UnitError as
    `stillhook.plan.definition.rules_file.rules_of`.
    """
    return _limited(plan.under(alternative), phase, alternative)


def limits_in(plan: LiftPlan, demand: Demand) -> Limits:
    """`limits_of` a demand by the rules of its phase and alternative and the calm of its phase, none with a swell."""
    plan = plan.under(demand.alternative)
    phase = plan.phase(demand.phase)
    still = calm(plan, phase) if plan.environment.calm(0.0) else None
    return limits_of(demand, limited(plan, phase, demand.alternative), still)


@remembered
def _limited(plan: LiftPlan, phase: Phase, alternative: Alternative) -> tuple[Limited, ...]:
    numbers = ("", *(row.name for row in plan.crane.plant.type.numbers))
    applicable = [
        (rule, _limit(plan, phase, alternative, rule))
        for rule in rules_of(plan.rules, phase)
        if QUANTITIES[rule.quantity].number in numbers
        and _holds(rule, phase, alternative)
        and ("vessel" not in QUANTITIES[rule.quantity].needs or off_other_vessel(plan, phase))
        and not (rule.quantity == "relief_share" and rule.key not in phase.limits and passage(plan, phase))
    ]
    return tuple(Limited(rule, each.value, each.basis, each.by_Hs) for rule, each in applicable if each is not None)


def passage(plan: LiftPlan, phase: Phase) -> bool:
    """Whether a phase is a short way at a speed: a single opening of a valve is there more than a share of its time may
    be, and `peak-pressure`, at the most probable largest pressure, allows about one."""
    return bool(phase.speed) and (phase.duration or 0.0) < plan.rules.settings["duration_least"]


def _holds(rule: Rule, phase: Phase, alternative: Alternative) -> bool:
    needs = QUANTITIES[rule.quantity].needs
    if "compensator" in needs:
        return alternative is Alternative.PHC
    if not phase.compensated:
        return "compensation" not in needs
    if alternative.stands:
        return "hydraulics" not in needs and "turning" not in needs
    return alternative.twin or "hydraulics" not in needs


def _limit(plan: LiftPlan, phase: Phase, alternative: Alternative, rule: Rule) -> CapacityValue | None:
    if not isinstance(rule.limit, str):
        return CapacityValue(rule.limit, rule.requirement)
    capacity = CAPACITIES[rule.limit].find(plan, phase, alternative)
    if capacity is None or rule.factor == 1.0:
        return capacity
    return capacity.times(rule.factor)


def as_row(each: Limited) -> dict[str, Any]:
    """A limit for JSON, with its steps where it depends on the wave height."""
    row: dict[str, Any] = {"rule": each.rule.key, "limit": each.limit, "basis": each.basis}
    return row | ({"by_Hs": [{"Hs": Hs, "limit": limit} for Hs, limit in each.by_Hs]} if each.by_Hs else {})
