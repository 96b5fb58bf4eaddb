"""Blocks of a result that only runs can tell: how landing speeds scatter, and how numbers settle as seeds are added."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stillhook.plan.definition.phases import PhaseKind
from stillhook.plan.limits import utilisation
from stillhook.plan.tiers.time_domain.cells import CellRequest
from stillhook.plan.tiers.time_domain.lowering import SeaState, winch_of
from stillhook.plan.tiers.time_domain.quantities import quantities
from stillhook.plan.tiers.time_domain.search import Column, LimitSearch, Work, nearest, snapped
from stillhook.statistics.extremes import FEWEST_MAXIMA
from stillhook.units import show
from stillhook.variables import attributes

if TYPE_CHECKING:
    import xarray

EVERY = 5
"""Seeds between two numbers of a convergence."""
SHOWN = 6
"""Cells whose convergence is told, at the most."""


def blocks(work: Work) -> dict[str, xarray.Dataset]:
    """The blocks "landing" and "convergence" of `stillhook.plan.result`, where there is something to tell."""
    datasets = {"landing": landing(work), "convergence": convergence(work)}
    return {name: data for name, data in datasets.items() if data is not None}


def landing(work: Work) -> xarray.Dataset | None:
    """Landing speeds of every alternative in one sea, seed by seed: where the best one is at its limit in the middle
    period.

    None where the plan has no landing, or no limit is known.
    """
    import xarray

    phase = next((p for p in work.plan.phases if p.kind is PhaseKind.LANDING), None)
    column = middle(work)
    if phase is None or column is None:
        return None
    best = max((work.least(a, column) for a in work.plan.alternatives), default=math.nan)
    Hs = snapped(min(best, max(work.plan.environment.Hs)))
    if not best > 0.0:
        return None
    spot, seeds = SeaState(Hs, *column), work.search.most_seeds
    asks = {a: CellRequest(phase.name, winch_of(phase, a), spot, seeds) for a in work.plan.alternatives}
    work.cells.request(list({ask.cell: ask for ask in asks.values()}.values()))
    rows = np.array([work.cells.runs[ask.cell]["v_landed"][:seeds] for ask in asks.values()])
    rule = next(
        (r.limit for r in work.limits(phase, work.plan.alternatives[0]) if r.rule.quantity == "v_landed"), math.nan
    )
    return xarray.Dataset(
        {"v_landed": (("alternative", "run"), rows, attributes("v_landed"))},
        coords={"alternative": [a.value for a in asks], "run": np.arange(1, seeds + 1)},
        attrs={"Hs": Hs, "Tp": column[0], "beta": column[1], "limit": rule, "phase": phase.name},
    )


def middle(work: Work) -> Column | None:
    """The column of the middle period in which the limits are lowest; None where nothing was looked for."""
    periods = sorted(work.plan.environment.Tp)
    Tp = periods[len(periods) // 2]
    columns = sorted({line.column for line in work.lines if line.column[0] == Tp})
    return min(columns, key=lambda c: min(work.least(a, c) for a in work.plan.alternatives)) if columns else None


def convergence(work: Work) -> xarray.Dataset | None:
    """Utilisation of the rule that governs next to the limit, with its 95 % interval, over the seeds that it is told
    from.

    One cell for each way of running the winch that governs in the middle column; NaN beyond the seeds that a cell has.
    """
    import xarray

    column = middle(work)
    lines = [] if column is None else _shown(work, column)
    if not lines:
        return None
    n = np.arange(FEWEST_MAXIMA, work.search.most_seeds + 1, EVERY)
    table = np.full((3, len(lines), len(n)), np.nan)
    names = []
    for i, line in enumerate(lines):
        Hs = work.heights(line)
        h = float(Hs[nearest(Hs, line.limit)])
        key = work.governs(line, h)
        names.append(_named(line, h, key))
        for j, count in enumerate(n):
            table[:, i, j] = _with(work, line, h, key, int(count))
    parts = dict(zip(("utilisation", "low", "high"), table, strict=True))
    return xarray.Dataset(
        {name: (("cell", "n"), values) for name, values in parts.items()}, coords={"cell": names, "n": n}
    )


def _shown(work: Work, column: Column) -> list[LimitSearch]:
    """Lines that limit their alternative in a column, each run once."""
    limiting: dict[tuple[str, object], LimitSearch] = {}
    for line in work.lines:
        if (
            line.column == column
            and line.resolved
            and 0.0 < line.limit < math.inf
            and line.limit <= work.least(line.alternative, column)
        ):
            limiting.setdefault((line.phase.name, line.winch), line)
    return list(limiting.values())[:SHOWN]


def _named(line: LimitSearch, Hs: float, key: str) -> str:
    who = line.alternative.value if line.phase.compensated else "all alternatives"
    T, beta = line.column
    return (
        f"{line.phase.name}, {who}: {key} at Hs {show(Hs, 'length')}, Tp {show(T, 'time')},"
        f" {math.degrees(beta):.4g} deg"
    )


def _with(work: Work, line: LimitSearch, Hs: float, key: str, n: int) -> tuple[float, float, float]:
    """Utilisation of a rule and the ends of its interval, from the first n seeds of a cell; NaN where it has fewer."""
    spot = line.spot(Hs)
    runs = work.cells.runs[line.phase.name, line.winch, spot]
    rule = next(r for r in work.rules(line) if r.rule.key == key)
    if n > len(runs["duration"]):
        return math.nan, math.nan, math.nan
    course = work.cells.course(line.phase, line.winch, spot)
    first = {name: values[:n] for name, values in runs.items()}
    estimate = quantities(work.plan, line.phase, line.alternative, line.winch, course, first)[rule.rule.quantity]
    value, low, high = (float(x) for x in utilisation(rule, np.array((estimate.value, estimate.low, estimate.high))))
    return value, min(low, high), max(low, high)
