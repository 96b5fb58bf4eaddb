"""Times of weather tables, in any way a spreadsheet or a data base writes them, as UTC.

Known: 2013-12-31 23:00[:00[.0]] with T or a blank and with Z, +01:00, UTC+3 or CET, 31.12.2013 23:00, 12/31/13 11:00
PM, 31-Dec-2013 23:00, 2013123123 and with minutes and seconds, 20131231.230000, 2013-12-31-23, 2013-365 23:00 (day of
the year); seconds since 1970, days since 1899-12-30 as spreadsheets count them; date and time in two columns, and
columns of year, month, day (or day of the year), hour, minute. Which of 12/31 and 31/12 is meant is seen from numbers
above 12, else from the order in which times ascend evenly; where both would do, it must be said (`order`).
Zones are those that a file states in its header, in the name of its column of times or in the row of units.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook.errors import WeatherError
from stillhook.units import quote, show
from stillhook.weather.series import usual_step

Times = NDArray[np.datetime64]
ORDERS = ("ymd", "mdy", "dmy")
WHERE = "in a description (TOML)"
"""Where a user says what a weather file leaves open."""
_NAMES = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_MONTHS = {name: f"{i:02d}" for i, name in enumerate(_NAMES, start=1)}
_CLOCK = (
    r"(?:[T\s,]+(?P<hour>\d{1,2})(?::(?P<minute>\d{1,2})(?::(?P<second>\d{1,2})(?:[.,]\d+)?)?)?"
    r"\s*(?P<half>[AaPp][Mm])?)?"
)
_ZONE = r"\s*(?P<zone>Z|(?:UTC|GMT)?\s?[+-]\d{1,2}:?(?:\d{2})?|[A-Z]{3,4})?"
_WRITTEN = tuple(
    re.compile(way + _ZONE)
    for way in (
        rf"(?P<a>\d{{1,4}})(?P<sign>[-/.])(?P<b>\d{{1,2}}|[A-Za-z]{{3}})(?P=sign)(?P<c>\d{{1,4}}){_CLOCK}",
        r"(?P<a>\d{4})(?P<b>\d{2})(?P<c>\d{2})[._-](?P<hour>\d{2})(?P<minute>\d{2})(?P<second>\d{2})",
        r"(?P<a>\d{4})(?P<b>\d{2})(?P<c>\d{2})T?(?:(?P<hour>\d{2})(?:(?P<minute>\d{2})(?P<second>\d{2})?)?)?",
        r"(?P<a>\d{4})-(?P<b>\d{2})-(?P<c>\d{2})-(?P<hour>\d{1,2})",
        rf"(?P<a>\d{{4}})[-/. ]?(?P<days>\d{{3}}){_CLOCK}",
    )
)
"""Ways to write a date and time: a, b, c of the date in the order of the text; days of the year in place of the last
two."""
_DIGITS = _WRITTEN[1:3]
_COUNTED = re.compile(r"\d+(?:\.\d+)?")
_PLAIN = re.compile(r"\d{4}-\d{2}-\d{2}[T ]\d{2}:\d{2}(?::\d{2})?Z?")
FIRST_YEAR, LAST_YEAR = 1800, 2200
"""Of records."""
ROUNDED = 1.01
"""A step may be so much longer than the usual spacing: times are rounded."""
_TURN = 70
"""Years of two digits below it are of this century."""

_OF_HOURS = {
    0: "utc gmt wet",
    1: "cet met mez west",
    2: "cest mesz eet",
    3: "eest msk",
    8: "awst sgt",
    9: "jst",
    -4: "edt",
    -5: "est cdt",
    -6: "mdt",
    -7: "mst pdt",
    -8: "pst akdt",
    -9: "akst",
    -10: "hst",
}
HOURS = {name: float(hours) for hours, names in _OF_HOURS.items() for name in names.split()}
"""Zones by their names, ahead of UTC [h]. Names that two zones have (IST, BST, CST) are none of them."""
AMBIGUOUS = ("bst", "ist", "cst", "ast")
FARTHEST = 14.0
"""Zone farthest ahead of UTC [h]."""
_OFFSET = r"[+\-−]\s?\d{1,2}(?::?\d{2})?"
_STATED_ZONE = re.compile(
    rf"(?<![A-Za-z])(?:(?:UTC|GMT|Z)\s?(?P<ahead>{_OFFSET})|(?P<bare>{_OFFSET})(?=\s*(?:h|hours|UTC)\b)"
    rf"|(?P<name>{'|'.join(sorted((*HOURS, *AMBIGUOUS), key=len, reverse=True))})(?![A-Za-z])"
    r"|(?P<local>local|LT\b|lokal\w*|ortszeit|(?:Europe|America|Asia|Africa|Australia|Atlantic|Pacific|Indian)/\w+))",
    re.IGNORECASE,
)
_OF_TIME = re.compile(r"time|zone|date|zeit|dato|tid\b|utc|gmt", re.IGNORECASE)
"""A remark is of times where it has one of these words."""


class Count(NamedTuple):
    """A way to count time: what it is called; from when; the unit [s]; least and most numbers."""

    name: str
    begin: np.datetime64
    unit: float
    least: float
    most: float


COUNTS = (
    Count("days since 1899-12-30, as spreadsheets count them", np.datetime64("1899-12-30", "s"), 86400.0, 18e3, 80e3),
    Count("days of MATLAB", np.datetime64("1970-01-01", "s") - np.timedelta64(719529 * 86400, "s"), 86400.0, 7e5, 8e5),
    Count("seconds since 1970", np.datetime64("1970-01-01", "s"), 1.0, 1e8, 5e9),
    Count("milliseconds since 1970", np.datetime64("1970-01-01", "s"), 1e-3, 1e11, 5e12),
)
"""Numbers of no two of them are the same; dates written as digits alone have eight or more and begin with the year."""


def counted(texts: Sequence[str]) -> tuple[Times, str] | None:
    """Times (n,) of texts that count time, rounded to seconds, and how they count; None for others."""
    if not texts or not all(map(_COUNTED.fullmatch, texts)):
        return None
    x = np.array(texts, dtype=np.float64)
    for count in COUNTS:
        if count.least <= x.min() and x.max() <= count.most and not _are_dates(texts):
            seconds = np.round(x * count.unit).astype("timedelta64[s]")
            return np.asarray(count.begin + seconds), count.name
    return None


def _are_dates(texts: Sequence[str]) -> bool:
    """Whether digits are dates such as 2013123123 in place of a count."""
    match = [next((m for way in _DIGITS if (m := way.fullmatch(text))), None) for text in (texts[0], texts[-1])]
    return all(
        m is not None and 1 <= int(m["b"]) <= 12 and 1 <= int(m["c"]) <= 31 and FIRST_YEAR <= int(m["a"]) < LAST_YEAR
        for m in match
    )


def read_times(texts: Sequence[str], lines: Sequence[int], name: str, order: str | None = None) -> Times:
    """Times (n,) of texts, UTC [s]. order: one of `ORDERS`, where the texts leave it open. Errors: WeatherError."""
    if (times := _iso(texts)) is not None:
        return times
    if (result := counted(texts)) is not None:
        return result[0]
    fields = [_fields(text, f"{name}: line {line}") for text, line in zip(texts, lines, strict=True)]
    digits = np.array([f[:3] for f in fields], dtype=np.int64)
    chosen = _order(digits, fields, lines, name, order)
    place = {letter: digits[:, chosen.index(letter)] for letter in "ymd"}
    years = np.where(place["y"] < _TURN, place["y"] + 2000, np.where(place["y"] < 100, place["y"] + 1900, place["y"]))
    return stamped(years, place["m"], place["d"], np.array([f[3] for f in fields], dtype=np.int64), lines, name, texts)


def _iso(texts: Sequence[str]) -> Times | None:
    """Times of texts that all read 2013-12-31 23:00 or 2013-12-31T23:00:00Z, at once; None for others."""
    if not all(map(_PLAIN.fullmatch, texts)):
        return None
    try:
        times = np.array([text.removesuffix("Z") for text in texts], dtype="datetime64[s]")
    except ValueError:
        return None
    if not len(times):
        return None
    first, last = np.datetime64(f"{FIRST_YEAR}", "s"), np.datetime64(f"{LAST_YEAR + 1}", "s")
    return times if times.min() >= first and times.max() < last else None


def step_of(time: Times, requested: float | None, name: str) -> float:
    """What a record stands for [s]: as requested, else the usual spacing of times (n,). Errors: WeatherError."""
    usual = usual_step(time)
    if requested is not None and requested > ROUNDED * usual:
        problem = f"its records are {show(usual, 'hours')} apart, and a longer step would count time twice"
        raise WeatherError(f"{name}: step = {show(requested, 'hours')}: {problem}. Leave step out.")
    return usual if requested is None else requested


def stamped(
    year: NDArray[np.int64],
    month: NDArray[np.int64],
    day: NDArray[np.int64],
    second: NDArray[np.int64],
    lines: Sequence[int],
    name: str,
    texts: Sequence[str],
) -> Times:
    """Times of calendar numbers and seconds of the day, which may reach over midnight. Errors: WeatherError."""
    months = (year - 1970) * 12 + np.clip(month, 1, 12) - 1
    begin = months.astype("datetime64[M]").astype("datetime64[D]")
    last = ((months + 1).astype("datetime64[M]").astype("datetime64[D]") - begin).astype(np.int64)
    wrong = (month < 1) | (month > 12) | (day < 1) | (day > last) | (year < FIRST_YEAR) | (year > LAST_YEAR)
    if np.any(wrong):
        i = int(np.flatnonzero(wrong)[0])
        do = "Correct the line, or give date_order = ymd, mdy or dmy."
        raise WeatherError(f"{name}: line {lines[i]}: {quote(texts[i])} is not a date. {do}")
    return np.asarray((begin + (day - 1)).astype("datetime64[s]") + second.astype("timedelta64[s]"))


def _fields(text: str, where: str) -> tuple[int, int, int, int, str]:
    """Three numbers of the date in the order of the text, seconds of the day in UTC, and the sign between them."""
    text = text.strip().strip('"')
    match = next((m for way in _WRITTEN if (m := way.fullmatch(text))), None)
    if match is None:
        known = "2013-12-31 23:00, 31.12.2013 23:00 or 12/31/13 23:00"
        do = "Correct the line, or name the column of times by time."
        raise WeatherError(f"{where}: {quote(text)} is not a time such as {known}. {do}")
    part = match.groupdict()
    second, a, sign = _second(part, where, text), part["a"], part.get("sign") or "iso"
    if "days" in part:
        return int(a), *calendar_of(int(a), int(part["days"]), where), second, "iso"
    b = part["b"]
    if b.isalpha():
        b, sign = _MONTHS.get(b.lower(), "0"), "name"
    return int(a), int(b), int(part["c"]), second, sign if len(a) < 4 else "iso"


def _second(part: Mapping[str, str | None], where: str, text: str) -> int:
    """Seconds of the day in UTC."""
    half, zone = part.get("half"), part["zone"]
    h, m, s = (int(part.get(name) or 0) for name in ("hour", "minute", "second"))
    if half is not None and not 1 <= h <= 12:
        raise WeatherError(
            f"{where}: {quote(text)} is not a time: hours before AM and PM run from 1 to 12. Correct the line."
        )
    if half is not None:
        h = h % 12 + (12 if half.lower() == "pm" else 0)
    if h > 24 or m > 59 or s > 60 or (h == 24 and (m or s)):
        raise WeatherError(f"{where}: {quote(text)} is not a time of the day. Correct the line.")
    ahead = 0.0
    if zone is not None and zone != "Z":
        stated = zone_in(f"UTC{zone}" if zone[0] in "+-" else zone)
        if stated is None or stated.ahead is None:
            raise WeatherError(f'{where}: {quote(text)}: the zone {quote(zone)} is not known. Write it as "+03:00".')
        ahead = stated.ahead
    return h * 3600 + m * 60 + s - round(ahead * 3600.0)


def calendar_of(year: int, day_of_year: int, where: str) -> tuple[int, int]:
    """Month and day of a day of the year, from 1. Errors: WeatherError."""
    last = 366 if (year % 4 == 0 and year % 100 != 0) or year % 400 == 0 else 365
    if not 1 <= day_of_year <= last or not FIRST_YEAR <= year <= LAST_YEAR:
        raise WeatherError(f"{where}: day {day_of_year} of {year} is not a date. Correct the line.")
    date = np.datetime64(f"{year:04d}-01-01", "D") + (day_of_year - 1)
    return int(str(date)[5:7]), int(str(date)[8:10])


def _order(
    digits: NDArray[np.int64],
    fields: Sequence[tuple[int, int, int, int, str]],
    lines: Sequence[int],
    name: str,
    order: str | None,
) -> str:
    """Order of year, month and day in the texts."""
    signs = {f[4] for f in fields}
    if signs == {"iso"}:
        return "ymd"
    if "iso" in signs:
        i = next(i for i, f in enumerate(fields) if (f[4] == "iso") != (fields[0][4] == "iso"))
        problem = f"its date is written in another way than that of line {lines[0]}"
        raise WeatherError(f"{name}: line {lines[i]}: {problem}. Use one way.")
    if "name" in signs or "." in signs:
        return "dmy"
    if order is not None:
        return order
    if np.any(digits[:, 0] > 12):
        return "dmy"
    if np.any(digits[:, 1] > 12):
        return "mdy"
    sound = [o for o in ("mdy", "dmy") if _even(digits, fields, o)]
    if len(sound) == 1:
        return sound[0]
    problem = "of the first two numbers of its dates either may be the month"
    raise WeatherError(f'{name}: line {lines[0]}: {problem}. Say date_order = "mdy" or "dmy", {WHERE}.')


def _even(digits: NDArray[np.int64], fields: Sequence[tuple[int, int, int, int, str]], order: str) -> bool:
    """Whether times ascend by a day at most, under an order of the date."""
    if len(digits) < 2:
        return False
    y, m, d = (digits[:, order.index(letter)] for letter in "ymd")
    day = ((y - 1970) * 12 + m - 1).astype("datetime64[M]").astype("datetime64[D]").astype(np.int64) + d
    steps = np.diff(day * 86400 + np.array([f[3] for f in fields]))
    return bool(np.all(steps > 0) and np.all(steps <= 86400))


class Zone(NamedTuple):
    """A zone as a file states it: ahead of UTC [h], None where it is not known; text as it is written there."""

    ahead: float | None
    text: str


def zone_in(text: str) -> Zone | None:
    """The zone that a text names; None where it names none."""
    match = _STATED_ZONE.search(text.replace("_", " "))
    if match is None:
        return None
    if offset := match["ahead"] or match["bare"]:
        digits = offset.replace("−", "-").replace(" ", "")
        sign, number = (-1.0 if digits[0] == "-" else 1.0), digits[1:].replace(":", "")
        hours = float(number) if len(number) <= 2 else float(number[:-2]) + float(number[-2:]) / 60.0
        return Zone(sign * hours if hours <= FARTHEST else None, match[0].strip())
    name = (match["name"] or "").lower()
    return Zone(HOURS.get(name), match[0].strip())


def zone_of_remarks(lines: Iterable[str]) -> Zone | None:
    """The zone that remarks of a file name, in a line about times."""
    result = (zone_in(line) for line in lines if _OF_TIME.search(line))
    return next((zone for zone in result if zone is not None), None)


def parse_zone(text: str, where: str) -> Zone:
    """A zone that the user states. Errors: WeatherError."""
    zone = zone_in(text)
    if zone is None or zone.ahead is None:
        raise WeatherError(f'{where} {quote(text)}: is not a time zone that is known. Write it as "UTC+3" or "CET".')
    return zone
