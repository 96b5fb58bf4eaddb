"""Whether a module keeps a contract: names, signatures, records and values. A contract is a typed class.

Its methods are the functions that a module has, its properties the values; a docstring's first line says what each is.
Every fault is a `SpecError` of one line: file and attribute, what came, what is allowed. Type checkers read the same
classes, so that `winch: Winch = my_winch` finds the same faults while a module is written.
"""

from __future__ import annotations

import difflib
import inspect
import math
import re
import typing
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from stillhook.errors import SpecError
from stillhook.units import quote

ALIKE = 0.82
"""Likeness of two names from which one is taken for a slip of the other: `note` for `notes`, not `stroke_of` for
`stroke`."""


class Rule(NamedTuple):
    """What a value must be: a test of it, and the words for what passes."""

    holds: Callable[[Any], bool]
    allowed: str


class Needed(NamedTuple):
    """A field that a record must have: its type, and what it is."""

    type: Any
    meaning: str


class Record(NamedTuple):
    """What a record of a module must be: a NamedTuple of floats, and of records of floats where they may be `nested`.

    needs: fields that it must have; mark: class of the annotation that each of its fields must have; starts: whether
    each has a number that it starts from; empty: whether it may have no field.
    """

    needs: Mapping[str, Needed] = {}
    mark: type | None = None
    nested: bool = True
    starts: bool = False
    empty: bool = False


def is_number(value: Any) -> bool:
    """Whether it is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def is_text(value: Any) -> bool:
    """Whether it is a text of one line."""
    return isinstance(value, str) and bool(value.strip()) and value.isprintable()


def is_range(value: Any) -> bool:
    """Whether it is a pair of numbers that rises."""
    return isinstance(value, tuple) and len(value) == 2 and all(map(is_number, value)) and value[0] < value[1]


def is_record(value: Any) -> bool:
    """Whether it is a class of NamedTuples."""
    return isinstance(value, type) and issubclass(value, tuple) and hasattr(value, "_field_defaults")


NAME = Rule(
    lambda name: isinstance(name, str) and re.fullmatch(r"[a-z][a-z0-9]*(-[a-z0-9]+)*", name) is not None,
    "lower-case letters, digits and hyphens, such as my-winch",
)
TEXT = Rule(is_text, "a text of one line")
FLAG = Rule(lambda value: isinstance(value, bool), "True or False")


def names_of(known: Iterable[str], what: str, least: int = 0) -> Rule:
    """A tuple of some of these names, each once."""
    every = tuple(known)

    def holds(value: Any) -> bool:
        return (
            isinstance(value, tuple)
            and all(each in every and value.count(each) == 1 for each in value)
            and len(value) >= least
        )

    return Rule(holds, f"a tuple of {'at least one of the ' if least else ''}{what}: {', '.join(every)}")


def one_of(*choices: str) -> Rule:
    """One of these words."""
    return Rule(lambda value: isinstance(value, str) and value in choices, " or ".join(map(quote, choices)))


class Contract:
    """A contract, and the checks of a module against it.

    kind: what such a module is, "A winch type"; needed: class of what it must have; optional: class of what it may
    have; compiled: whether a function is one that kernels call, and its source then, else None.
    """

    def __init__(self, kind: str, needed: type, optional: type, compiled: Callable[[Any], Any]) -> None:
        self.kind, self.needed_by, self.compiled = kind, needed, compiled
        self.needed, self.optional = _members(needed), _members(optional)
        self.known = self.needed | self.optional

    def check(self, module: ModuleType) -> None:
        """Names and signatures of a module. Errors: SpecError."""
        for name, member in self.needed.items():
            if not hasattr(module, name):
                raise fault(
                    module, f"{name} is missing", f"{self.kind} needs {name}{self._call(member)}: {say(member)}"
                )
        for slip, meant in self._slips(module):
            raise fault(module, f"{slip} is not read", f"Call it {meant}, or _{slip} where it is not meant as {meant}")
        for name, member in self.known.items():
            if callable(member) and (function := getattr(module, name, None)) is not None:
                self._signature(module, name, member, function)

    def _call(self, member: Any) -> str:
        return f"({', '.join(self._arguments(member))})" if callable(member) else ""

    def _arguments(self, function: Any) -> list[str]:
        """Arguments that a function must be called with; a contract's own `self` is not one."""
        law = self.compiled(function)
        parameters = inspect.signature(function if law is None else law).parameters.values()
        required = [p for p in parameters if p.kind is not p.KEYWORD_ONLY or p.default is p.empty]
        return [p.name for p in required if p.name != "self"]

    def _signature(self, module: ModuleType, name: str, member: Any, function: Any) -> None:
        if not inspect.isfunction(function):
            raise fault(module, f"{name} = {quote(function)}", f"Make it a function {name}{self._call(member)}")
        if self.compiled(member) is not None and self.compiled(function) is None:
            raise fault(module, f"{name} is not decorated with @scalar", "Kernels call it: put @scalar above it")
        actual, wanted = self._arguments(function), self._arguments(member)
        if actual != wanted:
            raise fault(module, f"{name}({', '.join(actual)})", f"It must be {name}({', '.join(wanted)})")

    def _slips(self, module: ModuleType) -> Iterator[tuple[str, str]]:
        """Names of a module's own that are not in the contract and nearly one that it may have, with that one."""
        free = {name.casefold(): name for name in self.optional if not hasattr(module, name)}
        for name, value in vars(module).items():
            if (
                name in self.known
                or name.startswith("_")
                or getattr(value, "__module__", module.__name__) != module.__name__
            ):
                continue
            for meant in difflib.get_close_matches(name.casefold(), free, 1, ALIKE):
                member = self.known[free[meant]]
                if callable(member) == inspect.isfunction(value) and (
                    not callable(member) or (self.compiled(member) is None) == (self.compiled(value) is None)
                ):
                    yield name, free[meant]


