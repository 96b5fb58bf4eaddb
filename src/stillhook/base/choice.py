"""One of a few named choices from a text, and the name that a misspelt one was meant to be."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from enum import StrEnum
from typing import TypeVar

from stillhook.errors import IdentifyError, StillhookError
from stillhook.units import quote

Choice = TypeVar("Choice", bound=StrEnum)


def choice(kind: type[Choice], text: Choice | str, name: str, error: type[StillhookError] = IdentifyError) -> Choice:
    """The choice of this name. Errors: `error` of one line that names the option and what there is."""
    try:
        return kind(text)
    except ValueError:
        raise error(f"{name} = {quote(text)}: not one of {', '.join(kind)}.") from None


def nearest(name: str, names: Iterable[str]) -> str:
    """``; did you mean "x"?`` for the nearest of the names, else a full stop."""
    close = difflib.get_close_matches(name, list(names), n=1, cutoff=0.6)
    return f'; did you mean "{close[0]}"?' if close else "."
