"""The shared memory between the servers' process and that of the observer."""

from __future__ import annotations

import json
from typing import NamedTuple

from stillhook.live.runtime.board import Block
from stillhook.live.runtime.ring import Records, Ring
from stillhook.live.runtime.sink import LONGEST

MESSAGES, VALUES, EVENTS, PROPOSALS = 2048, 8, 128, 4
"""Slots of each ring: messages of twenty seconds at 100 Hz."""
MOST_MEASURED, MOST_SHOWN = 32, 64
"""Signals of a message and numbers that are shown, at most."""
HEAD = 2
"""Cells of a message before its values: arrival and its own time stamp, UTC [s]."""
PROPOSAL_BYTES = 1500


class Proposal(NamedTuple):
    """What the observer says of friction.

    time: of a clock that its reader has, too [s]; known: whether there is an estimate that is not old; value: factor
    that may be applied, None where it may not; low, high: its 95 % interval; reason why there is none or may not be
    applied; steps of friction since the observer's start, and what the last one says: each begins the estimate again;
    deviating: signals whose deviation is an alarm.
    """

    time: float
    known: bool = False
    value: float | None = None
    low: float = 0.0
    high: float = 0.0
    reason: str = "no rows yet"
    steps: int = 0
    step: str = ""
    deviating: str = ""

    def to_json(self) -> bytes:
        """As bytes, at most PROPOSAL_BYTES."""
        return json.dumps(self._replace(reason=self.reason[:200], step=self.step[:200])._asdict()).encode()

    @classmethod
    def from_json(cls, data: bytes) -> Proposal:
        """Of bytes."""
        return cls(**json.loads(data))


class Panel(Block):
    """Messages to the observer; numbers, events and proposals from it. Parameter: name, as of a `Block`."""

    def __init__(self, name: str | None = None) -> None:
        sizes = [
            Ring.size(MESSAGES, HEAD + MOST_MEASURED),
            Ring.size(VALUES, MOST_SHOWN),
            Records.bytes_of(EVENTS, LONGEST),
            Records.bytes_of(PROPOSALS, PROPOSAL_BYTES),
        ]
        super().__init__(sizes, name)
        parts = self._parts
        self.messages = Ring(parts[1], MESSAGES, HEAD + MOST_MEASURED)
        self.values = Ring(parts[2], VALUES, MOST_SHOWN)
        self.events = Records(parts[3], EVENTS, LONGEST)
        self.proposals = Records(parts[4], PROPOSALS, PROPOSAL_BYTES)
        self.rings = (self.messages, self.values, self.events, self.proposals)
