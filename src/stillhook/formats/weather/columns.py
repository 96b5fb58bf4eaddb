"""Columns of weather tables: which of them is what, in which unit, in which sense, and what represents a missing
number.

From columns that were read to weather: directions in the sense that the file or the user declares, and notes on what
was assumed.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.errors import StillhookError, WeatherError, all_of
from stillhook.formats.table.corrections import ColumnRow, row_of
from stillhook.formats.table.dialect import MISSING
from stillhook.formats.table.text import TextTable
from stillhook.formats.weather.times import WHERE, step_of
from stillhook.sea.spectra.directions import FULL, DirectionSense, coming_from
from stillhook.units import quote
from stillhook.weather.series import Weather

HEADINGS: Mapping[str, Any] = MappingProxyType(
    tomllib.loads(Path(__file__).with_name("headings.toml").read_text(encoding="utf-8"))
)
"""What headings of weather tables are, by tables: columns, times."""
KINDS: Mapping[str, str] = MappingProxyType({name: row["kind"] for name, row in HEADINGS["columns"].items()})
_DEGREES = ("deg", "degree", "degrees", "degree_true", "degree true", "degrees true", "°", "degt", "degn")
UNITS: Mapping[str, Mapping[str, float]] = {
    "height": {"m": 1.0, "cm": 0.01, "ft": 0.3048} | dict.fromkeys(("metre", "meter", "metres", "meters"), 1.0),
    "period": dict.fromkeys(("s", "sec", "second", "seconds"), 1.0),
    "speed": dict.fromkeys(("m/s", "m s-1", "m s**-1", "ms-1", "m.s-1"), 1.0)
    | dict.fromkeys(("kn", "kt", "kts", "knots"), 1852.0 / 3600.0)
    | {"km/h": 1.0 / 3.6, "cm/s": 0.01},
    "direction": dict.fromkeys(_DEGREES, math.pi / 180.0) | {"rad": 1.0},
}
PLAIN = {"height": "m", "period": "s", "speed": "m/s", "direction": "deg"}
"""Units that numbers without any are taken for; the reader says so."""
LARGEST = {"height": 40.0, "period": 60.0, "speed": 110.0, "direction": 2.0 * math.pi + 1e-6}
"""In SI. Waves above 40 m, periods above 60 s and wind above 110 m/s were never measured; directions go round once at
most."""
OTHERS = {"height": ("cm", "m"), "period": (), "speed": ("kn", "km/h", "cm/s"), "direction": ("deg", "rad")}
"""Units that numbers may be in which are too large for those that they are in by the file."""
FREQUENCIES: Mapping[str, float] = dict.fromkeys(("hz", "1/s", "s-1", "s^-1"), 1.0) | dict.fromkeys(
    ("rad/s", "rad s-1"), 2.0 * math.pi
)
"""Units of a frequency, and the period times the frequency."""
FREQUENCY_HEADINGS = ("fp", "f_p", "peak_frequency", "fpeak")
"""Headings of a frequency, for which Hz is taken where there is no unit."""
SHORTEST, TALLEST = 1.5, 10.0
"""Median below which periods [s] are another number, and above which heights [m] are in another unit: no place has such
weather on the median."""
FILLS = (999.0, 9999.0, 99999.0, -99.0, -999.0, -9999.0, -32768.0, 999.9, -999.9, 9.96920996838687e36, 1e20)
SHORT_FILLS = (99.0, 99.9, 99.99)
"""Represent a missing number too, but in directions, of which 99 deg is one."""
_BRACKET = re.compile(r"\s*[\[(]\s*([^\])]*?)\s*[\])]\s*$")


@dataclass(frozen=True)
class Column:
    """A column that was recognised: name in `stillhook.weather.series.COLUMNS`, its place, heading and unit; stated:
    the file gave the unit; by_user: the user did; scale: the user's factor on its numbers."""

    name: str
    place: int
    heading: str
    unit: str
    stated: bool
    by_user: bool = False
    scale: float = 1.0

    @property
    def inverse(self) -> bool:
        """Whether its numbers are frequencies of periods."""
        return KINDS[self.name] == "period" and self.unit in FREQUENCIES


def bare(heading: str) -> tuple[str, str]:
    """A heading in lower case with _ between its words, less a number at its end, and its unit in brackets."""
    unit = match[1] if (match := _BRACKET.search(heading)) else ""
    name = re.sub(r"[^a-z0-9]+", "_", _BRACKET.sub("", heading).strip().lower()).strip("_")
    return re.sub(r"_\d$", "", name), unit


def without_unit(heading: str) -> str:
    """A heading less its unit in brackets."""
    return _BRACKET.sub("", heading).strip()


