"""In which weather may this lift be done, what limits it, how long will we wait, and what does a better controller buy?

>>> from stillhook import plan
>>> found = plan.plan("template-to-1500m", tier="frequency")  # doctest: +SKIP
>>> found.data["Hs_limit"].sel(credit="credited", alternative="ssc")  # doctest: +SKIP
>>> plan.save_plan(found, "plan")  # doctest: +SKIP
>>> plan.save_report(found, "plan")  # doctest: +SKIP
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from stillhook.base.lazy import attached

if TYPE_CHECKING:
    from stillhook.plan.answer.files import load_plan_result, save_plan
    from stillhook.plan.definition.compensation import Alternative
    from stillhook.plan.definition.demand import Tier
    from stillhook.plan.definition.lift_plan import LiftPlan
    from stillhook.plan.definition.rules_file import load_rules
    from stillhook.plan.file import load_plan
    from stillhook.plan.planning import plan
    from stillhook.plan.report.save import save_report
    from stillhook.plan.result.result import PlanResult
    from stillhook.plan.table.table import LimitTable

_HOMES = {
    "Alternative": "plan.definition.compensation",
    "LiftPlan": "plan.definition.lift_plan",
    "LimitTable": "plan.table.table",
    "PlanResult": "plan.result.result",
    "Tier": "plan.definition.demand",
    "load_plan": "plan.file",
    "load_plan_result": "plan.answer.files",
    "load_rules": "plan.definition.rules_file",
    "plan": "plan.planning",
    "save_plan": "plan.answer.files",
    "save_report": "plan.report.save",
}
__all__ = [
    "Alternative",
    "LiftPlan",
    "LimitTable",
    "PlanResult",
    "Tier",
    "load_plan",
    "load_plan_result",
    "load_rules",
    "plan",
    "save_plan",
    "save_report",
]

__getattr__, __dir__ = attached(__name__, _HOMES)
