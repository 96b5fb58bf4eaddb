"""What may be credited of the compensation that a twin computes: all of it where its certificate covers a sea, else the
flat cap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from stillhook.engine.validity import NO_CERTIFICATE, objections
from stillhook.physics.scalar import G
from stillhook.plan.definition.capacities import at_rest, places
from stillhook.plan.definition.compensation import Alternative
from stillhook.plan.definition.demand import Seas
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.phases import Phase
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
