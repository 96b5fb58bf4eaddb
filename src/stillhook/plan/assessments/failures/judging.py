"""What runs with a failure use of the limits of the lift, and from which height of the waves on it is more than all."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.plan.assessments.failures.runs import BY_KEY, HOIST, HOLD, FailureRuns, Numbers, Request
from stillhook.plan.definition.capacities import calm
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Limited
from stillhook.plan.limits import limited, utilisation
from stillhook.plan.tiers.time_domain.lowering import BLOCK
from stillhook.plan.tiers.time_domain.measures import least_at_rest
from stillhook.spec.lift.phase import APART, Phase, PhaseKind
from stillhook.statistics.extremes import gumbel

LOADS = ("F_top_max", "DAF", "sling_ratio", "snap_load")
"""Quantities of loads that a failure is held against; the same limits as without it."""
TOUCH_DOWN = "v_landed"
JUDGED = (*LOADS, TOUCH_DOWN)
FAILED_RUN = "run-failed"
"""In place of a rule: a run lost its numbers, or never came to the failure."""
ROUND = 0.05
"""Heights from which a limit is passed are rounded down to a multiple of this [m]."""
HALF_HOUR = 1800.0
"""Time for which a payload that is stopped in the wave zone is assessed [s] (DNV-RP-N103, recalled)."""


class Used(NamedTuple):
    """The most that a sea uses of a rule's limit [-], the value [SI] and the limit at its height, and the run (from 0)
    that is the worst."""

    rule: str
    used: float
    value: float
    limit: float
    run: int


def rules_of_failure(plan: LiftPlan, phase: Phase) -> tuple[Limited, ...]:
    """Rules that a failure in a phase is held against: those of loads and of touch-down, of a winch on its brake."""
    return tuple(each for each in limited(plan, phase, Alternative.NONE) if each.rule.quantity in JUDGED)


def quantities(plan: LiftPlan, each: Request, numbers: Numbers) -> dict[str, FloatArray]:
    """Quantity -> its value of every run (n,). A load that landed has slack slings as it should. Touch-down is that of
    the runs where the winch stands afterwards; where it goes on, wrongly, the largest downward speed of a load that
    hangs counts as well: it may land at any moment. At a deck it is the fastest of all touches. What waves take of the
    sling tension of the high weight case is taken of that of the low one."""
    phase = plan.phase(each.phase)
    result = {"F_top_max": numbers["F_w_max"], "DAF": numbers["DAF"]}
    landed = np.isfinite(numbers["v_landed"])
    if phase.kind is PhaseKind.LANDING:
        goes_on = each.failure in BY_KEY and not BY_KEY[each.failure].stands
        v = np.nan_to_num(numbers["v_landed"])
        result[TOUCH_DOWN] = np.fmax(v, -numbers["v_load_min"]) if goes_on else v
    if phase.kind in APART:
        result[TOUCH_DOWN] = np.nan_to_num(numbers["v_hit_max"])
    rest, low = least_at_rest(plan, phase), least_at_rest(plan.low or plan, phase)
    result["sling_ratio"] = np.where(landed, 1.0, 1.0 - (rest - numbers["F_sling_min"]) / low)
    result["snap_load"] = np.where(landed, 0.0, numbers["snap"])
    return result


def used(plan: LiftPlan, each: Request, numbers: Numbers) -> list[Used]:
    """What a sea uses of every rule: of the worst moment of a failure; of a payload that is held, or hoisted, the level
    that the rule asks for."""
    phase = plan.phase(each.phase)
    if not np.isfinite(numbers["duration"]).all():
        return [Used(FAILED_RUN, math.inf, math.nan, math.nan, int(np.argmin(np.isfinite(numbers["duration"]))))]
    values = quantities(plan, each, numbers)
    Hs = float(plan.environment.H_m0(np.array([each.sea.Hs]))[0])
    result = []
    for rule in rules_of_failure(plan, phase):
        x = values.get(rule.rule.quantity)
        if x is None:
            continue
        parts = utilisation(rule, x, Hs)
        worst = int(np.argmax(parts))
        value, part = float(x[worst]), float(parts[worst])
        if each.failure in (HOLD, HOIST):
            value = _level(plan, each, rule, x)
            part = float(utilisation(rule, np.array([value]), Hs)[0])
        result.append(Used(rule.rule.key, part, value, float(rule.at(np.array(Hs))), worst))
    return result


def _level(plan: LiftPlan, each: Request, rule: Limited, x: FloatArray) -> float:
    """Level of a quantity that half an hour of a hold, or one passage, stays below with the probability that the rule
    asks for; at least the worst run's."""
    falls = rule.rule.quantity == "sling_ratio"
    y = -x if falls else x
    if float(np.median(y) - y.min()) <= 1e-9 * float(np.max(np.abs(y)) or 1.0):
        return float(x[np.argmax(y)])  # most runs are alike, such as without a snap: no distribution
    q = plan.rules.level(rule.rule.quantity).quantile
    times = HALF_HOUR / BLOCK if each.failure == HOLD else 1.0
    level = max(float(gumbel(y).quantile(q ** (1.0 / times))), float(y.max()))
    return -level if falls else level


