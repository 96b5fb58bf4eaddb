"""The shared memory between the kernel's process and that of the servers."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Sequence
from enum import IntFlag
from multiprocessing.shared_memory import SharedMemory
from typing import NamedTuple

import numpy as np

from stillhook.control.interface import Sensed
from stillhook.live.runtime.ring import CELL, Records, Ring
from stillhook.live.runtime.sink import LONGEST


class Flag(IntFlag):
    """What is to be said about a cycle."""

    LATE = 1  # begun more than `LATE` after its deadline
    OVERRUN = 2  # not complete when the next cycle was due
    MISSED = 4  # cycles before it were left out
    STALE = 8  # an input is older than its time-out
    PARTIAL = 16  # a part of the tip's motion was never given, so the scenario's is used
    REFUSED = 32  # an input in force has a value that was refused
    RESET = 64  # the state was no number and went back to an earlier one


class Column(NamedTuple):
    """A number of the runtime: unit and meaning."""

    unit: str
    meaning: str


STATUS = {
    "cycle_number": Column("1", "deadlines since the start, those of cycles that were left out included"),
    "time": Column("s", "time of the winch since the scenario's start"),
    "time_utc": Column("s", "UTC when the cycle began, seconds since 1970"),
    "lateness": Column("s", "time from the deadline of the cycle to its begin"),
    "cost": Column("s", "time from the begin of the cycle to its complete row"),
    "cycle_flags": Column("1", "sum of 1 late, 2 overrun, 4 missed, 8 stale input, 16 partial, 32 refused, 64 reset"),
    "late_cycles": Column("1", "cycles that began more than 2 ms after their deadline"),
    "overrun_cycles": Column("1", "cycles that were not complete when the next one was due"),
    "missed_cycles": Column("1", "cycles that were left out after a stall too long to catch up with"),
    "worst_lateness": Column("s", "largest lateness since the start"),
    "stale_inputs": Column("1", "inputs that are older than their time-out"),
    "refused_inputs": Column("1", "values of inputs that were refused since the start"),
    "input_age": Column("s", "time since the oldest streamed input came in; 0 where none ever did"),
    "source_delay": Column("s", "from the newest input's own time stamp to its arrival; clocks of both sides"),
    "late_cause": Column(
        "1", "why the cycle before was late: 0 not, 1 no processor, 2 pages, 3 host, 4 the cycle before it, 5 timer"
    ),
}
"""Numbers of the runtime, which are before those of the winch in a row."""
SENSED = tuple(f"sensed_{name}" for name in Sensed._fields)
"""Names of what the PLC reads, behind the numbers of the winch in a row that has them."""
IMAGE = ("cycle_number", "time", "time_utc", "e_c", "u_p", *SENSED)
"""The process image of a PLC: numbers of one cycle that are read together, see `stillhook.live.hil`."""
ROWS, INPUT_ROWS, EVENTS, STATES = 4096, 16, 256, 2
"""Slots of each ring: rows of forty seconds at 10 ms, which servers take to start on a busy machine."""
MOST_NAMES, MOST_INPUTS, INPUT_CELLS = 256, 128, 3
"""Numbers in a row and inputs at most; cells of an input: value, arrival, its own time stamp."""
STATE_BYTES, FACE_BYTES = 262_144, 32_768


class Face(NamedTuple):
    """What the kernel's process says of itself when it is ready.

    names: of a row; inputs: what may be written, streamed ones first; streamed: how many of them are; cycle [s];
    modes: names of the modes with their numbers; scheduling: one sentence; real_time: whether it has that class.
    """

    names: tuple[str, ...]
    inputs: tuple[str, ...]
    streamed: int
    cycle: float
    modes: dict[str, float]
    scheduling: str
    real_time: bool

    def to_json(self) -> bytes:
        """As bytes."""
        return json.dumps(self._asdict()).encode()

    @classmethod
    def from_json(cls, data: bytes) -> Face:
        """Of bytes."""
        row = json.loads(data)
        return cls(**{**row, "names": tuple(row["names"]), "inputs": tuple(row["inputs"])})


class Block:
    """Parts of one piece of shared memory, of which the first holds a flag to stop.

    Parameters: sizes of the other parts [bytes]; name of an existing block; None makes one, which `close` removes.
    """

    def __init__(self, sizes: Sequence[int], name: str | None = None) -> None:
        sizes = [8 * CELL, *sizes]
        self._creator = name is None
        self._memory = SharedMemory(name, create=self._creator, size=sum(sizes))
        buffer = self._memory.buf
        assert buffer is not None
        if self._creator:
            buffer[:] = bytes(len(buffer))
        ends = np.cumsum(sizes).tolist()
        self._parts = [buffer[end - size : end] for end, size in zip(ends, sizes, strict=True)]
        self._control = np.frombuffer(self._parts[0], dtype=np.int64)
        self.rings: tuple[Ring, ...] = ()

    @property
    def name(self) -> str:
        """Name of the block, for another process."""
        return self._memory.name

    @property
    def stopping(self) -> bool:
        """Whether the process behind it is to stop."""
        return bool(self._control[0])

    def stop(self, wanted: bool = True) -> None:
        """Ask that process to stop after its cycle."""
        self._control[0] = int(wanted)

    def close(self) -> None:
        """Release the memory, and remove it where it was made here."""
        for ring in self.rings:
            ring.close()
        del self._control
        for part in self._parts:
            part.release()
        self._memory.close()
        if self._creator:
            with contextlib.suppress(FileNotFoundError):
                self._memory.unlink()


class Board(Block):
    """Rows, inputs, events, states and a flag to stop of the kernel's process. Parameter: name, as of a `Block`."""

    def __init__(self, name: str | None = None) -> None:
        sizes = [
            Ring.size(ROWS, MOST_NAMES),
            Ring.size(INPUT_ROWS, INPUT_CELLS * MOST_INPUTS),
            Records.bytes_of(EVENTS, LONGEST),
            Records.bytes_of(STATES, STATE_BYTES),
            Records.bytes_of(1, FACE_BYTES),
        ]
        super().__init__(sizes, name)
        parts = self._parts
        self.rows = Ring(parts[1], ROWS, MOST_NAMES)
        self.inputs = Ring(parts[2], INPUT_ROWS, INPUT_CELLS * MOST_INPUTS)
        self.events = Records(parts[3], EVENTS, LONGEST)
        self.states = Records(parts[4], STATES, STATE_BYTES)
        self.faces = Records(parts[5], 1, FACE_BYTES)
        self.rings = (self.rows, self.inputs, self.events, self.states, self.faces)

    def face(self) -> Face | None:
        """What the kernel says of itself; None before it is ready."""
        newest = self.faces.newest()
        return None if newest is None else Face.from_json(newest[1])
