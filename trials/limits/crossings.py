"""Limits over the seabed on the twin's own distributions: repeated plans against all their runs together, and fresh
runs at the limits of three lifts; fresh runs at the limits of the passage through the surface, which are of curves.

`python -m trials.limits.crossings` (three quarters of an hour of two cores) writes crossings.json, which the page is
made from; with names of parts (fresh, coverage, passage) these alone.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.special import log_ndtr, ndtri

from stillhook.library import load_crane
from stillhook.library.catalogue import read_payload
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.file import load_plan
from stillhook.plan.limits import Limits, limited, limits_in
from stillhook.plan.tiers.closed_form import closed_form
from stillhook.plan.tiers.frequency import frequency
from stillhook.plan.tiers.time_domain.cells import CellRequest, Cells, Execution, merged
from stillhook.plan.tiers.time_domain.crossings import crosses
from stillhook.plan.tiers.time_domain.lowering import SeaState, winch_of
from stillhook.plan.tiers.time_domain.placing import Search
from stillhook.plan.tiers.time_domain.search import Work
from stillhook.spec.lift.phase import PhaseKind
from trials import store

STORE = Path(__file__).with_name("crossings.json")
PERIODS, HEADINGS = (5.0, 6.0, 7.0, 8.0, 9.0, 11.0, 13.0), (165.0, 180.0)
"""Periods [s] and directions of travel [deg] of the fourteen columns."""
CONTROLLERS = (Alternative.NONE, Alternative.NS, Alternative.HS, Alternative.SSC)
RULES = ("control-error", "load-motion")
FRESH, FRESH_SEED = 64, 90001
"""Runs in each sea at a printed limit, in waves that no plan saw."""
PLANS = 100
ROUNDS = 200


class Lift(NamedTuple):
    """A payload that is landed from a crane; depth [m]; tolerance [m] of the payload's motion over the seabed, and of
    the wire's control error."""

    name: str
    crane: str
    payload: str
    depth: float
    motion: str
    error: str


LIFTS = (
    Lift("120 t on 1,500 m, the example", "nov-250t", "template-120t", 1500.0, "0.30 m", "0.20 m"),
    Lift("60 t on 300 m, another crane", "nov-150t", "manifold-60t", 300.0, "0.25 m", "0.25 m"),
    Lift("85 t on 800 m", "nov-250t", "suction-anchor-85t", 800.0, "0.40 m", "0.30 m"),
)


def lift_plan(
    lift: Lift,
    alternatives: Sequence[Alternative] = CONTROLLERS,
    periods: Sequence[float] = PERIODS,
    headings: Sequence[float] = HEADINGS,
) -> LiftPlan:
    """The landing of the example, and the stop before it, with another crane, payload and depth."""
    plan = load_plan("template-to-1500m")
    down = lift.depth - plan.depth
    limits = {"load-motion": lift.motion, "control-error": lift.error}
    phases = tuple(
        phase.model_copy(
            update={"start_depth": phase.start_depth + down, "depth": phase.depth + down, "limits": limits}
        )
        for phase in plan.phases
        if crosses(phase)
    )
    angles = tuple(math.radians(beta) for beta in headings)
    environment = plan.environment.model_copy(update={"Tp": tuple(periods), "headings": angles})
    return replace(
        plan,
        crane=load_crane(lift.crane),
        payload=read_payload(lift.payload),
        depth=lift.depth,
        phases=phases,
        environment=environment,
        alternatives=tuple(alternatives),
    )


def predicted(plan: LiftPlan) -> list[Limits]:
    """Limits by the frequency-domain method."""
    demands = frequency(plan, plan.alternatives, plan.environment.table(), threads=1)
    return [limits_in(plan, demand) for demand in demands]


def searched(plan: LiftPlan, guesses: Sequence[Limits], seed: int) -> Work:
    """The search of the tool, to its end."""
    work = Work(plan, Search(), Cells(plan, Execution(seed=seed)), None)
    work.prepare(guesses)
    for _ in range(ROUNDS):
        if not work.round():
            break
    return work


class Row(NamedTuple):
    """A limit of a rule in a column [m], with its interval; allowed: share of runs that may be beyond it."""

    phase: str
    alternative: str
    rule: str
    Tp: float
    beta: float
    Hs: float
    low: float
    high: float
    allowed: float

    @property
    def place(self) -> tuple[str, str, str, float, float]:
        """What it is a limit of."""
        return self[:5]


