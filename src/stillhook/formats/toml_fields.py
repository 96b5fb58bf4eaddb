"""Fields of a table in a file that describes a campaign: read one by one, each with the line that says what is wrong
with it."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from os.path import isfile
from pathlib import Path
from typing import Any, Protocol, TypeVar

from stillhook.base.nearest import nearest
from stillhook.errors import StillhookError
from stillhook.library.toml.kinds import FileKind
from stillhook.library.toml.tree import parsed, toml_text
from stillhook.units import parse, quote

Described = TypeVar("Described")

MOST = 1e12
"""Pure numbers beyond this size are slips of the pen."""
_PERCENT = re.compile(r"[+-]?[0-9]+(\.[0-9]*)? %")


def described(path: str | Path, kind: FileKind, read: Callable[[Mapping[str, Any], Path], Described]) -> Described:
    """What `read` makes of a TOML file of a kind, given its table and its path. Errors: StillhookError whose line
    begins with the file's name."""
    file = Path(path)
    data = parsed(toml_text(file), file.name, kind, start="Write its fields, or copy an example.")
    try:
        return read(data, file)
    except StillhookError as e:
        text = str(e)
        raise type(e)(text if text.startswith(file.name) else f"{file.name}: {text}") from None


class Fields:
    """A table of a parsed TOML file. place stands before every message, such as 'test "3": '; error is what is
    raised."""

    def __init__(self, table: Any, place: str, error: type[StillhookError]) -> None:
        if not isinstance(table, Mapping):
            raise error(f"{place.rstrip('.: ')}: {quote(table)} is not a table. Write its fields as name = value.")
        self.table, self.place, self.error = table, place, error

    def refuse_unknown(self, allowed: tuple[str, ...]) -> None:
        """Refuse fields that are none of these."""
        for key in self.table:
            if key not in allowed:
                raise self.error(
                    f"{self.place}{quote(key)[1:-1]}: unknown field. Allowed:"
                    f" {', '.join(allowed)}{nearest(key, allowed)}"
                )

    def need(self, *keys: str) -> None:
        """Refuse a table without these."""
        for key in keys:
            if key not in self.table:
                raise self.error(f"{self.place}{key}: missing. Give it.")

    def __contains__(self, key: str) -> bool:
        return key in self.table

    def wrong(self, key: str, instead: str) -> StillhookError:
        """The error that names a field, what came, and what to write."""
        return self.error(f"{self.place}{key} = {quote(self.table[key])}: {instead}")

    def text(self, key: str, otherwise: str | None = None) -> str:
        """A text that is not empty."""
        if key not in self.table and otherwise is not None:
            return otherwise
        self.need(key)
        value = self.table[key]
        if not isinstance(value, str) or not value.strip():
            raise self.wrong(key, "give a text.")
        return value

    def flag(self, key: str, otherwise: bool = False) -> bool:
        """true or false."""
        value = self.table.get(key, otherwise)
        if not isinstance(value, bool):
            raise self.wrong(key, "give true or false.")
        return value

    def quantity(self, key: str, kind: str, otherwise: float | None = None) -> float | None:
        """A text with a unit as SI; `otherwise` where the field is not there."""
        return parse(self.table[key], kind, f"{self.place}{key}") if key in self.table else otherwise

    def figure(self, key: str, kind: str) -> tuple[float, str]:
        """A number in SI and as written: text with a unit; a number or a text such as "3 %" where its kind is "" (a
        pure number)."""
        value = self.table[key]
        if kind:
            return parse(value, kind, f"{self.place}{key}"), " ".join(str(value).split())
        if isinstance(value, str) and _PERCENT.fullmatch(value.strip()) and abs(float(value.strip()[:-1])) < MOST:
            return float(value.strip()[:-1]) / 100.0, " ".join(value.split())
        if isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < MOST:
            return float(value), f"{value:g}"
        raise self.wrong(key, 'give a number, or a text such as "3 %".')

    def path_or_name(self, key: str, folder: Path) -> str:
        """The path of a file seen from the folder of this one, or a name of the library as it is."""
        name = self.text(key)
        return str(folder / name) if name.endswith(".toml") and isfile(folder / name) else name

    def file(self, key: str, folder: Path) -> Path:
        """A file that is there, seen from the folder of this one."""
        path = folder / self.text(key)
        if not path.is_file():
            raise self.wrong(key, "no such file next to the campaign file. Check the path.")
        return path


def no_name_twice(names: Sequence[str], error: type[StillhookError]) -> None:
    """Refuse tests of one name: results could not be distinguished."""
    twice = next((n for n in names if names.count(n) > 1), None)
    if twice is not None:
        raise error(f"test: the name {quote(twice)} is given twice. Give every test its own.")


class PartOfLog(Protocol):
    """A test that takes a part of a log."""

    @property
    def name(self) -> str: ...
    @property
    def log(self) -> Path: ...
    @property
    def start(self) -> float: ...
    @property
    def end(self) -> float: ...


def no_log_twice(tests: Sequence[PartOfLog], error: type[StillhookError]) -> None:
    """Refuse two tests that take the same part of the same log: it would count twice."""
    for i, a in enumerate(tests):
        for b in tests[:i]:
            if a.log.resolve() == b.log.resolve() and a.start < b.end and b.start < a.end:
                raise error(
                    f'test "{a.name}": log = {quote(a.log.name)} is that of test "{b.name}" as well, and would count'
                    " twice. Name another log, or give each its own start and end."
                )
