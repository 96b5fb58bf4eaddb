"""Types of the arrays that all rooms share, records with arrays, and columns of numbers as text, exact to the bit."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from dataclasses import fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.intp]


def copied(record: Any, changes: Mapping[str, Any]) -> Any:
    """A frozen dataclass with other values of some fields, which are not checked; nothing that it remembers."""
    made = object.__new__(type(record))
    fill(made, **{each.name: getattr(record, each.name) for each in fields(record)} | dict(changes))
    return made


def fill(record: object, /, **values: Any) -> None:
    """Set the fields of a frozen record while it is being made; its arrays become read-only."""
    for name, value in values.items():
        if isinstance(value, np.ndarray):
            value.flags.writeable = False
        object.__setattr__(record, name, value)


class ArrayRecord:
    """A frozen dataclass (eq=False) with arrays: equal, hashed and pickled by its content. Its fields are the arguments
    of its constructor."""

    @cached_property
    def _content(self) -> tuple[Any, ...]:
        values = (getattr(self, f.name) for f in fields(self))  # type: ignore[arg-type]
        return tuple(x.tobytes() if isinstance(x, np.ndarray) else x for x in values)

    def __eq__(self, other: object) -> bool:
        return self._content == other._content if isinstance(other, type(self)) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._content)

    def __reduce__(self) -> tuple[Any, ...]:
        return _revive, (type(self), {f.name: getattr(self, f.name) for f in fields(self)})  # type: ignore[arg-type]


def _revive(kind: type[Any], values: dict[str, Any]) -> Any:
    """A record out of a pickle, checked and read-only again."""
    return kind(**values)


def encode_array(column: NDArray[np.float64]) -> str:
    """A column as text."""
    return base64.b64encode(zlib.compress(column.astype("<f8").tobytes())).decode("ascii")


def decode_array(text: str) -> NDArray[np.float64]:
    """The column that `encode_array` wrote.

    Errors: TypeError, ValueError (binascii.Error), zlib.error where the text is not one.
    """
    return np.frombuffer(zlib.decompress(base64.b64decode(text)), dtype="<f8")
