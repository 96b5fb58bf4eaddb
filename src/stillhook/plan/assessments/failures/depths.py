"""What a winch on its brake means at every depth: limiting heights of the waves by the frequency-domain method, which
depths must not be stopped in, and what to do where AHC is lost."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.plan.assessments.failures.judging import HALF_HOUR, LOADS, TOUCH_DOWN, rules_of_failure
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Demand, Seas, Tier
from stillhook.plan.limits import limits_of
from stillhook.plan.tiers.frequency import Part, forcing_at, of_load, quantiles
from stillhook.plan.tiers.situations import Situation, situations
from stillhook.plan.tiers.winch_residual import BRAKE
from stillhook.response.frequency_domain import sigmas
from stillhook.spec.lift.phase import OFF_DECK, ON_DECK, Phase, PhaseKind
from stillhook.statistics.extremes import largest_of_parts, speed_at_crossing, zero_crossing_period

IN_WATER = (PhaseKind.LOWERING, PhaseKind.DEEP, PhaseKind.STAND_OFF, PhaseKind.LANDING)
"""Phases in which the payload is covered, and hangs free."""
CREST = 2.0
"""Height of a usual crest of the tip over the standard deviation of its motion [-]: half of the significant height."""
ALIKE = 1.0
"""Way within which two heights of different phases are one [m]."""


class Braked(NamedTuple):
    """The payload on a winch that stands on its brake for half an hour at one height: phase, z [m], natural period on
    the wire [s]; Hs rule -> limiting heights (c,) [m] over the columns of the table, inf above the highest sea; fall:
    how far the payload moves down from where it hangs in the sea of each column that is asked for, (c,) [m], NaN but
    over the seabed. Touch-down is that of a load that is lowered on without compensation."""

    phase: str
    z: float
    T_0: float
    Hs: Mapping[str, FloatArray]
    fall: FloatArray

    def least(self, rules: Sequence[str]) -> FloatArray:
        """Least height of some rules in every column (c,) [m]."""
        rows = [np.where(np.isnan(self.Hs[key]), np.inf, self.Hs[key]) for key in rules if key in self.Hs]
        return np.asarray(np.min(rows, axis=0)) if rows else np.full(len(self.fall), np.inf)


def braked(plan: LiftPlan, heights: FloatArray) -> list[Braked]:
    """The payload on the brake along all phases in which it is covered. heights (c,) of the sea in every column [m] in
    which its motion is asked for."""
    seas = plan.environment.table()
    columns = seas.columns
    at = Seas(heights, *(np.array([column[i] for column in columns], dtype=np.float64) for i in (0, 1)))
    result: list[Braked] = []
    for phase in plan.phases:
        if phase.kind not in IN_WATER:
            continue
        lands = landing_after(plan, phase)
        for place in situations(plan, phase):
            if lands is None and any(abs(place.z - each.z) < ALIKE for each in result):
                continue
            result.append(_at(plan, phase, lands, replace(place, time=HALF_HOUR), seas, at))
    return result


def with_low_weight(plan: LiftPlan, high: Sequence[Braked], heights: FloatArray) -> list[Braked]:
    """The same with the low weight case, where there is one: of slack slings and of touch-down the lower height of
    both, and the longer way down; each at the low case's next height, as resonances differ."""
    if plan.low is None:
        return list(high)
    judged = {each.rule.key for p in plan.phases for each in rules_of_failure(plan, p) if each.rule.quantity in BY_LOW}
    result, lows = [], braked(plan.low, heights)
    for each in high:
        low = min((x for x in lows if x.phase == each.phase), key=lambda x: abs(x.z - each.z), default=each)
        Hs = {key: np.fmin(x, low.Hs[key]) if key in judged and key in low.Hs else x for key, x in each.Hs.items()}
        result.append(each._replace(Hs=Hs, fall=np.fmax(each.fall, low.fall)))
    return result


BY_LOW = ("sling_ratio", TOUCH_DOWN)
"""Quantities that may be worse with the low weight case."""


