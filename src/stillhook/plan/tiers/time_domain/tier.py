"""The twin's tier: limits by runs in the time domain, placed about the limits that the other tiers predict.

Blocks of a result that only runs give: how landing speeds scatter, and how numbers settle as seeds are added.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.base.progress import Progress
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.phases import Phase, PhaseKind
from stillhook.plan.definition.rules import Alternative, Demand, Limited, Seas, Tier
from stillhook.plan.limits import Limits, limited, limits_of, utilisation
from stillhook.plan.result import labelled
from stillhook.plan.tiers.time_domain.cells import CellRequest, Cells, Execution, quantities
from stillhook.plan.tiers.time_domain.lowering import KINDS, SeaState, winch_of
from stillhook.plan.tiers.time_domain.search import (
    UNDERESTIMATE_FACTOR,
    Column,
    LimitSearch,
    Search,
    Work,
    nearest,
    snapped,
)
from stillhook.statistics.estimate import Estimate
from stillhook.statistics.extremes import FEWEST_MAXIMA
from stillhook.units import show

if TYPE_CHECKING:
    import xarray


EVERY = 5
"""Seeds between two numbers of a convergence."""
SHOWN = 6
"""Largest number of cells whose convergence is reported."""


def landing(work: Work) -> xarray.Dataset | None:
    """Landing speeds of every alternative in one sea, seed by seed: where the best one is at its limit in the middle
    period.

    None where the plan has no landing, or no limit is known.
    """
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
    rules = limited(work.plan, phase, work.plan.alternatives[0])
    limit = next((r.limit for r in rules if r.rule.quantity == "v_landed"), math.nan)
    return labelled(
        {"v_landed": (("alternative", "run"), rows)},
        {"alternative": [a.value for a in asks], "run": np.arange(1, seeds + 1)},
        {"Hs": Hs, "Tp": column[0], "beta": column[1], "limit": limit, "phase": phase.name},
    )


def middle(work: Work) -> Column | None:
    """The column of the middle period in which the limits are lowest; None where nothing was looked for."""
    periods = sorted(work.plan.environment.Tp)
    Tp = periods[len(periods) // 2]
    columns = sorted({line.column for line in work.lines if line.column[0] == Tp})
    return min(columns, key=lambda c: min(work.least(a, c) for a in work.plan.alternatives)) if columns else None


def convergence(work: Work) -> xarray.Dataset | None:
    """Utilisation of the rule that governs next to the limit, with its 95 % interval, over the seeds that it is
    estimated from.

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
    ends = np.array((estimate.value, estimate.low, estimate.high))
    value, low, high = (float(x) for x in utilisation(rule, ends, Hs))
    return value, min(low, high), max(low, high)


USUAL_CELLS = 2.5
"""Cells that a limit takes on the mean, for the estimate in advance."""
MOST_ROUNDS = 100
SATURATED = 1.02
"""Worse end of a utilisation's interval over its value up to which the cell is at the end of what there is, such as
slack slings."""


@dataclass(frozen=True, eq=False)
class TwinTier:
    """Results of the twin's tier."""

    demands: tuple[Demand, ...] = field(repr=False)  # of each phase and alternative that was run
    limits: tuple[Limits, ...] = field(repr=False)  # tier TIME, as demands
    runs: Mapping[str, Any]  # number of runs and seeds
    reasons: Mapping[str, str]  # phase -> reason why it was run, or not
    notes: tuple[str, ...] = ()  # remarks on the limits
    blocks: Mapping[str, xarray.Dataset] = field(default_factory=dict, repr=False)  # "landing" and "convergence"


def refine(
    plan: LiftPlan,
    predicted: Sequence[Limits],
    *,
    search: Search | None = None,
    store: Any = None,
    client: Any = None,
    threads: int = 2,
    progress: Progress | None = None,
) -> TwinTier:
    """Limits of the phases that may govern, by runs of the twin.

    predicted: limits of the other tiers. In every column (Tp, direction) and under every alternative the phase that may
    limit the lowest height is run first; a phase is not run where another known limit is below the least that
    it may limit (its predicted height over `UNDERESTIMATE_FACTOR`). Alternatives see the same waves (common random
    numbers), and what is one run under several of them is run once. Heights are placed by
    `stillhook.plan.tiers.time_domain.search`; the cell next to a limit gets more seeds until its interval closes.

    store: folder in which runs are kept, so that an interrupted plan goes on; client of a Dask cluster; progress: share
    done, 0..1.
    Errors: StillhookError, one line: a lift beyond any crane, a store that cannot be written.
    """
    work = Work(plan, search or Search(), Cells(plan, Execution(store, client, threads)), progress)
    work.prepare(predicted)
    for _ in range(MOST_ROUNDS):
        if not work.round():
            break
    return _result(work)


def _result(work: Work) -> TwinTier:
    """Demands and limits of everything that was run."""
    pairs = {(line.phase.name, line.alternative): line.phase for line in work.lines if line.started}
    demands = [_demand(work, phase, alternative) for (_, alternative), phase in pairs.items()]
    highest = max(work.plan.environment.Hs)
    rules = [limited(work.plan, phase, alternative) for (_, alternative), phase in pairs.items()]
    limits = [
        _with_ends(limits_of(demand, held, most=highest), demand, {each.rule.key: each for each in held}, highest)
        for demand, held in zip(demands, rules, strict=True)
    ]
    blocks = {"landing": landing(work), "convergence": convergence(work)}
    if work.progress is not None:
        work.progress(1.0)
    return TwinTier(
        tuple(demands),
        tuple(limits),
        _runs(work.cells),
        {p.name: _reason(work, p) for p in work.plan.phases},
        _notes(work),
        {name: data for name, data in blocks.items() if data is not None},
    )


