"""Copies of the repository in which a mutant lives, and the process that runs tests in one.

A change lies on the disk, so that programs that tests start and kernels that are compiled from the sources see it. The
process is forked from one that has loaded the libraries, not Stillhook, and what it may take is counted in seconds of
the processor, which other work on the machine does not change.
"""

from __future__ import annotations

import contextlib
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from trials.mutants.sites import Mutant

ROOT = Path(__file__).resolve().parents[2]
LIBRARIES = (
    *("h5netcdf", "hypothesis", "matplotlib", "numpy", "pandas", "pydantic", "pytest", "rich", "typer", "xarray"),
    *(f"scipy.{part}" for part in ("integrate", "interpolate", "linalg", "optimize", "signal", "stats")),
)
"""What most tests load, loaded once."""
HANGS = 60.0
"""One test may take so much longer than all tests are given [s of the processor]."""
PATIENCE = 20.0
"""Longest time on the clock for a second of the processor [s]: something waits for ever beyond it."""
PASSED, FAILED, NO_TESTS = 0, 1, 5
"""Exit codes of pytest."""
STOPPED, OVER = -1, 77
"""Exit codes beside those: a test did not end in its time; the time of all tests has passed."""


class Ended(NamedTuple):
    """How a run of tests ended: pytest's exit code, STOPPED or OVER; seconds of the processor; output."""

    code: int
    cpu: float
    text: str


class Run(NamedTuple):
    """Arguments of pytest, and the tests that are run of what they collect; () for all."""

    arguments: Sequence[str]
    only: Sequence[str] = ()


class Tree:
    """One copy of the repository, with a folder for what its runs write."""

    def __init__(self, folder: Path, number: int) -> None:
        self.root, self._notes, self._cache = folder / f"tree-{number}", folder / f"run-{number}", folder / "cache"
        self._child: int | None = None
        self._compiled: Path | None = None
        self._notes.mkdir(parents=True, exist_ok=True)
        _copy(self.root)

    @property
    def busy(self) -> bool:
        return self._child is not None

    def change(self, mutant: Mutant, compiles: bool) -> None:
        """Put a mutant in; compiles: kernels follow from it, and those that its tests compile are thrown away."""
        path = self.root / mutant.file
        _write(path, mutant.apply((ROOT / mutant.file).read_bytes()))
        self._compiled = self._notes / "cache" if compiles else None

    def restore(self, mutant: Mutant) -> None:
        """Take the mutant out."""
        _write(self.root / mutant.file, (ROOT / mutant.file).read_bytes())
        if self._compiled is not None:
            shutil.rmtree(self._compiled, ignore_errors=True)
        self._compiled = None

    def start(self, runs: Sequence[Run], budget: float) -> None:
        """Run pytest, one run after the other until one fails; no test begins after `budget` [s of the processor]."""
        sys.stdout.flush()
        self._until = time.monotonic() + PATIENCE * (budget + HANGS)
        child = os.fork()
        if child:
            self._child = child
            return
        code = 3
        try:
            os.setpgid(0, 0)
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            limit = int(budget + HANGS)
            resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
            output = os.open(self._notes / "output", os.O_CREAT | os.O_TRUNC | os.O_WRONLY)
            os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
            os.dup2(output, 1)
            os.dup2(output, 2)
            code = self._test(runs, budget)
        finally:
            with contextlib.suppress(Exception):
                sys.stdout.flush()
                sys.stderr.flush()
            os._exit(code)

    def _test(self, runs: Sequence[Run], budget: float) -> int:
        import pytest

        os.chdir(self.root)
        sys.modules["__main__"] = ModuleType("__main__")  # a process that a test spawns would import this program
        os.environ |= environment(self.root, self._compiled or self._cache)
        for name in [name for name in sys.modules if name.split(".")[0] in ("trials", "stillhook", "tests")]:
            del sys.modules[name]
        sys.path[:] = [str(self.root / "src"), str(self.root), *(p for p in sys.path if str(ROOT) not in p)]
        options = ["-q", "-m", "not thorough", "--tb=line", "-p", "no:cacheprovider", "-p", "no:xdist"]
        given = Budget(budget)
        for run in runs:
            plugins = [given, Only(run.only)] if run.only else [given]
            code = int(pytest.main([*options, *run.arguments], plugins=plugins))
            if code == FAILED or (code not in (PASSED, NO_TESTS) and not given.over):
                return code
            if given.over:
                return OVER
        return PASSED

    def ended(self) -> Ended | None:
        """How the run ended, None while it goes on."""
        assert self._child is not None
        pid, status, usage = os.wait4(self._child, os.WNOHANG)
        late = time.monotonic() > self._until
        if not pid:
            if late:
                os.killpg(self._child, signal.SIGKILL)
            return None
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self._child, signal.SIGKILL)  # what it may have left running
        self._child = None
        text = (self._notes / "output").read_text(encoding="utf-8", errors="replace")
        code = os.waitstatus_to_exitcode(status)
        if code < 0:
            text = f"{text}\n{signal.Signals(-code).name}"
        return Ended(code if code >= 0 else STOPPED, usage.ru_utime + usage.ru_stime, text)

    def stop(self) -> None:
        """End what runs."""
        if self._child is not None:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(self._child, signal.SIGKILL)
            os.waitpid(self._child, 0)
            self._child = None


