"""Ranges of heights, periods and headings as a plan file writes them: a list, or "0.5 m to 6 m by 0.5 m"."""

from __future__ import annotations

import math
import re
from itertools import pairwise

from stillhook.formats.toml_fields import Fields
from stillhook.units import parse, quote, show

KINDS = {"Hs": "length", "Tp": "time", "headings": "angle"}
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


def spelled(table: Fields, key: str) -> tuple[str, ...]:
    """Texts of a range or list, rising (headings in the order of the file), none twice. Errors: the table's own,
    UnitError."""
    entry, kind = table.table[key], KINDS[key]
    where = f"{table.place}{key}"
    if isinstance(entry, str):
        values = _range(table, key, entry)
    elif isinstance(entry, list) and entry:
        values = [parse(item, kind, f"{where}[{i}]") for i, item in enumerate(entry)]
    else:
        raise table.wrong(key, f"give {LIKE[key]}.")
    if len(values) > MOST:
        raise table.wrong(key, f"{len(values)} values, and {MOST} are the most. Take larger steps.")
    for value in values:
        if not LOWEST[key] <= value <= HIGHEST[key] + 1e-9:
            low, high = show(LOWEST[key], kind), show(HIGHEST[key], kind)
            raise table.wrong(key, f"{show(value, kind)} is not between {low} and {high}.")
    ordered = values if key == "headings" else sorted(values)
    around = [v % (2.0 * math.pi) for v in ordered] if key == "headings" else ordered
    if any(math.isclose(a, b, abs_tol=1e-9) for a, b in pairwise(sorted(around))):
        raise table.wrong(key, "a value comes twice. Write it once.")
    return tuple(f"{value!r} {'rad' if kind == 'angle' else 's' if kind == 'time' else 'm'}" for value in around)


def _range(table: Fields, key: str, text: str) -> list[float]:
    """Values of a range with both ends, or of one text alone."""
    kind, where = KINDS[key], f"{table.place}{key}"
    match = _RANGE.fullmatch(text.strip())
    if match is None:
        if " to " in text:
            raise table.wrong(key, f"give {LIKE[key]}.")
        return [parse(text, kind, where)]
    first, last, step = (parse(part, kind, f"{where}: {quote(part)[1:-1]}") for part in match.groups())
    if step <= 0.0 or last < first:
        raise table.wrong(key, f"the range must increase, for example {LIKE[key]}.")
    count = (last - first) / step
    if count > MOST:
        raise table.wrong(key, f"{count:.0f} steps, and {MOST} are the most. Take larger steps.")
    if abs(count - round(count)) > 1e-6:
        raise table.wrong(key, f"steps of {show(step, kind)} do not meet {show(last, kind)}. Choose a step that does.")
    return [first + i * (last - first) / round(count) if round(count) else first for i in range(round(count) + 1)]
