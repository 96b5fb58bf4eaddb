"""What a protocol's library warns of: an event now and then, in place of its tracebacks on standard error."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Sequence

QUIET = 1.0
"""Least time between two events [s]."""
LONGEST = 160
"""Letters of a warning that are kept."""


class LibraryLog(logging.Handler):
    """Takes loggers over while a server runs: a context.

    Parameters: loggers by name; of: begin of the names of those whose warnings are passed on, the others are dropped;
    but: texts that are dropped as well; tell: is told one sentence.
    """

    def __init__(self, loggers: Sequence[str], of: str, but: Sequence[str], tell: Callable[[str], None]) -> None:
        super().__init__(logging.WARNING)
        self._loggers, self._of, self._but, self._tell = tuple(loggers), of, tuple(but), tell
        self._before: dict[str, bool] = {}
        self._reported, self._count = -math.inf, 0

    def emit(self, record: logging.LogRecord) -> None:
        """Pass a warning on: the first at once, later ones counted."""
        reason = record.exc_info[1] if record.exc_info else None
        text = " ".join((record.getMessage() if reason is None else f"{type(reason).__name__}: {reason}").split())
        if not record.name.startswith(self._of) or any(each in text for each in self._but):
            return
        self._count += 1
        if time.monotonic() - self._reported >= QUIET:
            self._tell(f"{self._count} messages were dropped or answered with an error, the last: {text[:LONGEST]}")
            self._reported, self._count = time.monotonic(), 0

    def __enter__(self) -> LibraryLog:
        for name in self._loggers:
            logger = logging.getLogger(name)
            self._before[name] = logger.propagate
            logger.propagate = False
            logger.addHandler(self)
        return self

    def __exit__(self, *of: object) -> None:
        for name, before in self._before.items():
            logger = logging.getLogger(name)
            logger.propagate = before
            logger.removeHandler(self)