def _members(contract: type) -> dict[str, Any]:
    """Functions, and properties or values, of a contract by name, those of its bases first."""
    every = {name: member for base in reversed(contract.__mro__) for name, member in vars(base).items()}
    return {
        name: member.__func__ if isinstance(member, staticmethod) else member
        for name, member in every.items()
        if not name.startswith("_")
    }


def say(member: Any) -> str:
    """What a contract says of a member in its first paragraph, to continue with after a colon."""
    text = " ".join((inspect.getdoc(member) or "").partition("\n\n")[0].split()).rstrip(".")
    return text[:1].lower() + text[1:] if text[1:2].islower() else text


def fault(module: ModuleType, wrong: str, do: str) -> SpecError:
    """A fault of a module: file, what is wrong, what is allowed or to do."""
    return SpecError(f"{file_of(module).name}: {wrong}. {do.rstrip('.')}.")


def file_of(module: ModuleType) -> Path:
    """File of a module."""
    return Path(str(getattr(module, "__file__", None) or f"{module.__name__}.py"))


def check_values(module: ModuleType, rules: Mapping[str, Rule]) -> None:
    """Values of a module that it has. Errors: SpecError."""
    for name, rule in rules.items():
        if name in vars(module) and not rule.holds(value := vars(module)[name]):
            raise fault(module, f"{name} = {quote(value)}", f"It must be {rule.allowed}")


def check_record(module: ModuleType, name: str, rule: Record) -> None:
    """A record is as the rule says. Errors: SpecError."""
    record = getattr(module, name)
    hints = dict(_hints(module, name, record))
    if not hints and not rule.empty:
        raise fault(module, f"{name} has no field", "Give it at least one, annotated as float")
    for field, needed in rule.needs.items():
        if field not in hints:
            do = f"{name} needs {field}, a {needed.type.__name__}: {needed.meaning}"
            raise fault(module, f"{name}.{field} is missing", do)
        if _bare(hints[field]) is not needed.type:
            do = f"Annotate it as {needed.type.__name__}: {needed.meaning}"
            raise fault(module, f"{name}.{field} is annotated as {_called(hints[field])}", do)
    for field, hint in hints.items():
        _check_field(module, f"{name}.{field}", hint, rule.nested)
        if rule.mark is not None and not _marks(hint, rule.mark):
            do = f"annotate it as Annotated[float, {rule.mark.__name__}(...)]"
            raise SpecError(f"{file_of(module).name}: {name}.{field}: {do}.")
        if rule.starts and not is_number(record._field_defaults.get(field)):
            do = "Give it the number that it starts from, such as 0.0"
            raise fault(module, f"{name}.{field} = {quote(record._field_defaults.get(field))}", do)


def marks_of(record: Any, kind: Any) -> dict[str, Any]:
    """What the fields of a record are annotated with besides their type, of this kind, by field."""
    hints = typing.get_type_hints(record, include_extras=True)
    return {field: mark for field, hint in hints.items() for mark in _marks(hint, kind)[:1]}


def _hints(module: ModuleType, name: str, record: Any) -> Iterator[tuple[str, Any]]:
    """Fields of a record with what they are annotated as."""
    if not is_record(record):
        raise fault(module, f"{name} is not a NamedTuple", f"Write class {name}(NamedTuple)")
    for field, value in vars(record).items():
        if not field.startswith("_") and field not in record._fields and is_number(value):
            raise fault(module, f"{name}.{field} = {value} has no annotation", "Annotate it as float")
    try:
        hints = typing.get_type_hints(record, include_extras=True)
    except Exception as problem:
        raise fault(module, f"{name}: {' '.join(str(problem).split())}", "Annotate its fields as float") from problem
    yield from ((field, hints[field]) for field in record._fields)


def _check_field(module: ModuleType, place: str, hint: Any, nested: bool, around: tuple[Any, ...] = ()) -> None:
    """A field is a float, or a record of floats, other than those around it. Errors: SpecError."""
    kind = _bare(hint)
    if kind is float:
        return
    if not nested or kind in around or not is_record(kind):
        allowed = "float or as a NamedTuple of floats" if nested else "float"
        raise fault(module, f"{place} is annotated as {_called(hint)}", f"Annotate it as {allowed}")
    for field, inner in _hints(module, place, kind):
        _check_field(module, f"{place}.{field}", inner, nested, (*around, kind))


def _bare(hint: Any) -> Any:
    """An annotation without the notes to its type."""
    return hint.__origin__ if hasattr(hint, "__metadata__") else hint


def _called(hint: Any) -> str:
    kind = _bare(hint)
    return kind.__name__ if isinstance(kind, type) else str(kind)


def _marks(hint: Any, kind: type) -> list[Any]:
    return [mark for mark in getattr(hint, "__metadata__", ()) if isinstance(mark, kind)]


def by_name(modules: Iterable[Any], what: str) -> dict[str, Any]:
    """What modules declare, by name. Errors: SpecError where two have one name."""
    result: dict[str, Any] = {}
    for each in modules:
        if each.name in result:
            other = result[each.name].file
            same = f"{other.name} in {other.parent}" if other.name == each.file.name else other.name
            raise SpecError(f'{each.file.name}: the {what} "{each.name}" is that of {same}. Change NAME.')
        result[each.name] = each
    return result
