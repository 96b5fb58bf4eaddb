"""Weights and rigging: static hook load, dynamic hook load in the seas of the limit, legs and items by utilisation."""

from stillhook.plan.assessments.rigging.assessment import NAME, assess
from stillhook.plan.assessments.rigging.section import TITLE, parts

EXPECTED = 0.5

__all__ = ["EXPECTED", "NAME", "TITLE", "assess", "parts"]
