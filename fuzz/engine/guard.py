"""One input in a target, within bounds of time and memory, and what came of it."""

from __future__ import annotations

import contextlib
import gc
import os
import resource
import shutil
import signal
import sys
import traceback
import warnings
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import NamedTuple

import stillhook
from fuzz.targets.registry import Target
from stillhook.errors import LONGEST_LINE, StillhookError
from stillhook.formats.binary import end_readers

PACKAGE = str(Path(stillhook.__file__).parent)
SLOWEST = 5.0
"""Processor time of one input [s]; an honest file of this size takes some hundredths."""
MOST_MEMORY = 2**30
"""Memory that one process may take beyond what it had at the start [bytes]."""


class Kind:
    """What came of an input."""

    READ, REFUSED, ESCAPE, HANG = "read", "refused", "escape", "hang"


class Outcome(NamedTuple):
    """kind: of `Kind`; line: the refusal, or what escaped and where; key: alike for one and the same fault."""

    kind: str
    line: str = ""
    key: str = ""

    @property
    def good(self) -> bool:
        return self.kind in (Kind.READ, Kind.REFUSED)


class Hang(BaseException):
    """The time is over. No Exception, so that no reader takes it for a damaged file."""


def _alarm(_signal: int, _frame: FrameType | None) -> None:
    raise Hang


class Guard:
    """Tries inputs of one target in a folder of its own, which is made and removed by the context."""

    def __init__(self, target: Target, folder: Path) -> None:
        self.target, self.folder = target, folder
        self.current = folder / (target.file or "input")
        """The input that is tried, also for who looks on from outside."""

    def __enter__(self) -> Guard:
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir(parents=True)
        for name, data in self.target.beside.items():
            (self.folder / name).write_bytes(data)
        self._usual = {self.current.name, *self.target.beside}
        with contextlib.ExitStack() as stack:
            stack.callback(shutil.rmtree, self.folder, ignore_errors=True)
            stack.callback(signal.signal, signal.SIGPROF, signal.signal(signal.SIGPROF, _alarm))
            stack.enter_context(_quiet())
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *of: object) -> None:
        self._stack.close()

    def attempt(self, data: bytes) -> Outcome:
        """What comes of an input."""
        self.current.write_bytes(data)
        asked = self.current if self.target.file else data
        try:
            try:
                signal.setitimer(signal.ITIMER_PROF, SLOWEST)
                self.target.read(asked)
            finally:
                signal.setitimer(signal.ITIMER_PROF, 0.0)
        except Hang:
            return Outcome(Kind.HANG, f"more than {SLOWEST:g} s of processor time", "hang")
        except StillhookError as problem:
            return _judged(problem)
        except MemoryError:
            gc.collect()
            return Outcome(Kind.ESCAPE, f"more than {MOST_MEMORY >> 20} MB", "memory")
        except BaseException as problem:  # all of them are findings
            return _escaped(problem)
        return Outcome(Kind.READ)

    def left(self) -> Outcome | None:
        """Files that readers left behind in the folder, removed."""
        more = sorted(path for path in self.folder.iterdir() if path.name not in self._usual)
        for path in more:
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        names = ", ".join(path.name for path in more)
        return Outcome(Kind.ESCAPE, f"left behind: {names}"[:LONGEST_LINE], "left") if more else None


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """What is printed is dropped; the package's own warnings are errors, as in its tests, and others are ignored."""
    with warnings.catch_warnings(), open(os.devnull, "w") as nowhere, contextlib.redirect_stdout(nowhere):
        warnings.simplefilter("ignore")
        for category in (RuntimeWarning, DeprecationWarning):
            warnings.filterwarnings("error", category=category, module="stillhook")
        yield


def _judged(problem: StillhookError) -> Outcome:
    """A refusal: lines that a person can read."""
    for line in problem.lines:
        fault = (
            "is empty"
            if not line.strip()
            else "has several lines"
            if len(line.splitlines()) > 1
            else f"has {len(line)} characters"
            if len(line) > LONGEST_LINE
            else ""
        )
        if fault:
            place = _place(problem)
            return Outcome(Kind.ESCAPE, f"a refusal that {fault}, raised in {place}: {line[:200]!r}", f"line {place}")
    return Outcome(Kind.REFUSED, str(problem))


def _escaped(problem: BaseException) -> Outcome:
    name, place = type(problem).__name__, _place(problem)
    message = " ".join(str(problem).split())[:200]
    return Outcome(Kind.ESCAPE, f"{name} in {place}: {message}", f"{name} {place}")


def _place(problem: BaseException) -> str:
    """Where in the package it went wrong: the innermost of its own lines."""
    own = [f for f in traceback.extract_tb(problem.__traceback__) if f.filename.startswith(PACKAGE)]
    if not own:
        return "the target"
    return f"{Path(own[-1].filename).relative_to(PACKAGE).as_posix()}:{own[-1].lineno}"


def bound_memory() -> None:
    """Bound the memory of this process to what it has now and `MOST_MEMORY` more."""
    if sys.platform != "linux":
        return
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    most = pages * resource.getpagesize() + MOST_MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (most, resource.getrlimit(resource.RLIMIT_AS)[1]))


def peak(of: int = resource.RUSAGE_SELF) -> int:
    """Largest memory of this process so far [bytes]."""
    return resource.getrusage(of).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def reader_peak() -> int:
    """Largest memory of a process that read binary files for this one [bytes]; they are ended."""
    end_readers()
    return peak(resource.RUSAGE_CHILDREN)