def rows_of(work: Work, rules: Sequence[str] = RULES) -> list[Row]:
    """Limits of some rules in all columns that were run."""
    rows = []
    for phase in work.plan.phases:
        for a in work.plan.alternatives:
            judged = work.judge(phase.name, a)
            for rule, of in judged.limits.items():
                if rule not in rules:
                    continue
                quantity = next(x.rule.quantity for x in limited(work.plan, phase, a) if x.rule.key == rule)
                p = 1.0 - _measure(work, phase.name, a, quantity).of_part()
                for i, (Tp, beta) in enumerate(judged.columns):
                    ends = (float(x[i]) for x in (of.Hs, of.low, of.high))
                    rows.append(Row(phase.name, a.value, rule, Tp, beta, *ends, p))
    return rows


def _measure(work: Work, phase: str, a: Alternative, quantity: str) -> Any:
    line = work.phases[phase, a][0]
    return work.measures(line)[quantity]


def beyond_of(work: Work, cells: Cells, row: Row, Hs: float) -> np.ndarray:
    """Whether each run of a sea is beyond a rule."""
    phase, a = work.plan.phase(row.phase), Alternative(row.alternative)
    rule = next(x for x in limited(work.plan, phase, a) if x.rule.key == row.rule)
    measure = _measure(work, row.phase, a, rule.rule.quantity)
    runs = cells.runs[row.phase, winch_of(phase, a), SeaState(Hs, row.Tp, row.beta)]
    return np.asarray(measure.values(runs) > measure.to_x(rule.limit))


def fresh(lift: Lift) -> list[dict[str, Any]]:
    """Share of fresh runs beyond each limit of a lift, where runs give it two ends in the seas that are analysed."""
    plan = lift_plan(lift)
    work = searched(plan, predicted(plan), 0)
    rows, highest = rows_of(work), max(plan.environment.Hs)
    told = [row for row in rows if 0.0 < row.Hs <= highest and row.high < math.inf]
    cells = Cells(plan, Execution(seed=FRESH_SEED))
    asks = [
        CellRequest(row.phase, winch_of(plan.phase(row.phase), Alternative(row.alternative)), _sea(row), FRESH)
        for row in told
    ]
    cells.request(merged(asks))
    found = []
    for row in rows:
        beyond = beyond_of(work, cells, row, _sea(row).Hs) if row in told else None
        found.append({"lift": lift.name, **_finite(row)} | {"beyond": None if beyond is None else float(beyond.mean())})
    print(f"{lift.name}: {work.cells.n_runs} runs, {cells.n_runs} fresh ones", flush=True)
    return found


def _sea(row: Row) -> SeaState:
    return SeaState(round(row.Hs, 4), row.Tp, row.beta)


def _finite(row: Row) -> dict[str, Any]:
    return {k: (x if isinstance(x, str) or math.isfinite(x) else None) for k, x in row._asdict().items()}


PASSAGES, PASSAGE_RULES = 128, ("slack-sling", "snap-load")
"""Fresh runs in each sea at a limit of the passage, and its rules that bind."""


def passage() -> list[dict[str, Any]]:
    """Share of fresh passages beyond each limit of the example's splash zone, of plans in two other sets of waves."""
    whole = load_plan("template-to-1500m")
    (phase,) = (phase for phase in whole.phases if phase.kind is PhaseKind.SPLASH)
    plan = replace(whole, alternatives=(Alternative.NONE,), phases=(phase,))
    guesses = [limits_in(plan, closed_form(plan, phase, plan.environment.table(), Alternative.NONE))]
    found = []
    for seed in (0, 7):
        work, cells = searched(plan, guesses, seed), Cells(plan, Execution(seed=FRESH_SEED + seed))
        told = [row for row in rows_of(work, PASSAGE_RULES) if 0.0 < row.Hs <= max(plan.environment.Hs)]
        cells.request([CellRequest(phase.name, winch_of(phase, Alternative.NONE), _sea(row), PASSAGES) for row in told])
        for row in told:
            beyond = float(beyond_of(work, cells, row, _sea(row).Hs).mean())
            found.append({"seed": seed, **_finite(row), "beyond": beyond})
        print(f"{phase.name}, seed {seed}: {work.cells.n_runs} runs, {cells.n_runs} fresh ones", flush=True)
    return found


COVERED = (Alternative.NS, Alternative.SSC)
"""Controllers of the repeated plans, whose motions have two peaks and plateaus."""
COVERED_PERIODS, COVERED_HEADING = (5.0, 7.0, 9.0, 12.0), (165.0,)
"""Columns of the repeated plans: periods [s] and direction of travel [deg]."""


def one_plan(seed: int) -> tuple[list[Row], dict[Any, list[tuple[float, bool]]]]:
    """Limits of the example by one seed, and what every run said: (height, beyond)."""
    plan = lift_plan(LIFTS[0], COVERED, COVERED_PERIODS, COVERED_HEADING)
    work = searched(plan, _guesses(plan), seed)
    rows, said = rows_of(work), {}
    for row in rows:
        line = next(x for x in work.phases[row.phase, Alternative(row.alternative)] if x.column == (row.Tp, row.beta))
        said[row.place] = [(h, bool(b)) for h in work.heights(line) for b in beyond_of(work, work.cells, row, h)]
    return rows, said


