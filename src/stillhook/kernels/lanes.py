"""Nested NamedTuples to and from one flat array A[field * lanes + lane]. Generic over plants; also runs as plain
Python."""

import functools
import itertools
import math
import typing
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.physics.records import define, fields
from stillhook.physics.scalar import scalar

if typing.TYPE_CHECKING:
    Array = NDArray[np.float64]
else:

    class Array:
        """Type of an array of floats, as a kernel declares it."""


VL = 16
"""Trajectories side by side: one loop over 16 lanes vectorises fully (8 and 32 are slower)."""


@functools.cache
def size(cls: type) -> int:
    """Number of floats in a record."""
    return 1 if cls is float else sum(size(t) for _, t in fields(cls))


def offset(cls: type, name: str, lanes: int) -> int:
    """Place of a top-level field in the flat array of `cls`."""
    return lanes * sum(size(t) for _, t in itertools.takewhile(lambda f: f[0] != name, fields(cls)))


def flatten(record: Any) -> list[float]:
    return [y for x in record for y in (flatten(x) if isinstance(x, tuple) else (float(x),))]


def unflatten(cls: type, it: Iterator[float]) -> Any:
    return next(it) if cls is float else cls(*[unflatten(t, it) for _, t in fields(cls)])


def paths(cls: type, prefix: str = "") -> list[str]:
    """Dotted access of every float: ".active.motors.count"."""
    return [prefix] if cls is float else [q for f, t in fields(cls) for q in paths(t, f"{prefix}.{f}")]


class Access(typing.NamedTuple):
    """Generated functions for one record: load(A, i), store(A, i, v), axpy(x, h, k), mix(x, y, w)."""

    load: Callable[..., Any]
    store: Callable[..., Any]
    axpy: Callable[..., Any]
    mix: Callable[..., Any]


@functools.cache
def access(cls: type, lanes: int) -> Access:
    """Loads and stores of one record; those of the records in it are functions of their own, so that each is short and
    compiled once. All of them inline to plain moves.

    i = offset + lane; a record's floats lie `lanes` places apart. `axpy` gives x + h k, `mix` x + w (y - x).
    """
    names: dict[str, Any] = {"cls": cls}
    load, store, axpy, mix, n = [], [], [], [], 0
    for f, t in fields(cls):
        at = f"i + {n * lanes}"
        if t is float:
            load.append(f"A[{at}]")
            store.append(f"A[{at}] = v.{f}")
            axpy.append(f"x.{f} + h * k.{f}")
            mix.append(f"x.{f} + w * (y.{f} - x.{f})")
        else:
            names |= {f"{kind}_{f}": function for kind, function in access(t, lanes)._asdict().items()}
            load.append(f"load_{f}(A, {at})")
            store.append(f"store_{f}(A, {at}, v.{f})")
            axpy.append(f"axpy_{f}(x.{f}, h, k.{f})")
            mix.append(f"mix_{f}(x.{f}, y.{f}, w)")
        n += size(t)
    src = f"def load(A, i): return cls({', '.join(load)})\n"
    src += f"def store(A, i, v):\n    {'; '.join(store) or 'pass'}\n"
    src += f"def axpy(x, h, k): return cls({', '.join(axpy)})\n"
    src += f"def mix(x, y, w): return cls({', '.join(mix)})\n"
    define(src, names, f"<{cls.__name__} on {lanes} lanes of {cls.__module__}>")
    return Access(*(scalar(names[f]) for f in ("load", "store", "axpy", "mix")))


def room_for(shape: tuple[int, ...]) -> NDArray[np.float64]:
    """An array on a 64-byte boundary: no vector load crosses a cache line."""
    size = math.prod(shape)
    room = np.empty(size + 8)
    start = -room.ctypes.data % 64 // 8
    return room[start : start + size].reshape(shape)


def aligned(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """A copy on a 64-byte boundary."""
    out = room_for(values.shape)
    out[...] = values
    return out