def columns(headings: Sequence[str], units: Sequence[str], columns_as: Mapping[str, Any], name: str) -> list[Column]:
    """Columns that are weather. columns_as: name -> heading of the file, or heading with a unit in brackets, before
    what is recognised."""
    recognised = []
    for key, kind in KINDS.items():
        wanted, scale = _written(key, columns_as.get(key), name)
        place = _recognised(headings, key, name) if wanted is None else _requested(headings, wanted, key, name)
        if place is None:
            continue
        heading, stated = bare(headings[place]), "" if wanted is None or wanted in headings else bare(wanted)[1]
        unit = stated or heading[1] or (units[place] if place < len(units) else "")
        tidy = " ".join(unit.lower().split())
        frequency = kind == "period" and (tidy in FREQUENCIES or (not tidy and heading[0] in FREQUENCY_HEADINGS))
        if tidy and not frequency and tidy not in UNITS[kind]:
            plain = f'columns.{key} = "{without_unit(headings[place])} [{PLAIN[kind]}]"'
            raise WeatherError(
                f"{name}: column {quote(headings[place])}: unit {quote(unit)} is not one of {', '.join(UNITS[kind])}."
                f" Convert its numbers, or say {plain} where that is what they are in."
            )
        by_user = wanted is not None and bool(_BRACKET.search(wanted))
        usual = "hz" if frequency else PLAIN[kind]
        recognised.append(Column(key, place, headings[place], tidy or usual, bool(tidy), by_user, scale))
    return recognised


def _written(key: str, row: Any, name: str) -> tuple[str | None, float]:
    """A row of corrections as heading with its unit in brackets, and the factor on its numbers."""
    if row is None:
        return None, 1.0
    read = row_of(row, ColumnRow, f"{name}: columns.{key}", WeatherError)
    if read.sign != 1 or read.offset:
        raise WeatherError(
            f"{name}: columns.{key}: a height, a period or a speed is not counted the other way, and what a direction"
            " means is said by sense. Leave sign and offset out."
        )
    return read.column if read.unit is None else f"{read.column} [{read.unit}]", read.scale


def _requested(headings: Sequence[str], wanted: str, key: str, name: str) -> int:
    short = without_unit(wanted)
    bares = [without_unit(h) for h in headings]
    for text, among in ((wanted, headings), (short, headings), (short, bares)):
        places = [i for i, h in enumerate(among) if h.strip().lower() == text.strip().lower()]
        if len(places) == 1:
            return places[0]
    have = ", ".join(h for h in headings if h)
    raise WeatherError(f"{name}: columns.{key} = {quote(wanted)}: no column, or several. It has {have}.")


def _recognised(headings: Sequence[str], key: str, name: str) -> int | None:
    for exact in (True, False):  # a number at the end of a heading is dropped only where that leaves one
        names = [
            re.sub(r"[^a-z0-9]+", "_", _BRACKET.sub("", h).strip().lower()).strip("_") if exact else bare(h)[0]
            for h in headings
        ]
        parts = ("u10",) if "v10" in names else ()  # next to v10 it is not a speed but its part towards the east
        row = HEADINGS["columns"][key]
        places = [i for i, n in enumerate(names) if n in row["headings"] and n not in parts]
        places = places or [i for i, n in enumerate(names) if n in row.get("otherwise", ())]
        if len(places) > 1:
            both = " and ".join(quote(headings[i]) for i in places)
            do = f"Choose one, columns.{key} = {quote(headings[places[0]])} {WHERE}."
            raise WeatherError(f"{name}: columns {both} both read as {key}. {do}")
        if places:
            return places[0]
    return None


def numbers(table: TextTable, column: Column, *, signed: bool = False) -> tuple[FloatArray, str]:
    """A column (n,) of a table in SI, and marks of missing numbers, as `in_si`."""
    return in_si(column.scale * table.numbers(column.place, MISSING), column, table.at, signed=signed)