_KNOWN: dict[str, list[Limits]] = {}


def _guesses(plan: LiftPlan) -> list[Limits]:
    """The same for all plans of a process."""
    if not _KNOWN:
        _KNOWN[""] = predicted(plan)
    return _KNOWN[""]


NEAR = 1.5
"""Runs within this factor of a limit tell it: a share need not follow one normal law over all heights."""


def reference(said: Sequence[tuple[float, bool]], p: float) -> tuple[float, float]:
    """Height that a share p of runs passes, and the standard deviation of its ln, by all runs together: a probit of
    the height alone, which knows nothing of their waves, through all of them and then through those near it. NaN where
    fewer than ten runs said yes, or no."""
    H, sd = _probit(said, p)
    for _ in range(3):
        H, sd = _probit([(h, b) for h, b in said if H / NEAR <= h <= H * NEAR], p)
    return H, sd


def _probit(said: Sequence[tuple[float, bool]], p: float) -> tuple[float, float]:
    h, b = np.log([x for x, _ in said]), np.array([x for _, x in said], dtype=bool)
    if min(b.sum(), (~b).sum()) < 10:
        return math.nan, math.nan
    sign = np.where(b, 1.0, -1.0)

    def loss(c: np.ndarray) -> float:
        return -float(log_ndtr(sign * (h - c[0]) * math.exp(-c[1])).sum())

    fit = minimize(loss, np.array([float(np.mean(h)), math.log(0.2)]), method="BFGS")
    z, s = float(ndtri(p)), math.exp(fit.x[1])
    slope = np.array([1.0, z * s])
    step = 1e-3 * np.eye(2)
    bend = np.array(
        [
            [
                sum(i * j * loss(fit.x + i * step[a] + j * step[c]) for i in (1.0, -1.0) for j in (1.0, -1.0)) / 4e-6
                for a in (0, 1)
            ]
            for c in (0, 1)
        ]
    )
    return math.exp(fit.x[0] + z * s), float(np.sqrt(slope @ np.linalg.solve(bend, slope)))


def coverage() -> None:
    """How many of the plans hold the limit by all runs; what is known so far is kept after every tenth plan."""
    plans = []
    with ProcessPoolExecutor() as pool:
        for plan in pool.map(one_plan, range(1, PLANS + 1)):
            plans.append(plan)
            if len(plans) % 10 == 0:
                store.write_parts(STORE, {"coverage": covered(plans)})
                print(f"{len(plans)} plans", flush=True)


def covered(plans: Sequence[tuple[list[Row], dict[Any, list[tuple[float, bool]]]]]) -> dict[str, Any]:
    """Each limit by all runs of plans, and how many of these hold it."""
    said: dict[Any, list[tuple[float, bool]]] = {}
    for _, each in plans:
        for place, of in each.items():
            said.setdefault(place, []).extend(of)
    allowed = {row.place: row.allowed for rows, _ in plans for row in rows}
    rows = []
    for place, runs in said.items():
        H, sd = reference(runs, allowed[place])
        of = [row for each, _ in plans for row in each if row.place == place]
        told = [row for row in of if row.high < math.inf and row.Hs > 0.0]
        rows.append(
            {
                **dict(zip(("phase", "alternative", "rule", "Tp", "beta"), place, strict=True)),
                "H": H if math.isfinite(H) else None,
                "sd": sd if math.isfinite(sd) else None,
                "runs": len(runs),
                "plans": len(of),
                "told": len(told),
                "held": sum(row.low <= H <= row.high for row in told),
                "low_too_high": sum(row.low > H for row in of),
                "off": [round(math.log(row.Hs / H), 4) for row in told] if math.isfinite(H) else [],
            }
        )
    return {"plans": len(plans), "rows": rows, "runs": sum(len(x) for x in said.values())}


PARTS = ("fresh", "coverage", "passage")


def main(parts: Sequence[str] = PARTS) -> None:
    """The named trials. Results of others stay as they are."""

    if "fresh" in parts:
        store.write_parts(STORE, {"fresh": {"runs": FRESH, "rows": [row for lift in LIFTS for row in fresh(lift)]}})
    if "passage" in parts:
        store.write_parts(STORE, {"passage": {"runs": PASSAGES, "rows": passage()}})
    if "coverage" in parts:
        coverage()


if __name__ == "__main__":
    main(sys.argv[1:] or PARTS)
