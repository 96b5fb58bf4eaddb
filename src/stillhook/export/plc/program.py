"""What is written for a PLC: structures, functions and one function block, as records that text and XML are made of."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

from stillhook.control.checks import Checks, CheckSettings, checks_at_start

LREAL, BOOL = "LREAL", "BOOL"
PREFIX = "SH_"
"""Begins every name that is global in the PLC's project, so that none meets one of the user's or of a library."""

RESERVED = frozenset(Path(__file__).with_name("reserved.txt").read_text(encoding="utf-8").split())
"""Words that a name may not be, in upper or lower case: keywords, operators of instruction lists, standard
functions."""


class Names:
    """Names of one scope: IEC 61131-3 does not distinguish upper from lower case, and wants single underscores
    within."""

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self.taken = {name.casefold() for name in taken}

    def new(self, wanted: str) -> str:
        """This name, or the next one like it that is free."""
        name = re.sub(r"_+", "_", re.sub(r"\W", "_", wanted)).strip("_") or "v"
        name = f"v_{name}" if name[0].isdigit() else name
        number = 1
        unique = name
        while unique.casefold() in self.taken or unique.casefold() in RESERVED:
            number += 1
            unique = f"{name}_{number}"
        self.taken.add(unique.casefold())
        return unique


class Variable(NamedTuple):
    """A variable or a member of a structure; initial value as text, "" for none."""

    name: str
    type: str
    comment: str = ""
    initial: str = ""


class Structure(NamedTuple):
    """A structured data type."""

    name: str
    comment: str
    members: tuple[Variable, ...]


class Unit(NamedTuple):
    """A function (with a result) or the function block (result ""); body one statement or comment a line."""

    name: str
    comment: str
    result: str
    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    variables: tuple[Variable, ...]
    body: tuple[str, ...]


class Program(NamedTuple):
    """A function block with what it needs: head says what it is."""

    head: tuple[str, ...]
    structures: tuple[Structure, ...]
    functions: tuple[Unit, ...]
    block: Unit


class Block(NamedTuple):
    """Everything that is exported: head says what it is; reference computes its cycle in Python."""

    head: tuple[str, ...]
    crane: str
    controller: str
    code: float
    t_cycle: float
    structures: tuple[Structure, ...]
    functions: tuple[Unit, ...]
    block: Unit
    settings: tuple[tuple[str, float, str], ...]  # path, value, what the structure's comment says
    memory: Any  # before the first cycle
    plc: Any
    control: Any
    drive: str  # kind of drive, see `stillhook.control.interface`
    own: Any
    law: Any
    guard: Any
    checks: CheckSettings | None = None  # of the checks before the guard
    prediction: Any = None  # of the tip's motion

    @property
    def own_settings(self) -> dict[str, Any]:
        """Settings of the controller and of the prediction, by the names under which controllers carry them."""
        named = {self.controller: self.own, "prediction": self.prediction}
        return {name: settings for name, settings in named.items() if settings is not None}

    @property
    def checks_at_start(self) -> Checks | None:
        """The checks before the first cycle, None without."""
        return None if self.checks is None else checks_at_start(self.checks)


def literal(number: float) -> str:
    """A literal that reads back to the same double: IEC 61131-3 wants a decimal point before the exponent."""
    text = repr(float(number))
    if "e" in text:
        digits, exponent = text.split("e")
        text = f"{digits if '.' in digits else digits + '.0'}E{int(exponent)}"
    return text


def plain_text(text: str) -> str:
    """A comment's text: ASCII, and no marks of comments within."""
    return text.replace("(*", "( *").replace("*)", "* )").encode("ascii", "replace").decode()
