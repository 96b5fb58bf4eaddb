"""A passage and the hold that belongs to it side by side, whether the plan claims the hold or not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.plan.assessments.interface import PlanState
from stillhook.plan.assessments.quality.consistency import finite
from stillhook.plan.definition.holds import HELD
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Demand, Tier
from stillhook.plan.tiers.closed_form import closed_form
from stillhook.plan.tiers.frequency import frequency
from stillhook.plan.tiers.situations import looked_at
from stillhook.plan.tiers.weight_cases import of_cases
from stillhook.sea.spectra.spectrum import highest_sea
from stillhook.spec.lift.phase import Phase


def holds(state: PlanState, progress: Progress) -> list[dict[str, Any]]:
    """Every hold with its passage: least claimable limit by period [m], None where there is none up to the highest sea;
    of one that the plan does not claim by closed form, or by the frequency-domain method where that knows it."""
    plan, of = state.plan, state.answered
    names = [phase.name for phase in plan.phases]
    rows = [(phase, True) for phase in plan.phases if phase.name.removesuffix(HELD) in names and _is_hold(phase)]
    rows += [(phase, False) for phase in plan.not_claimed]
    others = _not_claimed(state, progress)
    steepest = np.array([highest_sea(T) for T in of.axes.periods])
    result = []
    for phase, claimed in rows:
        passage = phase.name.removesuffix(HELD)
        held, tier = (_claimed(state, phase.name), "") if claimed else others[phase.name]
        limits = {"passage": _claimed(state, passage), "held": held}
        row = {"phase": passage, "kind": str(phase.kind), "claimed": claimed, "time": phase.time, "tier": tier}
        row["Tp"] = list(of.axes.periods)
        result.append(row | {key: [finite(float(x)) for x in np.minimum(Hs, steepest)] for key, Hs in limits.items()})
    return result


def _is_hold(phase: Phase) -> bool:
    return phase.name.endswith(HELD) and phase.time is not None


def _claimed(state: PlanState, name: str) -> FloatArray:
    """Claimable limits of a phase of the alternative that leads, the least over rules and headings (period,)."""
    of = state.answered
    Hs = of.counting[of.claim].Hs[of.axes.alternatives.index(of.shown()), of.axes.phases.index(name)]
    return _least(Hs.reshape(-1, Hs.shape[-1]))


def _least(Hs: FloatArray) -> FloatArray:
    """Least of limits (n, period); inf where none is known."""
    return np.asarray(np.where(np.isnan(Hs), np.inf, Hs).min(axis=0))


def _not_claimed(state: PlanState, progress: Progress) -> dict[str, tuple[FloatArray, str]]:
    """Limits by period of the holds that the plan turns off, and their tier: under the alternative that leads, and no
    more than with the flat cap."""
    if not state.plan.not_claimed:
        return {}
    plan, shown = replace(state.plan, phases=state.plan.not_claimed), state.answered.shown()
    under = dict.fromkeys((shown, *(a for a in state.answered.axes.alternatives if a is Alternative.CAP)))
    seas = plan.environment.table()
    known = [phase.name for phase, _ in looked_at(plan)] if state.last is not Tier.CLOSED_FORM else []

    def demands(case: LiftPlan) -> list[Demand]:
        made = frequency(case, tuple(under), seas, progress) if known else []
        others = [phase for phase in case.phases if phase.name not in known]
        return made + [closed_form(case, phase, seas, a) for phase in others for a in under]

    _, limits = of_cases(plan, demands)
    result = {}
    for phase in plan.phases:
        of = [each for each in limits if each.phase == phase.name]
        tables = [_by_period(plan, Hs, each.Tp) for each in of for Hs in each.Hs.values()]
        result[phase.name] = _least(np.array(tables)), of[0].tier.value
    return result


def _by_period(plan: LiftPlan, Hs: FloatArray, Tp: FloatArray) -> FloatArray:
    """Least over the headings of limits in columns (c,), by period."""
    of: Sequence[FloatArray] = [Hs[Tp == T] for T in sorted(plan.environment.Tp)]
    return np.array([np.where(np.isnan(each), np.inf, each).min() for each in of])
