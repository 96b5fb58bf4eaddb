"""Limits against the runs that they come from, against their credit, their neighbours and the other tiers."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.plan.assessments.interface import PlanState
from stillhook.plan.definition.rules import Alternative, Demand, Limited, Tier
from stillhook.plan.limits import ROUNDING, Limits, limited, utilisation
from stillhook.plan.result import grouped
from stillhook.plan.table import APART, BY_FREQUENCY, BY_RULE, BY_RUNS, ENDS, TIERS, End
from stillhook.sea.spectra.spectrum import highest_sea
from stillhook.spec.lift.phase import APART as DECKS
from stillhook.spec.lift.phase import PhaseKind

WELL_INSIDE = 0.85
"""Utilisation of a cell below which no limit may lie below its height."""
CLOSED_FORM = TIERS.index(Tier.CLOSED_FORM)


def credit(state: PlanState) -> dict[str, Any]:
    """Whether what is credited is the lesser of twin and flat cap or more, and not above the twin, rule by rule."""
    of, plan = state.answered, state.plan
    modelled, credited, axes = of.modelled.Hs, of.credited.Hs, of.axes
    least = modelled.copy()
    if Alternative.CAP in axes.alternatives:
        twins = [i for i, a in enumerate(axes.alternatives) if a.twin]
        follows = [k for k, phase in enumerate(plan.phases) if phase.compensated]
        cap = modelled[axes.alternatives.index(Alternative.CAP)]
        for i, k in product(twins, follows):
            least[i, k] = np.fmin(modelled[i, k], cap[k])
    wrong = ~np.isnan(least) & ~((credited >= least * (1.0 - ROUNDING)) & (credited <= modelled * (1.0 + ROUNDING)))
    failed = [
        {
            "alternative": axes.alternatives[i].value,
            "phase": axes.phases[k],
            "rule": axes.rules[r],
            "beta": axes.headings[b],
            "Tp": axes.periods[T],
            "Hs": finite(float(credited[i, k, r, b, T])),
            "least": finite(float(least[i, k, r, b, T])),
        }
        for i, k, r, b, T in zip(*np.nonzero(wrong), strict=True)
    ]
    return {"check": "credit", "n": int((~np.isnan(least)).sum()), "failed": failed}


def cells(state: PlanState) -> dict[str, Any]:
    """Whether no limit by runs lies below a cell whose runs use less than `WELL_INSIDE` of the rule, where no lower
    cell is beyond it."""
    limits = {(each.phase, each.alternative): each for each in state.limits if each.tier is Tier.TIME}
    n, failed = 0, []
    for demand in state.demands:
        if demand.tier is not Tier.TIME:
            continue
        of, phase = limits[demand.phase, demand.alternative], state.plan.phase(demand.phase)
        for rule in limited(state.plan, phase, demand.alternative):
            for row in _of_rule(demand, rule, of):
                n += 1
                failed += [row] if row["Hs"] < row["least"] * (1.0 - ROUNDING) else []
    return {"check": "cells", "n": n, "failed": failed}


def _of_rule(demand: Demand, rule: Limited, of: Limits) -> Iterator[dict[str, Any]]:
    """Limit of every column with the height up to which cells are well inside; not of the low weight case, whose
    capacities are others."""
    key, q = rule.rule.key, rule.rule.quantity
    if key not in of.Hs or q not in demand.values:
        return
    used = utilisation(rule, demand.values[q], demand.seas.Hs)
    for Tp, beta, rows in demand.seas.columns:
        at = np.flatnonzero((of.Tp == Tp) & (of.beta == beta))
        if not at.size or np.isnan(of.Hs[key][at[0]]) or (key in of.low_weight and of.low_weight[key][at[0]]):
            continue
        within = np.logical_and.accumulate(used[rows] <= 1.0 + ROUNDING)
        least = float(np.where(within & (used[rows] < WELL_INSIDE), demand.seas.Hs[rows], 0.0).max())
        place = {"alternative": demand.alternative.value, "phase": demand.phase, "rule": key, "beta": beta, "Tp": Tp}
        yield place | {"Hs": float(of.Hs[key][at[0]]), "least": least}


def finite(Hs: float) -> float | None:
    """A height for JSON: None where there is none."""
    return Hs if np.isfinite(Hs) else None


def agreement(state: PlanState) -> dict[str, Any] | None:
    """By which factor another tier is off the limit that governs, at most, of the alternative that leads; None where no
    other tier knows any of these limits."""
    of = state.answered
    axes, i = of.axes, of.axes.alternatives.index(of.shown())
    g = of.claimed
    worst: dict[str, Any] | None = None
    for b, T in np.ndindex(axes.columns):
        k, r = int(g.phase[i, b, T]), int(g.rule[i, b, T])
        Hs = float(of.modelled.Hs[i, k, r, b, T]) if k >= 0 else 0.0
        for t in range(len(TIERS)) if k >= 0 and _comparable(state, i, k) else (BY_FREQUENCY, BY_RUNS):
            other = float(of.limits.Hs[t, i, k, r, b, T]) if k >= 0 else 0.0
            if not (0.0 < Hs < np.inf and 0.0 < other < np.inf) or t == of.modelled.tier[i, k, r, b, T]:
                continue
            row = {"phase": axes.phases[k], "rule": axes.rules[r], "beta": axes.headings[b], "Tp": axes.periods[T]}
            row |= {"tier": TIERS[t].value, "Hs": Hs, "other": other, "factor": max(Hs / other, other / Hs)}
            worst = row if worst is None or row["factor"] > worst["factor"] else worst
    return worst


def _comparable(state: PlanState, alternative: int, phase: int) -> bool:
    """Whether the closed form is of the same winch: it has no twin, and takes the flat cap in its place."""
    return not (state.answered.axes.alternatives[alternative].twin and state.plan.phases[phase].compensated)


def tiers_apart(state: PlanState) -> list[dict[str, Any]]:
    """Phases and rules in which one tier allows more than `APART` times another, with what counts and the reason."""
    of = state.answered
    axes, tier = of.axes, of.modelled.tier
    pairs = ((BY_FREQUENCY, BY_RUNS), (BY_RUNS, BY_FREQUENCY), (CLOSED_FORM, BY_RUNS), (CLOSED_FORM, BY_FREQUENCY))
    result = []
    for (low, high), k, r in product(pairs, range(len(axes.phases)), range(len(axes.rules))):
        lower, higher = (of.limits.Hs[t, :, k, r] for t in (low, high))
        with np.errstate(invalid="ignore"):
            far = np.isfinite(lower) & (higher > APART * lower)
        if low == CLOSED_FORM:
            far &= np.array([_comparable(state, i, k) for i in range(len(far))])[:, None, None]
            far &= tier[:, k, r] == high  # of two better tiers that which counts
        if not far.any():
            continue
        counts = sorted({TIERS[t].value for t in tier[:, k, r][far]})
        row = {"phase": axes.phases[k], "rule": axes.rules[r], "n": int(far.sum()), "counts": counts}
        row["alternatives"] = [a.value for a, each in zip(axes.alternatives, far, strict=True) if each.any()]
        row["of"] = far[far.any(axis=(1, 2))].size
        row |= {"lower": TIERS[low].value, "higher": TIERS[high].value}
        row |= {"Hs_lower": _ends(lower, far), "Hs_higher": _ends(higher, far)}
        result.append(row | {"reason": _reason(state, low, high, axes.phases[k], axes.rules[r])})
    return result


def _ends(Hs: FloatArray, at: BoolArray) -> list[float | None]:
    """Least and largest of heights [m]; None for any."""
    return [finite(float(Hs[at].min())), finite(float(Hs[at].max()))]


def _reason(state: PlanState, low: int, high: int, phase: str, rule: str) -> str:
    """Code of why it counts as it does, or the reason of the plan file."""
    if low == CLOSED_FORM:
        kind = state.plan.phase(phase).kind
        return "wave-zone" if kind is PhaseKind.SPLASH else "worst-instant" if kind in DECKS else "one-period"
    return state.plan.reconciled.get((phase, rule), "lower") if high == BY_RUNS else "lower"


def neighbours(state: PlanState) -> list[dict[str, Any]]:
    """Neighbouring cells of the alternative that leads whose claimable limits are more than `APART` apart."""
    of = state.answered
    axes, i, g = of.axes, of.axes.alternatives.index(of.shown()), of.claimed
    Hs = np.minimum(g.Hs[i], max(state.plan.environment.Hs))
    result = []
    for axis, (b, T) in product((0, 1), np.ndindex(axes.columns)):
        pair = ((b, T), (b + 1, T) if axis == 0 else (b, T + 1))
        if pair[1][axis] >= Hs.shape[axis]:
            continue
        low, high = sorted(float(Hs[at]) for at in pair)
        if high > APART * low:
            by = [_by(state, i, *at) for at in pair]
            place = {"beta": [axes.headings[at[0]] for at in pair], "Tp": [axes.periods[at[1]] for at in pair]}
            result.append(place | {"Hs": [float(Hs[at]) for at in pair], "governs": by})
    return result


def _by(state: PlanState, i: int, b: int, T: int) -> dict[str, str]:
    """What governs a claimable limit."""
    axes, g = state.answered.axes, state.answered.claimed
    k, r, end = (int(of[i, b, T]) for of in (g.phase, g.rule, g.ends))
    names = (axes.phases[k], axes.rules[r]) if k >= 0 else ("", "")
    return {"phase": names[0], "rule": names[1], "end": ENDS[end].value if end != BY_RULE else ""}


def steep(state: PlanState) -> dict[str, Any]:
    """How many of the seas analysed are above the steepness limit, and how many claimable limits it cuts, by the
    alternatives."""
    env, of = state.plan.environment, state.answered
    end = of.claimed.ends == ENDS.index(End.STEEPNESS)
    heights = {T: highest_sea(T) for T in of.axes.periods}
    above = sum(Hs > heights[T] * (1.0 + ROUNDING) for Hs in env.Hs for T in env.Tp)
    counted = grouped((int(n), a.value) for a, n in zip(of.axes.alternatives, end.sum(axis=(1, 2)), strict=True))
    return {
        "n": above * len(env.headings),
        "of": len(env.table()),
        "Hs_steepest": [{"Tp": T, "Hs": Hs} for T, Hs in heights.items() if Hs < max(env.Hs)],
        "cut": [{"n": n, "alternatives": names} for n, names in counted.items() if n],
        "cells": int(end[0].size),
    }
