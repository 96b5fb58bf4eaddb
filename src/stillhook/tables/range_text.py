"""Several values in one text, in the ways that people write them: "0.5 m to 4 m by 0.5 m", "0.5-4 m step 0.5",
"0,5..4 m in steps of 0,5 m", "1, 2 and 3 m"."""

from __future__ import annotations

import math
import re

from stillhook.errors import UnitError
from stillhook.units import KINDS, parse, show

_NUMBER = r"[-+]?\d+(?:[.,]\d+)?"
_UNIT = r"(?:\s*(?![-+\d.,]|to\b|bis\b|til\b|by\b|and\b)([^\W\d]\S*?|°))?"
_RANGE = re.compile(
    rf"({_NUMBER}){_UNIT}\s*(?:to|bis|til|-|–|\.\.\.?|…)\s*({_NUMBER}){_UNIT}"
    rf"(?:\s*,?\s*(?:by|steps?|in steps of|every|@)\s*({_NUMBER}){_UNIT})?"
)
_VALUE = re.compile(rf"({_NUMBER}){_UNIT}")
_BETWEEN = re.compile(r"\s*;\s*|\s*,\s+|\s+and\s+|\s*/\s*")


def values_of(text: str, kind: str, most: int) -> tuple[str, ...]:
    """The values of a text, each as a number with its unit; a text that is no range and no list as it is.

    most: values that a range may have. A unit that is named once holds for all. Errors: ValueError that says what to
    write.
    """
    tidy = " ".join(text.split())
    if (match := _RANGE.fullmatch(tidy)) is not None:
        if match[5] is None:
            raise ValueError(_without_step(match, kind))
        return _range([match[i] for i in (1, 3, 5)], [match[i] for i in (2, 4, 6)], kind, most)
    parts = _BETWEEN.split(tidy)
    if len(parts) == 1 and _VALUE.fullmatch(tidy):
        return (str(with_point(text)),)
    values = [_VALUE.fullmatch(part) for part in parts]
    if all(values):
        units = [value[2] for value in values if value is not None]
        return tuple(f"{_point(v[1])} {u}" for v, u in zip(values, _filled(units, kind), strict=True) if v is not None)
    if re.search(r"\d\s*(to|-|–|\.\.|…|by|step)\s*[\d.,]", tidy):
        unit = KINDS[kind].display
        raise ValueError(f'write a range as "1 {unit} to 6 {unit} by 1 {unit}", or a list ["1 {unit}", "2 {unit}"].')
    return (text,)


def _range(numbers: list[str], units: list[str | None], kind: str, most: int) -> tuple[str, ...]:
    try:
        texts = zip(numbers, _filled(units, kind), strict=True)
        first, last, step = (parse(f"{_point(number)} {unit}", kind) for number, unit in texts)
    except UnitError as problem:
        raise ValueError(str(problem)) from None
    if step <= 0.0 or last < first:
        unit = KINDS[kind].display
        raise ValueError(f'the range must increase, for example "1 {unit} to 6 {unit} by 1 {unit}".')
    count = (last - first) / step
    if count > most:
        raise ValueError(f"{count:.6g} steps, and {most} are the most. Take larger steps.")
    if abs(count - round(count)) > 1e-6:
        raise ValueError(f"steps of {show(step, kind)} do not meet {show(last, kind)}. Choose a step that does.")
    steps = round(count)
    values = [first + i * (last - first) / steps for i in range(steps + 1)] if steps else [first]
    return tuple(f"{x!r} {KINDS[kind].si}" for x in values)


def _without_step(match: re.Match[str], kind: str) -> str:
    """What to write in place of a range without a step."""
    unit = match[4] or match[2] or KINDS[kind].display
    first, last = _point(match[1]), _point(match[3])
    step = _usual_step(float(last) - float(first))
    return f'a range needs its step: write "{first} {unit} to {last} {unit} by {step:g} {unit}".'


def _usual_step(span: float) -> float:
    """A step of 1, 2 or 5 times a power of ten that meets the end, of at most twelve."""
    span = abs(span)
    for step in (0.25, 0.5, 1.0, 2.0, 5.0, 15.0, 30.0):
        if span / step <= 12.0 and abs(span / step - round(span / step)) < 1e-9:
            return step
    return span if 0.0 < span < math.inf else 1.0


def _filled(units: list[str | None], kind: str) -> list[str]:
    """Units of values, those that are missing as the next one that is named, else the one before. Errors: ValueError
    where none is named."""
    named = [unit for unit in units if unit]
    if not named:
        unit, allowed = KINDS[kind].display, ", ".join(KINDS[kind].allowed)
        raise ValueError(f'no unit: write it behind the numbers, such as "{unit}" (allowed: {allowed}).')
    return [unit or next((u for u in units[i:] if u), named[-1]) for i, unit in enumerate(units)]


def _point(number: str) -> str:
    return number.replace(",", ".")


def with_point(text: object) -> object:
    """A text with a number that has a decimal comma, such as "0,5 m", with a point; anything else as it is."""
    if isinstance(text, str) and (match := _VALUE.fullmatch(text.strip())) and "," in match[1]:
        return f"{_point(match[1])} {match[2] or ''}".strip()
    return text
