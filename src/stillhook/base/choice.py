"""One of a few named choices, from a text."""

from __future__ import annotations

from enum import StrEnum
from typing import TypeVar

from stillhook.errors import IdentifyError
from stillhook.units import quote

Choice = TypeVar("Choice", bound=StrEnum)


def choice(kind: type[Choice], text: Choice | str, name: str) -> Choice:
    """The choice of this name. Errors: IdentifyError of one line that names the option and what there is."""
    try:
        return kind(text)
    except ValueError:
        raise IdentifyError(f"{name} = {quote(text)}: not one of {', '.join(kind)}.") from None
