"""A row of the table of variables: what a number is called, in which unit, and what it means."""

import re
from collections.abc import Iterable
from typing import Any, NamedTuple

_LIST = re.compile(r"(?:^|: |(?P<sum>sum of ))(?P<items>\d+ [^,;]+(?:, \d+ [^,;]+)+)$")
_ITEM = re.compile(r"(\d+) ([^,;]+)")


class Variable(NamedTuple):
    """kind is a key of `stillhook.units.KINDS`, or "" for a pure number or text."""

    name: str
    symbol: str
    unit: str
    kind: str
    sign: str
    meaning: str
    source: str


def flags(meaning: str) -> dict[str, Any]:
    """Attributes of the CF conventions for a code, from the list that ends its meaning: "holding brake: 0 open,
    1 closed" as values, "sum of 1 late, 2 overrun" as masks; none for another meaning."""
    found = _LIST.search(meaning)
    if found is None:
        return {}
    items = [(int(number), words) for number, words in _ITEM.findall(found["items"])]
    return coded(items, "flag_masks" if found["sum"] else "flag_values")


def coded(items: Iterable[tuple[int, str]], kind: str = "flag_values") -> dict[str, Any]:
    """Attributes of the CF conventions for a code: its numbers, and the word of each."""
    pairs = list(items)
    words = (re.sub(r"\s+", "_", text.strip()) for _, text in pairs)
    return {kind: [float(number) for number, _ in pairs], "flag_meanings": " ".join(words)}


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