def in_si(x: FloatArray, column: Column, at: Callable[[int], str], *, signed: bool = False) -> tuple[FloatArray, str]:
    """Numbers (n,) of a column in SI (directions in rad, in the file's sense), marks of missing ones as NaN, and what
    marks there were, in words.

    Periods of 0 s, which wave models write into calms, are missing: they would pass for the shortest waves. at: where a
    record is, for the error; signed: of either sign, as parts of the wind are. Errors: WeatherError for numbers that no
    weather has.
    """
    raw, sign = x, np.where(np.signbit(x), -1.0, 1.0) if signed else 1.0

    def place(i: int) -> str:
        return f"{at(i)}: {column.heading} = {raw[i]:.10g} {column.unit}"

    x, kind = x * sign, KINDS[column.name]
    fills = np.isin(x, FILLS if kind == "direction" else (*FILLS, *SHORT_FILLS)) | np.isinf(x)
    none = (x == 0.0) & (kind == "period")
    x = np.where(fills | none | np.isnan(x), np.nan, x)
    x = FREQUENCIES[column.unit] / x if column.inverse else x * UNITS[kind][column.unit]
    wrong = (x > LARGEST[kind]) | (x < (-LARGEST[kind] if kind == "direction" else 0.0))
    if np.any(wrong):
        do = "Correct the line or empty the cell"
        lines = [
            f"{place(i)}: not a possible {kind}. {do}{_in_another_unit(float(x[i]), column)}."
            for i in np.flatnonzero(wrong).tolist()
        ]
        raise WeatherError(lines[0]).with_lines(lines)
    marks = f", {np.count_nonzero(fills)} of them marked by 99, inf or the like" if fills.any() else ""
    noughts = f", {np.count_nonzero(none)} of them 0, first in {place(int(np.argmax(none)))}" if none.any() else ""
    return np.asarray(sign * x), marks + noughts


def _in_another_unit(x: float, column: Column) -> str:
    """What to say where a number [SI] that no weather has would be one in another unit."""
    kind = KINDS[column.name]
    for unit in OTHERS[kind]:
        factor = UNITS[kind][unit] / UNITS[kind][column.unit]
        if factor < 1.0 and 0.0 < abs(x) * factor <= LARGEST[kind] and (x > 0.0 or kind == "direction"):
            said = f'columns.{column.name} = "{without_unit(column.heading)} [{unit}]"'
            return f"; if the numbers are in {unit}, say {said}"
    return ""


SENSES = {
    "coming-from": DirectionSense.FROM_NORTH,
    "going-to": DirectionSense.TO_NORTH,
    "cartesian": DirectionSense.TO_EAST,
    "cartesian-from": DirectionSense.FROM_EAST,
}
"""Words for what directions mean: cartesian is going to, counter-clockwise from east."""
FEWEST = 3
"""Different directions from which it may be seen that they are in radians."""
_DECLARED = re.compile(r"wave[s]?[ _-]*direction[s]?\s*[:=]\s*(.+)", re.IGNORECASE)


def weather_of(
    name: str,
    time: NDArray[np.datetime64],
    headings: Sequence[str],
    units: Sequence[str],
    read: Callable[..., tuple[FloatArray, str]],
    columns_as: Mapping[str, Any],
    sense: DirectionSense | None,
    step: float | None,
    *,
    names: Sequence[str] = (),
    comments: Sequence[str] = (),
    notes: Sequence[str] = (),
) -> Weather:
    """Weather over times UTC [s] of columns with these headings; names: what to call them in notes, where not by their
    headings.

    read: a column in SI in the file's sense, NaN where missing, and what marks of missing numbers it had, in words;
    with signed=True of numbers of either sign. columns_as: as in `columns`. Errors: WeatherError where no column is
    weather.
    """
    names, recognised = names or headings, columns(headings, units, columns_as, name)
    if not recognised:
        have = ", ".join(quote(heading) for heading in headings if heading)
        raise WeatherError(f"{name}: no column of weather among {have}. Name it: columns.Hs, columns.wind {WHERE}.")
    values, more = assembled(_each(recognised, read), comments, name, sense)
    plain = [bare(heading)[0] for heading in headings]
    pair = next((pair for pair in WIND_PARTS if set(pair) <= set(plain)), None)
    parts: list[Column] = []
    if pair is not None and "wind" not in values:
        parts = [Column("wind", i, headings[i], "m/s", False) for i in map(plain.index, pair)]
        east, north = (read(part, signed=True)[0] for part in parts)
        values |= {"wind": np.hypot(east, north), "wind_from": np.asarray(np.arctan2(-east, -north) % FULL)}
        more.append(f"wind from its parts {' and '.join(names[part.place] for part in parts)}")
    places = {column.place for column in (*recognised, *parts)}
    if unread := [names[i] for i, heading in enumerate(headings) if heading and i not in places]:
        more.append(f"not read: {', '.join(unread)}")
    of = {
        c.name: f"{without_unit(names[c.place])} [{_plain(c.unit)}]" for c in recognised if KINDS[c.name] != "direction"
    }
    of |= {c.name: names[c.place] for c in recognised if KINDS[c.name] == "direction"}
    return Weather(time, values, step_of(time, step, name), name, (*comments, *notes, *more), of)


def _each(
    recognised: Sequence[Column], read: Callable[..., tuple[FloatArray, str]]
) -> list[tuple[Column, FloatArray, str]]:
    """Every column, read. Errors: those of all columns at once."""
    done, problems = [], []
    for column in recognised:
        try:
            done.append((column, *read(column)))
        except StillhookError as problem:
            problems.append(problem)
    if problems:
        raise all_of(problems)
    return done


