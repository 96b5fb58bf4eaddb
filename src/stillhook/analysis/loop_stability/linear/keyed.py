"""What answers that are kept in memory are asked about: a machine and what an answer follows from."""

from __future__ import annotations

from typing import Any


class Keyed:
    """A machine as a loop sees it: equal where its loop is equal, whatever its settings."""

    def __init__(self, machine: Any, key: tuple[Any, ...]) -> None:
        self.machine, self.key = machine, key

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Keyed) and self.key == other.key
