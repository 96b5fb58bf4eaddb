"""Cells of the twin's tier: runs of a phase in one sea under one way of running the winch, requested together and
stored by their inputs.

From the numbers of runs to the quantities that rules ask of a phase: which number of which stage, at which level,
for how long.

From runs with different seeds to a number of the phase that they are of, with the interval that so few of them leave
open.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.engine.lowering.problem import Case
from stillhook.engine.pack.programme import payload_weight
from stillhook.engine.simulate import simulate
from stillhook.kernels.lanes import VL
from stillhook.plan.definition.capacities import places
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.phases import Phase, PhaseKind
from stillhook.plan.definition.rules import Alternative, Level, Seas
from stillhook.plan.result import grouped
from stillhook.plan.tiers.frequency import forcing_at, situations
from stillhook.plan.tiers.time_domain.lowering import (
    Course,
    SeaState,
    Winch,
    course_of,
    in_sea,
    lowering_of,
    machine_of,
)
from stillhook.plan.tiers.winch_residual import BRAKE
from stillhook.response.frequency_domain import sigmas
from stillhook.sea.vessel.tip import TipPoint
from stillhook.spec.crane import Crane
from stillhook.statistics.estimate import ENDS, Estimate
from stillhook.statistics.extremes import FEWEST_MAXIMA, MPM, P90, gumbel

if TYPE_CHECKING:
    import xarray


QUANTILE = {Level.MPM: MPM, Level.P90: P90}
"""Part of all phases that stay below a level."""
ALIKE = 1e-6
"""Range of maxima over their size below which they are one value: a relief valve that held all of them."""

BEYOND = Estimate(math.inf, math.inf, math.inf)
"""What stands for a number of runs that failed."""


def largest(maxima: FloatArray, level: Level, times: float = 1.0) -> Estimate:
    r"""Largest value of a phase that holds `times` such runs, from the largest of each run (n,): Gumbel of maximum
    likelihood.

    .. math:: P(X_{phase} \le x) = P(X_{run} \le x)^{times}, \qquad x_q = \mu - \beta \ln(-\ln q^{1/times}) = \ldots +
    \beta \ln times

    so that the most probable largest of the phase is mu + beta ln(times). The runs are taken as independent, which they
    are. Where all maxima are one value that value; of fewer than five the largest, without an interval.
    """
    x = np.asarray(maxima, dtype=np.float64)
    if np.isinf(x).any():
        return BEYOND
    top = float(x.max())
    if len(x) < FEWEST_MAXIMA:
        return Estimate(top, n=len(x))
    if np.ptp(x) <= ALIKE * np.abs(x).max():
        return Estimate(top, top, top, len(x))
    q = QUANTILE[level] ** (1.0 / max(times, 1.0))
    return gumbel(x).estimate(q)


def passage(maxima: FloatArray, level: Level, times: float = 1.0) -> Estimate:
    """Largest value of something that passes once, a surface or a touch-down, or `times` times, from the largest of
    each run (n,).

    What happens in a few seconds follows no extreme-value law: which wave meets the payload scatters, slam grows with
    the square of the speed, and a Gumbel fit to the bulk gives a 90 % level 7 to 13 % low (480 passages of the
    example). So it is the runs' own quantile, at rank q (n + 1), with the order statistics between which the true one
    is with 95 %; inf above where even the largest run may be below it (fewer than 36 runs at 90 %). Where no run
    exceeds the level, the larger of the largest run and the Gumbel distribution.
    """
    x = np.sort(np.asarray(maxima, dtype=np.float64))
    n, q = len(x), QUANTILE[level] ** (1.0 / max(times, 1.0))
    if np.isinf(x).any() or n < FEWEST_MAXIMA or np.ptp(x) <= ALIKE * np.abs(x).max():
        return largest(x, level, times)
    if q * (n + 1) > n:
        fit = largest(x, level, times)
        return Estimate(max(fit.value, float(x[-1])), fit.low, max(fit.high, float(x[-1])), n)
    below = np.cumsum([math.comb(n, k) * q**k * (1.0 - q) ** (n - k) for k in range(n)])
    first, last = int(np.searchsorted(below, ENDS[0], side="right")), int(np.searchsorted(below, ENDS[1]))
    low, high = float(x[max(first - 1, 0)]), float(x[last]) if last < n else math.inf
    return Estimate(float(np.quantile(x, q, method="weibull")), low, high, n)


def mean(values: FloatArray) -> Estimate:
    """The mean over runs (n,), with the normal interval of a mean."""
    return Estimate.of_mean(np.asarray(values, dtype=np.float64))


def chance(hits: int, n: int, times: float = 1.0) -> Estimate:
    """Chance that a phase of `times` runs sees what `hits` of n runs saw; Wilson's interval."""
    share = Estimate.of_share(hits, n)
    value, low, high = (1.0 - (1.0 - x) ** max(times, 1.0) for x in (share.value, share.low, share.high))
    return Estimate(value, low, high, n)