def landing_after(plan: LiftPlan, phase: Phase) -> Phase | None:
    """The landing that a phase over the seabed is of; None for other phases."""
    if phase.kind is PhaseKind.LANDING:
        return phase
    if phase.kind is not PhaseKind.STAND_OFF:
        return None
    later = plan.phases[plan.phases.index(phase) :]
    return next((each for each in later if each.kind is PhaseKind.LANDING), None)


def _at(plan: LiftPlan, phase: Phase, lands: Phase | None, place: Situation, seas: Seas, at: Seas) -> Braked:
    part = _part(plan, place, seas)
    values: dict[str, FloatArray] = dict(of_load([part], quantiles(plan)))
    rules = [each for each in rules_of_failure(plan, phase) if each.rule.quantity in LOADS]
    if lands is not None:
        v = lands.speed or 0.0
        lowered = _part(plan, replace(place, load=replace(place.load, V=v)), seas)
        values[TOUCH_DOWN] = speed_at_crossing(v, lowered.s.load_rate, quantiles(plan)(TOUCH_DOWN))
        rules += [each for each in rules_of_failure(plan, lands) if each.rule.quantity == TOUCH_DOWN]
    demand = Demand(phase.name, Alternative.NONE, Tier.FREQUENCY, seas, values)
    limits = limits_of(demand, rules)
    fall = np.full(len(at), np.nan) if lands is None else _fall(_part(plan, place, at), quantiles(plan)("load_pp"))
    known = {key: Hs for key, Hs in limits.Hs.items() if np.isfinite(values_of(values, rules, key)).any()}
    return Braked(phase.name, place.z, place.T_0, known, np.where(at.Hs > 0.0, fall, 0.0))


def _fall(part: Part, quantile: float) -> FloatArray:
    """How far the payload moves down in half an hour from where it hung as the brake closed [m]: with the wire that was
    out for a crest of the tip, `CREST` of its standard deviation, it hangs so much lower from then on."""
    T = zero_crossing_period(part.s.load, part.s.load_rate)
    cycles = HALF_HOUR / np.where(np.isnan(T), np.inf, T)
    return CREST * part.forcing.deviation() + largest_of_parts(0.0, part.s.load[None], cycles[None], quantile)


def values_of(values: Mapping[str, FloatArray], rules: Sequence[Any], key: str) -> FloatArray:
    """Values of the quantity that a rule limits; NaN where the method has none."""
    quantity = next(each.rule.quantity for each in rules if each.rule.key == key)
    return values.get(quantity, np.full(1, np.nan))


def _part(plan: LiftPlan, place: Situation, seas: Seas) -> Part:
    forcing = forcing_at(plan, seas, place.x, place.y)
    return Part(place.load, place.time, 0.0, forcing, sigmas(forcing, place.load, BRAKE))


def speeds(plan: LiftPlan) -> list[tuple[float, float, float]]:
    """Ways over the side of the phases that move: upper and lower end of each [m] and its wire speed [m/s]."""
    ways = [(p.z_start, p.z_end, p.speed) for p in plan.phases if p.speed and p.kind not in (*OFF_DECK, *ON_DECK)]
    return [
        (max(z_0, z_1), min(z_0, z_1), v) for z_0, z_1, v in ways if z_0 is not None and z_1 is not None and z_0 != z_1
    ]


def time_between(plan: LiftPlan, z_0: float, z_1: float) -> float:
    """Time that the payload takes from one height to another [s], everywhere at the least speed of the phases that pass
    it; where none does at the least of all; inf where nothing moves."""
    top, bottom = max(z_0, z_1), min(z_0, z_1)
    ways = speeds(plan)
    if not ways:
        return math.inf
    slowest = min(v for _, _, v in ways)
    ends = sorted({top, bottom, *(z for upper, lower, _ in ways for z in (upper, lower) if bottom < z < top)})
    return sum(
        (b - a) / min((v for upper, lower, v in ways if lower < 0.5 * (a + b) < upper), default=slowest)
        for a, b in pairwise(ends)
    )
