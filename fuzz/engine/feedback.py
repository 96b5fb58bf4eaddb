"""What an input showed that none before it did: lines of the package that ran, and sentences of refusals."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from types import CodeType, FrameType
from typing import Any

from fuzz.engine.guard import PACKAGE, Outcome

_VALUES = re.compile(r'"[^"]*"|\'[^\']*\'|[-+]?\d[\d.,e+-]*')
NOTHING: set[int] = set()

Trace = Callable[[FrameType, str, Any], Any]


class Lines:
    """Counts lines of the package that run for the first time, while it is the trace function (a context).

    A function all of whose lines have run is not traced any more, so that the cost falls with time.
    """

    def __init__(self) -> None:
        self.seen = 0
        self._left: dict[CodeType, set[int]] = {}

    def __enter__(self) -> Lines:
        sys.settrace(self._call)
        return self

    def __exit__(self, *of: object) -> None:
        sys.settrace(None)

    def _call(self, frame: FrameType, _event: str, _of: Any) -> Trace | None:
        code = frame.f_code
        left = self._left.get(code)
        if left is None:
            own = code.co_filename.startswith(PACKAGE)
            left = {line for *_, line in code.co_lines() if line} if own else NOTHING
            self._left[code] = left
        return self._line if left else None

    def _line(self, frame: FrameType, event: str, _of: Any) -> Trace:
        if event == "line":
            left = self._left[frame.f_code]
            if frame.f_lineno in left:
                left.discard(frame.f_lineno)
                self.seen += 1
        return self._line


class Sentences:
    """Refusals seen so far, without the values in them: nearly every branch that refuses has a sentence of its own."""

    def __init__(self) -> None:
        self._seen: set[str] = set()

    def new(self, outcome: Outcome) -> bool:
        """Whether no outcome before said this."""
        said = outcome.kind + _VALUES.sub("_", outcome.line)[:300]
        if said in self._seen or len(self._seen) > MOST:
            return False
        self._seen.add(said)
        return True


MOST = 20_000
"""Sentences at most: some name what was written without quotes, and would never end."""
