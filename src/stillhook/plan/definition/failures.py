"""Numbers that could not be computed once the runs were made: each is named in the answer, and loses no other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

from stillhook.errors import StillhookError

NUMERICAL = (ArithmeticError, ValueError, IndexError, KeyError)
"""What a computation on odd numbers ends in."""
Cause = Mapping[str, Any]
"""Why a result is as it is: its code under "cause", and values [SI]; `stillhook.plan.report.words` makes sentences."""
FAILED = "not-computed"
"""Code of what failed."""
T = TypeVar("T")


def cause(code: str, **values: Any) -> Cause:
    """A cause as plain data for JSON."""
    return {"cause": code, **values}


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
    def remarks(self) -> list[Cause]:
        """A cause each."""
        return [cause(FAILED, what=what, reason=reason) for what, reason in self.reasons.items()]
