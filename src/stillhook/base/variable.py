"""A row of the table of variables: what a number is called, in which unit, and what it means."""

from typing import NamedTuple


class Variable(NamedTuple):
    """kind is a key of `stillhook.units.KINDS`, or "" for a pure number or text."""

    name: str
    symbol: str
    unit: str
    kind: str
    sign: str
    meaning: str
    source: str


class Row(NamedTuple):
    """The row of a field, which gives it its name: the annotation of a signal or number that a winch type declares."""

    unit: str
    kind: str
    sign: str
    meaning: str
    source: str = ""
    symbol: str = ""  # default the name

    def named(self, name: str) -> Variable:
        """The row of the variable of this name."""
        return Variable(name, self.symbol or name, self.unit, self.kind, self.sign, self.meaning, self.source)
