"""What of a twin's limits may be credited: all where its certificate covers the run, else no more than the cap's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.engine.validity import NO_CERTIFICATE, objections
from stillhook.physics.scalar import G
from stillhook.plan.definition.capacities import at_rest, calm, places
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.phases import Phase
from stillhook.plan.definition.rules import Alternative, Demand, Seas
from stillhook.plan.limits import limited, limits_of
from stillhook.plan.table.table import Axes, Chosen, chosen, gathered
from stillhook.plan.tiers.closed_form import tip_motion
from stillhook.plan.tiers.winch_residual import controlled
from stillhook.spec.validity import CAP, Conditions


@dataclass(frozen=True, eq=False)
class Inside:
    """covered (n,): whether the certificate covers each sea; why: what stands against it, a reason each with the seas
    that it is of."""

    covered: NDArray[np.bool_] = field(repr=False)
    reasons: tuple[str, ...] = ()


def inside(plan: LiftPlan, phase: Phase, alternative: Alternative, seas: Seas) -> Inside:
    """Where the compensation that the twin computes may be credited in full.

    Everywhere for phases without compensation, and for none and the flat cap: there is nothing to credit. For a twin
    where the crane's certificate holds, is of a crane and not synthetic, and its envelope covers load, wire, motion and
    period of the tip, and mode. The load is what hangs at the tip less the hook, as the winch feels it; the tip's
    motion is the most probable largest of the phase, from crest to trough.
    """
    everywhere = np.ones(len(seas), dtype=bool)
    if not (phase.compensated and alternative.twin):
        return Inside(everywhere)
    against = _against(plan, alternative)
    if against:
        return Inside(~everywhere, against)
    reasons: list[tuple[str, ...]] = []
    for i, conditions in enumerate(_conditions(plan, phase, alternative, seas)):
        assert plan.crane.certified is not None
        outside = plan.crane.certified.outside(conditions)
        everywhere[i] = not outside
        reasons.append(outside)
    return Inside(everywhere, _counted(reasons))


def _counted(reasons: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    """Reasons of every sea in a line for each range that is left: the first of them, and in how many seas."""
    alike: dict[str, list[str]] = {}
    for reason in chain.from_iterable(reasons):
        alike.setdefault(reason[reason.find(" (") :], []).append(reason)
    return tuple(
        f"outside the validated envelope in {len(lines)} of {len(reasons)} seas:"
        f" {lines[0]}{' and the like' if len(set(lines)) > 1 else ''}"
        for lines in alike.values()
    )


def _against(plan: LiftPlan, alternative: Alternative) -> tuple[str, ...]:
    """What stands against a certificate in all seas."""
    crane = plan.crane
    if crane.certified is None:
        return (f"{NO_CERTIFICATE}: no more than {CAP:.0%} of compensation is credited",)
    reasons = objections(crane)
    if reasons:
        return tuple(f"certificate does not hold: {reason}" for reason in reasons)
    if crane.certified.synthetic:
        return (f"certificate {crane.certified.short} is SYNTHETIC: no crane was validated",)
    if controlled(crane, alternative, plan.sensors)[0] != crane:
        return (f"{alternative} runs with other settings of the controller than those that were validated",)
    return ()


def _conditions(plan: LiftPlan, phase: Phase, alternative: Alternative, seas: Seas) -> list[Conditions]:
    """What a phase asks in each sea, in the terms of a certificate."""
    mode = controlled(plan.crane, alternative, plan.sensors)[1].mode.value
    still = [at_rest(plan, phase, z) for z in places(phase)]
    load, wire = max(s.F_tip for s in still) / G - plan.crane.hook_mass, [s.s_w for s in still]
    tip = tip_motion(plan, phase, seas)
    pp, T = 2.0 * tip.largest(max(phase.duration or 0.0, plan.rules.settings["duration_least"]))[0], tip.T_z
    return [
        Conditions(
            load=load,
            s_w_min=min(wire) - 0.5 * float(s),
            s_w_max=max(wire) + 0.5 * float(s),
            s_tip_pp=float(s),
            period=float(t),
            modes=(mode,),
        )
        for s, t in zip(pp, T, strict=True)
    ]


@dataclass(frozen=True, eq=False)
class Certified:
    """Whether all that the twin computes is credited (alternative, phase, heading, period, height), heights rising; why
    not, by alternative; needs (alternative, phase): whether that takes a certificate, for a twin computes a
    compensation."""

    covers: BoolArray = field(repr=False)
    reasons: Mapping[Alternative, tuple[str, ...]]
    needs: BoolArray = field(repr=False)

    @property
    def share(self) -> FloatArray:
        """Share of the heights that the certificate covers (alternative, phase, heading, period); NaN where nothing
        takes one."""
        return np.where(self.needs[:, :, None, None], self.covers.mean(axis=-1), np.nan)


def certified_in(plan: LiftPlan, axes: Axes, seas: Seas) -> Certified:
    """What the crane's certificate covers of a full table of seas. Phases that nothing compensates need no certificate,
    and alternatives that are no twin have none to need."""
    heights = np.unique(seas.Hs)
    covers = np.ones((len(axes.alternatives), len(axes.phases), *axes.columns, len(heights)), dtype=np.bool_)
    heading, period = axes.place(seas.Tp, seas.beta)
    height = np.searchsorted(heights, seas.Hs)
    reasons: dict[Alternative, list[str]] = {}
    needs = np.zeros(covers.shape[:2], dtype=np.bool_)
    for i, alternative in enumerate(axes.alternatives):
        for k, phase in enumerate(plan.phases):
            if alternative.twin and phase.compensated:
                needs[i, k] = True
                coverage = inside(plan, phase, alternative, seas)
                covers[i, k, heading, period, height] = coverage.covered
                reasons.setdefault(alternative, []).extend(coverage.reasons)
    return Certified(
        covers, {alternative: tuple(dict.fromkeys(lines)) for alternative, lines in reasons.items()}, needs
    )


def credited_of(
    plan: LiftPlan, modelled: Chosen, demands: Sequence[Demand], heights: FloatArray, certified: BoolArray
) -> Chosen:
    """Limits that may be credited, of limits by the model of each alternative.

    demands: those of all alternatives and tiers, of which the cap's are held against each alternative's own limits;
    certified (alternative, phase, heading, period, height) as `Certified.covers` for heights [m] rising. Where a sea is
    not covered, a rule is met only where the cap meets it as well: the limit falls to the highest covered sea below it,
    or to the cap's where that is more. Rules that the cap does not tell (pressures of a winch) stay with the twin.
    """
    axes, Hs, tier = modelled.axes, modelled.Hs.copy(), modelled.tier.copy()
    low, high = modelled.low.copy(), modelled.high.copy()
    for i, alternative in enumerate(axes.alternatives):
        phases = [p for p in plan.phases if p.compensated and not certified[i, axes.phases.index(p.name)].all()]
        if not alternative.twin or not phases:
            continue
        cap = _cap(plan, axes, alternative, phases, demands)
        for phase in phases:
            at = (i, axes.phases.index(phase.name))
            reach = np.fmax(cap.Hs[at], _covered_up_to(cap.Hs[at], heights, certified[at]))
            lower = reach < modelled.Hs[at]
            by_cap = lower & (cap.Hs[at] == reach)
            Hs[at] = np.where(lower, reach, modelled.Hs[at])
            tier[at] = np.where(by_cap, cap.tier[at], modelled.tier[at])
            for ends, of in ((low, cap.low), (high, cap.high)):
                ends[at] = np.where(by_cap, of[at], np.where(lower, np.nan, ends[at]))
    return replace(modelled, Hs=Hs, low=low, high=high, tier=tier)


def _cap(
    plan: LiftPlan, axes: Axes, alternative: Alternative, phases: Sequence[Phase], demands: Sequence[Demand]
) -> Chosen:
    """Limits of the flat cap where it has to meet the rules of another alternative, in the places of that one."""
    names = {phase.name: phase for phase in phases}
    limits = []
    for demand in demands:
        if demand.alternative is Alternative.CAP and demand.phase in names:
            phase = names[demand.phase]
            still = calm(plan, phase, Alternative.CAP)
            highest = max(plan.environment.Hs)
            limits.append(
                limits_of(
                    replace(demand, alternative=alternative), limited(plan, phase, alternative), still, most=highest
                )
            )
    return chosen(gathered(axes, limits))


def _covered_up_to(cap: FloatArray, heights: FloatArray, certified: BoolArray) -> FloatArray:
    """Highest sea (rule, heading, period) [m] up to which every sea above the cap's limit (rule, heading, period) is
    covered by certified (heading, period, height); inf where all are, -inf where the first above it is not."""
    beyond = (heights > cap[..., None]) & ~certified[None]
    first = beyond.argmax(axis=-1)
    before = np.where(first > 0, heights[np.maximum(first - 1, 0)], -np.inf)
    return np.asarray(np.where(beyond.any(axis=-1), before, np.inf))
