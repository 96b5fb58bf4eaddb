"""Failure cases of a lift in the seas of its limit: what happens where AHC trips, sensors fail, power or gas is lost,
where the payload is stopped in the wave zone or hoisted back, and where the vessel leaves its place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from stillhook.plan.assessments.failures.assessment import assess
from stillhook.plan.assessments.failures.section import section
from stillhook.report.document import Part

__all__ = ["EXPECTED", "NAME", "TITLE", "assess", "parts"]

NAME, TITLE = "failures", "Failure cases"
EXPECTED = 28.0


def parts(facts: Mapping[str, Any]) -> Sequence[Part]:
    """The section, from the facts of a result."""
    return section(facts[NAME])
