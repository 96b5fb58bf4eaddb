"""The frequency tier: what every phase that does not cut the surface asks, in all seas of a table, under every
alternative."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Parts, Progress
from stillhook.physics.scalar import G
from stillhook.plan.definition.capacities import CAPACITIES, jerk
from stillhook.plan.definition.lift_plan import LiftPlan, remembered
from stillhook.plan.definition.rules import Alternative, Demand, Seas, Tier
from stillhook.plan.tiers.situations import Looks, Situation, looked_at
from stillhook.plan.tiers.winch_residual import BRAKE, Way, ways
from stillhook.response.forcing import Forcing, filtered_forcing, forcing_of_seas
from stillhook.response.frequency_domain import Sigmas, compensated_sigmas, sigmas
from stillhook.response.suspended_load import SuspendedLoad, mean_drag, suspended_load
from stillhook.response.winch.linear_form import Residual
from stillhook.spec.lift.phase import Phase, PhaseKind
from stillhook.statistics.extremes import (
    largest_of_parts,
    most_probable_maximum,
    rate_below_zero,
    share_beyond,
    speed_at_crossing,
    zero_crossing_period,
)

Levels = Callable[[str], float]
"""Quantity -> probability that its largest value stays below the reported one."""

OF_TIP = ("v_tip_max", "s_tip_pp", "v_w_demand")
"""Quantities that follow from the tip alone."""
OF_ROD = "compensator_share"
"""Share of the time with the rod at an end of its stroke: known also where the rod comes there, as it says so."""
UNUSABLE = "the controller may not be used at this load and layer: not simulated"


EXPECTED = {"winch residuals": 13.0, "sea states": 5.5}
"""Parts of the method and what each took of the embedded plan [s]: for progress, in ratio to each other."""


def frequency(
    plan: LiftPlan,
    alternatives: Sequence[Alternative],
    seas: Seas,
    progress: Progress | None = None,
    *,
    threads: int = 2,
) -> list[Demand]:
    """What every phase asks in every sea under every alternative, by the frequency-domain method; phases in the surface
    are left out.

    Phases in which the winch does not follow the tip are the same under all alternatives: they share one set of
    numbers. Largest values are those of the phase's duration, part by part of its way (see above),
    at the level of the rule that asks for them; shares of time are means. Residuals of the winch are made on the twin
    where they are not on disk (`stillhook.plan.tiers.winch_residual`), those of the high weight case.
    Errors: StillhookError, one line: a lift that cannot hang, or that the twin cannot carry.
    """
    parts, high = Parts(progress, EXPECTED), plan.of_high
    winch = winches_of(high, looked_at(high), alternatives, parts("winch residuals"), threads=threads)
    parts("sea states")
    phases = looked_at(plan)
    return demands(plan, alternatives, seas, phases, forcings(high, seas, phases), winch, threads=threads)


AtTip = Mapping[tuple[float, float], Forcing]
"""Seas at the crane tip, by its place (x, y) [m]."""


def forcings(plan: LiftPlan, seas: Seas, phases: Looks) -> AtTip:
    """What the seas of a table do at the crane tip in these phases."""
    return {(s.x, s.y): forcing_at(plan, seas, s.x, s.y) for _, parts in phases for s in parts}


@remembered
def forcing_at(plan: LiftPlan, seas: Seas, x: float, y: float) -> Forcing:
    """What the seas of a table do at a crane tip x, y from the vessel's reference point [m]."""
    each = [plan.environment.sea(*(float(v) for v in row)) for row in zip(seas.Hs, seas.Tp, seas.beta, strict=True)]
    return filtered_forcing(lambda vessel: forcing_of_seas(each, vessel, x, y), plan.vessel, plan.unit)


def winches_of(
    plan: LiftPlan,
    phases: Looks,
    alternatives: Sequence[Alternative],
    progress: Progress | None = None,
    *,
    threads: int = 2,
) -> Mapping[Alternative, Way]:
    """What the winch leaves under each alternative on the way of the phases in which it follows the tip; nothing where
    there is none. Remembered as long as the plan lives."""
    follows = [(phase, parts) for phase, parts in phases if phase.compensated]
    duties = [replace(s.load.duty, sensors=plan.sensors) for _, parts in follows for s in parts]
    usable = [a for a in alternatives if any(may_be_used(plan, phase, a) for phase, _ in follows)]
    unusable = {a: Way((), (), UNUSABLE) for a in alternatives if a not in usable}
    if not duties:
        return {}
    known = plan.once(_ways, tuple(usable), tuple(duties), threads=threads, progress=progress)
    return {**unusable, **known}


