"""Records of a kernel: NamedTuples of floats and records, and functions of them that are written out when they are
made."""

import functools
import linecache
import typing
from collections.abc import Callable
from typing import Any

from stillhook.physics.scalar import fmax, scalar


@functools.cache
def fields(cls: type) -> list[tuple[str, Any]]:
    return list(typing.get_type_hints(cls).items())


def define(src: str, names: dict[str, Any], file: str) -> None:
    """Run generated source under a file name of its own, so that tracebacks and `stillhook.kernels.c99.source` can read
    it."""
    linecache.cache[file] = (len(src), None, src.splitlines(keepends=True), file)
    exec(compile(src, file, "exec"), names)


def replace(cls: type, *names: str) -> Callable[..., Any]:
    """A scalar function (record, values) -> record with these top-level fields replaced, values in this order."""
    made: dict[str, Any] = {"cls": cls}
    values = ", ".join(f"new_{n}" for n in names)
    args = ", ".join(f"new_{f}" if f in names else f"x.{f}" for f, _ in fields(cls))
    file = f"<{cls.__name__} with {' '.join(names)} of {cls.__module__}>"
    define(f"def replace(x, {values}): return cls({args})\n", made, file)
    return typing.cast(Callable[..., Any], scalar(made["replace"]))


def inflow(cls: type, *names: str) -> Callable[..., Any]:
    """A scalar function record -> sum of these fields where they are positive."""
    made: dict[str, Any] = {"fmax": fmax}
    terms = " + ".join(f"fmax(x.{n}, 0.0)" for n in names)
    file = f"<inflow of {' '.join(names)} of {cls.__module__}>"
    define(f"def inflow(x): return {terms}\n", made, file)
    return typing.cast(Callable[..., Any], scalar(made["inflow"]))
