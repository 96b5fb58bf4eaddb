"""The twin's tier: limits by runs in the time domain, placed about the limits that the other tiers predict."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Demand, Seas, Tier
from stillhook.plan.limits import Limits
from stillhook.plan.result import Cause, Failures, cause
from stillhook.plan.tiers.time_domain.cells import Cells, Execution, Runs
from stillhook.plan.tiers.time_domain.levels import cell_levels
from stillhook.plan.tiers.time_domain.measures import Measure, Statistic
from stillhook.plan.tiers.time_domain.placing import Column, LimitSearch, Search, prediction_factors
from stillhook.plan.tiers.time_domain.search import Work
from stillhook.spec.lift.phase import Phase, PhaseKind
from stillhook.statistics.estimate import Estimate

if TYPE_CHECKING:
    pass


MOST_ROUNDS = 200


@dataclass(frozen=True, eq=False)
class TwinTier:
    """Results of the twin's tier."""

    demands: tuple[Demand, ...] = field(repr=False)  # of each phase and alternative that was run
    limits: tuple[Limits, ...] = field(repr=False)  # tier TIME, as demands
    runs: Mapping[str, Any]  # number of runs and seeds
    reasons: Mapping[str, Cause]  # phase -> why it was run, or not
    notes: tuple[Cause, ...] = ()  # remarks on the limits
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

    occurrence: weather about a limit of a column, over the usual (`stillhook.plan.weather.records`);
    execution: where runs are kept, so that an interrupted plan goes on, and who runs them; progress: share done, 0..1.
    Errors: StillhookError, one line: a lift beyond any crane, a store that cannot be written.
    """
    work = Work(plan, search or Search(), Cells(plan, execution or Execution()), progress, occurrence)
    work.prepare(predicted)
    for _ in range(MOST_ROUNDS):
        if not work.round():
            break
    return _result(work)


def _result(work: Work) -> TwinTier:
    """Demands and limits of everything that was run."""
    pairs = {(line.phase.name, line.alternative): line.phase for line in work.lines if _was_run(work, line)}
    failures = Failures()
    demands = [_demand(work, phase, alternative, failures) for (_, alternative), phase in pairs.items()]
    limits = [_limits(work, phase, alternative, failures) for (_, alternative), phase in pairs.items()]
    if work.progress is not None:
        work.progress(1.0)
    return TwinTier(
        tuple(demands),
        tuple(limits),
        _runs(work.cells),
        {p.name: _reason(work, p) for p in work.plan.phases},
        _notes(work),
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
    tier = Tier.CLOSED_FORM if phase.kind is PhaseKind.SPLASH else Tier.FREQUENCY
    factor = prediction_factors(phase, tier)[0]
    return cause("run-in-part" if run else "not-run", n=len(run), of=len(lines), factor=factor)
