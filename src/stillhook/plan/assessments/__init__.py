"""What a plan assesses beside its limiting sea states: each a module with the names of `Assessment`, listed once."""

from collections.abc import Sequence

from stillhook.plan.assessments import failures
from stillhook.plan.assessments.interface import Assessment

ASSESSMENTS: Sequence[Assessment] = (failures,)
"""In the order of the report."""
