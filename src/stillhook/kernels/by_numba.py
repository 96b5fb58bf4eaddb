"""Numba: scalar functions as it inlines them, the operations of machine code that they use, and kernels as it compiles
them, their machine code cached in a folder that only the user can enter."""

import contextlib
import functools
from collections.abc import Iterator
from pathlib import Path
from types import FunctionType
from typing import Any

import numba
from llvmlite import ir
from numba import njit, types
from numba.core.caching import FunctionCache
from numba.extending import intrinsic, overload, typeof_impl

from stillhook.kernels.cache import make_private
from stillhook.physics.scalar import STRICT, ByRecord, Operation, Scalar, scalar_of


@functools.cache
def kernel_of(scalar: Scalar) -> Any:
    """The function that is inlined into the kernels that call it.

    It has no wrapper for calls of the machine code from Python: building those takes half of the compile time.
    """
    source = OPERATIONS[scalar.source.__name__] if isinstance(scalar, Operation) else scalar.source
    if isinstance(scalar, ByRecord):
        source = _by_record(scalar)
    return njit(forceinline=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, **scalar.options)(source)


def _by_record(scalar: ByRecord) -> Any:
    """A function that calls the one of the class of its last argument."""

    def chosen(a: Any, b: Any, c: Any, record: Any) -> Any:
        raise NotImplementedError

    @overload(chosen, strict=False, jit_options={"forceinline": True, **STRICT})
    def _typed(a: Any, b: Any, c: Any, record: Any) -> Any:
        function = scalar.choose(record.instance_class)
        return lambda a, b, c, record: function(a, b, c, record)

    return lambda a, b, c, record: chosen(a, b, c, record)


_typeof_any = typeof_impl.dispatch(object)


@typeof_impl.register(FunctionType)
def _typeof_function(value: FunctionType, context: Any) -> Any:
    kernel = scalar_of(value)
    return types.Dispatcher(kernel_of(kernel)) if kernel else _typeof_any(value, context)


@intrinsic
def bits(typingctx, x):
    """The 64 bits of a double as an integer."""
    return types.int64(types.float64), lambda c, b, s, a: b.bitcast(a[0], ir.IntType(64))


@intrinsic
def double(typingctx, x):
    """The double that has these 64 bits."""
    return types.float64(types.int64), lambda c, b, s, a: b.bitcast(a[0], ir.DoubleType())


@intrinsic
def slot(typingctx):
    """Eight doubles on the stack, on a boundary of their own size; never used."""

    def generate(context, builder, signature, args):
        with builder.goto_entry_block():
            place = builder.alloca(ir.ArrayType(ir.DoubleType(), 8))
        place.align = 64
        builder.asm(ir.FunctionType(ir.VoidType(), [place.type]), "", "r", [place], side_effect=True)
        return context.get_dummy_value()

    return types.void(), generate


OPERATIONS: dict[str, Any] = {"bits": lambda x: bits(x), "double": lambda n: double(n), "slot": lambda: slot()}
"""Operations of `stillhook.physics.scalar` by name, as machine code."""


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
