"""What a protocol's library warns of: an event now and then, in place of its tracebacks on standard error."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence

from stillhook.live.servers.counted import Counted


class LibraryLog(logging.Handler):
    """Takes loggers over while a server runs.

    Parameters: loggers by name; of: begin of the names of those whose warnings are passed on, the others are dropped;
    but: texts that are dropped as well; tell: is told one sentence.
    """

    def __init__(self, loggers: Sequence[str], of: str, but: Sequence[str], tell: Callable[[str], None]) -> None:
        super().__init__(logging.WARNING)
        self._loggers, self._of, self._but = tuple(loggers), of, tuple(but)
        self._before: dict[str, bool] = {}
        self._counted = Counted(
            lambda count, text: tell(f"{count} messages were dropped or answered with an error, the last: {text}")
        )

    def emit(self, record: logging.LogRecord) -> None:
        """Pass a warning on: the first at once, later ones counted."""
        reason = record.exc_info[1] if record.exc_info else None
        text = " ".join((record.getMessage() if reason is None else f"{type(reason).__name__}: {reason}").split())
        if not record.name.startswith(self._of) or any(each in text for each in self._but):
            return
        self._counted.add(text)

    def attach(self) -> None:
        """Take the loggers over."""
        for name in self._loggers:
            logger = logging.getLogger(name)
            self._before[name] = logger.propagate
            logger.propagate = False
            logger.addHandler(self)

    def detach(self) -> None:
        """Give them back."""
        self._counted.flush()
        for name, before in self._before.items():
            logger = logging.getLogger(name)
            logger.propagate = before
            logger.removeHandler(self)
