"""Moments of a history: UTC in seconds since 1970, and as ISO 8601 where people read and write them."""

from __future__ import annotations

import math
from datetime import UTC, datetime

from stillhook.errors import LiveError
from stillhook.units import quote

LATEST = 9.0e9
"""A time beyond, in the year 2255, is in another unit: milliseconds of today are 200 times as many [s]."""


def moment(value: str | float | None, place: str, otherwise: float) -> float:
    """UTC in seconds since 1970, of a number or of ISO 8601; without a zone it is UTC. Errors: LiveError."""
    if value is None:
        return otherwise
    try:
        if isinstance(value, str):
            stamp = datetime.fromisoformat(value.strip())
            value = (stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)).timestamp()
        if math.isfinite(value):
            return float(value)
    except (ValueError, TypeError, OverflowError):
        pass
    raise LiveError(f"{place} = {quote(value)}: give UTC such as 2026-11-28T13:00, or seconds since 1970.")


def show_moment(time: float) -> str:
    """ISO 8601 to the second."""
    try:
        return f"{datetime.fromtimestamp(time, UTC):%Y-%m-%dT%H:%M:%SZ}"
    except (ValueError, OverflowError, OSError):
        return f"{time:.6g} s"
