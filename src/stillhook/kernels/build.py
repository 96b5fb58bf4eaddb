"""Binds the drivers to one plant and its controllers, and caches the machine code under a hash of every kernel source.

A cache that is keyed on one file serves stale physics after an edit in another: hence the hash over all of them.

The folder that compiled kernels are kept in. What is in it runs as machine code, so only a folder that nobody else
may write to is used.

On POSIX systems the folder belongs to the user, and neither group nor others may write to it; every folder above it
belongs to the user or to root, and is closed in the same way or has the sticky bit, as /tmp has. Links are resolved
first. Access lists of network drives are not read. On Windows rights are not read either: a folder inside the user's
profile is taken, which Windows closes to other users, and no other.
"""

from __future__ import annotations

import contextlib
import functools
import getpass
import hashlib
import importlib.util
import logging
import os
import stat
import sys
import tempfile
import threading
from collections.abc import Iterator, Mapping
from importlib.metadata import version
from pathlib import Path
from types import ModuleType
from typing import Any

import numba
import platformdirs
from numba.core.caching import FunctionCache

from stillhook.base.extensions import extension_sources
from stillhook.errors import SimulationError
from stillhook.kernels import control_laws
from stillhook.kernels.c99.source import Translator, entry_types
from stillhook.kernels.native import Entry, Library, compiler
from stillhook.physics import intrinsics as intrinsics
from stillhook.physics.records import fields
from stillhook.physics.scalar import STRICT
from stillhook.winches.reference import plant as truth
from stillhook.winches.registry import WINCH_TYPES

VARIABLE = "STILLHOOK_CACHE"
PRIVATE = 0o700
LOG = logging.getLogger("stillhook")


def cache_root() -> Path:
    """Folder for compiled kernels and residuals: STILLHOOK_CACHE, else the user's cache folder; a private temporary one
    where that cannot be written to, or where somebody else may write to it, which is noted once."""
    wanted = Path(os.environ.get(VARIABLE) or platformdirs.user_cache_dir("stillhook", appauthor=False))
    try:
        wanted = wanted.resolve()
        reason = weakness(wanted)
        if not reason:
            make_private(wanted)
            reason = weakness(wanted)
        if not reason:
            return wanted if os.access(wanted, os.W_OK) else private_folder()
    except (
        OSError,
        RuntimeError,
        ValueError,
    ):  # a loop of links is a RuntimeError, a zero byte in the name a ValueError
        return private_folder()
    _note(wanted, reason)
    return private_folder()


@functools.cache
def _note(folder: Path, reason: str) -> None:
    LOG.warning(
        f"Cache folder {folder}: {reason}, so compiled code is kept in {private_folder()} instead. "
        f"Remove the folder, or set {VARIABLE} to one that only you can write to."
    )


def weakness(folder: Path) -> str:
    """Why somebody else could replace what is in a resolved folder, "" where nobody can. What does not exist yet is
    left out."""
    if os.name == "nt":
        return "" if folder.is_relative_to(Path.home().resolve()) else "is outside your profile"
    for path in (folder, *folder.parents):
        try:
            status = path.lstat()
        except FileNotFoundError:
            continue
        prefix = "" if path == folder else f"{path} "
        if not stat.S_ISDIR(status.st_mode):
            return f"{prefix}is not a folder"
        if status.st_uid != os.geteuid() and (path == folder or status.st_uid != 0):
            return f"{prefix}belongs to another user"
        if status.st_mode & 0o022 and (path == folder or not status.st_mode & stat.S_ISVTX):
            return f"others may write to {path if prefix else 'it'}"
    return ""


def weak_content(folder: Path) -> str:
    """Why what is in a folder of the cache is not to be trusted: a link, another owner, or files that others may write
    to; "" where all is well or nothing is there."""
    if os.name == "nt" or not os.path.lexists(folder):
        return ""
    closed = not (folder.lstat().st_mode & folder.parent.lstat().st_mode) & 0o011
    for path in (folder, *_below(folder)):
        status = path.lstat()
        if stat.S_ISLNK(status.st_mode):
            return f"{path.name} in it is a link"
        if status.st_uid != os.geteuid():
            return f"{path.name} in it belongs to another user"
        if status.st_mode & 0o022 and not closed:
            return f"others may write to {path.name} in it"
    return ""