Runs = Mapping[str, FloatArray]
"""Name of `OF_STAGE`, or v_landed -> that number of every run (n,)."""

OF_STAGE = (
    "duration",
    "s_tip_pp",
    "e_c_pp",
    "load_pp",
    "F_w_max",
    "DAF",
    "F_sling_min",
    "sling_slack_time",
    "snap",
    "v_tip_max",
    "v_w_max",
    "p_a_max",
    "saturation_time",
    "relief_time",
    "power_time",
    "stroke_time",
)
"""Numbers that are kept of the stage that counts, where the winch type has them; in addition `v_landed` of the whole
run, the speed of the first touch: it may come before its stage is over."""
FAILED_MOST = 0.1
"""Chance of a failed run in a phase from which a cell is beyond every limit: as many phases as the level of 90 %
leaves. One of 20 runs may fail in a phase that holds one run, none in a phase that holds two or more."""
OF_LOAD = ("F_top_max", "DAF", "load_pp", "sling_ratio", "slack_chance", "snap_load")
"""Quantities of what hangs: largest about the worst height of a way. All others are those of tip and winch, at every
height alike."""
WINCH = ("p_a_max", "saturation_share", "relief_share", "power_share", "stroke_share", "v_w_demand")
"""Quantities of the winch while it compensates: none and the flat cap have none of the twin's."""


def run_numbers(data: xarray.Dataset, counts: Sequence[int]) -> dict[str, FloatArray]:
    """Numbers of every run of a Dataset of lowerings over "case"; counts: number of the stage that counts in each."""
    each = np.arange(len(counts)), np.array(counts)
    numbers = {name: data[f"stage_{name}"].values[each] for name in OF_STAGE if f"stage_{name}" in data}
    return numbers | {"v_landed": data["v_landed"].values}


def quantities(
    plan: LiftPlan, phase: Phase, alternative: Alternative, winch: Winch, course: Course, runs: Runs
) -> dict[str, Estimate]:
    """Quantities of `stillhook.plan.definition.rules` that the twin determines for a phase in one sea, from the runs of
    that sea, each with its interval.

    Largest values are those of the phase's duration at the level that the rules ask for; shares of time are means. What
    counts is the stage after everything settled. A phase of which too many runs fail is beyond every limit.
    """
    landing = phase.kind is PhaseKind.LANDING
    sound = np.isfinite(runs["duration"]) & (np.isfinite(runs["v_landed"]) if landing else True)
    n = len(sound)
    estimates = (
        _estimates(plan, phase, alternative, winch, course, {name: values[sound] for name, values in runs.items()})
        if sound.any()
        else {}
    )
    failed = 1.0 - (float(sound.sum()) / n) ** course.times
    if failed < FAILED_MOST - 1e-9:
        return estimates
    names = estimates or {rule.quantity: BEYOND for rule in plan.rules.of(phase.kind).values()}
    return {name: Estimate(0.0, 0.0, 0.0) if name == "sling_ratio" else BEYOND for name in names}


def _estimates(
    plan: LiftPlan, phase: Phase, alternative: Alternative, winch: Winch, course: Course, runs: Runs
) -> dict[str, Estimate]:
    level, residual = plan.rules.level, winch.left
    compensates = phase.compensated
    stick = max(abs(stage.lower) for stage in course.programme)

    def top(name: str, quantity: str) -> Estimate:
        return _extreme(phase)(runs[name], level(quantity), course.swings if quantity in OF_LOAD else course.times)

    times = {f"{key}_share": f"{key}_time" for key in ("saturation", "relief", "power", "stroke")}
    tip, v_tip = (
        top("s_tip_pp", "s_tip_pp").scaled(1.0 / residual),
        top("v_tip_max", "v_tip_max").scaled(1.0 / residual),
    )
    estimates = {
        "F_top_max": top("F_w_max", "F_top_max"),
        "DAF": top("DAF", "DAF"),
        "s_tip_pp": tip,
        "v_tip_max": v_tip,
        "load_pp": top("load_pp", "load_pp"),
        **({"p_a_max": top("p_a_max", "p_a_max")} if "p_a_max" in runs else {}),
        "v_w_demand": v_tip.scaled(1.0, stick) if compensates else top("v_w_max", "v_w_demand"),
    }
    estimates |= {share: mean(runs[time] / runs["duration"]) for share, time in times.items() if time in runs}
    if phase.kind is PhaseKind.LANDING:
        estimates["v_landed"] = passage(runs["v_landed"], level("v_landed"))
    else:
        estimates |= _slings(plan, phase, course, runs)
    if compensates:
        estimates["e_c_pp"] = top("e_c_pp", "e_c_pp") if alternative.twin else top("s_tip_pp", "e_c_pp")
        if not alternative.twin:
            estimates = {name: value for name, value in estimates.items() if name not in WINCH}
        if alternative is Alternative.CAP:
            estimates["v_w_demand"] = v_tip.scaled(1.0, stick)
    return estimates


