"""What a reader does not expect in a file becomes one line of its error, with the file's name."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import ParamSpec, TypeVar

from stillhook.errors import Cancelled, StillhookError, UnreadableError
from stillhook.units import quote

CORRECT = "Correct the file, or give another."
REASON = 120
"""Characters of a message that are passed on."""

Given = ParamSpec("Given")
Result = TypeVar("Result")


@contextmanager
def guarded(name: str, error: type[StillhookError], do: str = CORRECT) -> Iterator[None]:
    """Around the reading of a file of this name: errors of Stillhook, a cancellation and a missing library pass, and
    everything else is raised as `error` of one line; do: what it tells the user to do. The cause stays with it."""
    try:
        yield
    except UnreadableError as problem:
        raise error(f"{name}: cannot be read ({problem}). {do}") from problem
    except (StillhookError, Cancelled, ImportError):
        raise
    except Exception as problem:
        raise error(f"{name}: cannot be read ({reason_of(problem)}). {do}") from problem


def reason_of(problem: Exception) -> str:
    """What went wrong, in a few words."""
    if isinstance(problem, MemoryError):
        return "takes more memory than there is"
    if isinstance(problem, RecursionError):
        return "nested too deep"
    text = " ".join((getattr(problem, "strerror", None) or str(problem)).split())
    if isinstance(problem, OSError):
        return text
    printed = "".join(sign if sign.isprintable() else "?" for sign in text[:REASON]).rstrip(" .")
    return f"{type(problem).__name__}: {printed}" if printed else type(problem).__name__


def few_words(problem: BaseException) -> str:
    """A library's message in a line, the beginning of it; its kind where it has none."""
    return " ".join(str(problem).split())[:REASON].rstrip(" .") or type(problem).__name__


class reader:
    """Marks a function as the reader of the file that its first argument names: it is `guarded`."""

    def __init__(self, error: type[StillhookError], do: str = CORRECT) -> None:
        self.error, self.do = error, do

    def __call__(self, read: Callable[Given, Result]) -> Callable[Given, Result]:
        @functools.wraps(read)
        def guard(*given: Given.args, **named: Given.kwargs) -> Result:
            with guarded(_name(given[0] if given else next(iter(named.values()), "")), self.error, self.do):
                return read(*given, **named)

        return guard


def _name(path: object) -> str:
    return Path(path).name or str(path) if isinstance(path, str | os.PathLike) else quote(path)
