"""From the numbers of runs to the quantities that rules ask of a phase: which number of which stage, at which level,
for how long.

From runs with different seeds to a number of the phase that they are of, with the interval that so few of them leave
open.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.programme import payload_weight
from stillhook.plan.definition.capacities import places
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.phases import Phase, PhaseKind
from stillhook.plan.definition.rules import Alternative, Level
from stillhook.plan.tiers.time_domain.lowering import Course, Winch
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
    the square of the speed, and a Gumbel fit to the bulk tells a 90 % level 7 to 13 % low (480 passages of the
    example). So it is the runs' own quantile, at rank q (n + 1), with the order statistics between which the true one
    lies with 95 %; inf above where even the largest run may lie below it (fewer than 36 runs at 90 %). Where no run
    lies beyond the level, the larger of the largest run and the Gumbel distribution.
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
    """Quantities of `stillhook.plan.definition.rules` that the twin tells of a phase in one sea, from the runs of that
    sea, each with its interval.

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
    level, left = plan.rules.level, winch.left
    compensates = phase.compensated
    stick = max(abs(stage.lower) for stage in course.programme)

    def top(name: str, quantity: str) -> Estimate:
        return _extreme(phase)(runs[name], level(quantity), course.swings if quantity in OF_LOAD else course.times)

    times = {f"{key}_share": f"{key}_time" for key in ("saturation", "relief", "power", "stroke")}
    tip, v_tip = top("s_tip_pp", "s_tip_pp").scaled(1.0 / left), top("v_tip_max", "v_tip_max").scaled(1.0 / left)
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

    Slings pull or hang: a least tension below nothing, as the distribution of larger ones may tell, is nothing.
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
