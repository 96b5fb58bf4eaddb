"""Kernels as Numba compiles them, their machine code cached in a folder that only the user can enter."""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numba
from numba.core.caching import FunctionCache

from stillhook.kernels.cache import make_private
from stillhook.physics import intrinsics as intrinsics
from stillhook.physics.scalar import STRICT


def machine_code(function: Any, folder: Path) -> Any:
    """A kernel that is compiled on first call. Numba takes the folder from a global setting while a function is
    decorated, so one at a time."""
    with _cached_in(folder):
        kernel = numba.njit(cache=True, nogil=True, **STRICT)(function)
        if hasattr(kernel, "_cache"):  # not where NUMBA_DISABLE_JIT is set
            kernel._cache = _Cache(kernel.py_func)
    return kernel


class _Cache(FunctionCache):  # type: ignore[misc]
    """Numba's cache, but never in the way: what cannot be read is compiled again, what cannot be written is not
    kept. Its folder is that of one state of all sources, so that a kernel is known by its types alone: what it is
    nested in need not be looked at."""

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        return sig, codegen.magic_tuple()

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