def worst(parts: Sequence[Used]) -> Used | None:
    """The one that uses the most; None where no rule is judged."""
    return max(parts, key=lambda each: each.used, default=None)


def still(plan: LiftPlan, phase: Phase, rule: str) -> float:
    """What a calm uses of a rule without a failure [-]."""
    limits = next((each for each in rules_of_failure(plan, phase) if each.rule.key == rule), None)
    value = None if limits is None else calm(plan, phase).get(limits.rule.quantity)
    return 0.0 if limits is None or value is None else max(float(utilisation(limits, np.array([value]), 0.0)[0]), 0.0)


def height_from(points: Mapping[float, float], at_rest: float) -> float:
    """Height from which more than all of a limit is used [m], rounded down, of the parts that were used at heights
    (Hs -> part); inf where the highest uses less. Between two heights, and below the lowest down to what a calm
    uses, it is straight: loads grow with the height or its square, so that a straight line crosses the limit sooner
    than the curve does."""
    heights = sorted(points)
    low_Hs, low = 0.0, at_rest
    for Hs in heights:
        if points[Hs] > 1.0:
            if low >= 1.0:
                return 0.0
            if not math.isfinite(points[Hs]):
                return rounded_down(low_Hs)
            crossing = low_Hs + (Hs - low_Hs) * (1.0 - low) / (points[Hs] - low)
            return rounded_down(crossing)
        low_Hs, low = Hs, points[Hs]
    return math.inf


def rounded_down(Hs: float) -> float:
    """A height rounded down to a multiple of `ROUND` [m]."""
    return round(math.floor(Hs / ROUND + 1e-9) * ROUND, 3)


def next_height(Hs: float, used_there: float, at_rest: float) -> float:
    """A lower height at which a failure is tried that is beyond a limit at Hs [m]: about where it may be at it."""
    share = (1.0 - at_rest) / (used_there - at_rest) if math.isfinite(used_there) else 0.5
    return max(round(Hs * min(max(share, 0.25), 0.9), 2), 0.05)


def row_of(plan: LiftPlan, runs: FailureRuns, each: Request) -> dict[str, Any]:
    """The worst of a request as plain data: rule, what it uses, peaks, least sling tension, motion, touch-down."""
    numbers = runs.runs[each]
    top = worst(used(plan, each, numbers))
    finite = np.isfinite(numbers["duration"])

    def most(name: str, of: Any = np.nanmax) -> float | None:
        x = numbers[name][finite]
        x = x[np.isfinite(x)]
        return float(of(x)) if len(x) else None

    fastest, at_deck = most("v_load_min", np.nanmin), plan.phase(each.phase).kind in APART
    return {
        "Tp": each.sea.Tp,
        "beta": each.sea.beta,
        "Hs": each.sea.Hs,
        "n_runs": len(finite),
        "rule": None if top is None else top.rule,
        "used": None if top is None else top.used,
        "value": None if top is None else top.value,
        "limit": None if top is None else top.limit,
        "F_top_max": most("F_w_max"),
        "F_sling_min": most("F_sling_min", np.nanmin),
        "slack_time": most("sling_slack_time"),
        "load_pp": most("load_pp"),
        "v_down": None if fastest is None else -fastest,
        **({"at_deck": True} if at_deck else {}),
        "v_landed": most("v_hit_max" if at_deck else "v_landed"),
        "n_landed": int(np.isfinite(numbers["v_landed"]).sum()),
        "z_min": most("z_load_min", np.nanmin),
    }
