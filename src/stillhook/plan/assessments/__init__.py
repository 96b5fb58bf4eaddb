"""What a plan assesses beside its limiting sea states: each a module with the names of `Assessment`, listed once."""

from collections.abc import Sequence

from stillhook.plan.assessments import card, failures, hindcast, other_vessel, quality, rigging, sensitivity, sideways
from stillhook.plan.assessments.interface import Assessment
from stillhook.plan.assessments.sensitivity import assumed

ASSESSMENTS: Sequence[Assessment] = (
    rigging,
    other_vessel,
    sideways,
    failures,
    sensitivity,
    assumed,
    hindcast,
    quality,
    card,
)
"""In the order of the report."""
