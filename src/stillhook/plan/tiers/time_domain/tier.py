"""The twin's tier: limits by runs in the time domain, placed about the limits that the other tiers predict.

Blocks of a result that only runs give: how landing speeds scatter, and how limits settle as seeds are added.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Parts, Progress
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Demand, Seas, Tier
from stillhook.plan.limits import Limits, limited
from stillhook.plan.result import Cause, Failures, cause, labelled
from stillhook.plan.tiers.time_domain.cells import CellRequest, Cells, Execution, Runs, merged
from stillhook.plan.tiers.time_domain.levels import cell_levels
from stillhook.plan.tiers.time_domain.lowering import KINDS, SeaState, winch_of
from stillhook.plan.tiers.time_domain.measures import Measure, Statistic
from stillhook.plan.tiers.time_domain.placing import Column, LimitSearch, Search, or_inf, prediction_factors, snapped
from stillhook.plan.tiers.time_domain.search import Work
from stillhook.plan.tiers.weight_cases import joined, lower_of
from stillhook.spec.lift.phase import APART, Phase, PhaseKind
from stillhook.statistics.estimate import Estimate
from stillhook.units import show

if TYPE_CHECKING:
    import xarray


STEPS = 6
"""Numbers of runs for which a convergence is reported."""
SHOWN = 6
"""Largest number of limits whose convergence is reported."""


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
    sea_state, seeds = SeaState(Hs, *column), LANDINGS
    asks = {a: CellRequest(phase.name, winch_of(phase, a), sea_state, seeds) for a in work.plan.alternatives}
    work.cells.request(merged(list(asks.values())))
    rows = np.array([work.cells.runs[ask.cell]["v_landed"][:seeds] for ask in asks.values()])
    rules = limited(work.plan, phase, work.plan.alternatives[0])
    limit = next((r.limit for r in rules if r.rule.quantity == "v_landed"), math.nan)
    return labelled(
        {"v_landed": (("alternative", "run"), rows)},
        {"alternative": [a.value for a in asks], "run": np.arange(1, seeds + 1)},
        {"Hs": Hs, "Tp": column[0], "beta": column[1], "limit": limit, "phase": phase.name},
    )


LANDINGS = 32
"""Landings of each alternative whose speeds are shown."""


def middle(work: Work) -> Column | None:
    """The column of the middle period in which the limits are lowest; None where nothing was looked for."""
    periods = sorted(work.plan.environment.Tp)
    Tp = periods[len(periods) // 2]
    columns = sorted({line.column for line in work.lines if line.column[0] == Tp})
    return min(columns, key=lambda c: min(work.least(a, c) for a in work.plan.alternatives)) if columns else None


def convergence(work: Work) -> xarray.Dataset | None:
    """Limits of the middle column with their 95 % interval [m], by the first runs of every cell alone.

    One line for each way of running the winch that governs there; n runs of the largest cell.
    """
    import xarray

    column = middle(work)
    lines = [] if column is None else _shown(work, column)
    if not lines or column is None:
        return None
    most = max(len(work.runs(line, h)["duration"]) for line in lines for h in work.heights(line))
    most = max(
        [most, *(sum(len(work.runs(x, h)["duration"]) for h in work.heights(x)) for x in lines if work.crosses(x))]
    )
    n = np.unique(np.linspace(min(8, most), most, STEPS).round().astype(int))
    table = np.full((3, len(lines), len(n)), np.nan)
    names = []
    for i, line in enumerate(lines):
        judged = work.judgement(line)
        at = judged.columns.index(column)
        key = min(judged.limits, key=lambda rule: or_inf(judged.limits[rule].Hs[at]))
        names.append(_named(line, key))
        rule = next(each for each in work.rules(line) if each.rule.key == key)
        for j, count in enumerate(n):
            limits = work.limits_by_first(line, rule, judged, int(count))
            table[:, i, j] = limits.Hs[at], limits.low[at], limits.high[at]
    parts = dict(zip(("Hs_limit", "low", "high"), table, strict=True))
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


def _named(line: LimitSearch, key: str) -> str:
    apart = line.phase.compensated or line.winch.below is not None
    who = line.alternative.value if apart else "all alternatives"
    T, beta = line.column
    return f"{line.phase.name}, {who}: {key} at Tp {show(T, 'time')}, {math.degrees(beta):.4g} deg"


MOST_ROUNDS = 200


@dataclass(frozen=True, eq=False)
class TwinTier:
    """Results of the twin's tier."""

    demands: tuple[Demand, ...] = field(repr=False)  # of each phase and alternative that was run
    limits: tuple[Limits, ...] = field(repr=False)  # tier TIME, as demands
    runs: Mapping[str, Any]  # number of runs and seeds
    reasons: Mapping[str, Cause]  # phase -> why it was run, or not
    notes: tuple[Cause, ...] = ()  # remarks on the limits
    blocks: Mapping[str, xarray.Dataset] = field(default_factory=dict, repr=False)  # "landing" and "convergence"
    failures: Failures = field(default_factory=Failures)  # what could not be computed


