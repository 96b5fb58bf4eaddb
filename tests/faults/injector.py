"""Faults in the calls to libc of one command line: which call, what happens, and what the command then says.

A server process with `shim.c` preloaded imports Stillhook once and forks for each command line, so that a fault costs
what the command does and no start of Python. Shared with all its processes is one file, see `struct control` there.
"""

from __future__ import annotations

import ctypes
import errno
import json
import mmap
import os
import select
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from enum import IntEnum
from pathlib import Path
from typing import Any, NamedTuple

import pytest

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
CALLS = ("open", "write", "fsync", "rename", "mkdir", "unlink")
"""What is counted, in the order of `enum call`."""


MODULES = "STILLHOOK_FAULTS_MODULES"
"""Environment variable: file for the names of the modules that a command line used."""


STILL = 1_795_867_200 * 10**9
"""2026-11-28T12:00 UTC [ns since 1970]."""


class Kind(IntEnum):
    """What happens at a call, as `enum kind`."""

    NONE = 0
    FAIL = 1
    FAIL_ON = 2
    FULL = 3
    KILL = 4
    TORN = 5


class Fault(NamedTuple):
    """kind; at: number of the call, from 1 on; error: errno."""

    kind: Kind = Kind.NONE
    at: int = 0
    error: int = 0

    def __str__(self) -> str:
        name = errno.errorcode.get(self.error, "")
        return f"{self.kind.name.lower()} {name} at {self.at}".replace("  ", " ")


NO_FAULT = Fault()
FORK, GO_ON, END = range(3)
"""What a command that is held is asked to do, as `enum turn`."""
LOOK = 0.001
"""Time between two looks at a command that is held [s]."""


class Logged(ctypes.Structure):
    """`struct logged` of shim.c."""

    _fields_ = (*((name, ctypes.c_int32) for name in ("call", "open", "others")), ("path", ctypes.c_char * 212))