def _extreme(phase: Phase) -> Callable[[FloatArray, Level, float], Estimate]:
    """How largest values of a phase follow from those of its runs: by passages through the surface, else by a time of
    swinging."""
    return passage if phase.kind is PhaseKind.SPLASH else largest


def _slings(plan: LiftPlan, phase: Phase, course: Course, runs: Runs) -> dict[str, Estimate]:
    """Least tension of the slings over the least at rest, the chance that they fall slack, and the snap when they come
    taut.

    Slings pull or hang: a least tension below nothing, as the fitted distribution may give, is set to nothing.
    """
    rest, level = least_at_rest(plan, phase), plan.rules.level
    fallen = _extreme(phase)(rest - runs["F_sling_min"], level("sling_ratio"), course.swings).scaled(-1.0 / rest, 1.0)
    value, low, high = (x if math.isnan(x) else max(x, 0.0) for x in (fallen.value, fallen.low, fallen.high))
    slack = runs["sling_slack_time"] > 0.0
    return {
        "sling_ratio": Estimate(value, low, high, fallen.n),
        "slack_chance": chance(int(slack.sum()), len(slack), course.swings),
        "snap_load": (
            _extreme(phase)(runs["snap"], level("snap_load"), course.swings) if slack.any() else Estimate(0.0, 0.0, 0.0)
        ),
    }


def least_at_rest(plan: LiftPlan, phase: Phase) -> float:
    """Least sling tension at rest on a phase's way [N]."""
    return min(payload_weight(plan.hanging(z), z) for z in places(phase))


REACH = 150.0
"""Depth down to which waves may be felt, for guessing which runs share a block [m]."""
ABOUT_WORST = 0.9
"""Part of the swing of the sling tension at the worst height from which a height counts as one like it."""


class CellRequest(NamedTuple):
    """A cell that is wanted, with so many seeds (1, 2, ...); a calm with one run."""

    phase: str
    winch: Winch
    spot: SeaState
    seeds: int

    @property
    def cell(self) -> tuple[str, Winch, SeaState]:
        """What it is kept by."""
        return self.phase, self.winch, self.spot


@dataclass(frozen=True)
class Execution:
    """How runs are shared out: folder of the store, client of a cluster, threads."""

    store: Any = None
    client: Any = None
    threads: int = 2


