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


def record(name: str, of: str, **members: Any) -> Any:
    """A NamedTuple with these fields; `of` says what it belongs to, and distinguishes its generated functions."""
    made: Any = typing.NamedTuple(name, list(members.items()))  # type: ignore[misc]
    made.__module__ = of
    return made


@functools.cache
def with_class(cls: Any, path: str, new: Any) -> Any:
    """The record with the class of a field, by its dotted path, replaced."""
    name, _, inner = path.partition(".")
    members = dict(fields(cls))
    members[name] = with_class(members[name], inner, new) if inner else new
    return record(cls.__name__, f"{cls.__module__} with {path} {new.__module__}", **members)


def other_classes(values: Any, cls: Any, path: str = "") -> dict[str, Any]:
    """Classes of the records in a record that are others than its class says, by their dotted path."""
    out: dict[str, Any] = {}
    for (name, of), value in zip(fields(cls), values, strict=True):
        place = f"{path}.{name}" if path else name
        if of is not float and type(value) is not of:
            out[place] = type(value)
        elif of is not float:
            out |= other_classes(value, of, place)
    return out


def replace(cls: type, *names: str) -> Callable[..., Any]:
    """A scalar function (record, values) -> record with these top-level fields replaced, values in this order."""
    made: dict[str, Any] = {"cls": cls}
    values = ", ".join(f"new_{n}" for n in names)
    args = ", ".join(f"new_{f}" if f in names else f"x.{f}" for f, _ in fields(cls))
    file = f"<{cls.__name__} with {' '.join(names)} of {cls.__module__}>"
    define(f"def replace(x, {values}): return cls({args})\n", made, file)
    return typing.cast(Callable[..., Any], scalar(made["replace"]))


def zeros_but(cls: type, *names: str) -> Callable[..., Any]:
    """A scalar function values -> record with these top-level fields, values in this order; its other fields are 0."""
    made: dict[str, Any] = {"cls": cls}
    args = ", ".join(f"new_{f}" if f in names else "0.0" for f, _ in fields(cls))
    file = f"<zeros but {' '.join(names)} of {cls.__name__} of {cls.__module__}>"
    define(f"def zeros_but({', '.join(f'new_{n}' for n in names)}): return cls({args})\n", made, file)
    return typing.cast(Callable[..., Any], scalar(made["zeros_but"]))


def each(cls: type, function: Callable[..., Any], records: int, shared: int = 0) -> Callable[..., Any]:
    """A scalar function that applies another to every field: of `records` records with the fields of cls, whose floats
    it takes first, and `shared` numbers, the same for every field; gives a cls."""
    a, b = [f"r_{i}" for i in range(records)], [f"s_{i}" for i in range(shared)]
    values = ", ".join(f"{f}=function({', '.join([*(f'{r}.{f}' for r in a), *b])})" for f, _ in fields(cls))
    made: dict[str, Any] = {"cls": cls, "function": function}
    file = f"<{function.__name__} of {records}, {shared} on every field of {cls.__name__} of {cls.__module__}>"
    define(f"def each_{function.__name__}({', '.join([*a, *b])}): return cls({values})\n", made, file)
    return typing.cast(Callable[..., Any], scalar(made[f"each_{function.__name__}"]))


def coded(cls: type) -> Callable[..., Any]:
    """A scalar function that gives the sum of 2^i times field i of a record: fields of 0 and 1 as one number."""
    made: dict[str, Any] = {}
    terms = " + ".join(f"{float(2**i)} * x.{f}" for i, (f, _) in enumerate(fields(cls)))
    define(f"def coded(x): return {terms}\n", made, f"<code of {cls.__name__} of {cls.__module__}>")
    return typing.cast(Callable[..., Any], scalar(made["coded"]))


def inflow(cls: type, *names: str) -> Callable[..., Any]:
    """A scalar function record -> sum of these fields where they are positive."""
    made: dict[str, Any] = {"fmax": fmax}
    terms = " + ".join(f"fmax(x.{n}, 0.0)" for n in names)
    file = f"<inflow of {' '.join(names)} of {cls.__module__}>"
    define(f"def inflow(x): return {terms}\n", made, file)
    return typing.cast(Callable[..., Any], scalar(made["inflow"]))


class Joined(typing.NamedTuple):
    """A record with the fields of two others, and the compiled function that makes it of them."""

    record: Any
    join: Callable[..., Any]


def joined(name: str, first: type, second: type) -> Joined:
    """The record of the fields of both, in this order, and join(a, b)."""
    of = f"{first.__module__} and {second.__module__}"
    hints = [typing.get_type_hints(cls, include_extras=True) for cls in (first, second)]
    made = record(name, of, **hints[0], **hints[1])
    args = [f"a.{f}" for f, _ in fields(first)] + [f"b.{f}" for f, _ in fields(second)]
    names: dict[str, Any] = {"record": made}
    file = f"<{name} of {of}>"
    define(f"def join(a, b): return record({', '.join(args)})\n", names, file)
    return Joined(made, scalar(names["join"]))
