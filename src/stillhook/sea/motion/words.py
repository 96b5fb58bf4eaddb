"""Motions as text that a person writes."""

from __future__ import annotations

import re

from stillhook.errors import MotionError
from stillhook.sea.motion.motion import Motion, Sine, Still, Sum
from stillhook.units import parse, quote

ALLOWED = '"still", "sine <amplitude> <period> [<phase>]" such as "sine 2.8 m 12 s", and sums of sines joined by " + "'
_STARTS_QUANTITY = re.compile(r"[+-]?\.?\d")


def parse_motion(text: str, where: str = "", size: str = "length") -> Motion:
    """The motion that a text names.

    - `still`
    - `sine 2.8 m 12 s`: amplitude (middle to crest), period; `sine 2.8 m 12 s 90 deg` with a phase
    - `sine 2 m 13 s + sine 0.5 m 6 s`: sums, with spaces round the plus sign

    Parameters: text; where, put first in every error (the file and field); size, kind of the amplitude, "angle" for
    roll and the like. Errors: MotionError for a text of another
    form, UnitError for a number with a wrong unit; both in one line.
    """
    place = f"{where}: " if where else ""
    if not isinstance(text, str):
        raise MotionError(f"{place}{quote(text)} is not a motion. Allowed: {ALLOWED}.")
    terms = [_term(term, quote(text), place, size) for term in re.split(r"(?:^|\s)\+(?=\s|$)", text.strip())]
    return terms[0] if len(terms) == 1 else Sum(terms)


def _term(text: str, full_text: str, place: str, size: str) -> Motion:
    word, *rest = text.split() or [""]
    match word.lower():
        case "still" if not rest:
            return Still()
        case "sine":
            return _sine(rest, full_text, place, size)
    raise MotionError(f"{place}{full_text}: {quote(text.strip())} is not a motion. Allowed: {ALLOWED}.")


def _sine(tokens: list[str], full_text: str, place: str, size: str) -> Sine:
    quantities: list[list[str]] = []
    for token in tokens:
        if _STARTS_QUANTITY.match(token) or not quantities:
            quantities.append([])
        quantities[-1].append(token)
    if len(quantities) not in (2, 3):
        problem = f"a sine has an amplitude, a period and at most a phase, not {len(quantities)} quantities"
        do = 'Write "sine 2.8 m 12 s" or "sine 2.8 m 12 s 90 deg".'
        raise MotionError(f"{place}{full_text}: {problem}. {do}")
    names = (("amplitude", size), ("period", "time"), ("phase", "angle"))
    values = [
        parse(" ".join(quantity), kind, f"{place}{full_text}: {name}")
        for (name, kind), quantity in zip(names, quantities, strict=False)
    ]
    return Sine.from_si(*values, where=f"{place}{full_text}")
