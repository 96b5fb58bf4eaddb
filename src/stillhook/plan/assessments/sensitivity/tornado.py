"""The facts of a tornado: of every phase its cell and limit, and of every factor the limit at both of its ends."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from stillhook.base.progress import Parts, Progress
from stillhook.plan.assessments.interface import PlanState
from stillhook.plan.assessments.sensitivity.by_method import limit_of, winches
from stillhook.plan.assessments.sensitivity.by_runs import SEEDS, CellRuns, Moved, base_of, heights_of, run
from stillhook.plan.assessments.sensitivity.factors import OF_MACHINE, OF_TABLE, End, Factor, alone, factors_of
from stillhook.plan.assessments.sensitivity.governing import Governing
from stillhook.plan.assessments.sensitivity.ranking import ABOVE, LIMITED, NOT_JUDGED
from stillhook.plan.definition.rules import Alternative, Tier
from stillhook.plan.table import TIERS, Gathered
from stillhook.plan.tiers.time_domain.lowering import SeaState

NOT_MOVED = 0.005
"""Change of a limit that counts as none [m]: the second decimal that tables print."""


def of_runs(
    state: PlanState, cells: Sequence[Governing], shown: Alternative, progress: Progress | None
) -> tuple[dict[str, Any], int]:
    """Phases whose limits the twin has, by name, and how many runs were made."""
    highest, plan = max(state.plan.environment.Hs), state.plan
    lines, wanted = [], []
    for of in cells:
        heights, middle = heights_of(of.Hs, highest)
        waves = SeaState(middle, *of.column)
        runs = CellRuns.of(alone(of.plan, of.phase, shown, of.column, of.lowest[1]), state.execution, waves)
        factors, ends = factors_of(runs.cell, plan.environment.heading_tolerance), dict[_Key, CellRuns]()
        wanted.append((runs, heights))
        for factor, end in ((f, e) for f in factors for e in f.ends):
            if end.cell is None or _in_table(state, of, shown, factor.name, end) is not None:
                continue
            other = CellRuns.of(end.cell, state.execution, waves)
            if factor.name in ("hold", "rule") and other.same_course(runs):
                other.cells.runs = runs.cells.runs
            else:
                wanted.append((other, [middle]))
            ends[factor.name, end.value] = other
        lines.append((of, runs, heights, factors, ends))
    part = Parts(progress, {"first": 3.0, "further": 1.0})
    if wanted:
        run(wanted, part("first"))
    bases = [base_of(runs, heights, of.Hs, heights[1], highest) for of, runs, heights, _, _ in lines]
    further: dict[tuple[str, _Key], float] = {}
    for base, (of, _, _, _, ends) in zip(bases, lines, strict=True):
        limit = of.lowest[0]
        at = {key: base.further(runs, limit) for key, runs in ends.items()}
        further |= {(of.phase.name, key): H for key, H in at.items() if H is not None}
    again = [
        (runs, [further[of.phase.name, key]])
        for of, _, _, _, ends in lines
        for key, runs in ends.items()
        if (of.phase.name, key) in further
    ]
    if again:
        run(again, part("further"))
    result = {}
    for base, (of, _, heights, factors, ends) in zip(bases, lines, strict=True):
        name = of.phase.name
        moved = {key: base.moved(runs, further.get((name, key))) for key, runs in ends.items()}
        rows = [_factor(f, partial(_end, state, of, shown, f.name, moved)) for f in factors]
        result[name] = _phase(of, rows) | {"n_seeds": SEEDS, "Hs_run": heights[1]}
    return result, sum(each.cells.n_runs for each, _ in wanted)


_Key = tuple[str, float]
"""Factor and the value at one of its ends."""


def _end(
    state: PlanState, of: Governing, shown: Alternative, name: str, moved: Mapping[_Key, Moved], end: End
) -> dict[str, Any]:
    """What an end of a factor gives, by the plan's table or by runs."""
    known = _in_table(state, of, shown, name, end)
    if known is not None:
        return known
    by_runs = moved.get((name, end.value))
    if by_runs is None:
        return _nothing(end.reason)
    if math.isnan(by_runs.Hs):
        return _nothing("runs fail" if by_runs.used == math.inf else "too few runs show it")
    limit = of.lowest[0]
    if not math.isfinite(limit):
        resolved = math.isfinite(by_runs.Hs)
    else:
        resolved = not by_runs.low <= limit <= by_runs.high and not abs(by_runs.Hs - limit) <= NOT_MOVED
    return _limit(by_runs.Hs, by_runs.low, by_runs.high, by_runs.rule, resolved=resolved, used=by_runs.used)


def _factor(factor: Factor, one: Callable[[End], dict[str, Any]]) -> dict[str, Any]:
    """A factor as plain data."""
    named = {"factor": factor.name, "title": factor.title, "source": factor.source, "reason": factor.reason}
    ends = [] if factor.reason else [{"value": e.value, "text": e.text, **one(e)} for e in factor.ends]
    return named | {"ends": ends}


def _nothing(reason: str) -> dict[str, Any]:
    return _limit(math.nan, math.nan, math.nan, "", resolved=False, reason=reason)