def _ways(plan: LiftPlan, *of: Any, **how: Any) -> Mapping[Alternative, Way]:
    return ways(plan, *of, **how)


def may_be_used(plan: LiftPlan, phase: Phase, alternative: Alternative) -> bool:
    """Whether a controller has a steady speed at the load and layers of a phase, without which the twin is not run."""
    top = CAPACITIES["v_top"].find(plan, phase, alternative) if alternative.twin else None
    return top is None or top.value > 0.0


def demands(
    plan: LiftPlan,
    alternatives: Sequence[Alternative],
    seas: Seas,
    phases: Looks,
    forcing: AtTip,
    winch: Mapping[Alternative, Way],
    *,
    threads: int = 1,
) -> list[Demand]:
    """As `frequency`, for seas whose forcing is known; the heights and periods of `seas` are only labels here."""

    def one(phase: Phase, parts: Sequence[Situation], alternative: Alternative) -> list[Demand]:
        """A phase under one alternative; under all of them where the winch does not follow the tip, but for the one
        with a compensator in the load path."""
        if alternative is Alternative.PHC:
            return [_on_compensator(plan.under(alternative), phase, parts, forcing, seas)]
        if not phase.compensated:
            shared = _phase(plan, phase, Alternative.NONE, parts, forcing, None)
            alike = [a for a in alternatives if a is not Alternative.PHC]
            return [Demand(phase.name, a, Tier.FREQUENCY, seas, shared) for a in alike]
        if winch[alternative].known:
            values = _phase(plan, phase, alternative, parts, forcing, winch[alternative])
        else:
            values = _unusable(plan, phase, parts, forcing)
        return [Demand(phase.name, alternative, Tier.FREQUENCY, seas, values)]

    plain = [a for a in alternatives if a is not Alternative.PHC][:1]
    linked = [a for a in alternatives if a is Alternative.PHC]
    requested = [
        (phase, parts, a) for phase, parts in phases for a in (alternatives if phase.compensated else [*plain, *linked])
    ]
    if threads <= 1:
        return [demand for each in requested for demand in one(*each)]
    with ThreadPoolExecutor(threads) as pool:
        return [demand for made in pool.map(one, *zip(*requested, strict=True)) for demand in made]


def _on_compensator(plan: LiftPlan, phase: Phase, parts: Sequence[Situation], forcing: AtTip, seas: Seas) -> Demand:
    """Demand of a phase with the compensator in the load path and the winch on its brake. Loads are not
    determined in seas in which its rod comes to an end of its stroke: nothing is linear there."""
    hangs = [replace(s, load=_linked_load(plan, s.z, plan.tip_of(phase).z)) for s in parts]
    values = dict(_phase(plan, phase, Alternative.PHC, hangs, forcing, None))
    beyond = np.zeros(len(seas), dtype=np.bool_)
    shares = []
    for s in hangs:
        way = compensated_sigmas(forcing[s.x, s.y], s.load, BRAKE)[1]
        if way is not None and s.load.link is not None:
            largest = most_probable_maximum(way.stroke, zero_crossing_period(way.stroke, way.rate), s.time)
            beyond |= largest > s.load.link.room
            shares.append(s.load.link.share_at_end(way.stroke))
        else:
            shares.append(np.where(np.isnan(forcing[s.x, s.y].deviation()), np.nan, 1.0))
    values[OF_ROD] = np.asarray(np.average(shares, axis=0, weights=[s.time for s in hangs]))
    of_load = {name: np.where(beyond & ~np.isin(name, (*OF_TIP, OF_ROD)), np.nan, x) for name, x in values.items()}
    return Demand(phase.name, Alternative.PHC, Tier.FREQUENCY, seas, of_load)


@remembered
def _linked_load(plan: LiftPlan, z: float, h_tip: float | None) -> SuspendedLoad:
    return suspended_load(plan.crane, plan.hanging(z, h_tip), z)


def _unusable(plan: LiftPlan, phase: Phase, parts: Sequence[Situation], forcing: AtTip) -> Mapping[str, FloatArray]:
    """Demand of the tip on a winch whose controller may not be used: nothing of the load is determined."""
    still = Sigmas(*np.full((len(Sigmas._fields), 1), np.nan))
    responses = [Part(s.load, s.time, 0.0, forcing[s.x, s.y], still) for s in parts]
    values = _of_tip(responses, phase, quantiles(plan))
    return {name: numbers for name, numbers in values.items() if name != "v_lift_off"}