def _plain(unit: str) -> str:
    return "Hz" if unit == "hz" else unit


def assembled(
    read: Sequence[tuple[Column, FloatArray, str]], comments: Sequence[str], name: str, sense: DirectionSense | None
) -> tuple[dict[str, FloatArray], list[str]]:
    """Columns [SI], directions as coming from, and notes on what was assumed, missing or left out.

    read: column, its numbers (n,) in the file's sense [SI], what marks such as 99 were missing values, in words;
    comments: lines of remarks of the file, of which one may say what wave directions mean. Errors: WeatherError where
    the file and the user differ.
    """
    values: dict[str, FloatArray] = {}
    notes: list[str] = []
    for column, x, marked in read:
        if missing := int(np.count_nonzero(np.isnan(x))):
            notes.append(f"{column.heading}: {missing} of {len(x)} missing{marked}")
        if KINDS[column.name] == "direction" and _like_radians(x, column):
            say = f'columns.{column.name} = "{without_unit(column.heading)} [rad]"'
            notes.append(f"{column.heading}: all directions are within 6.3 deg of north. In radians? Then say {say}")
        _check_plausible(x, column, name)
        if column.inverse:
            notes.append(f"{column.heading} is a frequency in {column.unit}: read as the period")
        if KINDS[column.name] != "direction":
            values[column.name] = x
        elif (meant := _meant(column, comments, name, sense)) is not None:
            values[column.name] = coming_from(x, meant)
        else:
            senses = f"{', '.join(list(SENSES)[:-1])} or {list(SENSES)[-1]}"
            notes.append(
                f"the file does not say what its wave direction {quote(column.heading)} means, and it was not read: say"
                f" {WHERE} sense = {senses} (cartesian: going to, counter-clockwise from east)"
            )
    guessed = [f"{c.heading} in {PLAIN[KINDS[c.name]]}" for c, _, _ in read if not c.stated and not c.inverse]
    return values, notes + ([f"units are not in the file and were taken: {', '.join(guessed)}"] if guessed else [])


def _check_plausible(x: FloatArray, column: Column, name: str) -> None:
    """Refuse numbers (n,) [SI] that no weather has on the median, unless the user stated their unit."""
    known = x[np.isfinite(x)]
    if not len(known) or column.by_user:
        return
    median, kind = float(np.median(known)), KINDS[column.name]
    where = f"{name}: column {quote(column.heading)}: the median is {median:.3g}"
    said = f'columns.{column.name} = "{without_unit(column.heading)}'
    if kind == "period" and median < SHORTEST:
        do = f'If it is a frequency, say {said} [Hz]" (then {1.0 / median:.3g} s); if it is right, [s].'
        raise WeatherError(f"{where} s, and no sea has such a period. {do}")
    if kind == "height" and median > TALLEST:
        do = f'If its numbers are in another unit, say which: {said} [cm]"; if they are right, [m].'
        raise WeatherError(f"{where} m, and no place has such waves. {do}")


WIND_PARTS = (("u10", "v10"), ("u_10", "v_10"), ("u10m", "v10m"), ("eastward_wind", "northward_wind"), ("uwnd", "vwnd"))
"""Headings of the wind's parts towards east and north."""


def _like_radians(x: FloatArray, column: Column) -> bool:
    """Whether directions that are taken for degrees all lie within 2 pi of 0, three or more of them."""
    unit = UNITS["direction"][column.unit]
    degrees = x[np.isfinite(x)] / unit
    return unit != 1.0 and len(np.unique(degrees)) >= FEWEST and bool(np.all(np.abs(degrees) <= FULL))


def _meant(column: Column, comments: Sequence[str], name: str, sense: DirectionSense | None) -> DirectionSense | None:
    """What the directions of a column mean; None where it is not stated."""
    words = bare(column.heading)[0].split("_")  # ..._from_direction, ..._to_direction
    said = {"from": DirectionSense.FROM_NORTH, "to": DirectionSense.TO_NORTH}
    declared = next((said[word] for word in said if word in words), None)
    if column.name == "wind_from":
        return declared or DirectionSense.FROM_NORTH
    for line in comments:
        if match := _DECLARED.match(line):
            declared = declared or next((s for s in DirectionSense if s.value == match[1].strip().lower()), None)
    if declared is not None and sense is not None and declared is not sense:
        both = f"the file says its directions are {quote(declared.value)}, sense says {quote(sense.value)}"
        raise WeatherError(f"{name}: column {quote(column.heading)}: {both}. Leave sense out, or correct the file.")
    return declared or sense
