"""Zones of times that a file states in its header, in the name of its column of times or in the row of units, such as
UTC+3 or CET."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import NamedTuple

from stillhook.errors import WeatherError
from stillhook.units import quote

HOURS = {
    "utc": 0.0,
    "gmt": 0.0,
    "wet": 0.0,
    "cet": 1.0,
    "met": 1.0,
    "mez": 1.0,
    "west": 1.0,
    "cest": 2.0,
    "mesz": 2.0,
    "eet": 2.0,
    "eest": 3.0,
    "msk": 3.0,
    "edt": -4.0,
    "est": -5.0,
    "cdt": -5.0,
    "mdt": -6.0,
    "mst": -7.0,
    "pdt": -7.0,
    "pst": -8.0,
    "akdt": -8.0,
    "akst": -9.0,
    "hst": -10.0,
    "jst": 9.0,
    "awst": 8.0,
    "sgt": 8.0,
}
"""Zones by their names, ahead of UTC [h]. Names that two zones have (IST, BST, CST) are none of them."""
AMBIGUOUS = ("bst", "ist", "cst", "ast")
FARTHEST = 14.0
"""Zone farthest ahead of UTC [h]."""
_OFFSET = r"[+\-−]\s?\d{1,2}(?::?\d{2})?"
_ZONE = re.compile(
    rf"(?<![A-Za-z])(?:(?:UTC|GMT|Z)\s?(?P<ahead>{_OFFSET})|(?P<bare>{_OFFSET})(?=\s*(?:h|hours|UTC)\b)"
    rf"|(?P<name>{'|'.join(sorted((*HOURS, *AMBIGUOUS), key=len, reverse=True))})(?![A-Za-z])"
    r"|(?P<local>local|LT\b|lokal\w*|ortszeit|(?:Europe|America|Asia|Africa|Australia|Atlantic|Pacific|Indian)/\w+))",
    re.IGNORECASE,
)
_OF_TIME = re.compile(r"time|zone|date|zeit|dato|tid\b|utc|gmt", re.IGNORECASE)
"""A remark is of times where it has one of these words."""


class Zone(NamedTuple):
    """A zone as a file states it: ahead of UTC [h], None where it is not known; text as it stands there."""

    ahead: float | None
    text: str


def zone_in(text: str) -> Zone | None:
    """The zone that a text names; None where it names none."""
    match = _ZONE.search(text.replace("_", " "))
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
    """The zone that remarks of a file name, in a line that speaks of times."""
    result = (zone_in(line) for line in lines if _OF_TIME.search(line))
    return next((zone for zone in result if zone is not None), None)


def parse_zone(text: str, where: str) -> Zone:
    """A zone that the user states. Errors: WeatherError."""
    zone = zone_in(text)
    if zone is None or zone.ahead is None:
        raise WeatherError(f'{where} {quote(text)}: is no time zone that is known. Write it as "UTC+3" or "CET".')
    return zone
