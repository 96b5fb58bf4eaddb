"""Answers about a frozen object that are remembered for that very object: a model's fields are too many to compare."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, Concatenate, ParamSpec, TypeVar

Object = TypeVar("Object")
Rest = ParamSpec("Rest")
Answer = TypeVar("Answer")


class _Identity:
    """An object, equal to nothing but itself, that lives as long as something is remembered of it."""

    def __init__(self, of: Any) -> None:
        self.of = of

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Identity) and self.of is other.of

    def __hash__(self) -> int:
        return id(self.of)


def remembered(
    function: Callable[Concatenate[Object, Rest], Answer],
) -> Callable[Concatenate[Object, Rest], Answer]:
    """A function that remembers its last 256 answers, by its first argument's identity and the others' values."""

    @functools.lru_cache(maxsize=256)
    def answer(identity: _Identity, *rest: Any, **named: Any) -> Answer:
        return function(identity.of, *rest, **named)

    @functools.wraps(function)
    def ask(of: Object, /, *rest: Rest.args, **named: Rest.kwargs) -> Answer:
        return answer(_Identity(of), *rest, **named)  # type: ignore[arg-type]

    return ask


class Keyed:
    """What answers that are kept in memory are asked about: a machine and all that an answer follows from. Machines are
    equal where that is equal, regardless of what else is set on them."""

    def __init__(self, machine: Any, key: tuple[Any, ...]) -> None:
        self.machine, self.key = machine, key

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Keyed) and self.key == other.key