def refine(
    plan: LiftPlan,
    predicted: Sequence[Limits],
    *,
    search: Search | None = None,
    occurrence: Callable[[Column, float], float] | None = None,
    execution: Execution | None = None,
    progress: Progress | None = None,
) -> TwinTier:
    """Limits of the phases that may govern, by runs of the twin.

    predicted: limits of the other tiers. In every column (Tp, direction) and under every alternative the phase that may
    limit the lowest height is run first; a phase is not run where another known limit is below the least that
    it may limit (its predicted height over the factor of `prediction_factors`). Alternatives see the same waves
    (common random numbers), and what is one run under several of them is run once. Heights are placed by
    `stillhook.plan.tiers.time_domain.search`; a column gets more runs until the interval of its limit is narrow enough.

    occurrence: weather about a limit of a column, over the usual (`stillhook.plan.weather.occurrence`);
    execution: where runs are kept, so that an interrupted plan resumes, and who runs them; progress: share done, 0..1.
    Errors: StillhookError, one line: a lift beyond any crane, a store that cannot be written.
    """
    parts = Parts(progress, EXPECTED) if plan.low is not None else None
    high = progress if parts is None else parts("high weight case")
    work = Work(plan, search or Search(), Cells(plan, execution or Execution()), high, occurrence)
    work.prepare(predicted)
    _searched(work)
    result = _result(work)
    return result if parts is None else _with_low_case(result, work, predicted, parts("low weight case"))


EXPECTED = {"high weight case": 92.0, "low weight case": 8.0}
"""Parts of the tier where a plan has two weight cases, in ratio to each other: for progress."""
SLACK = ("sling_ratio", "slack_chance", "snap_load")
"""Quantities that the low weight case governs, which runs therefore determine of it as well: slack and what follows."""


def _searched(work: Work) -> None:
    for _ in range(MOST_ROUNDS):
        if not work.round():
            break


def _with_low_case(result: TwinTier, high: Work, predicted: Sequence[Limits], progress: Progress | None) -> TwinTier:
    """The result with limits of slack slings by runs of the low weight case, wherever that may govern below everything
    that is known of the high one."""
    assert high.plan.low is not None
    keys = {rule.key for rule in high.plan.rules.rules if rule.quantity in SLACK}
    phases = [p for p in high.plan.phases if p.kind in KINDS and keys & set(rule_keys(high.plan, p))]
    plan = replace(high.plan.low, phases=tuple(phases))
    work = Work(plan, high.search, Cells(plan, high.cells.execution), progress, high.occurrence, judges=SLACK)
    work.prepare([replace(each, Hs={k: Hs for k, Hs in each.Hs.items() if k in keys}) for each in predicted])
    work.others = {key: high.least(*key) for key in work.groups}
    _searched(work)
    low = _result(work, blocks=False)
    of_low = {(each.phase, each.alternative): each for each in low.limits}
    run = {(each.phase, each.alternative): each for each in low.demands}
    limits, demands = list(result.limits), list(result.demands)
    for i, each in enumerate(limits):
        if (other := of_low.pop((each.phase, each.alternative), None)) is not None:
            limits[i] = lower_of(each, other)
    for i, demand in enumerate(demands):
        if (more := run.pop((demand.phase, demand.alternative), None)) is not None:
            demands[i] = joined(demand, more)
    counts = {name: result.runs[name] + low.runs[name] for name in ("n", "n_failed", "n_cells", "simulated")}
    runs = {**result.runs, **counts, "n_low_weight": low.runs["n"]}
    failures = Failures({**result.failures.reasons, **low.failures.reasons})
    new = tuple(replace(each, low_weight={k: np.isfinite(Hs) for k, Hs in each.Hs.items()}) for each in of_low.values())
    demands += run.values()
    return replace(result, limits=(*limits, *new), demands=tuple(demands), runs=runs, failures=failures)


