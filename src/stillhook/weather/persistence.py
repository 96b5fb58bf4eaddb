"""Persistence of workable weather: how much of the time, in windows how long, and how long one waits for one that is
long enough.

A record stands for one step from its time on: a window of n hourly records is n hours long. Two records follow each
other if they are one step apart; a longer way is a gap (`GAP`), and a gap breaks a window, as does a record of which
what a limit needs is not known. Windows that the ends of the series or a gap cut are counted as long as they are
seen.

A vessel that is free to turn keeps one heading through an operation: its records are given heading by heading, and a
window is a longest unbroken time at one of them (windows of two headings may overlap). A record is then workable where
it lies in a window of the operation's length at one heading: no heading is that of a record alone.

An operation of a given length can start in a record from which at least so much workable time follows without a break,
and the wait of a record is the time by the clock, gaps included, to the first such record at or after it: 0 where it
can start at once. Waits are taken from every record, workable or not. Records after the last possible start are
censored: their wait is not known, they are counted and left out of mean and percentiles, which are therefore too low
where many are. Percentiles are linear between the two nearest waits (numpy's "linear").

Answers about weather as one table of names and numbers, for JSON and for people.
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
from stillhook.sea.spectra.directions import FULL
from stillhook.units import number
from stillhook.weather.limit_text import BETA, KIND, Limit, by_heading, inside_by_heading
from stillhook.weather.series import HOUR, Weather, every

GAP = 1.01
"""Records further apart than this many steps have a gap between them; below, clocks of buoys jitter."""
SLACK = 1e-6
"""Rounding of times that may be missing in a window [s]."""
IN_TIME = ("window_mean", "window_max", "wait_mean", "wait_p50", "wait_p90", "wait_max")


@dataclass(frozen=True)
class Persistence:
    """Counts, shares and times of one series, or of one month of the year in it.

    n_hours: hours that the records cover (records times step); n_missing: records of which something that a limit asks
    for is not known; operability: share of the valid records inside all limits, for a vessel that keeps one of several
    headings those in a window of the operation's length at one of them; start_share: share of the possible
    starts, records that are followed by known ones through a whole window, in which the operation can start at once;
    n_windows, window_mean, window_max: unbroken workable times [s], of a month those that begin in it;
    n_windows_long_enough: of these, as long as the operation or longer; wait_mean, wait_p50, wait_p90, wait_max [s];
    n_censored: records without a later start; n_gaps: breaks in time. Times and shares are NaN where there is nothing
    to take them from. month: 1 to 12, of the record or window's begin, all years.
    """

    n_hours: float
    n_missing: int
    operability: float
    start_share: float
    n_windows: int
    window_mean: float
    window_max: float
    n_windows_long_enough: int
    wait_mean: float
    wait_p50: float
    wait_p90: float
    wait_max: float
    n_censored: int
    n_gaps: int
    month: int | None = None
    months: tuple[Persistence, ...] = field(default=(), repr=False)

    def numbers(self) -> dict[str, Any]:
        """Its numbers by name [SI], counts as whole numbers; a month's begin with which it is."""
        hours = round(self.n_hours, 9)
        hours = int(hours) if hours.is_integer() else hours
        values = {name: value for name, value in vars(self).items() if name not in ("month", "months")} | {
            "n_hours": hours
        }
        return values if self.month is None else {"month": self.month} | values


@dataclass(frozen=True, eq=False)
class Windows:
    """Unbroken workable times: first record (k,) and length (k,) [s]. reach (n,) [s]: workable time without a break
    from each record on; heading (n,): the row of headings at which it is longest."""

    first: NDArray[np.intp]
    length: FloatArray
    reach: FloatArray = field(repr=False)
    heading: NDArray[np.intp] = field(repr=False)

    def starts(self, window: float) -> BoolArray:
        """Whether what takes a window [s] can start in each record (n,)."""
        return np.asarray(self.reach >= window - SLACK)


def seconds(time: NDArray[np.datetime64]) -> FloatArray:
    """Times as seconds from the first."""
    return np.asarray((time - time[0]) / np.timedelta64(1, "ms"), dtype=np.float64) / 1000.0


def gaps(time: NDArray[np.datetime64], step: float) -> BoolArray:
    """Whether there is a gap between each record and the next (n - 1,)."""
    return np.asarray(np.diff(seconds(time)) > GAP * step)


