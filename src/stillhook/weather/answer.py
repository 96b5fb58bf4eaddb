"""Answers about weather as one table of names and numbers, for JSON and for people."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from stillhook.sea.weather import HOUR, Weather
from stillhook.weather.limit_text import BETA, Limit, inside
from stillhook.weather.persistence import IN_TIME, persistence

MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")


def stamp(time: np.datetime64) -> str:
    """A time as text (UTC)."""
    return f"{np.datetime_as_string(time, unit='s')}Z"


def persistence_answer(
    weather: Weather, limits: Sequence[Limit], window: float, *, ship: float | None = None, free: bool = False
) -> dict[str, Any]:
    """Persistence of a series under limits, with where it is from [SI]; window [s]; ship, free as in `limit_text.inside`."""
    workable, valid = inside(limits, weather, ship, free=free)
    found = persistence(workable, weather.time, weather.step, window, valid=valid)
    turned = any(BETA in limit.columns for limit in limits)
    numbers = found.numbers()
    return (
        {"file": weather.source, "start": stamp(weather.time[0]), "end": stamp(weather.time[-1]), "step": weather.step}
        | {"limits": [limit.text for limit in limits], "window": window, "ship": ("free" if free else ship) if turned else None}
        | {"n_records": len(weather), "n_valid": int(np.count_nonzero(valid))}
        | numbers
        | {"hours": _hours(numbers | {"window": window})}
        | {"months": [month.numbers() for month in found.months], "notes": list(weather.notes)}
    )


def _hours(numbers: dict[str, Any]) -> dict[str, float]:
    return {name: numbers[name] / HOUR if math.isfinite(numbers[name]) else math.nan for name in ("window", *IN_TIME)}