def rule_keys(plan: LiftPlan, phase: Phase) -> tuple[str, ...]:
    """Rules that hold in a phase under the first alternative."""
    return tuple(each.rule.key for each in limited(plan, phase, plan.alternatives[0]))


def _result(work: Work, *, blocks: bool = True) -> TwinTier:
    """Demands and limits of everything that was run; blocks: what only runs give as well."""
    pairs = {(line.phase.name, line.alternative): line.phase for line in work.lines if _was_run(work, line)}
    failures = Failures()
    demands = [_demand(work, phase, alternative, failures) for (_, alternative), phase in pairs.items()]
    limits = [_limits(work, phase, alternative, failures) for (_, alternative), phase in pairs.items()]
    makers = {"landing": landing, "convergence": convergence} if blocks else {}
    made = {name: failures.attempt(name, partial(make, work), None) for name, make in makers.items()}
    if work.progress is not None:
        work.progress(1.0)
    return TwinTier(
        tuple(demands),
        tuple(limits),
        _runs(work.cells),
        {p.name: _reason(work, p) for p in work.plan.phases},
        _notes(work),
        {name: data for name, data in made.items() if data is not None},
        failures,
    )


def _was_run(work: Work, line: LimitSearch) -> bool:
    """Whether a line was started, or another alternative's runs are its own."""
    return line.started or bool(work.heights(line))


def _lines_run(work: Work, phase: Phase, alternative: Alternative) -> list[LimitSearch]:
    return [line for line in work.phases[phase.name, alternative] if _was_run(work, line)]


def _limits(work: Work, phase: Phase, alternative: Alternative, failures: Failures) -> Limits:
    """Limits of every rule in every column that was looked at; in one whose calm is beyond, of the calm. A rule that
    could not be judged allows no sea."""
    lines, judged = _lines_run(work, phase, alternative), work.judge(phase.name, alternative)
    Tp, beta = (np.array([line.column[i] for line in lines]) for i in (0, 1))
    Hs, low, high = ({each.rule.key: np.full(len(lines), np.nan) for each in work.rules(lines[0])} for _ in range(3))
    draws: dict[str, FloatArray] = {}
    place = [i for i, line in enumerate(lines) if line.column in judged.columns]
    of = [judged.columns.index(lines[i].column) for i in place]
    for key, result in judged.limits.items():
        for table, values in ((Hs, result.Hs), (low, result.low), (high, result.high)):
            table[key][place] = values[of]
        if len(result.draws):
            draws[key] = np.full((len(result.draws), len(lines)), np.nan)
            draws[key][:, place] = result.draws[:, of]
    for key, reason in judged.failed.items():
        Hs[key][place] = 0.0
        failures.reasons[f'limit by "{key}", {phase.name}, {alternative}: 0 m in its place'] = reason
    for i, line in enumerate(lines):
        if line.column in judged.columns:
            continue
        for each in work.rules(line):
            for table in (Hs, low, high):
                table[each.rule.key][i] = 0.0 if work.beyond_in_calm(line, each) else math.nan
    return Limits(phase.name, alternative, Tier.TIME, Tp, beta, Hs, low, high, draws)


class _Cell(NamedTuple):
    """A row of a demand: line, height of its sea [m], runs there."""

    line: LimitSearch
    Hs: float
    runs: Runs


def _demand(work: Work, phase: Phase, alternative: Alternative, failures: Failures) -> Demand:
    """All cells of a phase under an alternative as one demand, the calm of every column first: levels of the cells, and
    of bins of runs where each run has a height of its own."""
    lines, judged = _lines_run(work, phase, alternative), work.judge(phase.name, alternative)
    bins = work.crosses(lines[0])
    each = [(line, [(0.0, work.runs(line, 0.0)), *work.cells_of(line, bins=bins)]) for line in lines]
    rows = [_Cell(line, h, runs) for line, cells in each for h, runs in cells]
    seas = Seas(*(np.array([getattr(row.line.spot(row.Hs), name) for row in rows]) for name in ("Hs", "Tp", "beta")))
    names = sorted({name for line in lines for name in work.measures(line) if work.has(line, name)})
    nothing = np.full((3, len(rows)), np.nan)
    tables = {
        q: failures.attempt(
            f"{q}, {phase.name}, {alternative}", partial(_of_cells, work, judged.columns, rows, q), nothing
        )
        for q in names
    }
    value, low, high = ({q: table[k] for q, table in tables.items()} for k in range(3))
    seeds = [
        sum(len(runs["duration"]) for h, runs in cells if h > 0.0) if bins else len(own["duration"])
        for _, cells in each
        for _, own in cells
    ]  # of bins every run is one of the column's
    return Demand(phase.name, alternative, Tier.TIME, seas, value, low, high, np.array(seeds, dtype=np.int64))


