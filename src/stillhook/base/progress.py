"""Progress of long work: its share done, from 0 to 1, of whatever parts it is made."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[float], None]
"""Is called with the share of the work that is done, 0 to 1, never falling."""


class Parts:
    """Progress of parts within the whole; never goes back. progress None: nobody listens."""

    def __init__(self, progress: Progress | None) -> None:
        self.progress, self.share = progress, 0.0

    def __call__(self, begin: float, end: float) -> Progress:
        """Progress of the part from share `begin` to share `end` of the whole, which has begun now."""
        self.at(begin)
        return lambda share: self.at(begin + (end - begin) * min(max(share, 0.0), 1.0))

    def at(self, share: float) -> None:
        """The whole is done up to this share."""
        if share > self.share or self.share == 0.0:
            self.share = share
            if self.progress is not None:
                self.progress(share)
