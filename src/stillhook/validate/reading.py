"""Logs of a campaign to records."""

from __future__ import annotations

from collections.abc import Callable

from stillhook.validate.campaign import Campaign
from stillhook.validate.record import Record


def read_records(campaign: Campaign, progress: Callable[[float], None]) -> tuple[Record, ...]:
    """Every test of a campaign, read."""
    raise NotImplementedError