class Budget:
    """A plugin of pytest that ends the session after so many seconds of the processor, children included."""

    def __init__(self, seconds: float) -> None:
        self._seconds, self.over = seconds, False

    def pytest_runtest_logfinish(self, nodeid: str, location: Any) -> None:
        self.over = sum(os.times()[:4]) > self._seconds

    def pytest_runtest_protocol(self, item: Any, nextitem: Any) -> None:
        if self.over:
            item.session.shouldstop = "the time that is given to tests has passed"


class Only:
    """A plugin of pytest that runs these tests alone, in this order, those of a file together."""

    def __init__(self, tests: Sequence[str]) -> None:
        files = {file: i for i, file in reversed([*enumerate(test.split("::")[0] for test in tests)])}
        self._order = {test: (files[test.split("::")[0]], i) for i, test in enumerate(tests)}

    def pytest_collection_modifyitems(self, items: list[Any]) -> None:
        kept = [item for item in items if item.nodeid in self._order]
        items[:] = sorted(kept, key=lambda item: self._order[item.nodeid])


def environment(root: Path, cache: Path) -> dict[str, str]:
    """Variables of a process that runs the tests of a copy."""
    return {
        "PYTHONPATH": f"{root / 'src'}{os.pathsep}{root}",
        "STILLHOOK_CACHE": str(cache),
        "STILLHOOK_SHARED_DATA": os.environ.get("STILLHOOK_SHARED_DATA", str(ROOT.parent / "shared" / "data")),
        "OPENBLAS_NUM_THREADS": "1",
        "CI": "1",  # the same examples each time
    }


def load_libraries() -> None:
    """Once, before the first fork; one that is not installed is left out."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    for name in LIBRARIES:
        with contextlib.suppress(ImportError):
            __import__(name)


def _copy(target: Path) -> None:
    """Bring a copy of the repository up to date: files under version control, and those that may come under it. What is
    as it was keeps its bytecode."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=ROOT, check=True, stdout=-1
    )
    names = {name for name in listed.stdout.decode().split("\0") if name and (ROOT / name).is_file()}
    for path in [path for path in target.rglob("*.*") if path.is_file() and path.suffix != ".pyc"]:
        if path.relative_to(target).as_posix() not in names:
            path.unlink()
    for name in names:
        source = (ROOT / name).read_bytes()
        copy = target / name
        if not (copy.is_file() and copy.read_bytes() == source):
            copy.parent.mkdir(parents=True, exist_ok=True)
            _write(copy, source)


def _write(path: Path, source: bytes) -> None:
    """A source, and no bytecode of another one, which would be believed within the same second."""
    path.write_bytes(source)
    for compiled in (path.parent / "__pycache__").glob(f"{path.stem}.*.pyc"):
        compiled.unlink(missing_ok=True)