@dataclass(eq=False)
class Cells:
    """All runs of a plan so far. runs: (phase, winch, sea) -> numbers of
    `stillhook.plan.tiers.time_domain.cells.Runs` of every seed (n,); n_runs, and seconds of them, that were
    requested (from the store or not)."""

    plan: LiftPlan
    execution: Execution
    runs: dict[tuple[str, Winch, SeaState], dict[str, FloatArray]] = field(default_factory=dict)
    n_runs: int = 0
    n_failed: int = 0
    seconds: float = 0.0
    _heights: dict[tuple[str, Winch, float, float], set[float]] = field(default_factory=dict)
    _still: dict[tuple[Winch, Course, TipPoint], dict[str, FloatArray]] = field(default_factory=dict)

    def course(self, phase: Phase, winch: Winch, spot: SeaState) -> Course:
        """What is run of a phase in the seas of a column: about its worst height where it is a long way."""
        worst = self.plan.once(worst_heights, phase) if phase.kind is PhaseKind.LOWERING else {}
        return self.plan.once(course_of, phase, winch, *worst.get((spot.Tp, spot.beta), (None, None)))

    def request(self, wanted: Sequence[CellRequest], progress: Progress | None = None) -> None:
        """Run what is wanted and not there yet, all of it together."""
        missing = {request.cell: request for request in wanted if request.seeds > len(self._durations(request))}
        calms = {
            request.cell: (request.winch, self._course_of(request), self.plan.tip_of(self.plan.phase(request.phase)))
            for request in missing.values()
            if request.spot.Hs <= 0.0
        }
        first = {still: cell for cell, still in reversed(calms.items()) if still not in self._still}
        missing = {
            cell: request for cell, request in missing.items() if cell not in calms or first.get(calms[cell]) == cell
        }
        self._run(self._filled(missing), progress)
        self._still |= {still: self.runs[cell] for still, cell in first.items()}
        self.runs |= {cell: self._still[still] for cell, still in calms.items()}
        for phase, winch, spot in (request.cell for request in wanted):
            self._heights.setdefault((phase, winch, spot.Tp, spot.beta), set()).add(spot.Hs)

    def _filled(
        self, missing: Mapping[tuple[str, Winch, SeaState], CellRequest]
    ) -> dict[tuple[str, Winch, SeaState], CellRequest]:
        """The same cells with some seeds more, where blocks of runs side by side would else have empty places: they
        cost nothing."""
        in_waves = [(self._course_of(request), cell) for cell, request in missing.items() if request.spot.Hs > 0.0]
        groups = grouped(
            ((course.duration, len(course.programme), course.z_top > -REACH), cell) for course, cell in in_waves
        )
        full = dict(missing)
        for group in groups.values():
            runs = sum(missing[cell].seeds - len(self._durations(missing[cell])) for cell in group)
            for k in range(-runs % VL):
                cell = group[k % len(group)]
                full[cell] = full[cell]._replace(seeds=full[cell].seeds + 1)
        return full

    def heights(self, phase: str, winch: Winch, Tp: float, beta: float) -> FloatArray:
        """Heights that were run in a column, ascending [m]."""
        return np.array(sorted(self._heights.get((phase, winch, Tp, beta), ())))

    def _run(self, missing: Mapping[tuple[str, Winch, SeaState], CellRequest], progress: Progress | None) -> None:
        """Run cells that are not there yet."""
        if not missing:
            return
        cases: list[Case] = []
        cranes: list[Crane] = []
        sizes: list[int] = []
        for request in missing.values():
            crane, made = self._cases(request)
            cases += made
            cranes += [crane] * len(made)
            sizes.append(len(made))
        data = simulate(
            cranes,
            cases,
            on_failure="mark",
            store=self.execution.store,
            client=self.execution.client,
            threads=self.execution.threads,
            progress=progress,
        )
        counts = [
            self._course_of(request).counts
            for request, size in zip(missing.values(), sizes, strict=True)
            for _ in range(size)
        ]
        numbers = run_numbers(data, counts)
        self.n_failed += int(np.sum(~np.isfinite(numbers["duration"])))
        start = 0
        for request, size in zip(missing.values(), sizes, strict=True):
            new = {name: values[start : start + size] for name, values in numbers.items()}
            old = self.runs.get(request.cell)
            self.runs[request.cell] = (
                new if old is None else {name: np.concatenate((old[name], values)) for name, values in new.items()}
            )
            start += size

    def _course_of(self, request: CellRequest) -> Course:
        return self.course(self.plan.phase(request.phase), request.winch, request.spot)

    def _durations(self, request: CellRequest) -> FloatArray:
        runs = self.runs.get(request.cell)
        return np.zeros(0) if runs is None else runs["duration"]

    def _cases(self, request: CellRequest) -> tuple[Crane, list[Case]]:
        """Runs of a cell that are still missing."""
        phase, course = self.plan.phase(request.phase), self._course_of(request)
        crane, mode = self.plan.once(machine_of, request.winch)
        calm = self.plan.once(lowering_of, phase, course, mode)
        first = len(self._durations(request)) + 1
        self.n_runs += request.seeds - first + 1
        self.seconds += course.duration * (request.seeds - first + 1)
        if self.plan.environment.calm(request.spot.Hs):
            return crane, [calm]
        one = in_sea(self.plan, phase, request.winch, course, calm, request.spot, first)
        return crane, [replace(one, seed=seed) for seed in range(first, request.seeds + 1)]


def worst_heights(plan: LiftPlan, phase: Phase) -> dict[tuple[float, float], tuple[float, float]]:
    """(Tp, beta) -> height of a phase's way at which the sling tension swings most with the winch on its brake [m], by
    the frequency-domain method in seas of middle height, and the time that the payload is where it swings hardly less
    [s]."""
    columns = plan.environment.table().columns()
    Tp, beta = (np.array([column[i] for column in columns]) for i in (0, 1))
    seas = Seas(np.full(len(Tp), float(np.median(plan.environment.Hs))), Tp, beta)
    parts, at = situations(plan, phase), plan.tip_of(phase)
    forcing = forcing_at(plan, seas, at.x, at.y)
    swing = np.array([sigmas(forcing, p.load, BRAKE).sling for p in parts])
    time = np.array([p.time for p in parts])
    worst = np.argmax(swing, axis=0)
    about = (time[:, None] * (swing >= ABOUT_WORST * swing.max(axis=0))).sum(axis=0)
    return {
        (float(T), float(b)): (parts[int(i)].z, float(t)) for T, b, i, t in zip(Tp, beta, worst, about, strict=True)
    }
