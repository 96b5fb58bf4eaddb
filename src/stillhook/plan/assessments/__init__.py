"""What a plan assesses beside its limiting sea states: each a module with the names of `Assessment`, listed once."""

from collections.abc import Sequence

from stillhook.plan.assessments import card
from stillhook.plan.assessments.interface import Assessment

ASSESSMENTS: Sequence[Assessment] = (card,)
"""In the order of the report."""
