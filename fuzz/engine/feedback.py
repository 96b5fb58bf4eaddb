"""What an input showed that none before it did: lines of the package that ran, and sentences of refusals."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import CodeType, FrameType
from typing import Any

from fuzz.engine.guard import PACKAGE, Outcome
from stillhook.errors import UnreadableError
from stillhook.formats.binary import REFUSED, VALUE, Reader, answer

_VALUES = re.compile(r'"[^"]*"|\'[^\']*\'|[-+]?\d[\d.,e+-]*')
NOTHING: frozenset[int] = frozenset()

ALIKE = 30
"""Requests in a row that show no new line of the process that reads, after which it is not traced any more: there the
package has some hundred lines."""

Trace = Callable[[FrameType, str, Any], Any]


class Lines:
    """Counts lines of the package that run for the first time, while it is the trace function (a context).

    A function all of whose lines have run is not traced any more, so that the cost falls with time. before: what
    `to_dict` of an earlier one gave.
    """

    def __init__(self, before: Mapping[str, Sequence[int]] = {}) -> None:
        self._before = {file: set(lines) for file, lines in before.items()}
        self.seen = sum(map(len, self._before.values()))
        self._left: dict[CodeType, set[int] | frozenset[int]] = {}
        self._call_reader = Reader.call
        self._read_alike = 0

    def to_dict(self) -> dict[str, list[int]]:
        """Lines that ran, by file."""
        ran = {file: set(lines) for file, lines in self._before.items()}
        for code, left in self._left.items():
            if left is not NOTHING:
                ran.setdefault(code.co_filename, set()).update(_lines(code) - left)
        return {file: sorted(lines) for file, lines in ran.items() if lines}

    def __enter__(self) -> Lines:
        Reader.call = self._traced_reader()  # type: ignore[method-assign]
        sys.settrace(self._call)
        return self

    def __exit__(self, *of: object) -> None:
        sys.settrace(None)
        Reader.call = self._call_reader  # type: ignore[method-assign]

    def _traced_reader(self) -> Callable[..., Any]:
        """`Reader.call` that counts the lines of the process that reads, too."""

        def call(reader: Reader, limit: float, function: Callable[..., Any], *arguments: Any) -> Any:
            if self._read_alike > ALIKE:
                return self._call_reader(reader, limit, function, *arguments)
            self._read_alike += 1
            (kind, value), ran = self._call_reader(reader, limit, with_lines, limit, function, arguments)
            for file, lines in ran.items():
                of = self._before.setdefault(file, set())
                if new := lines - of:
                    self.seen += len(new)
                    self._read_alike = 0
                of |= lines
            if kind != VALUE:
                raise value if kind == REFUSED else UnreadableError(str(value))
            return value

        return call

    def _call(self, frame: FrameType, _event: str, _of: Any) -> Trace | None:
        code = frame.f_code
        left = self._left.get(code)
        if left is None:
            own = code.co_filename.startswith(PACKAGE)
            left = self._left[code] = _lines(code) - self._before.get(code.co_filename, NOTHING) if own else NOTHING
        return self._line if left else None

    def _line(self, frame: FrameType, event: str, _of: Any) -> Trace:
        if event == "line":
            left = self._left[frame.f_code]
            if frame.f_lineno in left:
                left.discard(frame.f_lineno)  # type: ignore[union-attr]
                self.seen += 1
        return self._line


def with_lines(
    limit: float, function: Callable[..., Any], arguments: tuple[Any, ...]
) -> tuple[Any, dict[str, set[int]]]:
    """In the process that reads: its answer, and lines of the package that ran, by file."""
    ran: dict[str, set[int]] = {}

    def line(frame: FrameType, event: str, _of: Any) -> Trace:
        if event == "line":
            ran.setdefault(frame.f_code.co_filename, set()).add(frame.f_lineno)
        return line

    sys.settrace(lambda frame, _event, _of: line if frame.f_code.co_filename.startswith(PACKAGE) else None)
    try:
        return answer((limit, function, arguments)), ran
    finally:
        sys.settrace(None)


def _lines(code: CodeType) -> set[int]:
    return {line for *_, line in code.co_lines() if line}


class Sentences:
    """Refusals seen so far, without the values in them: nearly every branch that refuses has a sentence of its own."""

    def __init__(self, before: Iterable[str] = ()) -> None:
        self._seen = set(before)

    def to_list(self) -> list[str]:
        return sorted(self._seen)

    def new(self, outcome: Outcome) -> bool:
        """Whether no outcome before said this."""
        said = outcome.kind + _VALUES.sub("_", outcome.line)[:300]
        if said in self._seen or len(self._seen) > MOST:
            return False
        self._seen.add(said)
        return True


MOST = 5000
"""Sentences at most: some name what was written without quotes, and would never end."""
