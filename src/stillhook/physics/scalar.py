"""For authors of components: the decorator `scalar` and the mathematics that vectorises.

A scalar function has one source and two lives. Called from Python it is plain Python: nothing is compiled, errors have
tracebacks. Called from a compiled kernel it is inlined into it. With `NUMBA_DISABLE_JIT=1` kernels are plain Python
too.

Arithmetic is strict (no reassociation; fused multiply-add in `exp` alone), so sixteen trajectories side by side give
the same bits as one. Never put full fastmath on these functions: it deletes the rounding step of `exp`.
"""

import math
import struct
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

STRICT = {"error_model": "numpy", "fastmath": {"nsz"}}

Function = TypeVar("Function", bound=Callable[..., Any])


class Scalar:
    """What a kernel inlines where it calls a scalar function: source and options of Numba; see
    `stillhook.kernels.by_numba`."""

    def __init__(self, source: Callable[..., Any], **options: Any) -> None:
        self.source = source
        self.options = options or STRICT


class ByRecord(Scalar):
    """A function of three numbers and a record: which one a kernel inlines follows from the record's class."""

    def __init__(self, source: Callable[..., Any], choose: Callable[[type], Callable[..., Any]]) -> None:
        super().__init__(source)
        self.choose = choose


class Operation(Scalar):
    """An operation of machine code; the intrinsic of Numba has the same name."""


def scalar(source: Function) -> Function:
    """Decorator of every equation in physics/, control/ and winches/. The function stays what it is."""
    return in_kernels(source, Scalar(source))


def in_kernels(python: Function, kernel: Scalar) -> Function:
    """A plain function that kernels replace by machine code of their own."""
    vars(python)["scalar"] = kernel
    return python


def by_record(choose: Callable[[type], Callable[..., Any]]) -> Callable[..., Any]:
    """The scalar function f(a, b, c, record) that is choose(class of the record), one for each class."""

    def chosen(a, b, c, record):
        return choose(type(record))(a, b, c, record)

    return in_kernels(chosen, ByRecord(chosen, choose))


def scalar_of(function: Any) -> Scalar | None:
    """What a kernel inlines for this function; None where it is no scalar function."""
    kernel = getattr(function, "scalar", None)
    return kernel if isinstance(kernel, Scalar) else None


G = 9.80665
"""Standard gravity [m/s^2]."""

EXP_RANGE = 700.0
"""`exp` holds its argument within this bound: beyond it a double overflows (709.8) or is below 1e-304."""


def _arrays(*values):
    return any(isinstance(x, np.ndarray) for x in values)


@scalar
def fmin(a, b):
    return a if a < b else b


@scalar
def fmax(a, b):
    return a if a > b else b


maximum = in_kernels(lambda a, b: np.maximum(a, b) if _arrays(a, b) else fmax(a, b), Scalar(fmax))
minimum = in_kernels(lambda a, b: np.minimum(a, b) if _arrays(a, b) else fmin(a, b), Scalar(fmin))
"""`fmax` and `fmin` that take arrays as well where they are called from Python."""


@scalar
def clip(x, lo, hi):
    return fmin(fmax(x, lo), hi)


def _sqrt(x):
    return math.sqrt(x)


sqrt = in_kernels(lambda x: np.sqrt(x) if _arrays(x) else math.sqrt(x), Scalar(_sqrt))
"""Square root; called from Python it takes arrays as well."""


@scalar
def ceil(x):
    return math.ceil(x)


@scalar
def copysign(x, y):
    """Magnitude of x with the sign of y."""
    return math.copysign(x, y)


def slot():
    """Nothing."""


def bits(x):
    """The 64 bits of a double as an integer."""
    return struct.unpack("<q", struct.pack("<d", x))[0]


def double(n):
    """The double that has these 64 bits."""
    return struct.unpack("<d", struct.pack("<q", n))[0]


slot, bits, double = (in_kernels(each, Operation(each)) for each in (slot, bits, double))


def _align_stack():
    slot()


align_stack = in_kernels(lambda: None, Scalar(_align_stack))
"""Puts a kernel's stack on a boundary of 64 bytes. Without it every vector that is kept on the stack may straddle two
cache lines: the kernel then runs up to a third slower, in some processes and not in others."""


def _exp(x):
    x = fmin(fmax(x, -EXP_RANGE), EXP_RANGE)
    t = x * 1.4426950408889634074 + 6755399441055744.0  # 1.5 * 2**52: the low bits of t are the rounded exponent
    n = t - 6755399441055744.0
    r = (x - n * 6.93147180369123816490e-01) - n * 1.90821492927058770002e-10
    r_2 = r * r
    r_4 = r_2 * r_2
    # Estrin's scheme for the Taylor polynomial: short chains of dependent operations.
    a = (1.0 + r) + r_2 * (0.5 + r * (1.0 / 6.0))
    b = (1.0 / 24.0 + r * (1.0 / 120.0)) + r_2 * (1.0 / 720.0 + r * (1.0 / 5040.0))
    c = (1.0 / 40320.0 + r * (1.0 / 362880.0)) + r_2 * (1.0 / 3628800.0 + r * (1.0 / 39916800.0))
    p = a + r_4 * (b + r_4 * c)
    return p * double((bits(t) + 1023) << 52)


def _exp_python(x):
    return math.exp(x) if isinstance(x, float) else np.exp(x)


exp = in_kernels(_exp_python, Scalar(_exp, error_model="numpy", fastmath={"contract"}))
"""Exponential as a polynomial that LLVM vectorises (libm's is not); relative error below 1e-14 for |x| <= 700.

Called from Python it takes arrays as well, so that measured data can be put into the same equations."""


def _cube(x):
    return x * x * x


def _power(x, n):
    """exp(n ln x): ln of the mantissa as its series in s = (m - 1) / (m + 1), m in 0.71 to 1.42."""
    e = bits(x) // 4503599627370496 - 1023
    m = double(bits(x) - (e << 52))
    large = m > 1.4142135623730951
    f = 0.5 * m if large else m
    s = (f - 1.0) / (f + 1.0)
    z = s * s
    a = 1.0 + z * (1.0 / 3.0 + z * (1.0 / 5.0 + z * (1.0 / 7.0 + z * (1.0 / 9.0 + z * (1.0 / 11.0)))))
    b = 1.0 / 13.0 + z * (1.0 / 15.0 + z * (1.0 / 17.0 + z * (1.0 / 19.0)))
    ln = (e + (1.0 if large else 0.0)) * 0.6931471805599453 + 2.0 * s * (a + z * z * z * z * z * z * b)
    return exp(n * ln) if x > 0.0 else 0.0


cube = in_kernels(lambda x: x**3, Scalar(_cube))
power = in_kernels(lambda x, n: x**n, Scalar(_power))
"""x to the power n, x not negative and n above 0, without the library's pow, whose last bit differs from one to the
next; relative error below 1e-13. Called from Python it takes arrays as well."""


def _sin(x):
    return math.sin(x)


def _cos(x):
    return math.cos(x)


sin, cos = in_kernels(lambda x: np.sin(x), Scalar(_sin)), in_kernels(lambda x: np.cos(x), Scalar(_cos))
"""Sine and cosine of an angle [rad]; called from Python they take arrays as well."""


@scalar
def tanh(x):
    q = exp(-2.0 * abs(x))
    return copysign((1.0 - q) / (1.0 + q), x)


@scalar
def quantise(x, step):
    """The nearest multiple of step; x itself where step is 0."""
    return x if step <= 0.0 else step * ceil(x / step - 0.5)