def _limit(
    Hs: float, low: float, high: float, rule: str, *, resolved: bool, used: float = math.nan, reason: str = ""
) -> dict[str, Any]:
    """A limit as plain data, of which JSON has no inf."""
    ends = {"Hs": Hs, "Hs_low": low, "Hs_high": high, "used": used}
    verdict = NOT_JUDGED if math.isnan(Hs) else ABOVE if Hs == math.inf else LIMITED
    numbers: dict[str, Any] = {name: x if math.isfinite(x) else None for name, x in ends.items()}
    return {"verdict": verdict, **numbers, "rule": rule, "resolved": resolved, "reason": reason}


def _phase(of: Governing, rows: Sequence[Mapping[str, Any]], known: tuple[float, str] | None = None) -> dict[str, Any]:
    """A phase with its cell, limit and factors."""
    Hs, rule = known or of.lowest
    low, high = of.interval
    limit = _limit(Hs, low, high, rule, resolved=True)
    return {
        "phase": of.phase.name,
        "tier": of.tier.value,
        "Tp": of.column[0],
        "beta": of.column[1],
        **{name: limit[name] for name in ("verdict", "Hs", "Hs_low", "Hs_high", "rule")},
        "counts": {"Hs": of.counts[0] if math.isfinite(of.counts[0]) else None, "tier": of.counts[1]},
        "factors": list(rows),
    }


def _in_table(state: PlanState, of: Governing, shown: Alternative, name: str, end: End) -> dict[str, Any] | None:
    """What the plan's own table says of an end: of a neighbouring period or heading, or of the flat cap; None where it
    says nothing."""
    if name == "certificate":
        return _with_cap(state, of)
    if name not in OF_TABLE or end.cell is None:
        return None
    limits: Gathered = state.answered.limits
    axes = limits.axes
    pairs = zip((axes.headings, axes.periods), reversed(end.cell.column), strict=True)
    places = [np.flatnonzero(np.isclose(axis, x)) for axis, x in pairs]
    if not all(len(place) for place in places):
        return None
    heading, period = (int(place[0]) for place in places)
    who = (TIERS.index(of.tier), axes.alternatives.index(shown), axes.phases.index(of.phase.name))
    at = (*who, slice(None), heading, period)
    if np.isnan(limits.Hs[at]).all():
        return None
    values = np.where(np.isnan(limits.Hs[at]), np.inf, limits.Hs[at])
    rule = int(values.argmin())
    Hs, low, high = float(values[rule]), *(float(table[at][rule]) for table in (limits.low, limits.high))
    base = of.lowest[0]
    ends = of.interval
    if all(map(math.isfinite, (low, high, *ends))):
        apart = high < ends[0] or low > ends[1]
    else:
        apart = Hs != base and not abs(Hs - base) <= NOT_MOVED
    return _limit(Hs, low, high, axes.rules[rule], resolved=bool(apart))


def _with_cap(state: PlanState, of: Governing) -> dict[str, Any]:
    """The limit with no more than the flat cap credited: of rules that it determines the lower of both."""
    modelled = state.answered.modelled
    axes = modelled.axes
    if Alternative.CAP not in axes.alternatives:
        return _nothing("the plan has no flat cap")
    heading, period = (int(x[0]) for x in axes.place(np.array(of.column[:1]), np.array(of.column[1:])))
    at = (axes.alternatives.index(Alternative.CAP), axes.phases.index(of.phase.name), slice(None), heading, period)
    cap = dict(zip(axes.rules, modelled.Hs[at].tolist(), strict=True))
    both = {key: float(np.fmin(Hs, cap[key])) for key, Hs in of.Hs.items()}
    rule = min(both, key=lambda key: math.inf if math.isnan(both[key]) else both[key])
    return _limit(both[rule], math.nan, math.nan, rule, resolved=both[rule] < of.lowest[0] - NOT_MOVED)


def of_method(
    state: PlanState, cells: Sequence[Governing], shown: Alternative, progress: Progress | None
) -> dict[str, Any]:
    """Phases whose limits another method has, by name."""
    result = {}
    for k, of in enumerate(cells):
        if progress is not None:
            progress(k / len(cells))
        result[of.phase.name] = _by_method(state, of, shown)
    return result


def _by_method(state: PlanState, of: Governing, shown: Alternative) -> dict[str, Any]:
    base = alone(of.plan, of.phase, shown, of.column, of.lowest[1])
    winch = winches(base) if of.tier is Tier.FREQUENCY else None
    known = limit_of(base, of.tier, winch)

    def one(name: str, end: End) -> dict[str, Any]:
        if end.cell is None:
            return _in_table(state, of, shown, name, end) or _nothing(end.reason)
        Hs, rule, used = limit_of(end.cell, of.tier, None if name in OF_MACHINE else winch)
        resolved = Hs != known[0] and not abs(Hs - known[0]) <= NOT_MOVED
        return _limit(Hs, math.nan, math.nan, rule, resolved=resolved, used=used)

    factors = factors_of(base, state.plan.environment.heading_tolerance)
    rows = [_factor(factor, partial(one, factor.name)) for factor in factors]
    return _phase(of, rows, known[:2])