def windows_of(workable: BoolArray, time: NDArray[np.datetime64], step: float) -> Windows:
    """Longest runs of workable records; workable (n,), or (heading, n) of which one is kept through a run."""
    t, unbroken = seconds(time), ~gaps(time, step)
    rows = np.atleast_2d(workable)
    reach, heading = _reach(rows[0], t, unbroken, step), np.zeros(len(t), dtype=np.intp)
    seen = {rows[0].tobytes()}
    for k, row in enumerate(rows[1:], start=1):
        if (content := row.tobytes()) in seen:
            continue
        seen.add(content)
        each = _reach(row, t, unbroken, step)
        heading[each > reach] = k
        reach = np.maximum(reach, each)
    end = t + reach
    first = np.flatnonzero((reach > 0.0) & np.concatenate(([True], np.diff(end) > SLACK)))
    return Windows(first, reach[first], reach, heading)


def _reach(workable: BoolArray, t: FloatArray, unbroken: BoolArray, step: float) -> FloatArray:
    """Workable time without a break from each record on (n,) [s]."""
    ends = workable & np.concatenate((~workable[1:] | ~unbroken, [True]))
    last = np.flatnonzero(ends)
    reach = np.zeros(len(t))
    reach[workable] = t[last[np.searchsorted(last, np.flatnonzero(workable))]] + step - t[workable]
    return reach


@dataclass(frozen=True, eq=False)
class Window:
    """Where in a series an operation of a given length can start, for many series of workable records with the same
    times: as `Windows.starts`, in a tenth of the time.

    after (n,): the record behind the last one that an operation needs which starts in each; possible (n,): whether the
    series continues so far without a gap; records: how many an operation needs, 0 where clocks jitter and it differs.
    """

    after: NDArray[np.intp]
    possible: BoolArray
    records: int

    @classmethod
    def of(cls, time: NDArray[np.datetime64], step: float, window: float) -> Window:
        """Of a window [s] in a series of records that stand for a step [s] each."""
        t, n = seconds(time), len(time)
        last = np.maximum(np.searchsorted(t, t + (window - SLACK - step)), np.arange(n))
        breaks = np.concatenate(([0], np.cumsum(gaps(time, step))))
        inside = last < n
        last = np.minimum(last, n - 1)
        possible = inside & (breaks[last] == breaks)
        needed = np.unique((last + 1 - np.arange(n))[possible])
        return cls(last + 1, possible, int(needed[0]) if len(needed) == 1 else 0)

    def starts(self, workable: BoolArray) -> BoolArray:
        """Whether it can start in each record, all of those that it needs being workable (n,)."""
        if self.records == 0:
            lost = np.concatenate(([0], np.cumsum(~workable, dtype=np.int32)))
            return np.asarray(self.possible & (lost[self.after] == lost[:-1]))
        start, seen = workable.copy(), 1
        while seen < self.records:  # so many records from each on are workable
            more = min(seen, self.records - seen)
            start[:-more] &= start[more:].copy()
            seen += more
        return np.asarray(start & self.possible)

    def covered(self, starts: BoolArray) -> BoolArray:
        """Whether each record lies within an operation that starts in one of these records (n,)."""
        change = np.zeros(len(starts) + 1, dtype=np.int64)
        change[:-1] += starts
        np.subtract.at(change, self.after[starts], 1)
        return np.asarray(np.cumsum(change)[:-1] > 0)


def waits(can_start: BoolArray, time: NDArray[np.datetime64]) -> FloatArray:
    """Time from each record to the first from it on in which the operation can start (n,) [s]; NaN: none."""
    n, t = len(can_start), seconds(time)
    after = np.minimum.accumulate(np.where(can_start, np.arange(n), n)[::-1])[::-1]
    return np.where(after < n, t[np.minimum(after, n - 1)] - t, np.nan)


