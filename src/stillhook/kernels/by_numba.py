"""Numba: scalar functions as it inlines them, the operations of machine code that they use, and kernels as it compiles
them, their machine code cached in a folder that only the user can enter."""

import contextlib
import functools
import hashlib
import pickle
import sys
from collections.abc import Iterator
from pathlib import Path
from types import FunctionType
from typing import Any

import numba
from llvmlite import ir
from numba import njit, types
from numba.core.caching import FunctionCache
from numba.core.serialize import dumps
from numba.extending import intrinsic, overload, typeof_impl

from stillhook.base.kept.checked import OTHER, Kept, note, read_checked, write_checked
from stillhook.base.kept.one_at_a_time import one_at_a_time
from stillhook.errors import StillhookError
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
    """A kernel that is compiled on first call, by one process while others wait. Numba takes the folder from a global
    setting while a function is decorated, so one at a time."""
    with _cached_in(folder):
        kernel = numba.njit(cache=True, nogil=True, **STRICT)(function)
        if not hasattr(kernel, "_cache"):  # where NUMBA_DISABLE_JIT is set
            return kernel
        kernel._cache = _Cache(kernel.py_func)
    compile_ = kernel.compile

    def compile_alone(signature: Any) -> Any:
        with one_at_a_time(folder / f"{function.__name__}.lock"):
            return compile_(signature)

    kernel.compile = compile_alone
    return kernel


class _Cache(FunctionCache):  # type: ignore[misc]
    """Numba's cache, but never in the way: what is damaged is compiled again, what cannot be written is not kept. Its
    folder is that of one state of all sources, so that a kernel is known by its types alone: what it is nested in need
    not be looked at."""

    def __init__(self, py_func: FunctionType) -> None:
        super().__init__(py_func)
        self._cache_file = _Files(Path(self.cache_path), py_func.__qualname__)

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        return sig, codegen.magic_tuple()

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # whatever unpickling makes of what another program wrote
            note(self._cache_file.folder, OTHER, Kept.MACHINE_CODE)
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        with contextlib.suppress(OSError, StillhookError):
            super().save_overload(sig, data)


class _Files:
    """Machine code of one kernel, a checked file for each set of types of its arguments."""

    def __init__(self, folder: Path, name: str) -> None:
        self.folder, self.name = folder, name

    def load(self, key: Any) -> Any:
        """What was saved, None where there is nothing sound."""
        content = read_checked(self._file(key), Kept.MACHINE_CODE)
        return None if content is None else pickle.loads(content)

    def save(self, key: Any, data: Any) -> None:
        write_checked(self._file(key), dumps(data))

    def _file(self, key: Any) -> Path:
        follows_from = f"{self.name} {key} numba {numba.__version__} python {sys.version}"
        return self.folder / f"{hashlib.sha256(follows_from.encode()).hexdigest()[:24]}.nbc"


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
