"""Kernels as native libraries: their C99 (`stillhook.kernels.c99.source`), compiled by Zig when a wheel is made, or on
this machine where the extra `native` is installed: in a quarter of the time that Numba takes and with the same bits.

A wheel holds libraries, one for each platform and level of processor; its index names what they were made from, and one
is used only where that is what is installed: all sources, or the C source of a kernel. A checkout holds none.

What is compiled here is kept under the hash of its C source, so that an edit of one kernel leaves the others as they
are; one process compiles it and the others wait. Every library has its checksum beside it: one that is damaged would
end the process, and is not loaded. Where Zig is missing or fails, or a winch or controller of the user is
outside the subset of Python that is translated, Numba compiles the kernel. `STILLHOOK_KERNELS=numba` leaves native
libraries out.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
import importlib
import importlib.util
import json
import logging
import os
import platform
import subprocess
import sys
import sysconfig
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.atomic import atomic_file
from stillhook.base.kept.checked import Kept, is_sound, read_checked, write_beside, write_checked
from stillhook.base.kept.leftovers import sweep
from stillhook.base.kept.one_at_a_time import one_at_a_time, remove_old_locks
from stillhook.errors import SimulationError, StillhookError
from stillhook.kernels.c99.expressions import SubsetError
from stillhook.kernels.c99.source import Translator, entry_types
from stillhook.kernels.c99.zig import compiled
from stillhook.kernels.cache import SHIPPED
from stillhook.kernels.lanes import Array

INDEX = "kernels.json"
SYSTEMS = {"linux": "linux", "win32": "windows", "darwin": "macos"}
X86 = ("amd64", "x86_64")
V2, V3, ARM = "x86_64_v2", "x86_64_v3", "aarch64"


class Index(NamedTuple):
    """sources: hash of everything that the kernels were translated from; kernels: symbol -> hash of its C source;
    libraries: platform -> file."""

    sources: str
    kernels: Mapping[str, str]
    libraries: Mapping[str, str]

    def write(self, folder: Path) -> None:
        """Write it, and the checksums of its libraries, into their folder. Errors: SimulationError."""
        write_checked(folder / INDEX, json.dumps(self._asdict(), indent=1).encode())
        for name in self.libraries.values():
            write_beside(folder / name, (folder / name).read_bytes())


def code_hash(source: str) -> str:
    """Identity of a C source."""
    return hashlib.sha256(source.encode()).hexdigest()[:24]


@functools.cache
def level() -> str:
    """Processor that code is made for: x86-64 with AVX2 where this one has it, else with SSE4.2; "aarch64"; "" for
    any other."""
    machine = platform.machine().lower()
    if machine not in X86:
        return ARM if machine in ("arm64", "aarch64") else ""
    core = "numpy._core" if importlib.util.find_spec("numpy._core") else "numpy.core"
    features = importlib.import_module(f"{core}._multiarray_umath").__cpu_features__
    return V3 if features["AVX2"] and features["FMA3"] else V2


@functools.cache
def index(folder: Path) -> Index | None:
    """Index of the libraries in a folder; None where it holds none that can be read."""
    try:
        content = read_checked(folder / INDEX, Kept.WHEEL)
        return None if content is None else Index(**json.loads(content))
    except (ValueError, TypeError):
        return None


def shipped_library(
    symbols: Iterable[str], *, sources: str = "", code: str = "", folder: Path = SHIPPED
) -> Path | None:
    """File of the library with these kernels for this machine.

    sources: hash of the installed sources, code: hash of the kernels' C source; None where neither is what the library
    was made from.
    """
    known, system = index(folder), SYSTEMS.get(sys.platform)
    if known is None or (name := known.libraries.get(f"{system}-{level()}")) is None:
        return None
    codes = {known.kernels.get(symbol) for symbol in symbols}
    if None in codes or not (known.sources == sources or codes == {code}):
        return None
    return folder / name


VARIABLE = "STILLHOOK_KERNELS"
NATIVE, NUMBA = "native", "numba"
FLAGS = ("-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-signed-zeros", "-fopenmp-simd", "-shared", "-s", "-w")
"""Strict arithmetic as Numba's: no reassociation, fused multiply-add in `exp` alone; square roots without errno."""
SUFFIX = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")
LOG = logging.getLogger("stillhook")
CTYPES = {Array: ctypes.c_void_p, int: ctypes.c_int64, float: ctypes.c_double}


class NoCompilerError(StillhookError):
    """Zig is not installed."""


def native() -> bool:
    """Whether native libraries are used. Errors: SimulationError for another word than these two in
    STILLHOOK_KERNELS."""
    chosen = os.environ.get(VARIABLE, NATIVE)
    if chosen not in (NATIVE, NUMBA):
        raise SimulationError(f'{VARIABLE} = "{chosen}": choose {NATIVE} or {NUMBA}.')
    return chosen == NATIVE


def compiler() -> tuple[str, ...] | None:
    """Command of the C compiler; None where it is not installed or left out."""
    installed = all(importlib.util.find_spec(name) for name in ("ziglang", "filelock"))
    return (sys.executable, "-m", "ziglang", "cc") if native() and installed else None


def target() -> str:
    """Option for the processor that code is made for."""
    return f"-mcpu={level() if level() in (V2, V3) else 'native'}"


