"""Kernels as native libraries: their C99 (`stillhook.kernels.c99`), compiled by Zig where the extra `native` is
installed, in a quarter of the time that Numba takes and with the same bits.

A library is kept under the hash of its C source, so that an edit of one kernel leaves the others as they are; one
process compiles it and the others wait. Where Zig is missing or fails, or a winch or controller of the user is outside
the subset of Python that is translated, Numba compiles the kernel. `STILLHOOK_KERNELS=numba` leaves Zig out.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
import importlib
import importlib.util
import logging
import os
import platform
import subprocess
import sys
import sysconfig
import threading
from collections.abc import Callable, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from stillhook.base.atomic import atomic_file
from stillhook.errors import SimulationError, StillhookError
from stillhook.kernels.c99.expressions import SubsetError
from stillhook.kernels.c99.source import Translator, entry_types
from stillhook.kernels.lanes import Array

VARIABLE = "STILLHOOK_KERNELS"
NATIVE, NUMBA = "native", "numba"
FLAGS = ("-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-signed-zeros", "-fopenmp-simd", "-shared", "-s", "-w")
"""Strict arithmetic as Numba's: no reassociation, fused multiply-add in `exp` alone; square roots without errno."""
SUFFIX = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")
LOG = logging.getLogger("stillhook")
CTYPES = {Array: ctypes.c_void_p, int: ctypes.c_int64, float: ctypes.c_double}


@functools.cache
def compiler() -> tuple[str, ...] | None:
    """Command of the C compiler; None where Numba compiles the kernels. Errors: SimulationError for another word than
    these two in STILLHOOK_KERNELS."""
    chosen = os.environ.get(VARIABLE, NATIVE)
    if chosen not in (NATIVE, NUMBA):
        raise SimulationError(f'{VARIABLE} = "{chosen}": choose {NATIVE} or {NUMBA}.')
    installed = all(importlib.util.find_spec(name) for name in ("ziglang", "filelock"))
    return (sys.executable, "-m", "ziglang", "cc") if chosen == NATIVE and installed else None


@functools.cache
def target() -> str:
    """Processor that code is made for: x86-64 with AVX2 where this one has it, else what it is."""
    if platform.machine().lower() not in ("amd64", "x86_64"):
        return "-mcpu=native"
    core = "numpy._core" if importlib.util.find_spec("numpy._core") else "numpy.core"
    features = importlib.import_module(f"{core}._multiarray_umath").__cpu_features__
    return "-mcpu=x86_64_v3" if features["AVX2"] and features["FMA3"] else "-mcpu=x86_64_v2"


class Library:
    """A shared library of some kernels, translated and compiled when the first of them is called.

    entries: kernels by the name of their symbol; folder: of the cache, for this state of the sources; kept: folder of
    libraries under the hash of their source.
    """

    def __init__(self, entries: Mapping[str, Callable[..., Any]], folder: Path, kept: Path) -> None:
        self.entries, self.folder, self.kept = entries, folder, kept
        self.lock = threading.Lock()
        self.loaded: ctypes.CDLL | None = None
        self.failed = False

    def function(self, name: str) -> Any:
        """The function of ctypes; None where the library cannot be made, which is noted once."""
        with self.lock:
            if self.loaded is None and not self.failed:
                try:
                    self.loaded = ctypes.CDLL(str(self.file()))
                except SubsetError:
                    self.failed = True
                except (OSError, StillhookError, subprocess.SubprocessError) as problem:
                    self.failed = True
                    LOG.warning(f"Zig did not compile a kernel, so Numba does: {_reason(problem)}")
        if self.loaded is None:
            return None
        function = getattr(self.loaded, name)
        function.argtypes, function.restype = [CTYPES[t] for t in entry_types(self.entries[name])], None
        return function

    def is_compiled(self) -> bool:
        return (known := self._known()) is not None and known.exists()

    def file(self) -> Path:
        """The library's file, compiled where there is none yet. Errors: SubsetError, OSError, SubprocessError."""
        known = self._known()
        if known is not None and known.exists():
            return known
        translator = Translator()
        for name, function in self.entries.items():
            if translator.function(function, entry_types(function), export=name).result is not None:
                raise SubsetError(f"{name}: a kernel gives its results in arrays.")
        source = translator.source()
        parts = (source, *FLAGS, target(), version("ziglang"), sysconfig.get_platform())
        file = self.kept / f"{hashlib.sha256(chr(0).join(parts).encode()).hexdigest()[:24]}{SUFFIX}"
        self._compile(source, file)
        self.folder.mkdir(parents=True, exist_ok=True)
        with atomic_file(self._pointer()) as pointer:
            pointer.write_text(file.name, encoding="utf-8")
        return file

    def _pointer(self) -> Path:
        """File that names the library for this processor: machines may share a home folder."""
        return self.folder / f"library{target()}.txt"

    def _known(self) -> Path | None:
        try:
            return self.kept / self._pointer().read_text(encoding="utf-8")
        except OSError:
            return None

    def _compile(self, source: str, file: Path) -> None:
        from filelock import FileLock

        command = compiler()
        assert command is not None
        with FileLock(file.with_suffix(".lock")):
            if file.exists():
                return
            with atomic_file(file) as library:
                code = library.with_suffix(".c")
                code.write_text(source, encoding="utf-8")
                caches = {f"ZIG_{which}_CACHE_DIR": str(self.kept.with_name("zig")) for which in ("LOCAL", "GLOBAL")}
                try:
                    subprocess.run(
                        [*command, *FLAGS, target(), "-o", str(library), str(code)],
                        env=os.environ | caches,
                        check=True,
                        capture_output=True,
                        text=True,
                    )
                finally:
                    code.unlink(missing_ok=True)


class Entry:
    """One kernel: native where its library can be made, else as `other` gives it. Called with contiguous arrays of
    floats, whole numbers and floats."""

    def __init__(self, library: Library, name: str, other: Callable[[], Callable[..., Any]]) -> None:
        self.library, self.name, self.other = library, name, other
        self.py_func = library.entries[name]
        self.arrays = [i for i, t in enumerate(entry_types(self.py_func)) if t is Array]

    @functools.cached_property
    def function(self) -> Callable[..., Any]:
        native = self.library.function(self.name)
        if native is None:
            return self.other()

        def call(*arguments: Any) -> None:
            passed = list(arguments)
            for i in self.arrays:
                array = arguments[i]
                assert array.flags.c_contiguous
                assert array.dtype == np.float64
                passed[i] = array.ctypes.data
            native(*passed)

        return call

    def __call__(self, *arguments: Any) -> Any:
        return self.function(*arguments)


def _reason(problem: Exception) -> str:
    lines = str(getattr(problem, "stderr", "") or problem).strip().splitlines()
    return lines[0] if lines else type(problem).__name__