def persistence(
    workable: BoolArray, time: NDArray[np.datetime64], step: float, window: float, *, valid: BoolArray | None = None
) -> Persistence:
    """Persistence of a series of workable records, with its months.

    Parameters: workable (n,), whether all limits are met, or (heading, n) for a vessel that keeps one of several
    headings; time (n,) ascending; step [s]: what a record stands for; window: how long the
    operation takes [s]; valid (n,): whether a record is known (default: all).
    Errors: WeatherError for shapes that differ, times that do not ascend and lengths that are not above 0.
    """
    n = np.shape(workable)[-1]
    finite = np.ones(n, dtype=np.bool_) if valid is None else np.asarray(valid, dtype=np.bool_)
    if n == 0 or len(time) != n or len(finite) != n:
        raise WeatherError(
            f"weather: {n} records, {len(time)} times and {len(finite)} marks. Give as many of each, at least one."
        )
    if np.any(np.diff(time) <= np.timedelta64(0, "ms")):
        raise WeatherError("weather: times do not ascend. Put the records in order, each time once.")
    if not (0.0 < window < math.inf) or not (0.0 < step < math.inf):
        raise WeatherError(f"weather: a window of {window:g} s in steps of {step:g} s. Give times longer than 0 s.")
    work: BoolArray = np.atleast_2d(np.asarray(workable, dtype=np.bool_)) & finite
    windows = windows_of(work, time, step)
    can_start, could_start = windows.starts(window), windows_of(finite, time, step).starts(window)
    kept = work[0]
    if len(work) > 1:
        whole = Window.of(time, step, window)
        rows = {row.tobytes(): row for row in work}.values()
        kept = np.any([whole.covered(whole.starts(row)) for row in rows], axis=0)
    wait, breaks, months = waits(can_start, time), gaps(time, step), month_of(time)

    def counted(month: int | None = None, parts: tuple[Persistence, ...] = ()) -> Persistence:
        """Numbers of all records, with their months; or of the records of one month."""
        rows = np.ones(n, dtype=np.bool_) if month is None else months == month
        lengths = windows.length[rows[windows.first]]
        waited = wait[rows & np.isfinite(wait)]
        p50, p90 = np.percentile(waited, (50.0, 90.0)) if len(waited) else (math.nan, math.nan)
        return Persistence(
            n_hours=int(np.count_nonzero(rows)) * step / HOUR,
            n_missing=int(np.count_nonzero(~finite & rows)),
            operability=_share(kept & rows, finite & rows),
            start_share=_share(can_start & rows, could_start & rows),
            n_windows=len(lengths),
            window_mean=float(lengths.mean()) if len(lengths) else math.nan,
            window_max=float(lengths.max()) if len(lengths) else math.nan,
            n_windows_long_enough=int(np.count_nonzero(lengths >= window - SLACK)),
            wait_mean=float(waited.mean()) if len(waited) else math.nan,
            wait_p50=float(p50),
            wait_p90=float(p90),
            wait_max=float(waited.max()) if len(waited) else math.nan,
            n_censored=int(np.count_nonzero(rows & ~np.isfinite(wait))),
            n_gaps=int(np.count_nonzero(breaks & rows[:-1])),
            month=month,
            months=parts,
        )

    return counted(parts=tuple(counted(int(month)) for month in np.unique(months)))


def _share(part: BoolArray, of: BoolArray) -> float:
    n = int(np.count_nonzero(of))
    return float(np.count_nonzero(part) / n) if n else math.nan


def month_of(time: NDArray[np.datetime64]) -> NDArray[np.int64]:
    """Month of each record (n,), 1 to 12."""
    return np.asarray(time.astype("datetime64[M]").astype(np.int64) % 12 + 1)


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
    headings = by_heading(limits, weather) if free and turned else []
    return {
        "file": weather.source,
        "start": stamp(weather.time[0]),
        "end": stamp(weather.time[-1]),
        "step": step,
        "limits": [limit.text for limit in limits],
        "window": window,
        "ship": ("free" if free else ship) if turned else None,
        "n_records": len(rows),
        "n_valid": int(np.count_nonzero(valid[rows])),
        **numbers,
        "hours": {"window": window / HOUR, **{name: numbers[name] / HOUR for name in IN_TIME}},
        "months": [month.numbers() for month in statistics.months],
        **({"by_heading": [{"ship": s, "operability": o} for s, o in headings]} if headings else {}),
        "notes": notes,
    }


def show_answer(weather: Weather) -> dict[str, Any]:
    """What a series holds, column by column [SI]; directions: mean, least and most. absent: time in gaps [s]."""
    apart = np.diff(seconds(weather.time))
    broken = gaps(weather.time, weather.step)
    return {
        "file": weather.source,
        "start": stamp(weather.time[0]),
        "end": stamp(weather.time[-1]),
        "step": weather.step,
        "n_records": len(weather),
        "n_gaps": int(np.count_nonzero(broken)),
        "absent": float(np.sum(apart[broken] - weather.step)),
        "columns": {name: _column(name, x) for name, x in weather.columns.items()},
        "notes": list(weather.notes),
    }


def _column(name: str, x: FloatArray) -> dict[str, float | int | None]:
    values = x[np.isfinite(x)]
    counts: dict[str, float | int | None] = {"n_missing": len(x) - len(values)}
    if len(values) == 0:
        return counts | dict.fromkeys(("min", "mean", "p90", "max"))
    if KIND[name] == "angle":
        mean, p90 = float(np.angle(np.mean(np.exp(1j * values)))) % FULL, None
    else:
        mean, p90 = float(values.mean()), float(np.percentile(values, 90.0))
    return counts | {"min": float(values.min()), "mean": mean, "p90": p90, "max": float(values.max())}
