"""Step 1."""

from __future__ import annotations

from collections.abc import Callable

from stillhook.validate.campaign import Campaign
from stillhook.validate.lines import Step, StepNumber
from stillhook.validate.record import Record


def check_parameters(campaign: Campaign, records: tuple[Record, ...], progress: Callable[[float], None]) -> Step:
    return Step(StepNumber.PARAMETERS, ())
