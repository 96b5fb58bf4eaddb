"""What every assessment of a plan gets, and what it is: a module of `stillhook.plan.assessments.ASSESSMENTS`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from stillhook.base.progress import Progress
from stillhook.plan.answer.dataset import Answered
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Demand, Tier
from stillhook.plan.limits import Limits
from stillhook.plan.tiers.time_domain.cells import Execution
from stillhook.plan.tiers.time_domain.tier import TwinTier
from stillhook.plan.weather.value import Forecast
from stillhook.report.document import Part
from stillhook.weather.series import Weather


@dataclass(frozen=True, eq=False)
class PlanState:
    """A plan whose limits are known.

    demands and limits: of all tiers that were run, up to `last`; twin: None without runs; records: weather, None
    without; execution: where runs of the twin are kept and who makes them.
    """

    plan: LiftPlan
    answered: Answered = field(repr=False)
    demands: Sequence[Demand] = field(repr=False)
    limits: Sequence[Limits] = field(repr=False)
    forecast: Forecast = field(repr=False)
    records: Weather | None = field(repr=False)
    twin: TwinTier | None = field(repr=False)
    execution: Execution
    last: Tier


class Assessment(Protocol):
    """A module that assesses more than limiting seas."""

    NAME: str
    """Key of its facts in a result, and name of its part of a plan."""
    TITLE: str
    """Title of its section in the report."""
    EXPECTED: float
    """Time that it takes of the embedded plan in the time domain [s], for progress."""

    def assess(self, state: PlanState, progress: Progress) -> Mapping[str, Any] | None:
        """Plain data in SI; None where it does not apply."""

    def parts(self, facts: Mapping[str, Any]) -> Sequence[Part]:
        """Its section, from the facts of a result: its own are at `NAME`."""