def _with_ends(limits: Limits, demand: Demand, rules: Mapping[str, Limited], most: float) -> Limits:
    """Limits with the ends of their 95 % interval from the cell next to each, whose seeds were closed: what the waves
    add there grows with the height. (Cells of one column see the same waves, so their errors go together; farther ones
    have fewer seeds and say less.)
    """
    low, high = ({key: ends.copy() for key, ends in side.items()} for side in (limits.low, limits.high))
    for key in high:
        rule, q = rules[key], rules[key].rule.quantity
        Hs_of = demand.seas.Hs
        value, *sides = (utilisation(rule, table[q], Hs_of) for table in (demand.values, demand.low, demand.high))
        worst, best = np.fmax(*sides), np.fmin(*sides)
        for i, (_, _, rows) in enumerate(demand.seas.columns()):
            Hs = float(limits.Hs[key][i])
            if not 0.0 < Hs < math.inf:
                continue
            n, calm = nearest(demand.seas.Hs[rows], Hs), value[rows[0]]
            k = (
                rows[n - 1] if n > 1 and worst[rows[n]] <= SATURATED * value[rows[n]] else rows[n]
            )  # slack slings cannot be slacker
            added = value[k] - calm
            if math.isfinite(added) and added > 0.0:
                low[key][i] = _scaled(Hs, added, worst[k] - calm) if math.isfinite(worst[k]) else math.nan
                high[key][i] = _scaled(Hs, added, best[k] - calm)
    return replace(limits, low=low, high={key: np.where(ends > most, np.inf, ends) for key, ends in high.items()})


def _scaled(Hs: float, added: float, taken: float) -> float:
    """Height at which what the waves add is that of the limit, if they add `taken` where `added` was calculated."""
    return Hs * added / taken if taken > 0.0 else math.inf


def _demand(work: Work, phase: Phase, alternative: Alternative) -> Demand:
    """All cells of a phase under an alternative as one demand, the calm of every column first."""
    lines = [line for line in work.lines if line.started and line.phase is phase and line.alternative is alternative]
    rows = [(line.spot(float(h)), work.numbers(line, float(h))) for line in lines for h in work.heights(line)]
    spots = [spot for spot, _ in rows]
    names = sorted({name for _, numbers in rows for name in numbers})
    seas = Seas(*(np.array([getattr(s, name) for s in spots]) for name in ("Hs", "Tp", "beta")))
    blank = Estimate(math.nan)
    value, low, high = (
        {q: np.array([getattr(numbers.get(q, blank), part) for _, numbers in rows]) for q in names}
        for part in ("value", "low", "high")
    )
    winch = lines[0].winch
    seeds = np.array([len(work.cells.runs[phase.name, winch, s]["duration"]) for s in spots], dtype=np.int64)
    return Demand(phase.name, alternative, Tier.TIME, seas, value, low, high, seeds)


def _runs(cells: Cells) -> dict[str, Any]:
    calm = cells.plan.environment.calm
    sizes = [len(runs["duration"]) for (_, _, spot), runs in cells.runs.items() if not calm(spot.Hs)]
    return {
        "n": cells.n_runs,
        "n_failed": cells.n_failed,
        "n_cells": len(sizes),
        "seeds_first": 1,
        "seeds_per_cell": [min(sizes, default=0), max(sizes, default=0)],
        "simulated": cells.seconds,
    }


def _notes(work: Work) -> tuple[str, ...]:
    """Landings by runs are braked by the water under the payload: by how much in a calm."""
    line = next((x for x in work.lines if x.started and x.phase.kind is PhaseKind.LANDING and x.alternative.twin), None)
    line = line or next((x for x in work.lines if x.started and x.phase.kind is PhaseKind.LANDING), None)
    if line is None or line.phase.speed is None or not work.plan.environment.calm(0.0):
        return ()
    v = work.numbers(line, 0.0)["v_landed"].value
    return (
        "landing speeds by runs count the cushion of water under the payload, with the gap numbers of the payload"
        f" file (assumed unless it says otherwise): lowered at {show(line.phase.speed, 'speed')} in a calm it"
        f" touches at {show(v, 'speed')}. Check them where the landing is limited by its speed",
    )


def _reason(work: Work, phase: Phase) -> str:
    """Reason why a phase was run by the twin, or not."""
    lines = [line for line in work.lines if line.phase is phase]
    if not lines:
        return (
            f"{phase.kind} is assessed by closed form and frequency-domain method: no run begins on a deck or on the"
            " seabed"
        )
    run = [line for line in lines if line.started]
    if len(run) == len(lines):
        return "run everywhere"
    factor = f"{UNDERESTIMATE_FACTOR[Tier.FREQUENCY]:g}"
    rest = (
        f"another phase has a known limit below its predicted limit over {factor}, or it is predicted to limit nowhere"
    )
    if not run:
        return f"not run: {rest}"
    return f"run in {len(run)} of {len(lines)} columns of alternative, period and heading; elsewhere {rest}"


def expected(plan: LiftPlan, search: Search | None = None) -> str:
    """What the twin's tier may take, in words, before it runs: every line that could be looked for, at the usual number
    of cells."""
    chosen = search or Search()
    kinds = {
        (phase.name, winch_of(phase, a)) for phase in plan.phases if phase.kind in KINDS for a in plan.alternatives
    }
    columns = len(plan.environment.Tp) * len(plan.environment.headings)
    runs = round(len(kinds) * columns * USUAL_CELLS * chosen.seeds)
    return f"up to some {runs:,} runs of the twin, fewer where a phase cannot govern"
