"""TOML files that users write, read into models; what a model alone cannot see is refused with the same one line."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from os.path import isfile
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from stillhook.errors import StillhookError
from stillhook.library.toml.explain import explain
from stillhook.library.toml.kinds import FileKind
from stillhook.library.toml.tree import parsed, toml_text
from stillhook.tables.problem import place_of, statement
from stillhook.tables.table import pure_number
from stillhook.units import parse, text_at

Model = TypeVar("Model", bound=BaseModel)
Result = TypeVar("Result")


@dataclass(frozen=True)
class TomlTable:
    """A table of a TOML file, as it is written."""

    path: Path
    data: Mapping[str, Any]  # of the whole file
    error: type[StillhookError]  # class of what is wrong with this kind of file
    loc: tuple[int | str, ...] = ()  # keys and indices of the table

    def at(self, *loc: int | str) -> TomlTable:
        """A table inside of this one."""
        return replace(self, loc=(*self.loc, *loc))

    def read(self, model: type[Model]) -> Model:
        """The file as a model. Errors: one line without the name of the file; UnitError for a quantity."""
        try:
            return model.model_validate(self.data)
        except ValidationError as error:
            raise explain(error, model, "", self.data, self.error) from None

    def wrong(self, message: str, *loc: int | str) -> StillhookError:
        """The error that names a place inside of this table, what is written there, and what is allowed."""
        place = (*self.loc, *loc)
        return self.error(statement(place, self.data, text_at(self.data, place, None), message))

    def missing(self, *loc: int | str) -> StillhookError:
        """The error for a field that this table needs here."""
        return self.error(f"{self.place(*loc)}: missing. Add it.")

    def quantity(self, kind: str, *loc: int | str) -> tuple[float, str]:
        """A value in SI and as it is written; kind of quantity, "": a pure number or a text such as "3 %"."""
        value = text_at(self.data, (*self.loc, *loc), None)
        if kind:
            return parse(value, kind, self.place(*loc)), " ".join(str(value).split())
        try:
            number = pure_number(value)
        except ValueError as problem:
            raise self.wrong(str(problem), *loc) from None
        return number, " ".join(value.split()) if isinstance(value, str) else f"{value:g}"

    def place(self, *loc: int | str) -> str:
        """A place inside of this table as messages name it."""
        return place_of((*self.loc, *loc), self.data)

    def relative_toml(self, name: str) -> str:
        """The path of a TOML file seen from the folder of this one, or a name of the library unchanged."""
        neighbour = self.path.parent / name
        return str(neighbour) if name.endswith(".toml") and isfile(neighbour) else name

    def relative_file(self, name: str, *loc: int | str) -> Path:
        """A file that exists, seen from the folder of this one; loc: of its name."""
        path = self.path.parent / name
        if not isfile(path):
            raise self.wrong("no such file next to this file. Check the path.", *loc)
        return path


def read_toml(
    path: str | Path,
    kind: FileKind,
    error: type[StillhookError],
    read: Callable[[TomlTable], Result],
    *,
    start: str = "Write its fields, or copy an example.",
) -> Result:
    """The result of `read` for a TOML file of a kind; start: what to do with an empty one. Errors: StillhookError of
    one line that begins with the file's name."""
    file = Path(path)
    data = parsed(toml_text(file), file.name, kind, start=start)
    return named(TomlTable(file, data, error), read)


def named(table: TomlTable, read: Callable[[TomlTable], Result]) -> Result:
    """The result of `read`; an error begins with the file's name."""
    try:
        return read(table)
    except StillhookError as e:
        name, line = table.path.name, str(e)
        raise type(e)(line if line.startswith(f"{name}:") else f"{name}: {line}") from None
