"""In which weather may this lift be done, what limits it, how long will we wait, and what does a better controller buy?

>>> from stillhook import plan
>>> found = plan.plan("template-to-1500m", tier="frequency")  # doctest: +SKIP
>>> found.data["Hs_limit"].sel(credit="credited", alternative="ssc")  # doctest: +SKIP
>>> plan.save_plan(found, "plan")  # doctest: +SKIP
>>> plan.save_report(found, "plan")  # doctest: +SKIP
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from stillhook._lazy import attached

if TYPE_CHECKING:
    from stillhook.plan.alternatives import Alternative
    from stillhook.plan.demand import Tier
    from stillhook.plan.lift_plan import LiftPlan
    from stillhook.plan.plan_file import load_plan
    from stillhook.plan.plan_files import load_plan_result, save_plan
    from stillhook.plan.planning import plan
    from stillhook.plan.report import save_report
    from stillhook.plan.result import PlanResult
    from stillhook.plan.rule_file import load_rules
    from stillhook.plan.table import LimitTable

_HOMES = {
    "Alternative": "plan.alternatives",
    "LiftPlan": "plan.lift_plan",
    "LimitTable": "plan.table",
    "PlanResult": "plan.result",
    "Tier": "plan.demand",
    "load_plan": "plan.plan_file",
    "load_plan_result": "plan.plan_files",
    "load_rules": "plan.rule_file",
    "plan": "plan.planning",
    "save_plan": "plan.plan_files",
    "save_report": "plan.report",
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
