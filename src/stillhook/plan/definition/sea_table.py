"""Ranges of heights, periods and headings as a plan file writes them: a list, or "0.5 m to 6 m by 0.5 m"."""

from __future__ import annotations

import math
import re
from itertools import pairwise

from stillhook.errors import UnitError
from stillhook.units import KINDS, parse, show

KIND = {"Hs": "length", "Tp": "time", "headings": "angle"}
LOWEST = {"Hs": 0.05, "Tp": 2.0, "headings": 0.0}
HIGHEST = {"Hs": 20.0, "Tp": 30.0, "headings": 2.0 * math.pi}
"""What seas of a table may be: below there is nothing to plan, above no lift."""
MOST = 60
"""Values that a range may have: a step of a wrong unit gives thousands."""
LIKE = {
    "Hs": '"0.5 m to 6 m by 0.5 m", or ["1 m", "2 m"]',
    "Tp": '"5 s to 14 s by 1 s", or ["6 s", "8 s"]',
    "headings": '["150 deg", "180 deg"], or "0 deg to 330 deg by 30 deg"',
}
_RANGE = re.compile(r"(.+?)\s+to\s+(.+?)\s+by\s+(.+)")


def expanded(value: object, key: str) -> object:
    """The texts of a range such as "1 m to 6 m by 0.5 m"; a list as it is. Errors: ValueError."""
    kind = KIND[key]
    if isinstance(value, list | tuple) and value:
        return tuple(value)
    if not isinstance(value, str):
        raise ValueError(f"give {LIKE[key]}.")
    match = _RANGE.fullmatch(value.strip())
    if match is None:
        if " to " in value:
            raise ValueError(f"give {LIKE[key]}.")
        return (value,)
    try:
        first, last, step = (parse(part, kind) for part in match.groups())
    except UnitError as problem:
        raise ValueError(str(problem)) from None
    if step <= 0.0 or last < first:
        raise ValueError(f"the range must increase, for example {LIKE[key]}.")
    count = (last - first) / step
    if count > MOST:
        raise ValueError(f"{count:.0f} steps, and {MOST} are the most. Take larger steps.")
    if abs(count - round(count)) > 1e-6:
        raise ValueError(f"steps of {show(step, kind)} do not meet {show(last, kind)}. Choose a step that does.")
    steps = round(count)
    values = [first + i * (last - first) / steps for i in range(steps + 1)] if steps else [first]
    return tuple(f"{x!r} {KINDS[kind].si}" for x in values)


def ordered(values: tuple[float, ...], key: str) -> tuple[float, ...]:
    """Values of a range or list [SI], rising (headings in the order of the file), none twice. Errors: ValueError."""
    kind = KIND[key]
    if len(values) > MOST:
        raise ValueError(f"{len(values)} values, and {MOST} are the most. Take larger steps.")
    for value in values:
        if not LOWEST[key] <= value <= HIGHEST[key] + 1e-9:
            low, high = show(LOWEST[key], kind), show(HIGHEST[key], kind)
            raise ValueError(f"{show(value, kind)} is not between {low} and {high}.")
    in_order = tuple(v % (2.0 * math.pi) for v in values) if key == "headings" else tuple(sorted(values))
    if any(math.isclose(a, b, abs_tol=1e-9) for a, b in pairwise(sorted(in_order))):
        raise ValueError("a value comes twice. Write it once.")
    return in_order