def _of_cells(work: Work, columns: Sequence[Column], rows: Sequence[_Cell], q: str) -> FloatArray:
    """A quantity in cells (3, n): value and ends of its interval. columns: those that have runs."""
    first = rows[0].line
    every = {line.column: line for line in work.phases[first.phase.name, first.alternative]}  # runs may be of another's
    bins = work.crosses(first)
    of = [work.runs_of(every[c], q, work.height(work.heights(every[c])[0]), bins=bins) for c in columns]
    counted = bool(of) and of[0].measure.statistic is Statistic.CHANCE
    levels, place = None if counted else cell_levels(of), {column: i for i, column in enumerate(columns)}
    result = np.full((3, len(rows)), np.nan)
    for k, (line, h, runs) in enumerate(rows):
        measure = work.measures(line)[q]
        if measure.statistic is Statistic.CHANCE:
            estimate = chance(measure, runs)
        elif levels is None or work.plan.environment.calm(h) or line.column not in place:
            x = float(measure.values(work.runs(line, 0.0)).max())
            estimate = _estimate(measure, x, x, x)
        else:
            estimate = _estimate(measure, *levels.at(place[line.column], work.height(h)))
        result[:, k] = estimate.value, estimate.low, estimate.high
    return result


def _estimate(measure: Measure, *x: float) -> Estimate:
    value, *ends = (float(v) for v in measure.of_x(np.array(x)))
    return Estimate(value, min(ends), max(ends))


def chance(measure: Measure, runs: Mapping[str, FloatArray]) -> Estimate:
    """Chance that a phase reaches the end of what there is, by the runs of one cell; Wilson's interval."""
    x = measure.values(runs)
    share = Estimate.of_share(int(np.sum(x >= measure.end * (1.0 - 1e-9))), len(x))
    value, low, high = (1.0 - (1.0 - p) ** max(measure.times, 1.0) for p in (share.value, share.low, share.high))
    return Estimate(value, low, high, len(x))


def _runs(cells: Cells) -> dict[str, Any]:
    calm = cells.plan.environment.calm
    sizes = [len(runs["duration"]) for (_, _, sea_state), runs in cells.runs.items() if not calm(sea_state.Hs)]
    return {
        "n": cells.n_runs,
        "n_failed": cells.n_failed,
        "n_cells": len(sizes),
        "seeds_per_cell": [min(sizes, default=0), max(sizes, default=0)],
        "seed": cells.execution.seed,
        "simulated": cells.seconds,
    }


def _notes(work: Work) -> tuple[Cause, ...]:
    """Landings by runs are braked by the water under the payload: by how much in a calm."""
    lands = [x for x in work.lines if x.started and x.phase.kind is PhaseKind.LANDING]
    line = next((x for x in lands if x.alternative.twin), next(iter(lands), None))
    if line is None or line.phase.speed is None or not work.plan.environment.calm(0.0):
        return ()
    landed = float(work.runs(line, 0.0)["v_landed"][0])
    return (cause("cushion", speed=line.phase.speed, landed=landed),)


def _reason(work: Work, phase: Phase) -> Cause:
    """Why a phase was run by the twin, or not."""
    lines = [line for line in work.lines if line.phase is phase]
    run = [line for line in lines if line.started]
    if not lines:
        return cause("no-ground", kind=str(phase.kind))
    if len(run) == len(lines):
        return cause("run-everywhere")
    tier = Tier.CLOSED_FORM if phase.kind in (PhaseKind.SPLASH, *APART) else Tier.FREQUENCY
    factor = prediction_factors(phase, tier)[0]
    return cause("run-in-part" if run else "not-run", n=len(run), of=len(lines), factor=factor)
