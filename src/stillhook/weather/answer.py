"""Answers about weather as one table of names and numbers, for JSON and for people."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.sea.spectra.directions import FULL
from stillhook.units import number
from stillhook.weather.limit_text import BETA, KIND, Limit, by_heading, inside_by_heading
from stillhook.weather.persistence import IN_TIME, gaps, persistence, seconds
from stillhook.weather.series import HOUR, Weather, every

MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")


def stamp(time: np.datetime64) -> str:
    """A time as text (UTC)."""
    return f"{np.datetime_as_string(time, unit='s')}Z"


def persistence_answer(
    weather: Weather, limits: Sequence[Limit], window: float, *, ship: float | None = None, free: bool = False
) -> dict[str, Any]:
    """Persistence of a series under limits, with where it is from [SI]; window [s]; ship, free as in
    `limit_text.inside_by_heading`."""
    workable, valid = inside_by_heading(limits, weather, ship, free=free)
    rows, step = every(weather, valid)
    statistics = persistence(workable[:, rows], weather.time[rows], step, window, valid=valid[rows])
    part = f"1 of {number(len(weather) / len(rows), 3)} records"
    less = f"limits can be judged on {part} only, {step / 60.0:g} min apart: the answer is about these"
    notes = [*([less] if len(rows) < len(weather) else []), *weather.notes]
    turned = any(BETA in limit.columns for limit in limits)
    numbers = statistics.numbers()
    return (
        {"file": weather.source, "start": stamp(weather.time[0]), "end": stamp(weather.time[-1]), "step": step}
        | {
            "limits": [limit.text for limit in limits],
            "window": window,
            "ship": ("free" if free else ship) if turned else None,
        }
        | {"n_records": len(rows), "n_valid": int(np.count_nonzero(valid[rows]))}
        | numbers
        | {"hours": _hours(numbers | {"window": window})}
        | {"months": [month.numbers() for month in statistics.months]}
        | (
            {"by_heading": [{"ship": s, "operability": o} for s, o in by_heading(limits, weather)]}
            if free and turned
            else {}
        )
        | {"notes": notes}
    )


def _hours(numbers: dict[str, Any]) -> dict[str, float]:
    return {name: numbers[name] / HOUR if math.isfinite(numbers[name]) else math.nan for name in ("window", *IN_TIME)}


def show_answer(weather: Weather) -> dict[str, Any]:
    """What a series holds, column by column [SI]; of directions the mean direction, least and most. absent: time in
    gaps [s]."""
    apart = np.diff(seconds(weather.time))
    broken = gaps(weather.time, weather.step)
    return (
        {"file": weather.source, "start": stamp(weather.time[0]), "end": stamp(weather.time[-1]), "step": weather.step}
        | {
            "n_records": len(weather),
            "n_gaps": int(np.count_nonzero(broken)),
            "absent": float(np.sum(apart[broken] - weather.step)),
        }
        | {"columns": {name: _column(name, x) for name, x in weather.columns.items()}, "notes": list(weather.notes)}
    )


def _column(name: str, x: FloatArray) -> dict[str, float | int | None]:
    known = x[np.isfinite(x)]
    counts: dict[str, float | int | None] = {"n_missing": len(x) - len(known)}
    if len(known) == 0:
        return counts | dict.fromkeys(("min", "mean", "p90", "max"))
    if KIND[name] == "angle":
        mean = float(np.angle(np.mean(np.exp(1j * known)))) % FULL
        return counts | {"min": float(known.min()), "mean": mean, "p90": None, "max": float(known.max())}
    return counts | {
        "min": float(known.min()),
        "mean": float(known.mean()),
        "p90": float(np.percentile(known, 90.0)),
        "max": float(known.max()),
    }
