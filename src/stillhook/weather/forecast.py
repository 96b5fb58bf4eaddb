"""Go or no-go from a forecast: may an operation start, now or within some days, if the forecast must stay within alpha
times its limits.

An operation may start at a record if, from its time on, T_R is forecast without a gap or a missing value and every
record of it is within all limits, those on the significant wave height times alpha (OP_WF), at one heading of the ship
for the whole of T_R. Limits on wind, periods, current and directions are taken as they are: their uncertainty must be
in them already. Alpha follows from the limiting height, its own for each, and from T_POP.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.errors import WeatherError
from stillhook.weather.alpha import Alpha, AlphaTable, alpha_of
from stillhook.weather.limit_text import KIND, Limit, inside_by_heading, values
from stillhook.weather.persistence import SLACK, seconds, stamp, windows_of
from stillhook.weather.series import Weather


@dataclass(frozen=True)
class Start:
    """A start that was looked at. go: None where the forecast ends, has a gap or misses a value within T_R before
    anything is beyond.

    governs: the limit (as written) that is used most within T_R, most: its value there [SI], allowed: what it is held
    against [SI], both None for ranges of angles and lower limits.
    """

    time: np.datetime64
    go: bool | None
    governs: str = ""
    most: float | None = None
    allowed: float | None = None


@dataclass(frozen=True, eq=False)
class Bound:
    """An upper limit record by record: text as it was written, x what it looks at (n,), allowed (n,), or
    (heading, n) where it depends on the heading [SI], NaN where it does not count."""

    text: str
    x: FloatArray = field(repr=False)
    allowed: FloatArray = field(repr=False)


@dataclass(frozen=True)
class Forecast:
    """What a forecast says. factors: alpha of each limit on the height; why: the reason of a no in one line."""

    go: bool
    first_start: np.datetime64 | None
    starts: tuple[Start, ...] = field(repr=False)
    factors: tuple[Alpha, ...]
    T_R: float
    reason: str = ""
    notes: tuple[str, ...] = ()


def check_forecast(
    weather: Weather,
    limits: Sequence[Limit],
    table: AlphaTable,
    T_POP: float,
    T_C: float | None = None,
    *,
    start: np.datetime64 | None = None,
    horizon: float = 72.0 * 3600.0,
    ship: float | None = None,
    free: bool = False,
) -> Forecast:
    """Looks at every record of the forecast from start (its first by default) to horizon [s] later.

    limits: at least one upper limit on H_m0; T_POP, T_C [s]; ship, free as in `limit_text.inside_by_heading`.
    Errors: WeatherError where no limit is on the height, alpha is not available, or no record is within the horizon.
    """
    heights = [i for i, limit in enumerate(limits) if limit.range.name == "H_m0" and math.isfinite(limit.range.high)]
    if not heights:
        raise WeatherError('--limit: none of them bounds the wave height from above. Give one such as "Hs <= 2 m".')
    factors = {i: alpha_of(table, limits[i].range.high, T_POP, T_C) for i in heights}
    for i in heights:
        if factors[i].alpha is None:
            raise WeatherError(f"--limit {limits[i].text}: {factors[i].reason}")
    scaled = [limit.scaled(factors[i].alpha or 0.0) if i in factors else limit for i, limit in enumerate(limits)]
    rows, one = rows_of(weather, start, horizon), factors[heights[0]]
    workable, valid = inside_by_heading(scaled, weather, ship, free=free)
    looked = starts_of(weather, workable, valid, () if free else bounds(weather, scaled, ship), rows, one.T_R)
    notes = tuple(f"no alpha on {limit.text}: taken as it is" for i, limit in enumerate(limits) if i not in factors)
    if not one.weather_restricted:
        return Forecast(False, None, looked, tuple(factors.values()), one.T_R, one.reason, notes)
    first_go = next((s.time for s in looked if s.go), None)
    reason = "" if looked[0].go else reason_against(looked[0], one.T_R, weather)
    return Forecast(bool(looked[0].go), first_go, looked, tuple(factors.values()), one.T_R, reason, notes)


def rows_of(weather: Weather, start: np.datetime64 | None, horizon: float) -> NDArray[np.intp]:
    """Records from start (the first by default) to horizon [s] later. Errors: WeatherError where there is none."""
    first = weather.time[0] if start is None else start
    rows = np.flatnonzero((weather.time >= first) & (weather.time <= first + np.timedelta64(round(horizon), "s")))
    if len(rows) == 0:
        raise WeatherError(
            f"--start {first}: {weather.source} has no record from there to {horizon / 3600.0:g} h later; it runs from"
            f" {weather.time[0]} to {weather.time[-1]} UTC. Give a start within it."
        )
    return rows


def starts_of(
    weather: Weather, met: BoolArray, valid: BoolArray, upper: Sequence[Bound], rows: NDArray[np.intp], T_R: float
) -> tuple[Start, ...]:
    """Every start of rows (k,), judged by which records meet all limits at each heading that is kept (heading, n), and
    which are known (n,); upper: which limit governs."""
    windows = windows_of(met, weather.time, weather.step)
    within, covered = windows.starts(T_R), windows_of(valid, weather.time, weather.step).starts(T_R)
    t = seconds(weather.time)
    starts = []
    for i in rows:
        last = int(np.searchsorted(t, t[i] + T_R - SLACK))
        go: bool | None = bool(within[i])
        if not go and not covered[i] and not np.any(valid[i:last] & ~met[:, i:last], axis=1).all():
            go = None
        heading = windows.heading[i] if windows.reach[i] else None
        starts.append(Start(weather.time[i], go, *_governing(upper, slice(int(i), last), heading)))
    return tuple(starts)


def bounds(weather: Weather, limits: Sequence[Limit], ship: float | None) -> tuple[Bound, ...]:
    """Those of the limits that have an upper end, record by record."""
    upper_limits = []
    for limit in limits:
        if KIND[limit.range.name] == "angle" or not math.isfinite(limit.range.high):
            continue
        counts = np.ones(len(weather), dtype=np.bool_)
        for part in limit.when:
            counts &= part.holds(values(weather, part.name, limit, ship))
        x = values(weather, limit.range.name, limit, ship)
        upper_limits.append(Bound(limit.text, x, np.where(counts, limit.range.high, np.nan)))
    return tuple(upper_limits)


def _governing(upper: Sequence[Bound], rows: slice, heading: np.intp | None) -> tuple[str, float | None, float | None]:
    """The bound that is used most in these records, its value there and what is allowed; at this heading, or without
    one at that which allows most at the start."""
    most: tuple[float, str, float, float] | None = None
    for bound in upper:
        at_heading = bound.allowed
        if at_heading.ndim > 1:
            at_heading = at_heading[at_heading[:, rows.start].argmax() if heading is None else heading]
        for x, allowed in zip(bound.x[rows], at_heading[rows], strict=True):
            if not (math.isfinite(x) and math.isfinite(allowed)):
                continue
            used = x / allowed if allowed > 0.0 else math.inf
            if most is None or used > most[0]:
                most = (used, bound.text, float(x), float(allowed))
    return ("", None, None) if most is None else most[1:]


def reason_against(first: Start, T_R: float, weather: Weather) -> str:
    """Why a start is a no, in one line."""
    length = f"the {T_R / 3600.0:g} h of T_R"
    if first.go is None:
        return (
            f"no-go at {first.time}: the forecast ends, has a gap or misses a value within {length}; it runs to"
            f" {weather.time[-1]}"
        )
    by = f" ({first.governs})" if first.governs else ""
    return f"no-go at {first.time}: a limit is exceeded within {length}{by}"


def numbers(forecast: Forecast) -> dict[str, Any]:
    """The answer by name [SI]; alpha and op_wf of the first limit on the height, every one under factors."""
    one = forecast.factors[0]
    first = None if forecast.first_start is None else stamp(forecast.first_start)
    return {
        "go": forecast.go,
        "first_start": first,
        "reason": forecast.reason,
        **{key: value for key, value in one.numbers().items() if key != "reason"},
        "factors": [f.numbers() for f in forecast.factors],
        "n_starts": len(forecast.starts),
        "n_go": sum(s.go is True for s in forecast.starts),
        "starts": started(forecast.starts),
        "notes": list(forecast.notes),
    }


def started(starts: Sequence[Start]) -> list[dict[str, Any]]:
    """Starts by name [SI]."""
    return [vars(s) | {"time": stamp(s.time)} for s in starts]