@dataclass(frozen=True, eq=False)
class Part:
    """One situation of a phase in all seas: time [s] that it stands for, V speed of the way, lowering positive [m/s],
    what moves there."""

    load: SuspendedLoad
    time: float
    V: float
    forcing: Forcing
    s: Sigmas = field(repr=False)

    def cycles(self, sigma: FloatArray, rate: FloatArray) -> FloatArray:
        """Number of cycles of a motion in the part's time; 0 of what is at rest."""
        T = zero_crossing_period(sigma, rate)
        return np.asarray(self.time / np.where(np.isnan(T), np.inf, T))

    @property
    def rise(self) -> FloatArray:
        """Mean force of the water on a payload that sinks, up positive [N]."""
        return mean_drag(self.load.B, self.V, self.s.relative, self.load.U) + self.load.C_lin * self.V


def _phase(
    plan: LiftPlan,
    phase: Phase,
    alternative: Alternative,
    parts: Sequence[Situation],
    forcing: AtTip,
    way: Way | None,
) -> Mapping[str, FloatArray]:
    """Quantities of one phase under one alternative."""
    residuals = [BRAKE if way is None else way.at(s.load.s_w) for s in parts]
    V = _way_speed(phase)
    responses = []
    for s, residual in zip(parts, residuals, strict=True):
        moving = replace(s.load, V=V) if s.load.z is not None else s.load
        responses.append(Part(moving, s.time, V, forcing[s.x, s.y], sigmas(forcing[s.x, s.y], moving, residual)))

    level = quantiles(plan)
    values = _of_tip(responses, phase, level) | of_load(responses, level)
    values["DAF"] = values["DAF"] * (plan.payload.mass / plan.of_high.payload.mass)
    if phase.compensated:
        values["e_c_pp"] = _error(responses, residuals, level("e_c_pp"))
    if way is not None and alternative.twin:
        values |= _of_winch(plan, phase, alternative, responses, way, values["v_tip_max"])
    if phase.kind in (PhaseKind.LIFT_OFF, PhaseKind.SEABED_LIFT_OFF):
        values = _taken_up(plan, phase, values)
    if phase.kind is PhaseKind.LANDING:
        values["v_landed"] = speed_at_crossing(abs(V), responses[-1].s.load_rate, level("v_landed"))
    return values


def quantiles(plan: LiftPlan) -> Levels:
    """Probability level at which a quantity's largest value is reported, by the plan's rules."""
    return lambda quantity: plan.rules.level(quantity).quantile


def _way_speed(phase: Phase) -> float:
    """Speed at which the payload goes down in a phase [m/s], negative up."""
    if phase.speed is None or phase.z_start is None or phase.z_end is None or phase.z_start == phase.z_end:
        return 0.0
    return phase.speed if phase.z_end < phase.z_start else -phase.speed


def _tip_speed(forcing: Forcing) -> tuple[FloatArray, FloatArray]:
    """Deviation of the tip's speed [m/s] and zero-crossing period of its motion [s], (n,) each."""
    v = forcing.deviation(1)
    return v, zero_crossing_period(forcing.deviation(), v)


def _mean(responses: Sequence[Part], values: Sequence[FloatArray]) -> FloatArray:
    """Mean over the time of a phase, (n,)."""
    return np.asarray(np.average(np.array(values), axis=0, weights=[p.time for p in responses]))


def _largest(responses: Sequence[Part], name: str, rate: str, quantile: float, *, of_rate: bool = False) -> FloatArray:
    """Largest value about its mean of a motion of `Sigmas`, or of its rate, over all parts, (n,)."""
    cycles = np.array([p.cycles(getattr(p.s, name), getattr(p.s, rate)) for p in responses])
    return largest_of_parts(
        0.0, np.array([getattr(p.s, rate if of_rate else name) for p in responses]), cycles, quantile
    )


def _error(responses: Sequence[Part], residuals: Sequence[Residual], quantile: float) -> FloatArray:
    """Largest peak-to-peak of the wire's end over 30 s in a phase, (n,): the twin's own of some minutes, grown to the
    phase's duration as a Gaussian one grows; of a flat share, and on the brake, twice the largest value."""
    duration = sum(p.time for p in responses)
    peaks = []
    for p, residual in zip(responses, residuals, strict=True):
        v, T_z = _tip_speed(p.forcing)
        moving = v > 0.0
        peak = (
            None
            if residual.remnant is None or p.forcing.lost is not None  # what a filter loses is Gaussian
            else residual.remnant.peak_at(np.where(moving, v, 1.0), np.where(moving, T_z, 1.0))
        )
        if residual.remnant is None or peak is None:
            return 2.0 * _largest(responses, "u", "u_rate", quantile)
        T_u = zero_crossing_period(p.s.u, p.s.u_rate)
        runs, lasts = np.log(np.maximum(residual.remnant.lasts / T_u, math.e)), duration / T_u / -math.log(quantile)
        grown = np.sqrt(np.log(np.maximum(lasts, math.e)) / runs)
        peaks.append(np.where(moving, p.s.u * peak * grown, 0.0 * p.s.u))
    return np.asarray(np.max(peaks, axis=0))


