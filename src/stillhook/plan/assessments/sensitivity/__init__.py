"""How far the limit of every phase moves when one number of the plan is otherwise: by the twin in the same waves where
it has the limit, else by the method that has."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stillhook.base.progress import Parts, Progress
from stillhook.plan.assessments.interface import PlanState
from stillhook.plan.assessments.sensitivity.governing import governing
from stillhook.plan.assessments.sensitivity.ranking import NAME
from stillhook.plan.assessments.sensitivity.report import parts
from stillhook.plan.assessments.sensitivity.tornado import of_method, of_runs
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Tier

__all__ = ["EXPECTED", "NAME", "TITLE", "assess", "parts"]

TITLE, EXPECTED = "Sensitivity, phase by phase", 40.0


def assess(state: PlanState, progress: Progress) -> Mapping[str, Any] | None:
    """The tornado of every phase that has a limit: facts of `stillhook.plan.assessments.sensitivity.tornado`. Made once
    of a state."""
    return state.plan.once(_assessed, state, progress=progress)


def _assessed(plan: LiftPlan, state: PlanState, *, progress: Progress) -> Mapping[str, Any] | None:
    if state.last is Tier.CLOSED_FORM:
        return None
    shown = state.answered.shown()
    cells = [governing(state, phase, shown) for phase in plan.phases]
    known = [cell for cell in cells if cell is not None]
    part = Parts(progress, {"runs": 40.0, "methods": 4.0})
    of_twin, n_runs = of_runs(state, [c for c in known if c.tier is Tier.TIME], shown, part("runs"))
    others = of_method(state, [c for c in known if c.tier is not Tier.TIME], shown, part("methods"))
    rows = {**of_twin, **others}
    return {
        "alternative": shown.value,
        "Hs_highest": max(plan.environment.Hs),
        "n_runs": n_runs,
        "phases": [rows[phase.name] for phase in plan.phases if phase.name in rows],
        "not_assessed": [p.name for p, cell in zip(plan.phases, cells, strict=True) if cell is None],
    }
