"""Quantities that rules ask of a phase as measures of its runs: which number of which run, at which level, for how
long."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.programme import payload_weight
from stillhook.plan.definition.capacities import places
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.tiers.time_domain.cells import PEAKS, ROD_AT_END, Runs
from stillhook.plan.tiers.time_domain.lowering import Course, Winch
from stillhook.spec.lift.phase import APART, OFF_DECK, Phase, PhaseKind
from stillhook.statistics.extremes import MPM

AT_DECK = ("F_top_max", "DAF", "v_landed", "v_second_hit_max")
"""Quantities that runs at a deck determine."""


class Statistic(Enum):
    """What a measure is of the runs: the level that the largest of a phase stays below, the mean, or the chance that a
    phase reaches the end of what there is."""

    LARGEST = "largest"
    MEAN = "mean"
    CHANCE = "chance"


@dataclass(frozen=True)
class Measure:
    """A quantity as offset + factor times a statistic of x, a number of every run.

    x: name of that number; statistic, at the quantile q of a phase of `times` runs of `length` [s]; factor, offset in
    the unit of the quantity; end: largest x that there is (slack slings are without tension, and no more than that);
    falls: x is `end` less the number.
    """

    x: str
    statistic: Statistic = Statistic.LARGEST
    q: float = MPM
    times: float = 1.0
    length: float = math.inf
    factor: float = 1.0
    offset: float = 0.0
    end: float = math.inf
    falls: bool = False

    def of_part(self, length: float = math.inf) -> float:
        """Quantile of a part of a run [s] that is the phase's: parts are independent."""
        share = 1.0 if length >= self.length else length / self.length
        return float(self.q ** (share / max(self.times, 1.0)))

    def values(self, runs: Runs) -> FloatArray:
        """x of every run (n,); inf of one that failed."""
        return self._of(np.asarray(runs[self.x], dtype=np.float64), runs["duration"])

    def peaks(self, runs: Runs) -> FloatArray | None:
        """x of every interval of every run (n, k), in the order of time; None where the phase is not stationary."""
        peaks = runs.get(PEAKS + self.x)
        return None if peaks is None else self._of(peaks, runs["duration"][:, None])

    def _of(self, x: FloatArray, duration: FloatArray) -> FloatArray:
        if self.falls:
            x = self.end - x
        if self.statistic is Statistic.MEAN:
            x = x / duration
        return np.where(np.isfinite(duration) & np.isfinite(x), x, np.inf)

    def to_x(self, limit: float) -> float:
        """x at which the quantity is a limit."""
        return (limit - self.offset) / self.factor

    def of_x(self, x: FloatArray) -> FloatArray:
        """The quantity of x (n,)."""
        return self.offset + self.factor * np.minimum(x, self.end)


def measures(
    plan: LiftPlan, phase: Phase, alternative: Alternative, winch: Winch, course: Course
) -> dict[str, Measure]:
    """Quantity -> its measure, of the quantities of `stillhook.plan.definition.rules` that runs of a phase determine.

    Largest values are those of the phase's duration at the level that the rules require: of what hangs about the worst
    height of a way, of tip and winch at every height alike. Shares of time are means. A speed of touch-down is of one
    passage. An alternative without a winch of its own has no numbers of the winch.
    """
    compensates, stick = phase.compensated, max(abs(each.speed or 0.0) for each in course.programme)

    def top(x: str, quantity: str, times: float = course.times, factor: float = 1.0, offset: float = 0.0) -> Measure:
        q = plan.rules.level(quantity).quantile
        return Measure(x, q=q, times=times, length=course.counted, factor=factor, offset=offset)

    whole = 1.0 / winch.left
    result = {"F_top_max": top("F_w_max", "F_top_max", course.swings), "DAF": top("DAF", "DAF", course.swings)}
    if phase.kind in APART:
        hit = "v_again" if phase.kind in OFF_DECK else "v_hit"
        return result | {name: top(hit, name) for name in AT_DECK if name not in result}
    result |= {
        "load_pp": top("load_pp", "load_pp", course.swings),
        "s_tip_pp": top("s_tip_pp", "s_tip_pp", factor=whole),
        "v_tip_max": top("v_tip_max", "v_tip_max", factor=whole),
    }
    if phase.kind is PhaseKind.LANDING:
        result["v_landed"] = top("v_landed", "v_landed", 1.0)
    else:
        result |= _slings(plan, phase, course)
    if not compensates:
        result["v_w_demand"] = top("v_w_max", "v_w_demand")
    elif not alternative.stands:
        result["v_w_demand"] = top("v_tip_max", "v_w_demand", factor=whole, offset=stick)
    if compensates:
        result["e_c_pp"] = top("e_c_pp" if alternative.twin else "s_tip_pp", "e_c_pp")
    if alternative.twin or not compensates:
        result["p_a_max"] = top("p_a_max", "p_a_max")
        for share in ("saturation", "oscillation", "relief", "power", "stroke"):
            result[f"{share}_share"] = Measure(f"{share}_time", Statistic.MEAN)
    if alternative is Alternative.PHC:
        result["compensator_share"] = Measure(ROD_AT_END, Statistic.MEAN)
    return result


def _slings(plan: LiftPlan, phase: Phase, course: Course) -> dict[str, Measure]:
    """Least sling tension over the least at rest, the chance of slack, and the snap when they come taut."""
    rest, level = least_at_rest(plan, phase), plan.rules.level
    lost = Measure(
        "F_sling_min",
        q=level("sling_ratio").quantile,
        times=course.swings,
        length=course.counted,
        factor=-1.0 / rest,
        offset=1.0,
        end=rest,
        falls=True,
    )
    chance = Measure("F_sling_min", Statistic.CHANCE, times=course.swings, length=course.counted, end=rest, falls=True)
    snap = Measure("snap", q=level("snap_load").quantile, times=course.swings, length=course.counted)
    return {"sling_ratio": lost, "slack_chance": chance, "snap_load": snap}


def least_at_rest(plan: LiftPlan, phase: Phase) -> float:
    """Least sling tension at rest on a phase's way [N]."""
    return min(payload_weight(plan.hanging(z), z) for z in places(phase))