class Library:
    """A shared library of some kernels: that of the wheel, else translated and compiled when the first of them is
    called.

    entries: kernels by the name of their symbol; folder: of the cache, for this state of the sources; store: folder of
    libraries under the hash of their source; sources: hash of what the kernels are translated from.
    """

    def __init__(
        self, entries: Mapping[str, Callable[..., Any]], folder: Path, store: Path, *, sources: str = ""
    ) -> None:
        self.entries, self.folder, self.store, self.sources = entries, folder, store, sources
        self.lock = threading.Lock()
        self.loaded: ctypes.CDLL | None = None
        self.failed = False

    def function(self, name: str) -> Any:
        """The function of ctypes; None where the library cannot be made, which is noted once."""
        with self.lock:
            if self.loaded is None and not self.failed:
                try:
                    self.loaded = self._load()
                except (SubsetError, NoCompilerError):
                    self.failed = True
                except (OSError, StillhookError, subprocess.SubprocessError) as problem:
                    self.failed = True
                    LOG.warning(f"Zig did not compile a kernel, so Numba does: {_reason(problem)}")
        if self.loaded is None:
            return None
        function = getattr(self.loaded, name)
        function.argtypes, function.restype = [CTYPES[t] for t in entry_types(self.entries[name])], None
        return function

    def _load(self) -> ctypes.CDLL:
        """The first of its files that is sound and that this system can load."""
        problem = OSError("no library")
        for file, kept in self.files():
            if not is_sound(file, kept):
                continue
            try:
                return ctypes.CDLL(str(file))
            except OSError as error:
                problem = error
        raise problem

    def is_compiled(self) -> bool:
        """Whether it is there, without a compilation."""
        if (shipped := shipped_library(self.entries, sources=self.sources)) is not None and is_sound(
            shipped, Kept.WHEEL
        ):
            return True
        return (known := self._known()) is not None and is_sound(known, Kept.LIBRARY)

    def files(self) -> Iterator[tuple[Path, Kept]]:
        """Where the library is, in the order of preference; compiled where there is none yet. Errors: SubsetError,
        NoCompilerError, OSError, SubprocessError."""
        if (shipped := shipped_library(self.entries, sources=self.sources)) is not None:
            yield shipped, Kept.WHEEL
        if (known := self._known()) is not None:
            yield known, Kept.LIBRARY
        source = self.source()
        if shipped is None and (same := shipped_library(self.entries, code=code_hash(source))) is not None:
            yield same, Kept.WHEEL
        yield self._made(source), Kept.LIBRARY

    def source(self) -> str:
        """Its C99. Errors: SubsetError."""
        translator = Translator()
        for name, function in self.entries.items():
            if translator.function(function, entry_types(function), export=name).result is not None:
                raise SubsetError(f"{name}: a kernel gives its results in arrays.")
        return translator.source()

    def _made(self, source: str) -> Path:
        """The library as Zig compiles it, kept."""
        if compiler() is None:
            raise NoCompilerError("Zig is not installed.")
        parts = (source, *FLAGS, target(), version("ziglang"), sysconfig.get_platform())
        file = self.store / f"{hashlib.sha256(chr(0).join(parts).encode()).hexdigest()[:24]}{SUFFIX}"
        self._compile(source, file)
        write_checked(self._pointer(), file.name.encode())
        return file

    def _pointer(self) -> Path:
        """File that names the library for this processor: machines may share a home folder."""
        return self.folder / f"library{target()}.txt"

    def _known(self) -> Path | None:
        name = read_checked(self._pointer(), Kept.LIBRARY)
        return None if name is None else self.store / name.decode()

    def _compile(self, source: str, file: Path) -> None:
        command = compiler()
        assert command is not None
        self.store.mkdir(parents=True, exist_ok=True)
        sweep(self.store, own=True)
        remove_old_locks(self.store)
        with one_at_a_time(file.with_suffix(".lock")):
            if is_sound(file, Kept.LIBRARY):
                return
            with atomic_file(file) as library:

                def compile_in(folder: Path, environment: dict[str, str]) -> subprocess.CompletedProcess[str]:
                    code = folder / "kernels.c"
                    code.write_text(source, encoding="utf-8")
                    return subprocess.run(
                        [*command, *FLAGS, target(), "-o", str(library), str(code)],
                        env=environment,
                        check=False,
                        capture_output=True,
                        text=True,
                    )

                compiled(self.store.with_name("zig"), compile_in).check_returncode()
                write_beside(file, library.read_bytes())


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

    def repeated(self, arguments: Sequence[Any], varying: Sequence[int]) -> Callable[..., None]:
        """The same call again and again, prepared: in a tenth of the time that a call takes.

        Parameters: arguments as a call takes them, whose arrays stay where they are; varying: places of whole numbers,
        which every call gives in this order.
        """
        native = self.library.function(self.name)
        if native is None:
            return repeated(self.other(), arguments, varying)
        passed = [
            kind(each.ctypes.data if kind is ctypes.c_void_p else each)
            for kind, each in zip(native.argtypes, arguments, strict=True)
        ]
        for i in self.arrays:
            assert arguments[i].flags.c_contiguous
            assert arguments[i].dtype == np.float64
        changing, kept = [passed[i] for i in varying], tuple(arguments)

        def call(*numbers: int) -> None:
            for place, number in zip(changing, numbers, strict=True):
                place.value = number
            native(*passed)

        call.arrays = kept  # type: ignore[attr-defined]  # they must live as long as their addresses are used
        return call


def repeated(kernel: Callable[..., Any], arguments: Sequence[Any], varying: Sequence[int]) -> Callable[..., None]:
    """See `Entry.repeated`; of any kernel."""
    if isinstance(kernel, Entry):
        return kernel.repeated(arguments, varying)
    passed = list(arguments)

    def call(*numbers: int) -> None:
        for i, number in zip(varying, numbers, strict=True):
            passed[i] = number
        kernel(*passed)

    return call


def _reason(problem: Exception) -> str:
    lines = str(getattr(problem, "stderr", "") or problem).strip().splitlines()
    return lines[0] if lines else type(problem).__name__