class Control(ctypes.Structure):
    """`struct control` of shim.c."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("kind", "at", "error", "count", "fired", "struck")),
        ("calls", ctypes.c_int64 * len(CALLS)),
        *((name, ctypes.c_int64) for name in ("memory_at", "memory_least", "memory_count", "clock", "still")),
        *((name, ctypes.c_int64) for name in ("hold", "held", "alone", "go", "turn", "done")),
        *((name, ctypes.c_int64) for name in ("status", "limit", "log")),
        ("below", ctypes.c_char * 4096),
        ("logged", Logged * 4096),
    )


class Call(NamedTuple):
    """A call that changes a file: its kind, and path below the folder; open: files below that are open; others:
    threads beside the one that calls, one more in a process that the command started."""

    kind: str
    path: str
    open: int
    others: int


class Outcome(NamedTuple):
    """code: exit code, negative for a signal; out, err: what was printed; count: calls that change files, by kind in
    `calls`; fired: faults, the first of them in a call of the kind `struck`; allocations: large ones."""

    code: int
    out: str
    err: str
    count: int
    fired: int
    struck: str
    calls: Mapping[str, int]
    allocations: int

    @property
    def lines(self) -> list[str]:
        """Lines on standard error."""
        return self.err.splitlines()


def compiled(folder: Path) -> Path:
    """The shim as a library; the test is skipped where no compiler is or libc is another one."""
    library = folder / "shim.so"
    flags = ["-O2", "-fPIC", "-shared", "-o", str(library), str(HERE / "shim.c"), "-ldl"]
    compilers = [[found] for name in ("cc", "gcc", "clang") if (found := shutil.which(name))]
    for command in [*compilers, [sys.executable, "-m", "ziglang", "cc"]] if sys.platform == "linux" else []:
        done = subprocess.run([*command, *flags], capture_output=True, check=False)
        if done.returncode == 0 and library.is_file():
            return library
    pytest.skip("faults are injected into libc, on Linux with a C compiler")


def preloaded(shared: Path, library: Path) -> tuple[Control, dict[str, str]]:
    """What a process and all that it starts share with this one, in a new file, and their environment."""
    shared.write_bytes(bytes(ctypes.sizeof(Control)))
    with shared.open("r+b") as file:
        control = Control.from_buffer(mmap.mmap(file.fileno(), 0))
    return control, os.environ | {
        "LD_PRELOAD": str(library),
        "STILLHOOK_FAULTS": str(shared),
        "OPENBLAS_NUM_THREADS": "1",
        "PYTHONPATH": os.pathsep.join([str(ROOT / "src"), str(ROOT)]),
    }


class Injector:
    """The server, as a context. Parameters: folder below which calls count; library: the shim; modules that it imports
    before it forks."""

    def __init__(self, folder: Path, library: Path, modules: Sequence[str] = ("stillhook.cli",)) -> None:
        self.folder = folder
        self._scratch = Path(tempfile.mkdtemp(prefix="stillhook-faults-"))
        self._shared = self._scratch / "control"
        self.control, env = preloaded(self._shared, library)
        env["MPLCONFIGDIR"] = str(self._scratch)
        self._server = subprocess.Popen(
            [sys.executable, "-m", "tests.faults.server", *modules],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=env, text=True, cwd=ROOT,
        )  # fmt: skip

    def __enter__(self) -> Injector:
        return self

    def __exit__(self, *of: object) -> None:
        assert self._server.stdin is not None
        self._server.stdin.close()
        self._server.wait(30)
        shutil.rmtree(self._scratch, ignore_errors=True)

    def run(
        self,
        arguments: Sequence[str],
        fault: Fault = NO_FAULT,
        *,
        env: Mapping[str, str] | None = None,
        below: Path | None = None,
        memory: tuple[int, int] = (0, 0),
        clock: float = 0.0,
        limit: float = 120.0,
    ) -> Outcome:
        """Run a command line with a fault. env: further variables; below: folder whose calls count, by default the
        injector's; memory: number and least size of the allocation that fails; clock: what the wall clock is
        ahead [s], 0: it stands at `STILL`, so that files that hold a time are the same; limit [s].

        Arguments that begin with "python" are the name of a function of `writers`, and its argument.
        """
        self._set(fault, memory, clock)
        code = self._asked(self._request(arguments, env, below, limit))["code"]
        self.control.memory_least = self.control.still = 0
        return self._outcome(code)

    @contextmanager
    def held(
        self, arguments: Sequence[str], env: Mapping[str, str] | None = None, limit: float = 120.0
    ) -> Iterator[Held]:
        """A command line that begins when it is first asked to wait before a call; it has ended after the block.
        limit: longest time to a call, and of what a fork does [s]."""
        self._set(NO_FAULT)
        self.control.done, self.control.limit = self.control.go, round(1e3 * limit)
        held = Held(self, self._request(arguments, env, None, 1e6), limit)
        try:
            yield held
        finally:
            held.end()
            self.control.hold = self.control.still = 0

    def logged(self, run: Callable[[], Outcome]) -> tuple[Outcome, list[Call]]:
        """Run something, and give its calls that change files."""
        self.control.log = 1
        outcome = run()
        self.control.log = 0
        logged = self.control.logged[: outcome.count]
        return outcome, [Call(CALLS[each.call], each.path.decode(), each.open, each.others) for each in logged]

    def _set(self, fault: Fault, memory: tuple[int, int] = (0, 0), clock: float = 0.0) -> None:
        control = self.control
        control.kind, control.at, control.error = fault
        control.count = control.fired = control.memory_count = 0
        control.calls[:] = [0] * len(CALLS)
        control.memory_at, control.memory_least = memory
        control.clock, control.still = round(1e9 * clock), 0 if clock else STILL

    def _request(
        self, arguments: Sequence[str], env: Mapping[str, str] | None, below: Path | None, limit: float
    ) -> dict[str, Any]:
        return {
            "arguments": list(map(str, arguments)),
            "cwd": str(self.folder),
            "env": dict(env or {}),
            "out": str(self._scratch / "out"),
            "err": str(self._scratch / "err"),
            "below": f"{below or self.folder}/",
            "shared": str(self._shared),
            "limit": limit,
        }

    def _outcome(self, code: int) -> Outcome:
        control = self.control
        out, err = ((self._scratch / name).read_text(encoding="utf-8", errors="replace") for name in ("out", "err"))
        struck = CALLS[control.struck] if control.fired else ""
        calls = dict(zip(CALLS, control.calls, strict=True))
        return Outcome(code, out, err, control.count, control.fired, struck, calls, control.memory_count)

    def learn(self, arguments: Sequence[str], env: Mapping[str, str] | None = None) -> Outcome:
        """Run a command line; the server then imports the modules that it used, for the next ones."""
        outcome = self.run(arguments, env={**(env or {}), MODULES: str(self._scratch / "modules")})
        self._asked({"import": str(self._scratch / "modules")})
        return outcome

    def _asked(self, request: Mapping[str, Any]) -> dict[str, Any]:
        self._ask(request)
        return self._answer()

    def _ask(self, request: Mapping[str, Any]) -> None:
        assert self._server.stdin is not None
        self._server.stdin.write(json.dumps(request) + "\n")
        self._server.stdin.flush()

    def _answered(self) -> bool:
        return bool(select.select([self._server.stdout], [], [], 0.0)[0])

    def _answer(self) -> dict[str, Any]:
        assert self._server.stdout is not None
        answer: dict[str, Any] = json.loads(self._server.stdout.readline())
        return answer


class Held:
    """A command that is held before some of its calls, one after the other; see `Injector.held`."""

    def __init__(self, injector: Injector, request: Mapping[str, Any], limit: float) -> None:
        self._injector, self._request, self._limit = injector, request, limit
        self._begun = False

    def before(self, call: int) -> bool:
        """Go on to a call, by its number, and wait before it; whether the command came to it, and has neither another
        thread, which forks would be without, nor an output open, which they would share."""
        control = self._injector.control
        control.hold, control.held = call, 0
        if self._begun:
            self._turn(GO_ON)
        else:
            self._injector._ask(self._request)
            self._begun = True
        self._wait(lambda: control.held or self._injector._answered())
        return bool(control.held and control.alone)

    def run(self, fault: Fault = NO_FAULT) -> Outcome:
        """Let a fork of the command as it is have a fault."""
        control = self._injector.control
        control.kind, control.at, control.error = fault
        control.fired = 0
        number = self._turn(FORK)
        self._wait(lambda: control.done == number)
        control.kind = Kind.NONE
        return self._injector._outcome(os.waitstatus_to_exitcode(control.status))

    def end(self) -> None:
        """End the command without what it has not done yet."""
        if self._begun:
            if not self._injector._answered():
                self._turn(END)
            self._injector._answer()

    def _turn(self, turn: int) -> int:
        control = self._injector.control
        control.turn = turn
        control.go += 1
        return int(control.go)

    def _wait(self, condition: Callable[[], object]) -> None:
        end = time.monotonic() + 2.0 * self._limit
        while not condition():
            assert time.monotonic() < end, "a command that is held does not answer"
            time.sleep(LOOK)
