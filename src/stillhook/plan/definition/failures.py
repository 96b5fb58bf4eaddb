"""Numbers that could not be computed once the runs were made: each is named in the answer, and loses no other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

from stillhook.errors import StillhookError

NUMERICAL = (ArithmeticError, ValueError, IndexError, KeyError)
"""What a computation on odd numbers ends in."""
FAILED = "NOT COMPUTED"
"""Begins remarks on what failed; shown with the answer."""
T = TypeVar("T")


def in_words(problem: Exception) -> str:
    """A failure in a line."""
    text = " ".join(str(problem).split()).rstrip(".")[:160]
    return text if isinstance(problem, StillhookError) else f"{type(problem).__name__}: {text}; please report it"


@dataclass(eq=False)
class Failures:
    """What failed -> reason."""

    reasons: dict[str, str] = field(default_factory=dict)

    def attempt(self, what: str, make: Callable[[], T], otherwise: T) -> T:
        """What is made, or `otherwise` where that fails: the reason is kept."""
        try:
            return make()
        except (StillhookError, *NUMERICAL) as problem:
            self.reasons[what] = in_words(problem)
            return otherwise

    @property
    def remarks(self) -> list[str]:
        """A line each."""
        return [f"{FAILED}: {what} ({reason})" for what, reason in self.reasons.items()]