def _of_tip(responses: Sequence[Part], phase: Phase, level: Levels) -> dict[str, FloatArray]:
    """What the tip does and asks of the winch."""
    z, v, a = (np.array([p.forcing.deviation(order) for p in responses]) for order in range(3))
    N_z, N_v = (np.array([p.cycles(x[i], y[i]) for i, p in enumerate(responses)]) for x, y in ((z, v), (v, a)))
    speed = abs(_way_speed(phase))
    followed = largest_of_parts(0.0, v, N_v, level("v_w_demand")) if phase.compensated else 0.0 * v[0]
    values = {
        "v_tip_max": largest_of_parts(0.0, v, N_v, level("v_tip_max")),
        "s_tip_pp": 2.0 * largest_of_parts(0.0, z, N_z, level("s_tip_pp")),
        "v_w_demand": followed + speed,
    }
    if phase.kind is PhaseKind.SEABED_LIFT_OFF:
        values["v_lift_off"] = _largest(responses, "u", "u_rate", level("v_lift_off"), of_rate=True)
    return values


def _taken_up(plan: LiftPlan, phase: Phase, values: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """The quantities with the jerk of taking up the load: at the hoisting speed, off the seabed at that and the wire
    end's own, and what holds the payload there besides. Slings come taut in these phases: what makes them slack is not
    determined."""
    F = jerk(plan, phase, 1.0) * ((phase.speed or 0.0) + values.get("v_lift_off", np.zeros(1)))
    if phase.kind is PhaseKind.SEABED_LIFT_OFF:
        F = F + plan.payload.lift_off.friction + plan.payload.lift_off.suction
    result = {
        **values,
        "F_top_max": values["F_top_max"] + F,
        "DAF": values["DAF"] + F / (plan.of_high.payload.mass * G),
    }
    return {name: numbers for name, numbers in result.items() if name not in ("sling_ratio", "slack_chance")}


def _of_winch(
    plan: LiftPlan, phase: Phase, alternative: Alternative, responses: Sequence[Part], way: Way, v: FloatArray
) -> dict[str, FloatArray]:
    """Shares of the time of the twin's hydraulics, and the pressure under a sine as fast as the fastest motion
    v [m/s]."""
    shares = [way.shares(p.load.s_w, *_tip_speed(p.forcing)) for p in responses]
    result = {name: _mean(responses, [share[name] for share in shares]) for name in shares[0]}
    tops = [
        way.pressure(p.load.s_w, v, zero_crossing_period(*(p.forcing.deviation(order) for order in (1, 2))))
        for p in responses
    ]
    pressures = [top for top in tops if top is not None]
    if pressures:
        result["p_a_max"] = np.asarray(np.max(pressures, axis=0))
    stroke = CAPACITIES["s_stroke"].find(plan, phase, alternative)
    if stroke is not None:
        result["stroke_share"] = _mean(
            responses, [share_beyond(0.5 * stroke.value, p.forcing.deviation()) for p in responses]
        )
    return result


def of_load(responses: Sequence[Part], level: Levels) -> dict[str, FloatArray]:
    """Tensions and motion of what hangs. The drag of a payload that sinks takes some of its weight, that of one that
    rises adds to it."""
    top, sling = (np.array([getattr(p.s, name) for p in responses]) for name in ("top", "sling"))
    N_top, N_sling = (
        np.array([p.cycles(getattr(p.s, q), getattr(p.s, f"{q}_rate")) for p in responses]) for q in ("top", "sling")
    )
    F_top, F_sling = (np.array([getattr(p.load, name) - p.rise for p in responses]) for name in ("F_top", "F_sling"))
    at_rest = min(p.load.F_sling for p in responses)
    T_sling = [zero_crossing_period(p.s.sling, p.s.sling_rate) for p in responses]
    often = sum(p.time * rate_below_zero(F, p.s.sling, T) for p, F, T in zip(responses, F_sling, T_sling, strict=True))
    return {
        "F_top_max": largest_of_parts(F_top, top, N_top, level("F_top_max")),
        "DAF": largest_of_parts(F_sling, sling, N_sling, level("DAF")) / (responses[0].load.end.m * G),
        "sling_ratio": -largest_of_parts(-F_sling, sling, N_sling, level("sling_ratio")) / at_rest,
        "slack_chance": -np.expm1(-np.asarray(often)),
        "load_pp": 2.0 * _largest(responses, "load", "load_rate", level("load_pp")),
    }
