"""Every error that Stillhook raises on purpose, in one place.

A message is one line: where, what came, what is allowed, what to do. The command line prints it and exits with 2. A
file with several problems raises the first, which has a line for each.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Self


class StillhookError(Exception):
    """Root of all errors that a user can correct: one line with the place, the value, what is allowed and what to do.

    >>> import stillhook
    >>> try:
    ...     stillhook.Scenario(load="100 kN", s_w="100 m")
    ... except stillhook.StillhookError as problem:
    ...     print(problem)
    Scenario.load = "100 kN": unit "kN" is not one of kg, t, te.
    """

    _lines: tuple[str, ...] = ()

    def __init__(self, line: str = "") -> None:
        super().__init__(_one_line(line))

    @property
    def lines(self) -> tuple[str, ...]:
        """Every problem of the file, a line for each; the message alone where there is one."""
        return self._lines or (str(self),)

    def with_lines(self, lines: Sequence[str]) -> Self:
        """The same error, with a line for every problem."""
        self._lines = tuple(map(_one_line, lines)) if len(lines) > 1 else ()
        return self


LONGEST_LINE = 2000
"""Characters of an error at most: a name in a file may have as many as the file."""
_LAST = 500
"""Those of a longer one that are kept from its end, which says what to do."""


def printed(text: object) -> str:
    """A text as one line for a terminal: line ends, control characters and halves of pairs as their codes."""
    line = str(text)
    if line.isprintable():
        return line
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in line)


def _one_line(text: object) -> str:
    """The same, with the middle left out where it is too long to read."""
    line = printed(text)
    return line if len(line) <= LONGEST_LINE else f"{line[: LONGEST_LINE - _LAST - 5]} ... {line[-_LAST:]}"


def all_of(problems: Sequence[StillhookError]) -> StillhookError:
    """The first of several problems of a file, with the lines of all."""
    first = problems[0]
    lines = tuple(dict.fromkeys(line for problem in problems for line in problem.lines))
    if len(problems) == 1 or len(lines) == 1:
        return first
    return type(first)(f"{first} (and {len(lines) - len(first.lines)} more)").with_lines(lines)


class Cancelled(Exception):  # noqa: N818  # not an error
    """Long work was stopped by its token. What was finished is in `partial`, and in the store where one was given.

    >>> import stillhook
    >>> crane, token = stillhook.load_crane("nov-250t"), stillhook.CancelToken()
    >>> token.cancel()
    >>> case = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 12 s")
    >>> try:
    ...     stillhook.simulate(crane, [case, case], progress=stillhook.Monitor(cancel=token))
    ... except stillhook.Cancelled as stopped:
    ...     print(stopped, stopped.partial)
    Cancelled. What was finished is in the store, where one was given. None
    """

    def __init__(self, partial: Callable[[], Any] | None = None) -> None:
        super().__init__("Cancelled. What was finished is in the store, where one was given.")
        self.make = partial

    def then(self, make: Callable[[Any], Any]) -> Cancelled:
        """The same, with something made of what was finished when it is asked for."""
        return Cancelled(lambda: None if (finished := self.partial) is None else make(finished))

    @property
    def partial(self) -> Any:
        """What was finished, of the type that the whole has: cases of a Dataset, cells of a map, the plan of the tier
        before; None where nothing was."""
        return None if self.make is None else self.make()


class CommandError(StillhookError):
    """A command line that says two things at once."""


class UnitError(StillhookError):
    """A text that is not a number with one of the allowed units."""


class SpecError(StillhookError):
    """A crane file, or one of its fields, that does not describe a crane."""


class ScenarioError(StillhookError):
    """A scenario that cannot be run on this crane, or does not describe a run."""


class MotionError(StillhookError):
    """A motion text, log or table that cannot be turned into crane-tip motion."""


class SimulationError(StillhookError):
    """A run that failed: the state left the physical range or lost its numbers."""


class UnreadableError(StillhookError):
    """A file that cannot be read or parsed: why, in a few words. Who reads it says the rest."""


class LogError(StillhookError):
    """A log, a supplier map or their mapping that cannot be read, or whose signals cannot be trusted."""


class ValidateError(StillhookError):
    """A validation campaign, its criteria or a certificate that cannot be used."""


class TrustError(StillhookError):
    """A key, a signature or a list of trusted keys that cannot be used."""


class IdentifyError(StillhookError):
    """Data that do not determine the requested quantity."""


class SeaError(StillhookError):
    """A wave text, spectrum file, vessel file or tip position that cannot be used."""


class LiftError(StillhookError):
    """A lift file, payload or winch programme that does not describe a lift, or one that is beyond this crane."""


class PlanError(StillhookError):
    """A lift plan, or a set of its rules, that does not describe a plan, or one that cannot be answered."""


class WeatherError(StillhookError):
    """Weather that cannot be read, or a question that it cannot answer."""


class ConvertError(StillhookError):
    """A run, log, signal or format that cannot be converted."""


class ExportError(StillhookError):
    """A crane, case, coupling or platform that cannot be exported."""


class LiveError(StillhookError):
    """A live twin, its bus or its history that cannot be used, or a request that it cannot answer."""
