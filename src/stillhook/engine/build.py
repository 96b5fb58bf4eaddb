"""Binds the drivers to one plant, and caches the machine code under a hash of every kernel source.

A cache that is keyed on one file serves stale physics after an edit in another: hence the hash over all of them.
"""

import hashlib
import importlib.util
import os
import sys
import tempfile
import threading
from pathlib import Path
from types import ModuleType

import numba
import platformdirs

from stillhook.plants import active_passive, pure_active

PLANTS: dict[str, ModuleType] = {"active-passive": active_passive, "pure-active": pure_active}
PACKAGE = Path(__file__).resolve().parents[1]
KERNEL_FOLDERS = ("physics", "control", "plants", "engine")
LOCK = threading.Lock()


def kernel_hash() -> str:
    """Hash of every source that a kernel can inline, of Numba and of Python."""
    digest = hashlib.sha256(f"numba {numba.__version__} python {sys.version_info[:2]}".encode())
    for folder in KERNEL_FOLDERS:
        for path in sorted((PACKAGE / folder).glob("*.py")):
            digest.update(f"{folder}/{path.name}".encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


def cache_root() -> Path:
    """Folder for compiled kernels: STILLHOOK_CACHE, else the user's cache folder, else a temporary one."""
    wanted = os.environ.get("STILLHOOK_CACHE") or platformdirs.user_cache_dir("stillhook", appauthor=False)
    try:
        Path(wanted).mkdir(parents=True, exist_ok=True)
        if os.access(wanted, os.W_OK):
            return Path(wanted)
    except OSError:
        pass
    return Path(tempfile.gettempdir()) / "stillhook-cache"


def cache_folder(plant: str, lanes: int) -> Path:
    return cache_root() / f"{kernel_hash()}-{plant}-{lanes}"


def is_compiled(plant: str, lanes: int) -> bool:
    """Whether a run of this plant starts from cached machine code."""
    return numba.config.DISABLE_JIT or any(cache_folder(plant, lanes).rglob("*.nbc"))


def driver(plant: str, lanes: int) -> ModuleType:
    """The driver of one plant for 1 or 16 lanes: `run`, `at_rest`, `Lane`. Compiled on first call, cached on disk.

    Numba takes the cache folder from a global setting while functions are decorated, so this holds a lock.
    """
    name = f"stillhook.engine.driver[{plant},{lanes}]"
    with LOCK:
        if name not in sys.modules:
            spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name("driver.py"))
            assert spec is not None
            assert spec.loader is not None
            module = importlib.util.module_from_spec(spec)
            module.plant = PLANTS[plant]  # type: ignore[attr-defined]
            module.LANES = lanes  # type: ignore[attr-defined]
            before, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(cache_folder(plant, lanes))
            try:
                spec.loader.exec_module(module)
            finally:
                numba.config.CACHE_DIR = before
            sys.modules[name] = module
    return sys.modules[name]
