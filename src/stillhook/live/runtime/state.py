"""The saved state of a live twin: that of its session, and the streamed inputs with their ages; where it is kept, and
which of several is the newest.

States of a twin are numbered on from start to start, so that the clock has no say in which is newer.
"""

from __future__ import annotations

import base64
import math
import sqlite3
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from stillhook.base.atomic import check_folder, durable_file
from stillhook.engine.saved import bytes_of, seal, unseal
from stillhook.errors import LiveError, SimulationError
from stillhook.live.history.journal import lock

FORMAT = 1
MOST_AGE = 1.0e9
"""Age of an input at most [s]."""
PATIENCE = 5.0
"""Time for a kernel whose servers died to end [s]."""


class LiveState(NamedTuple):
    """session: bytes of `Session.save`; inputs: value and age [s] by name; number: of this state."""

    session: bytes
    inputs: Mapping[str, tuple[float, float]]
    number: int

    def to_bytes(self) -> bytes:
        """With a checksum at the end."""
        inputs = {name: [value.hex(), age.hex()] for name, (value, age) in self.inputs.items()}
        head = {"session": base64.b64encode(self.session).decode(), "inputs": inputs, "number": self.number}
        return seal("live", FORMAT, head, [])

    @classmethod
    def from_bytes(cls, state: bytes | Path) -> LiveState:
        """Errors: LiveError, one line, for what is not such a state or damaged."""
        try:
            data, label = bytes_of(state)
            head, _ = unseal("live", FORMAT, data, label)
        except SimulationError as problem:
            raise LiveError(f"{problem} Or start without it: move the file away.") from None
        try:
            session = base64.b64decode(head["session"], validate=True)
            inputs = {str(n): (float.fromhex(v), float.fromhex(a)) for n, (v, a) in head["inputs"].items()}
            number = head["number"]
            good = all(math.isfinite(v) and 0.0 <= a <= MOST_AGE for v, a in inputs.values())
            good &= type(number) is int and number >= 0
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
            good = False
        if not good:
            raise LiveError(f"{label}: damaged: its inputs are not numbers with ages. Start without it: move it away.")
        return cls(session, inputs, number)


def write_state(path: Path, data: bytes) -> None:
    """The state in a file, which is complete and on the disk, or as it was. Errors: SimulationError."""
    with durable_file(path) as part:
        part.write_bytes(data)


def newest_state(path: Path, handed: bytes | None) -> tuple[LiveState | None, str]:
    """The newer one of the state in a file and of one that was handed over; None where there is neither. With a line on
    one that is damaged, where the other is not. Errors: LiveError where there is none but damaged ones."""
    states: list[LiveState] = []
    problems: list[LiveError] = []
    for each in (path if path.exists() else None, handed):
        if each is not None:
            try:
                states.append(LiveState.from_bytes(each))
            except LiveError as problem:
                problems.append(problem)
    if problems and not states:
        raise problems[0]
    return max(states, key=lambda state: state.number, default=None), " ".join(map(str, problems))


def lock_state(path: Path) -> sqlite3.Connection:
    """Make this process the one that owns a state, until it ends.

    Errors: LiveError where another twin has it, and keeps it for `PATIENCE`; SimulationError where its folder
    cannot be written.
    """
    check_folder(path.parent, (path.name,))
    held = lock(path.parent, path.with_suffix(".lock").name, PATIENCE)
    if held is None:
        raise LiveError(f"{path}: another twin continues from it. Stop that one, or choose another folder.")
    return held
