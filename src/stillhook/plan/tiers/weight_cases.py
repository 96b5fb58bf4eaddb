"""The low weight case beside the high one: of every rule the lower limit counts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Demand, RuleSet, Seas, Sense
from stillhook.plan.limits import Limits, limits_in

Pair = tuple[list[Demand], list[Limits]]
"""Demands and limits, in the same order."""
Columns = list[tuple[float, float]]
ALIKE = 5e-3
"""Part of a limit by which that of the low case must be lower to be reported as such."""


def of_cases(plan: LiftPlan, demands_of: Callable[[LiftPlan], list[Demand]]) -> Pair:
    """What a tier asks of a plan, and its limits: of both weight cases where there are two, each by the capacities that
    it has."""
    high = demands_of(plan)
    limits = [limits_in(plan, demand) for demand in high]
    if plan.low is None:
        return high, limits
    low = demands_of(plan.low)
    lower = [limits_in(plan.low, demand) for demand in low]
    worse = [_worse(plan.rules, *pair) for pair in zip(high, low, strict=True)]
    return worse, [lower_of(*pair) for pair in zip(limits, lower, strict=True)]


def _worse(rules: RuleSet, high: Demand, low: Demand) -> Demand:
    """A demand with the worse value of both cases in every sea."""
    least = {rule.quantity for rule in rules.rules if rule.sense is Sense.AT_LEAST}
    values = {q: (np.fmin if q in least else np.fmax)(x, low.values.get(q, x)) for q, x in high.values.items()}
    return replace(high, values=values)


def lower_of(high: Limits, low: Limits) -> Limits:
    """The lower limit of both cases in every column of either, and where that is the low one's."""
    cases = (high, low)
    columns = list(dict.fromkeys(column for each in cases for column in _columns(each)))
    rows = [[columns.index(column) for column in _columns(each)] for each in cases]

    def both(name: str, key: str) -> list[FloatArray]:
        return [_row(getattr(each, name), key, at, len(columns)) for each, at in zip(cases, rows, strict=True)]

    Tp, beta = np.array(columns, dtype=np.float64).T
    tables: dict[str, dict[str, Any]] = {name: {} for name in ("Hs", "low", "high", "draws", "low_weight")}
    for key in dict.fromkeys([*high.Hs, *low.Hs]):
        a, b = both("Hs", key)
        taken = np.isfinite(b) & ~(a <= b)
        tables["low_weight"][key] = taken & ~(a <= (1.0 + ALIKE) * b)
        for name in ("Hs", "low", "high", "draws"):
            if any(key in getattr(each, name) for each in cases):
                ends = both(name, key)
                tables[name][key] = np.where(taken, ends[1], ends[0])
    return Limits(high.phase, high.alternative, high.tier, Tp, beta, **tables)


def _columns(limits: Limits) -> Columns:
    return [(float(T), float(b)) for T, b in zip(limits.Tp, limits.beta, strict=True)]


def _row(table: Mapping[str, FloatArray], key: str, at: Sequence[int], n: int) -> FloatArray:
    """Numbers of a rule in n columns, NaN where there is none."""
    values = table.get(key)
    row = np.full((n,) if values is None else (*values.shape[:-1], n), np.nan)
    if values is not None:
        row[..., at] = values
    return row


def joined(high: Demand, low: Demand) -> Demand:
    """Runs of both cases as one demand: in columns in which the low case was run, what it judges is that of its runs,
    everything else that of the high case."""
    columns = set(zip(low.seas.Tp.tolist(), low.seas.beta.tolist(), strict=True))
    there = np.array([c in columns for c in zip(high.seas.Tp.tolist(), high.seas.beta.tolist(), strict=True)])
    nothing = np.full(len(high.seas), np.nan), np.full(len(low.seas), np.nan)

    def table(name: str) -> dict[str, FloatArray]:
        a, b = getattr(high, name), getattr(low, name)
        names = dict.fromkeys([*a, *b])
        of_high = {q: np.where(there, np.nan, a.get(q, nothing[0])) if q in low.values else a[q] for q in names}
        return {q: np.concatenate((of_high[q], b.get(q, nothing[1]))) for q in names}

    seas = Seas(*(np.concatenate((getattr(high.seas, x), getattr(low.seas, x))) for x in ("Hs", "Tp", "beta")))
    seeds = None if high.seeds is None or low.seeds is None else np.concatenate((high.seeds, low.seeds))
    return replace(high, seas=seas, values=table("values"), low=table("low"), high=table("high"), seeds=seeds)
