"""What of a twin's limits may be credited: no more than the cap's where no certificate covers the seas."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.plan.definition.capacities import calm
from stillhook.plan.definition.compensation import Alternative
from stillhook.plan.definition.demand import Demand, Seas
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.phases import Phase
from stillhook.plan.limits.applicable_rules import limited
from stillhook.plan.limits.solve import limits_of
from stillhook.plan.table.credit import inside
from stillhook.plan.table.table import Axes, Chosen, chosen, gathered


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
