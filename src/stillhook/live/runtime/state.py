"""The saved state of a live twin: that of its session, and the streamed inputs with their ages."""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from stillhook.base.atomic import atomic_file
from stillhook.engine.saved import bytes_of, seal, unseal
from stillhook.errors import LiveError, SimulationError

FORMAT = 1
MOST_AGE = 1.0e9
"""Age of an input at most [s]."""


class LiveState(NamedTuple):
    """session: bytes of `Session.save`; inputs: value and age [s] by name."""

    session: bytes
    inputs: Mapping[str, tuple[float, float]]

    def to_bytes(self) -> bytes:
        """With a checksum at the end."""
        inputs = {name: [value.hex(), age.hex()] for name, (value, age) in self.inputs.items()}
        return seal("live", FORMAT, {"session": base64.b64encode(self.session).decode(), "inputs": inputs}, [])

    @classmethod
    def from_bytes(cls, state: bytes | Path) -> LiveState:
        """Errors: LiveError, one line, for what is no such state or damaged."""
        try:
            data, label = bytes_of(state)
            head, _ = unseal("live", FORMAT, data, label)
        except SimulationError as problem:
            raise LiveError(f"{problem} Or start without it: move the file away.") from None
        try:
            session = base64.b64decode(head["session"], validate=True)
            inputs = {str(n): (float.fromhex(v), float.fromhex(a)) for n, (v, a) in head["inputs"].items()}
            good = all(math.isfinite(v) and 0.0 <= a <= MOST_AGE for v, a in inputs.values())
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
            good = False
        if not good:
            raise LiveError(f"{label}: damaged: its inputs are no numbers with ages. Start without it: move it away.")
        return cls(session, inputs)


def write_state(path: Path, data: bytes) -> None:
    """The state in a file, which is complete or not there."""
    with atomic_file(path) as part:
        part.write_bytes(data)
