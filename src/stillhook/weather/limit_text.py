"""Limits of weather as text: "Hs <= 1.5 m", "wind <= 10 m/s", "Tp 5..12 s", "Hs <= 3 m for beta 150..210 deg"; both
ends are inside.

A limit is a range of one column of the weather, and may hold for a part of the records only ("for ..."). Every limit
must hold. beta is the direction in which the waves travel, counter-clockwise from the bow, and needs to know where the
ship heads; a ship that is free keeps one heading through an operation (every `FREE_STEP` is tried). Ranges of angles
run in rising sense, through 360 deg.

Headings of a weather file that a user names: "Hs" = "my height (cm)".
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.base.choice import nearest
from stillhook.errors import UnitError, WeatherError
from stillhook.sea.spectra.directions import FULL, relative
from stillhook.units import parse, quote
from stillhook.variables import BY_NAME
from stillhook.weather.series import SYSTEMS, Weather

BETA = "beta"
SPELLINGS = {
    "H_m0": ("hs", "h_s", "hm0", "h_m0", "waveheight", "wave_height", "height"),
    "T_p": ("tp", "t_p", "period"),
    "T_m02": ("tz", "t_z", "tm02", "t_m02"),
    "wind": ("wind", "windspeed", "wind_speed"),
    "current": ("current",),
    "come_from": ("from", "come_from", "direction", "wave_from"),
    "wind_from": ("wind_from",),
    BETA: (BETA,),
    **{f"H_m0_{system}": (f"hs_{system}", f"hm0_{system}") for system in SYSTEMS},
    **{f"T_p_{system}": (f"tp_{system}",) for system in SYSTEMS},
    **{f"come_from_{system}": (f"from_{system}", f"come_from_{system}") for system in SYSTEMS},
}
KIND = {name: BY_NAME[name].kind for name in SPELLINGS}
"""Columns that a limit may be of, with the kind of their units."""
SPELT = {spelling: name for name, spellings in SPELLINGS.items() for spelling in spellings}
FREE_STEP = math.radians(5.0)
"""Headings that a ship free to turn tries are so far apart [rad]."""
SAME = 1e-9
"""Relative: how far from a limit a number may lie and still be on it. Sums of binary floats are off by 1e-16."""
EXAMPLES = '"Hs <= 1.5 m", "wind <= 10 m/s", "Tp 5..12 s" or "Hs <= 3 m for beta 150..210 deg"'

_BOUND = re.compile(r"\s*([A-Za-z_][A-Za-z_0-9]*)\s*(<=|>=|=<|=>|≤|≥|<|>|==?)\s*(\S.*?)\s*")
_RANGE = re.compile(r"\s*([A-Za-z_][A-Za-z_0-9]*)\s+(\S+?)\s*\.\.\s*(\S+)\s+(\S.*?)\s*")


@dataclass(frozen=True)
class Range:
    """low <= column <= high [SI]; of angles, from low on in rising sense to high."""

    name: str
    low: float = -math.inf
    high: float = math.inf

    def holds(self, x: FloatArray) -> BoolArray:
        """Whether each number is inside; a number that is not known is not."""
        if KIND[self.name] == "angle":
            width = self.high - self.low if self.high - self.low >= FULL else (self.high - self.low) % FULL
            return np.asarray(((x - self.low + SAME) % FULL <= width + 2.0 * SAME) & np.isfinite(x))
        return np.asarray((x >= self.low - SAME * abs(self.low)) & (x <= self.high + SAME * abs(self.high)))


@dataclass(frozen=True)
class Limit:
    """A range that counts where every one of `when` holds (always, without any). text: as it was written."""

    range: Range
    when: tuple[Range, ...] = ()
    text: str = ""

    @property
    def columns(self) -> tuple[str, ...]:
        """What it asks of the weather."""
        return tuple(dict.fromkeys((self.range.name, *(r.name for r in self.when))))

    def scaled(self, factor: float) -> Limit:
        """The limit with its upper end times a factor."""
        return replace(self, range=replace(self.range, high=self.range.high * factor))


def parse_limit(text: str, where: str = "--limit") -> Limit:
    """The limit that a text describes. Errors: WeatherError, UnitError of one line."""
    head, *conditions = re.split(r"\s+for\s+", text.strip())
    if len(conditions) > 1:
        raise WeatherError(f'{where} {quote(text)}: has "for" twice. Join conditions with "and".')
    when = tuple(_range(part, text, where) for part in re.split(r"\s+and\s+", conditions[0])) if conditions else ()
    return Limit(_range(head, text, where), when, " ".join(text.split()))


def _range(part: str, text: str, where: str) -> Range:
    if match := _RANGE.fullmatch(part):
        name = _column(match[1], text, where)
        low, high = (_value(f"{number} {match[4]}", name, text, where) for number in (match[2], match[3]))
        if low > high and KIND[name] != "angle":
            raise WeatherError(f"{where} {quote(text)}: the range ends below its start. Write the lower end first.")
        return Range(name, low, high)
    match = _BOUND.fullmatch(part)
    if match is None:
        raise WeatherError(f"{where} {quote(text)}: is not a limit. Write one such as {EXAMPLES}.")
    name, sign = _column(match[1], text, where), match[2]
    if sign in ("<", ">", "=", "=="):
        raise WeatherError(f"{where} {quote(text)}: limits are inclusive. Write <= or >=.")
    if KIND[name] == "angle":
        raise WeatherError(
            f'{where} {quote(text)}: a direction has no lower and upper side. Write a range such as "{name} 150..210'
            ' deg".'
        )
    value = _value(match[3], name, text, where)
    return Range(name, high=value) if sign in ("<=", "=<", "≤") else Range(name, low=value)


def _column(name: str, text: str, where: str) -> str:
    if name in KIND:
        return name
    if name.lower() not in SPELT:
        raise WeatherError(
            f"{where} {quote(text)}: {quote(name)} is not one of Hs, Tp, Tz, wind, current, come_from, wind_from, beta,"
            " nor Hs, Tp or from with _swell or _wind_sea."
        )
    return SPELT[name.lower()]


def _value(value: str, name: str, text: str, where: str) -> float:
    number = parse(value, KIND[name], f"{where} {quote(text)}")
    if number < 0.0 and KIND[name] != "angle":
        raise UnitError(f"{where} {quote(text)}: below zero. Give a limit that weather can meet.")
    return number


def inside(limits: Sequence[Limit], weather: Weather, ship: float | None = None) -> tuple[BoolArray, BoolArray]:
    """Which records (n,) meet every limit, and which of them are valid: all that the limits need is known. What is
    not valid is not met.

    ship: where the bow points, clockwise from north [rad].
    Errors: WeatherError where the weather has no column for a limit, or where waves from the bow are requested
    without a heading.
    """
    if ship is None and _of_heading(limits):
        raise WeatherError(
            '--ship: missing: a limit depends on beta. Give where the bow points, "315 deg" from north, or "free".'
        )
    return _inside(limits, weather, ship)


def inside_by_heading(
    limits: Sequence[Limit], weather: Weather, ship: float | None = None, *, free: bool = False
) -> tuple[BoolArray, BoolArray]:
    """`inside` at each heading that the ship may keep (heading, n): one row where it is held, `free_headings` where it
    is free and a limit needs beta; and which records are valid (n,), at some heading. Errors: as `inside`."""
    if not free or not _of_heading(limits):
        met, valid = inside(limits, weather, ship)
        return met[None], valid
    answers = [_inside(limits, weather, float(heading)) for heading in free_headings()]
    return np.stack([met for met, _ in answers]), np.any([valid for _, valid in answers], axis=0)


def free_headings() -> FloatArray:
    """Headings that a ship free to turn tries [rad from north]."""
    return np.arange(0.0, FULL - SAME, FREE_STEP)


def _of_heading(limits: Sequence[Limit]) -> bool:
    return any(BETA in limit.columns for limit in limits)


def by_heading(limits: Sequence[Limit], weather: Weather) -> list[tuple[float, float]]:
    """Headings that a ship free to turn tries [rad from north], and the share of valid records inside all limits."""
    shares = []
    for heading in free_headings():
        met, valid = _inside(limits, weather, float(heading))
        shares.append((float(heading), float(met[valid].mean()) if valid.any() else math.nan))
    return shares


def _inside(limits: Sequence[Limit], weather: Weather, ship: float | None) -> tuple[BoolArray, BoolArray]:
    met, valid = np.ones(len(weather), dtype=np.bool_), np.ones(len(weather), dtype=np.bool_)
    for limit in limits:
        counts, finite = np.ones(len(weather), dtype=np.bool_), np.ones(len(weather), dtype=np.bool_)
        for part in limit.when:
            x = values(weather, part.name, limit, ship)
            counts &= part.holds(x)
            finite &= np.isfinite(x)
        x = values(weather, limit.range.name, limit, ship)
        valid &= finite & (~counts | np.isfinite(x))
        met &= ~counts | limit.range.holds(x)
    return met & valid, valid


def values(weather: Weather, name: str, limit: Limit, ship: float | None) -> FloatArray:
    """What a limit looks at, record by record (n,) [SI]."""
    column = "come_from" if name == BETA else name
    if column not in weather.columns:
        have = ", ".join(weather.columns) or "nothing"
        hint = next((note for note in weather.notes if column == "come_from" and "direction" in note), "")
        do = (
            hint[:1].upper() + hint[1:]
            if hint
            else "Drop the limit, or map a column to it, columns.NAME in a description (TOML)."
        )
        raise WeatherError(f"--limit {quote(limit.text)}: {weather.source} has no {column}; it has {have}. {do}")
    x = weather.columns[column]
    if not np.isfinite(x).any():
        raise WeatherError(
            f"--limit {quote(limit.text)}: {weather.source} has no record of {column}: all {len(x)} are missing. Choose"
            " another column, columns.NAME in a description (TOML), or drop the limit."
        )
    return relative(x, ship) if name == BETA and ship is not None else x


NAMED = (
    *("Hs", "Tp", "Tz", "wind", "come_from", "wind_from", "current"),
    *(f"{name}_{system}" for system in SYSTEMS for name in ("Hs", "Tp", "from")),
)


def mapped(headings: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Names as users write them -> headings for `stillhook.formats.weather.file.read_weather`. Errors: WeatherError."""
    columns: dict[str, Any] = {}
    for name, heading in headings.items():
        key = SPELT.get(name.strip().lower())
        if key is None or key == BETA:
            raise WeatherError(f"{where} {quote(name)}: is not one of {', '.join(NAMED)}{nearest(name, NAMED)}")
        if isinstance(heading, Mapping):
            columns[key] = heading
            continue
        if not isinstance(heading, str) or not heading.strip():
            raise WeatherError(
                f"{where} {name} = {quote(heading)}: write a heading of the file, with its unit in brackets if it has"
                " none."
            )
        columns[key] = heading.strip()
    return columns