def _below(folder: Path) -> Iterator[Path]:
    for top, folders, files in os.walk(folder):
        yield from (Path(top) / name for name in (*folders, *files))


def make_private(folder: Path) -> None:
    """Make a folder, and what is missing above it, that only the user can enter."""
    for path in (*reversed(folder.parents), folder):
        path.mkdir(mode=PRIVATE, exist_ok=True)


def kernel_folder(name: str) -> Path:
    """The cache's folder of this name, not made yet; one in the private folder where its content is not to be trusted,
    which is noted once."""
    folder = cache_root() / name
    try:
        reason = weak_content(folder)
    except OSError as problem:  # removed by another process meanwhile
        reason = str(problem.strerror)
    if reason:
        _note(folder, reason)
        return private_folder() / name
    return folder


@functools.cache
def private_folder() -> Path:
    """A temporary folder that nobody else can write to. Errors: SimulationError where there is none."""
    above = Path(tempfile.gettempdir()).resolve()
    for name in ("stillhook-cache", f"stillhook-cache-{getpass.getuser()}"):
        with contextlib.suppress(OSError):
            (above / name).mkdir(mode=PRIVATE, exist_ok=True)
            if not weakness(above / name):
                return above / name
    made = Path(tempfile.mkdtemp(prefix="stillhook-cache-"))
    if reason := weakness(made):
        made.rmdir()
        raise SimulationError(
            f"{above}: {reason}, so that no compiled code can be kept there. Set {VARIABLE} to a folder that only you"
            " can write to."
        )
    return made


PLANTS: dict[str, ModuleType] = {**{name: each.module for name, each in WINCH_TYPES.items()}, "truth": truth}
"""Module of every winch type, and of the reference plant for synthetic logs."""
PACKAGE = Path(__file__).resolve().parents[1]
KERNEL_FOLDERS = ("physics", "control", "winches", "kernels")
"""Rooms of every source that a kernel can inline, and of what compiles them."""
LOCK = threading.RLock()


