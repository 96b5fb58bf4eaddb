"""The loop of one target: change an input, try it, keep it where it showed something new."""

from __future__ import annotations

import os
import random
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from fuzz.engine.feedback import Lines, Sentences
from fuzz.engine.guard import Guard, Kind, Outcome, peak, reader_peak
from fuzz.mutators.choose import mutated
from fuzz.targets.registry import Target
from stillhook.base.gateway.budget import late

TRACED = 8
"""One input of so many is traced for lines; of all others the refusal alone is looked at."""
WHOLE = 0.6
"""Share of inputs made of one that is read: most that are made of a refused one are refused at the same place."""
LATE = late(0.0).partition("0")[0]
"""In the refusal of a binary file that its reader did not read in time."""
FIRST = 40
"""Inputs at the start that are tried again where a campaign continues."""
RECENT = 30
"""Inputs found last, which are taken half of the time."""
LOOK = 100
"""Inputs between two looks for files that were left behind."""
LONGEST_KEPT = 60_000
"""Bytes of an input that is kept as a parent of others."""
MOST_KEPT = 3000


@dataclass
class Tally:
    """What a campaign did: inputs by what came of them, those given up at the limit of time among the refused ones,
    lines of the package seen, peak memory above the start, and that of the processes that read."""

    inputs: int = 0
    read: int = 0
    refused: int = 0
    escape: int = 0
    hang: int = 0
    late: int = 0
    lines: int = 0
    kept: int = 0
    seconds: float = 0.0
    peak: int = 0
    reader_peak: int = 0
    slowest: float = 0.0

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)


@dataclass
class Campaign:
    """The loop's state. found: called with the input and outcome of each new fault; kept: with each input worth
    keeping."""

    target: Target
    folder: Path
    seed: int
    found: Callable[[bytes, Outcome], None] = lambda data, outcome: None
    kept: Callable[[bytes], None] = lambda data: None
    seen: Mapping[str, Any] = field(default_factory=dict)
    """What an earlier campaign of the same code had seen: its `showed`."""
    tally: Tally = field(default_factory=Tally)
    pool: list[bytes] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.r = random.Random(f"{self.target.name} {self.seed}")
        self._lines = Lines(self.seen.get("lines", {}))
        self._sentences = Sentences(self.seen.get("sentences", ()))
        self._faults: set[str] = set()
        self._whole: list[bytes] = []

    def showed(self) -> dict[str, Any]:
        """Lines and sentences seen so far, for JSON."""
        return {"lines": self._lines.to_dict(), "sentences": self._sentences.to_list()}

    def run(self, start: Sequence[bytes], *, inputs: int | None = None, seconds: float | None = None) -> Tally:
        """Try the inputs at the start, then changed ones, until so many were tried or so much time [s] is over."""
        before, begun = peak(), time.perf_counter()
        with Guard(self.target, self.folder) as guard:
            for data in start[:FIRST] if self.seen else start:
                self._try(guard, data, traced=not self.seen, parent=True)
            self.pool += start[FIRST:] if self.seen else ()
            while not self._over(inputs, seconds, time.perf_counter() - begun):
                parent = self._parent()
                data = mutated(self.r, self.target.form, parent, self.pool)
                self._try(guard, data, traced=self.tally.inputs % TRACED == 0)
                if self.tally.inputs % LOOK == 0 and (left := guard.left()) is not None:
                    self._fault(guard, data, left)
            if (left := guard.left()) is not None:
                self._fault(guard, b"", left)
        self.tally.seconds = time.perf_counter() - begun
        self.tally.lines, self.tally.peak = self._lines.seen, max(0, peak() - before)
        self.tally.kept, self.tally.reader_peak = len(self.pool), reader_peak()
        return self.tally

    def _over(self, inputs: int | None, seconds: float | None, passed: float) -> bool:
        return (inputs is not None and self.tally.inputs >= inputs) or (seconds is not None and passed >= seconds)

    def _parent(self) -> bytes:
        if not self.pool:
            return b""
        if self._whole and self.r.random() < WHOLE:
            return self.r.choice(self._whole)
        return self.r.choice(self.pool[-RECENT:] if self.r.random() < 0.5 else self.pool)

    def _try(self, guard: Guard, data: bytes, *, traced: bool, parent: bool = False) -> None:
        begun, lines = time.process_time(), self._lines.seen
        if traced:
            with self._lines:
                outcome = guard.attempt(data)
        else:
            outcome = guard.attempt(data)
        tally = self.tally
        tally.inputs += 1
        tally.slowest = max(tally.slowest, time.process_time() - begun)
        setattr(tally, outcome.kind, getattr(tally, outcome.kind) + 1)
        tally.late += LATE in outcome.line
        new = self._sentences.new(outcome) | (self._lines.seen > lines)
        if not outcome.good:
            self._fault(guard, data, outcome)
        elif (new or parent) and len(data) <= LONGEST_KEPT and len(self.pool) < MOST_KEPT:
            self.pool.append(data)
            if outcome.kind == Kind.READ:
                self._whole.append(data)
            if not parent:
                self.kept(data)

    def _fault(self, guard: Guard, data: bytes, outcome: Outcome) -> None:
        if outcome.key in self._faults:
            return
        self._faults.add(outcome.key)
        if outcome.kind == Kind.ESCAPE and outcome.key != "left":
            data = shortened(guard, data, outcome)
        self.found(data, outcome)


SHORTENINGS = 300
"""Inputs that are tried to find a shorter one with the same fault."""


def shortened(guard: Guard, data: bytes, outcome: Outcome) -> bytes:
    """A shorter input with the same fault, by leaving out ever smaller parts."""
    tries, size = 0, max(1, len(data) // 2)
    while size and tries < SHORTENINGS:
        at = 0
        while at < len(data) and tries < SHORTENINGS:
            shorter = data[:at] + data[at + size :]
            tries += 1
            if guard.attempt(shorter).key == outcome.key:
                data = shorter
            else:
                at += size
        size //= 2
    return data


def room(name: str, process: int) -> Path:
    """A folder for one target of a process, in memory where the system has such a place."""
    base = Path("/dev/shm") if os.access("/dev/shm", os.W_OK) else Path(tempfile.gettempdir())
    return base / f"stillhook-fuzz-{process}" / name
