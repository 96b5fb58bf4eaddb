"""Limits that may be claimed, by part of a lift and cell, and what they rest on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from stillhook.plan.answer.dataset import Answered
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.result import CLAIMABLE
from stillhook.plan.table import BY_RULE, ENDS, TIERS, Chosen, Governed, governing
from stillhook.plan.weather.value import Forecast, forecast_limits
from stillhook.spec.lift.joining import IN_AIR
from stillhook.spec.lift.phase import Phase, PhaseKind
from stillhook.spec.validity import CAP

WAVE_ZONE, DEEP, SEABED = "wave zone", "deep", "landing"
"""Parts of a lift that have a column of their own on the limits card."""
PART_OF: Mapping[PhaseKind, str] = {
    **dict.fromkeys((*IN_AIR, PhaseKind.SPLASH), WAVE_ZONE),
    **dict.fromkeys((PhaseKind.LOWERING, PhaseKind.DEEP), DEEP),
    **dict.fromkeys((PhaseKind.STAND_OFF, PhaseKind.LANDING, PhaseKind.SEABED_LIFT_OFF), SEABED),
}


def parts_of(plan: LiftPlan) -> dict[str, list[Phase]]:
    """Phases of each part of a lift, in the order of the plan."""
    parts: dict[str, list[Phase]] = {}
    for phase in plan.phases:
        parts.setdefault(WAVE_ZONE if phase.kind is None else PART_OF[phase.kind], []).append(phase)
    return parts


def credit_of(plan: LiftPlan, of: Answered, alternative: Alternative) -> dict[str, Any]:
    """What the claim rests on: no compensation, a flat share of it, or a certificate, which may cover a part alone."""
    i = of.axes.alternatives.index(alternative)
    followed = of.certified.needs[i] if alternative.twin else np.array([p.compensated for p in plan.phases])
    if alternative.stands or not followed.any():
        return {"by": "none"}
    certificate = plan.crane.certified
    share = float(np.nanmean(of.certified.share[i])) if alternative.twin else 0.0
    if certificate is None or not certificate.real or share == 0.0:
        return {"by": "cap", "cap": CAP}
    return {"by": "certificate", "certificate": certificate.short, "cap": CAP, "share": share}


def of_phases(plan: LiftPlan, chosen: Chosen, phases: Sequence[Phase]) -> Governed:
    """The least limits over some phases alone."""
    names = {phase.name for phase in phases}
    inside = np.array([name in names for name in chosen.axes.phases])[None, :, None, None, None]
    Hs, low, high = (np.where(inside, ends, np.nan) for ends in (chosen.Hs, chosen.low, chosen.high))
    part = replace(chosen, Hs=Hs, low=low, high=high)
    return governing(plan, {CLAIMABLE: part})[CLAIMABLE]


def cells_of(plan: LiftPlan, governs: Governed, forecast: Forecast, alternative: Alternative) -> list[dict[str, Any]]:
    """Every cell of an alternative: beta, T_p, Hs_limit (at most the highest sea analysed; None without a result),
    above (whether that is no limit), Hs_limit_low, alpha, op_wf (None where there is no factor), and what governs."""
    axes, highest = governs.axes, max(plan.environment.Hs)
    i = axes.alternatives.index(alternative)
    factors = forecast_limits(plan, forecast.table, {CLAIMABLE: governs})
    rows = []
    for k, beta in enumerate(axes.headings):
        for m, Tp in enumerate(axes.periods):
            at = (i, k, m)
            Hs, by = float(governs.Hs[at]), governs.phase[at] >= 0
            rows.append(
                {
                    "beta": beta,
                    "T_p": Tp,
                    "Hs_limit": _number(min(Hs, highest)),
                    "above": Hs > highest,
                    "Hs_limit_low": _number(float(governs.low[at])),
                    "alpha": _number(float(factors.alpha[(0, *at)])),
                    "op_wf": _number(float(factors.op_wf[(0, *at)])),
                    "governing_phase": axes.phases[governs.phase[at]] if by else "",
                    "governing_rule": axes.rules[governs.rule[at]] if by else "",
                    "governing_tier": TIERS[governs.tier[at]].value if by else "",
                    "governing_end": ENDS[governs.ends[at]].value if governs.ends[at] != BY_RULE else "",
                }
            )
    return rows


def _number(value: float) -> float | None:
    return value if np.isfinite(value) else None
