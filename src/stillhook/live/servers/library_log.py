"""What a protocol's library warns of, one sentence each, in place of its tracebacks on standard error."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence


class LibraryLog(logging.Handler):
    """Takes loggers over while a server runs: a context.

    Parameters: loggers by name; of: begin of the names of those whose warnings are passed on, the others are dropped;
    but: texts that are dropped as well; tell: takes one sentence.
    """

    def __init__(self, loggers: Sequence[str], of: str, but: Sequence[str], tell: Callable[[str], None]) -> None:
        super().__init__(logging.WARNING)
        self._loggers, self._of, self._but, self._tell = tuple(loggers), of, tuple(but), tell
        self._before: dict[str, bool] = {}

    def emit(self, record: logging.LogRecord) -> None:
        """Pass a warning on, without the traceback that may be in it."""
        reason = record.exc_info[1] if record.exc_info else None
        text = " ".join((record.getMessage() if reason is None else f"{type(reason).__name__}: {reason}").split())
        if not record.name.startswith(self._of) or any(each in text for each in self._but):
            return
        self._tell(text.partition("; Traceback")[0])

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
