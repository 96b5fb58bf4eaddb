"""From columns that were read to weather: directions in the sense that the file or the user declares, and notes on what
was assumed."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import WeatherError
from stillhook.formats.weather.columns import KINDS, PLAIN, UNITS, Column, sense_in, without_unit
from stillhook.sea.spectra.directions import FULL, DirectionSense, coming_from
from stillhook.units import quote

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
            say = f'--column "{column.name}={without_unit(column.heading)} [rad]"'
            notes.append(
                f"{column.heading}: all directions lie within 6.3 deg of north: are they in radians? Then say {say}"
            )
        if KINDS[column.name] != "direction":
            values[column.name] = x
        elif (meant := _meant(column, comments, name, sense)) is not None:
            values[column.name] = coming_from(x, meant)
        else:
            notes.append(
                f"the file does not say what its wave direction {quote(column.heading)} means, and it was not read: say"
                f" --direction {', '.join(list(SENSES)[:-1])} or {list(SENSES)[-1]} (cartesian: going to,"
                " counter-clockwise from east)"
            )
    guessed = [f"{c.heading} in {PLAIN[KINDS[c.name]]}" for c, _, _ in read if not c.stated]
    return values, notes + ([f"units are not in the file and were taken: {', '.join(guessed)}"] if guessed else [])


def _like_radians(x: FloatArray, column: Column) -> bool:
    """Whether directions that are taken for degrees all lie within 2 pi of 0, three or more of them."""
    known = x[np.isfinite(x)] / UNITS["direction"][column.unit]
    return (
        UNITS["direction"][column.unit] != 1.0
        and len(np.unique(known)) >= FEWEST
        and bool(np.all(np.abs(known) <= FULL))
    )


def _meant(column: Column, comments: Sequence[str], name: str, sense: DirectionSense | None) -> DirectionSense | None:
    """What the directions of a column mean; None where nobody says."""
    declared = sense_in(column.heading)
    if column.name == "wind_from":
        return declared or DirectionSense.FROM_NORTH
    for line in comments:
        if match := _DECLARED.match(line):
            declared = declared or next((s for s in DirectionSense if s.value == match[1].strip().lower()), None)
    if declared is not None and sense is not None and declared is not sense:
        raise WeatherError(
            f"{name}: column {quote(column.heading)}: the file says its directions are"
            f" {quote(declared.value)}, --direction"
            f" says {quote(sense.value)}. Leave --direction out, or correct the file."
        )
    return declared or sense
