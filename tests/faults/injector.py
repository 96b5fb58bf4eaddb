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
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from enum import IntEnum
from pathlib import Path
from typing import Any, NamedTuple

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


class Control(ctypes.Structure):
    """`struct control` of shim.c."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("kind", "at", "error", "count", "fired", "struck")),
        ("calls", ctypes.c_int64 * len(CALLS)),
        *((name, ctypes.c_int64) for name in ("memory_at", "memory_least", "memory_count", "clock", "still")),
        ("below", ctypes.c_char * 4096),
    )


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


def compiled(folder: Path) -> Path | None:
    """The shim as a library; None where no compiler is or libc is another one."""
    if sys.platform != "linux":
        return None
    library = folder / "shim.so"
    flags = ["-O2", "-fPIC", "-shared", "-o", str(library), str(HERE / "shim.c"), "-ldl"]
    compilers = [[found] for name in ("cc", "gcc", "clang") if (found := shutil.which(name))]
    for command in [*compilers, [sys.executable, "-m", "ziglang", "cc"]]:
        done = subprocess.run([*command, *flags], capture_output=True, check=False)
        if done.returncode == 0 and library.is_file():
            return library
    return None


class Injector:
    """The server, as a context. Parameters: folder below which calls count; library: the shim; modules that it imports
    before it forks."""

    def __init__(self, folder: Path, library: Path, modules: Sequence[str] = ("stillhook.cli",)) -> None:
        self.folder = folder
        self._scratch = Path(tempfile.mkdtemp(prefix="stillhook-faults-"))
        self._shared = self._scratch / "control"
        self._shared.write_bytes(bytes(ctypes.sizeof(Control)))
        with self._shared.open("r+b") as file:
            self._map = mmap.mmap(file.fileno(), 0)
        self.control = Control.from_buffer(self._map)
        env = os.environ | {
            "LD_PRELOAD": str(library),
            "STILLHOOK_FAULTS": str(self._shared),
            "OPENBLAS_NUM_THREADS": "1",
            "PYTHONPATH": os.pathsep.join([str(ROOT / "src"), str(ROOT)]),
            "MPLCONFIGDIR": str(self._scratch),
        }
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
        control = self.control
        control.kind, control.at, control.error = fault
        control.count = control.fired = control.memory_count = 0
        control.calls[:] = [0] * len(CALLS)
        control.memory_at, control.memory_least = memory
        control.clock, control.still = round(1e9 * clock), 0 if clock else STILL
        request = {
            "arguments": list(map(str, arguments)),
            "cwd": str(self.folder),
            "env": dict(env or {}),
            "out": str(self._scratch / "out"),
            "err": str(self._scratch / "err"),
            "below": f"{below or self.folder}/",
            "shared": str(self._shared),
            "limit": limit,
        }
        code = self._asked(request)["code"]
        control.memory_least = control.still = 0
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
        assert self._server.stdin is not None
        assert self._server.stdout is not None
        self._server.stdin.write(json.dumps(request) + "\n")
        self._server.stdin.flush()
        answer: dict[str, Any] = json.loads(self._server.stdout.readline())
        return answer
