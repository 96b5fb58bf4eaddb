"""Whether the limits of a plan agree with what they come from: with the runs, with the credit, with their neighbours,
between the tiers; and which holds and seas are not claimed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stillhook.base.progress import Progress
from stillhook.plan.assessments.interface import PlanState
from stillhook.plan.assessments.quality.consistency import agreement, cells, credit, neighbours, steep, tiers_apart
from stillhook.plan.assessments.quality.holds import holds
from stillhook.plan.assessments.quality.sections import parts

__all__ = ["EXPECTED", "NAME", "TITLE", "assess", "parts"]
NAME, TITLE, EXPECTED = "quality", "Quality of the limits", 1.0


def assess(state: PlanState, progress: Progress) -> Mapping[str, Any]:
    """Checks of every limit, neighbours and tiers that are apart, holds side by side with their passages, steep
    seas."""
    return {
        "checks": [credit(state), cells(state)],
        "agreement": agreement(state),
        "tiers": tiers_apart(state),
        "neighbours": neighbours(state),
        "holds": holds(state, progress),
        "steep": steep(state),
    }
