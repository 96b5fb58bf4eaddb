"""Scalar functions as Numba inlines them, and the operations of machine code that they use; loaded with Numba."""

import functools
from types import FunctionType
from typing import Any

from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic, typeof_impl

from stillhook.physics.scalar import Operation, Scalar, scalar_of


@functools.cache
def kernel_of(scalar: Scalar) -> Any:
    """The function that is inlined into the kernels that call it.

    It has no wrapper for calls of the machine code from Python: building those takes half of the compile time.
    """
    source = OPERATIONS[scalar.source.__name__] if isinstance(scalar, Operation) else scalar.source
    return njit(forceinline=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, **scalar.options)(source)


_typeof_any = typeof_impl.dispatch(object)


@typeof_impl.register(FunctionType)
def _typeof_function(value: FunctionType, context: Any) -> Any:
    found = scalar_of(value)
    return types.Dispatcher(kernel_of(found)) if found else _typeof_any(value, context)


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
