"""Times of weather tables, in whatever way a spreadsheet or a data base writes them, as UTC.

Known: 2013-12-31 23:00[:00[.0]] with T or a blank and with Z or +01:00, 31.12.2013 23:00, 12/31/13 11:00 PM,
31-Dec-2013 23:00, 2013123123 and with minutes and seconds; date and time in two columns, and columns of year, month,
day, hour, minute. Which of 12/31 and 31/12 is meant is seen from numbers above 12, else from the order in which times
ascend evenly; where both would do, it must be said (`order`).
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from stillhook.errors import WeatherError
from stillhook.units import quote, show
from stillhook.weather.series import usual_step

Times = NDArray[np.datetime64]
ORDERS = ("ymd", "mdy", "dmy")
_NAMES = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_MONTHS = {name: f"{i:02d}" for i, name in enumerate(_NAMES, start=1)}
_CLOCK = r"(?:[T\s,]+(\d{1,2})(?::(\d{1,2})(?::(\d{1,2})(?:[.,]\d+)?)?)?\s*([AaPp][Mm])?)?"
_ZONE = r"\s*(Z|UTC|GMT|[+-]\d{2}:?\d{2})?"
_DATE = re.compile(rf"(\d{{1,4}})([-/.])(\d{{1,2}}|[A-Za-z]{{3}})\2(\d{{1,4}}){_CLOCK}{_ZONE}")
_DIGITS = re.compile(r"(\d{4})(\d{2})(\d{2})T?(?:(\d{2})(?:(\d{2})(?:(\d{2}))?)?)?" + _ZONE)
_PLAIN = re.compile(r"\d{4}-\d{2}-\d{2}[T ]\d{2}:\d{2}(?::\d{2})?Z?")
FIRST_YEAR, LAST_YEAR = 1800, 2200
"""Of records."""
ROUNDED = 1.01
"""A step may be so much longer than the usual spacing: times are rounded."""
_TURN = 70
"""Years of two digits below it are of this century."""


def read_times(texts: Sequence[str], lines: Sequence[int], name: str, order: str | None = None) -> Times:
    """Times (n,) of texts, UTC [s]. order: one of `ORDERS`, needed where the texts leave it open. Errors: WeatherError
    with the line."""
    if (times := _iso(texts)) is not None:
        return times
    fields = [_fields(text, f"{name}: line {line}") for text, line in zip(texts, lines, strict=True)]
    digits = np.array([f[:3] for f in fields], dtype=np.int64)
    chosen = _order(digits, fields, lines, name, order)
    place = {letter: digits[:, chosen.index(letter)] for letter in "ymd"}
    years = np.where(place["y"] < _TURN, place["y"] + 2000, np.where(place["y"] < 100, place["y"] + 1900, place["y"]))
    return stamped(years, place["m"], place["d"], np.array([f[3] for f in fields], dtype=np.int64), lines, name, texts)


def _iso(texts: Sequence[str]) -> Times | None:
    """Times of texts that all read 2013-12-31 23:00 or 2013-12-31T23:00:00Z, as most files have them, at once; None for
    others, and where one is no time."""
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
    """What a record stands for [s]: as requested, else the usual spacing of times (n,). Errors: WeatherError where it
    is longer than that."""
    usual = usual_step(time)
    if requested is not None and requested > ROUNDED * usual:
        raise WeatherError(
            f"{name}: --step {show(requested, 'hours')}: its records are {show(usual, 'hours')} apart, and a longer"
            " step would count time twice. Leave --step out."
        )
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
    """Times of calendar numbers and seconds of the day (which may reach over midnight, by a time zone). Errors:
    WeatherError."""
    months = (year - 1970) * 12 + np.clip(month, 1, 12) - 1
    begin = months.astype("datetime64[M]").astype("datetime64[D]")
    last = ((months + 1).astype("datetime64[M]").astype("datetime64[D]") - begin).astype(np.int64)
    wrong = (month < 1) | (month > 12) | (day < 1) | (day > last) | (year < FIRST_YEAR) | (year > LAST_YEAR)
    if np.any(wrong):
        i = int(np.flatnonzero(wrong)[0])
        raise WeatherError(
            f"{name}: line {lines[i]}: {quote(texts[i])} is no date. Correct the line, or say --date-order ymd, mdy"
            " or dmy."
        )
    return np.asarray((begin + (day - 1)).astype("datetime64[s]") + second.astype("timedelta64[s]"))


def _fields(text: str, where: str) -> tuple[int, int, int, int, str]:
    """Three numbers of the date in the order of the text, seconds of the day in UTC, and the sign between the
    numbers."""
    text = text.strip().strip('"')
    if match := _DATE.fullmatch(text):
        a, sign, b, c, hour, minute, second, half, zone = match.groups()
        if b.isalpha():
            b, sign = _MONTHS.get(b.lower(), "0"), "name"
        return (
            int(a),
            int(b),
            int(c),
            _second(hour, minute, second, half, zone, where, text),
            sign if len(a) < 4 else "iso",
        )
    if match := _DIGITS.fullmatch(text):
        y, m, d, hour, minute, second, zone = match.groups()
        return int(y), int(m), int(d), _second(hour, minute, second, None, zone, where, text), "iso"
    raise WeatherError(
        f"{where}: {quote(text)} is no time such as 2013-12-31 23:00, 31.12.2013 23:00 or 12/31/13 23:00. Correct"
        " the line,"
        " or name the column of times with --time."
    )


def _second(
    hour: str | None, minute: str | None, second: str | None, half: str | None, zone: str | None, where: str, text: str
) -> int:
    h, m, s = (int(x or 0) for x in (hour, minute, second))
    if half is not None:
        if not 1 <= h <= 12:
            raise WeatherError(
                f"{where}: {quote(text)} is no time: hours before AM and PM run from 1 to 12. Correct the line."
            )
        h = h % 12 + (12 if half.lower() == "pm" else 0)
    if h > 24 or m > 59 or s > 60 or (h == 24 and (m or s)):
        raise WeatherError(f"{where}: {quote(text)} is no time of the day. Correct the line.")
    ahead = 0
    if zone is not None and zone[0] in "+-":
        bare = zone[1:].replace(":", "")
        ahead = (int(bare[:2]) * 3600 + int(bare[2:]) * 60) * (-1 if zone[0] == "-" else 1)
    return h * 3600 + m * 60 + s - ahead


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
        raise WeatherError(
            f"{name}: line {lines[i]}: its date is written in another way than that of line {lines[0]}. Use one way."
        )
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
    raise WeatherError(
        f"{name}: line {lines[0]}: of the first two numbers of its dates either may be the month. Say --date-order mdy"
        " or dmy."
    )


def _even(digits: NDArray[np.int64], fields: Sequence[tuple[int, int, int, int, str]], order: str) -> bool:
    """Whether times ascend, without a way from one to the next that is longer than a day, under an order of the
    date."""
    if len(digits) < 2:
        return False
    y, m, d = (digits[:, order.index(letter)] for letter in "ymd")
    day = ((y - 1970) * 12 + m - 1).astype("datetime64[M]").astype("datetime64[D]").astype(np.int64) + d
    steps = np.diff(day * 86400 + np.array([f[3] for f in fields]))
    return bool(np.all(steps > 0) and np.all(steps <= 86400))
