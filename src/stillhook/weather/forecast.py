"""Go or no-go from a forecast: may an operation start, now or within some days, if the forecast must stay within alpha
times its limits.

An operation may start at a record if, from its time on, its planned time and contingency are forecast without a gap or
a missing value and every record of it is within all limits, those on the significant wave height times alpha (OP_WF),
at one heading of the ship throughout. T_POP counts from the issue of the forecast: a later start has a longer T_POP and
a lower alpha, and from some start on none. Limits on wind, periods, current and directions are taken as they are: their
uncertainty must be in them already. Alpha follows from the limiting height, its own for each, and from T_POP.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.errors import WeatherError
from stillhook.weather.alpha import Alpha, AlphaTable, alpha_of, reference_period, row_of_times
from stillhook.weather.limit_text import KIND, Limit, inside_by_heading, values
from stillhook.weather.persistence import SLACK, seconds, stamp, windows_of
from stillhook.weather.series import Weather


@dataclass(frozen=True)
class Start:
    """A start that was looked at. go: None where the forecast ends, has a gap or misses a value before anything is
    beyond, and where there is no factor so long after its issue.

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
    issue: np.datetime64 | None = None,
) -> Forecast:
    """Looks at every record of the forecast from start (its first by default) to horizon [s] later.

    limits: at least one upper limit on H_m0; T_POP of the operation from its start, T_C [s]; ship, free as in
    `limit_text.inside_by_heading`; issue of the forecast (its first record by default).
    Errors: WeatherError where no limit is on the height, alpha is not to be had, or no record is within the horizon.
    """
    heights = [i for i, limit in enumerate(limits) if limit.range.name == "H_m0" and math.isfinite(limit.range.high)]
    if not heights:
        raise WeatherError('--limit: none of them bounds the wave height from above. Give one such as "Hs <= 2 m".')
    rows = rows_of(weather, start, horizon)
    lead = lead_times(weather, rows, issue)
    contingency = T_POP if T_C is None else T_C
    window, first = T_POP + contingency, float(lead[0]) + T_POP
    factors = {i: alpha_of(table, limits[i].range.high, first, contingency) for i in heights}
    for i in heights:
        if factors[i].alpha is None:
            raise WeatherError(f"--limit {limits[i].text}: {factors[i].reason}")
    looked: list[Start] = [Start(weather.time[i], None) for i in rows]
    for group, T in by_lead(table, lead, T_POP, contingency):
        alpha = {i: alpha_of(table, limits[i].range.high, T, contingency).alpha for i in heights}
        if None in alpha.values():
            continue
        scaled = [limit.scaled(alpha[i] or 0.0) if i in alpha else limit for i, limit in enumerate(limits)]
        workable, valid = inside_by_heading(scaled, weather, ship, free=free)
        upper = () if free else bounds(weather, scaled, ship)
        for k, each in zip(group, starts_of(weather, workable, valid, upper, rows[group], window), strict=True):
            looked[k] = each
    one = factors[heights[0]]
    notes = [f"no alpha on {limit.text}: taken as it is" for i, limit in enumerate(limits) if i not in factors]
    notes += [
        *issue_notes(weather, rows, lead, T_POP, contingency, table, issue),
        *filter(None, [one.short_contingency]),
    ]
    if not one.weather_restricted:
        return Forecast(False, None, tuple(looked), tuple(factors.values()), one.T_R, one.reason, tuple(notes))
    first_go = next((s.time for s in looked if s.go), None)
    reason = "" if looked[0].go else reason_against(looked[0], window, weather)
    return Forecast(bool(looked[0].go), first_go, tuple(looked), tuple(factors.values()), one.T_R, reason, tuple(notes))


def lead_times(weather: Weather, rows: NDArray[np.intp], issue: np.datetime64 | None) -> FloatArray:
    """Time from the issue of the forecast (its first record by default) to each start (n,) [s], 0 before it."""
    since = weather.time[rows] - (weather.time[0] if issue is None else issue)
    return np.maximum(since / np.timedelta64(1, "s"), 0.0)


def by_lead(table: AlphaTable, lead: FloatArray, T_POP: float, T_C: float) -> Iterator[tuple[NDArray[np.intp], float]]:
    """Starts that one row of the table of factors counts for, as places in lead (n,) [s], and their T_POP from the
    issue of the forecast [s]; those that no row counts for, or that are not weather restricted, are in none.

    T_POP of the operation from its start, T_C [s].
    """
    total = lead + T_POP
    row = row_of_times(table, total)
    for k in range(len(table.T_POP)):
        group = np.array(
            [i for i in np.flatnonzero(row == k) if reference_period(table, float(total[i]), T_C)[1]], dtype=np.intp
        )
        if len(group):
            yield group, float(total[group].max())


def issue_notes(
    weather: Weather,
    rows: NDArray[np.intp],
    lead: FloatArray,
    T_POP: float,
    T_C: float,
    table: AlphaTable,
    issue: np.datetime64 | None,
) -> list[str]:
    """When the forecast was issued, and from which start on it gives none; parameters as `by_lead`."""
    since = weather.time[0] if issue is None else issue
    assumed = " (its first record: give the issue where it is another)" if issue is None else ""
    known = {int(i) for group, _ in by_lead(table, lead, T_POP, T_C) for i in group}
    late = [weather.time[i] for k, i in enumerate(rows) if k not in known]
    notes = [f"forecast issued at {stamp(since)}{assumed}: T_POP of a start is its lead time and the planned time"]
    if late:
        notes.append(f"no forecast factor for starts from {stamp(late[0])} on: wait for the next forecast")
    return notes


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
    weather: Weather, met: BoolArray, valid: BoolArray, upper: Sequence[Bound], rows: NDArray[np.intp], window: float
) -> tuple[Start, ...]:
    """Every start of rows (k,), judged by which records meet all limits at each heading that is kept (heading, n), and
    which are known (n,); upper: which limit governs."""
    windows = windows_of(met, weather.time, weather.step)
    within, covered = windows.starts(window), windows_of(valid, weather.time, weather.step).starts(window)
    t = seconds(weather.time)
    starts = []
    for i in rows:
        last = int(np.searchsorted(t, t[i] + window - SLACK))
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


def reason_against(first: Start, window: float, weather: Weather) -> str:
    """Why a start is a no, in one line."""
    length = f"the {window / 3600.0:g} h of operation and contingency"
    if first.go is None:
        return (
            f"no-go at {first.time}: the forecast ends, has a gap or misses a value within {length}, or gives no factor"
            f" so long after its issue; it runs to {weather.time[-1]}"
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