@functools.cache
def kernel_hash() -> str:
    """Hash of every source that a kernel can inline, of Numba and of Python."""
    digest = hashlib.sha256(f"numba {numba.__version__} python {sys.version_info[:2]}".encode())
    for path in (p for folder in KERNEL_FOLDERS for p in sorted((PACKAGE / folder).rglob("*.py"))):
        digest.update(path.relative_to(PACKAGE).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


RESULT_FOLDERS = (*KERNEL_FOLDERS, "engine", "sea", "spec", "tables", "library")
RESULT_FILES = ("metrics.py", "variables.csv", "variables.py")


@functools.cache
def results_hash() -> str:
    """Hash of everything but crane and scenario that a result follows from: kernels, motions, tables of the library,
    and the libraries that make sines and splines."""
    digest = hashlib.sha256(f"{kernel_hash()} numpy {version('numpy')} scipy {version('scipy')}".encode())
    inside = [p for folder in RESULT_FOLDERS for p in (PACKAGE / folder).rglob("*") if p.suffix in (".py", ".toml")]
    for path in sorted(inside) + [PACKAGE / name for name in RESULT_FILES]:
        digest.update(path.relative_to(PACKAGE).as_posix().encode() + b"\0" + path.read_bytes())
    for path in extension_sources():
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder(plant: str, lanes: int) -> Path:
    return kernel_folder(f"{kernel_hash()}-{plant}-{lanes}")


def _folder(plant: str, kind: str, extra_controllers: tuple[str, ...]) -> str:
    """What the folder of a kernel is called; it holds the sources of the user's modules where the winch is theirs."""
    own = extension_sources()
    sources = b"\0".join(path.read_bytes() for path in own) if Path(str(PLANTS[plant].__file__)) in own else b""
    of_user = f"-{hashlib.sha256(sources).hexdigest()[:12]}" if sources else ""
    return (plant if kind == "driver" else f"{kind}-{plant}") + of_user + control_laws.label(extra_controllers)


def is_compiled(plant: str, lanes: int, kind: str = "driver", extra_controllers: tuple[str, ...] = ()) -> bool:
    """Whether a run of this plant starts from cached machine code."""
    if numba.config.DISABLE_JIT:
        return True
    entry = driver(plant, lanes, kind, extra_controllers).run
    if isinstance(entry, Entry) and not entry.library.failed:
        return entry.library.is_compiled()
    return any(cache_folder(_folder(plant, kind, extra_controllers), lanes).rglob("*.nbc"))


class _Cache(FunctionCache):  # type: ignore[misc]
    """Numba's cache, but never in the way: what cannot be read is compiled again, what cannot be written is not
    kept."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # whatever a damaged file makes of unpickling
            with contextlib.suppress(OSError):
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        with contextlib.suppress(OSError):
            super().save_overload(sig, data)


@contextlib.contextmanager
def _cached_in(folder: Path) -> Iterator[None]:
    """Functions that are decorated within keep their machine code in this folder, which only the user can enter."""
    with contextlib.suppress(OSError):  # what cannot be written is not kept
        make_private(folder)
    before, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(folder)
    try:
        yield
    finally:
        numba.config.CACHE_DIR = before


BASE = {"lift_driver": "lift_wire", "lift_wire": "driver"}
"""What a file of a driver builds on."""


def driver(plant: str, lanes: int, kind: str = "driver", extra_controllers: tuple[str, ...] = ()) -> ModuleType:
    """The driver of one plant for 1 or 16 lanes: `run`, `at_rest`, `Lane`. Compiled on first call, cached on disk.

    kind: file of the driver, "driver" for a load on the wire, "lift_driver" for a lowering (see `BASE`).
    extra_controllers: those that it holds in addition to those of every kernel, see `stillhook.kernels.control_laws`.
    """
    name = f"stillhook.kernels.{kind}[{','.join((plant, str(lanes), *extra_controllers))}]"
    base = driver(plant, lanes, BASE[kind], extra_controllers) if kind in BASE else None
    with LOCK:
        if name not in sys.modules:
            spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{kind}.py"))
            assert spec is not None
            assert spec.loader is not None
            module = importlib.util.module_from_spec(spec)
            module.plant = PLANTS[plant]  # type: ignore[attr-defined]
            module.LANES = lanes  # type: ignore[attr-defined]
            module.laws = control_laws.control_laws(extra_controllers)  # type: ignore[attr-defined]
            module.base = base  # type: ignore[attr-defined]
            spec.loader.exec_module(module)
            folder = cache_folder(_folder(plant, kind, extra_controllers), lanes)
            kernels = {each: f for each, f in vars(module).items() if each in ("run", "at_rest")}
            vars(module).update(_machine_code(kernels, folder))
            sys.modules[name] = module
    return sys.modules[name]


def compiled(function: Any, name: str) -> Any:
    """A kernel of its own besides the drivers, compiled on first call and cached on disk under this name; see
    `driver`."""
    return _machine_code({function.__name__: function}, cache_folder(name, 1))[function.__name__]


def _machine_code(kernels: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Kernels as Zig compiles them, else Numba; compiled on first call, cached in this folder."""
    if numba.config.DISABLE_JIT or not kernels:
        return dict(kernels)
    by_numba = {name: functools.partial(_by_numba, function, folder) for name, function in kernels.items()}
    if compiler() is None:
        return {name: make() for name, make in by_numba.items()}
    library = Library(kernels, folder, kernel_folder("native"))
    return {name: Entry(library, name, make) for name, make in by_numba.items()}


def _by_numba(function: Any, folder: Path) -> Any:
    """Numba takes the cache folder from a global setting while functions are decorated, so this holds a lock."""
    with LOCK, _cached_in(folder):
        entry = numba.njit(cache=True, nogil=True, **STRICT)(function)
        entry._cache = _Cache(entry.py_func)
    return entry


def c_source(plant: str, lanes: tuple[int, ...] = (1, 16)) -> str:
    """One C99 file with everything that a plant's kernels do.

    For each lane count it exports `run_<lanes>` and `at_rest_<lanes>` (arguments as in `stillhook.kernels.driver`) and
    `step_<lanes>`, one step of one trajectory on structs.
    """
    t = Translator()
    for n in lanes:
        d = driver(plant, n)
        lane = dict(fields(d.Lane))
        step = tuple(lane[f] for f in ("x", "u", "geo", "tip_0", "tip_1", "tip_2", "p"))
        for name in ("run", "at_rest"):
            t.function(getattr(d, name), entry_types(getattr(d, name)), export=f"{name}_{n}")
        t.function(d.step, (*step, float), export=f"step_{n}")
    return t.source()
