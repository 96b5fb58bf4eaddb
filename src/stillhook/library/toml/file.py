"""TOML files that users write, read into models; what a model alone cannot see is refused with the same one line.

Errors of pydantic in a file, as one line: where, what came, what is allowed, what to do.

Sets of rows by key that a file builds on a base: criteria and rules. What a file leaves out keeps its value.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol, TypeVar

from pydantic import BaseModel, Field, ValidationError

from stillhook.base.choice import nearest
from stillhook.base.gateway.guard import guarded
from stillhook.base.gateway.named_files import links_in, named_path, plain_name
from stillhook.errors import ScenarioError, SpecError, StillhookError, UnitError
from stillhook.library.toml.kinds import FileKind, unknown_name
from stillhook.library.toml.tree import parsed, toml_text
from stillhook.spec.crane import Crane
from stillhook.tables.sheet import is_table
from stillhook.tables.table import Spec, Text, place_of, problems_of, pure_number, statement
from stillhook.units import parse, quote, text_at

_BASE = ", or start the file with base = <crane of the library>."


def explain(
    error: ValidationError,
    model: type[BaseModel],
    where: str,
    data: Mapping[str, Any],
    raised: type[StillhookError] = SpecError,
) -> StillhookError:
    """The first problem of a validation of ``data`` as one line, with the number of further ones.

    An error of the matching class: UnitError for a quantity, that of what a field names; `raised` for the rest.
    """
    problems = problems_of(error, model, data)
    problem = problems[0]
    line = problem.line
    if problem.kind == "missing" and issubclass(model, Crane):
        line = line.removesuffix(".") + _BASE
    more = f" (and {problem.total - 1} more)" if problem.total > 1 else ""
    if problem.kind == "unit":
        raised = UnitError
    elif problem.cause is not None and not isinstance(problem.cause, ScenarioError):
        raised = type(problem.cause)
    lines = [line, *(other.line for other in problems[1:])]
    return raised(f"{where}: {line}{more}" if where else line + more).with_lines(
        [f"{where}: {each}" if where else each for each in lines]
    )


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
        """The path of a file seen from the folder of this one, or a name of the library unchanged. Errors: for a path
        that leads out of that folder."""
        if is_library_name(name):
            return name
        return str(named_path(self.path.parent, name, lambda why: self.error(f"{quote(name)}: {why}")))

    def named_path(self, name: str, *loc: int | str) -> Path:
        """A path that this file names, which need not exist; loc: of its name. Errors: for one that leads out of the
        folder of this file."""
        return named_path(self.path.parent, name, lambda why: self.wrong(why, *loc))

    def named_folder(self, name: str, *loc: int | str) -> Path:
        """The same of a folder whose files grow while a command runs: nor may a link in it lead out of it, which would
        have them written elsewhere."""
        folder = self.named_path(name, *loc)
        for link in links_in(folder):
            named_path(folder, link, lambda why, link=link: self.wrong(f"{quote(link)} in it {why}", *loc))  # type: ignore[misc]
        return folder

    def relative_file(self, name: str, *loc: int | str) -> Path:
        """The same of a file, or an Excel file's sheet, that exists."""
        path = self.named_path(name, *loc)
        if not is_table(path):
            raise self.wrong("no such file next to this file. Check the path.", *loc)
        return path


def is_library_name(name: str) -> bool:
    """Whether a text can be a name of the library alone: a file's ends in .toml, or leads somewhere."""
    return plain_name(name) and not name.endswith(".toml")


def read_toml(
    path: str | Path,
    kind: FileKind,
    error: type[StillhookError],
    read: Callable[[TomlTable], Result],
    *,
    start: str = "Write its fields, or copy an example.",
) -> Result:
    """The result of `read` for a TOML file of a kind; start: what to do with an empty one. Errors: StillhookError."""
    file = Path(path)
    with guarded(file.name, error):
        data = parsed(toml_text(file), file.name, kind, start=start)
        return named(TomlTable(file, data, error), read)


def read_toml_raising(
    error: type[StillhookError], path: str | Path, kind: FileKind, read: Callable[[TomlTable], Result], *, start: str
) -> Result:
    """The same, with `error` wherever a crane or a file that is not TOML raises SpecError."""
    try:
        return read_toml(path, kind, error, read, start=start)
    except SpecError as problem:
        raise error(str(problem)).with_lines(problem.lines) from None


def named(table: TomlTable, read: Callable[[TomlTable], Result]) -> Result:
    """The result of `read`; an error begins with the file's name."""
    try:
        return read(table)
    except StillhookError as e:
        name = f"{table.path.name}:"
        first, *lines = (line if line.startswith(name) else f"{name} {line}" for line in (str(e), *e.lines))
        raise type(e)(first).with_lines(lines) from None


class SetFile(Spec):
    """The top of a file with a set."""

    base: Text | None = Field(default=None, description="set that this one changes; default: every row is stated")
    name: Text | None = Field(default=None, description="name of the set; default that of the file")
    version: Text = Field(description="version of the set")
    source: Text | None = Field(default=None, description="where the set is from")
    drop: tuple[Text, ...] = Field(default=(), description="keys of the base that are left out")


def set_names(folder: Path) -> tuple[str, ...]:
    """Names of the sets in a folder of Stillhook."""
    return tuple(sorted(path.stem for path in folder.glob("*.toml")))


def load_set(
    name_or_path: str | Path,
    folder: Path,
    noun: str,
    kind: FileKind,
    error: type[StillhookError],
    read: Callable[[TomlTable], Result],
) -> Result:
    """A set by its name in a folder of Stillhook, or from a file; noun: what it is. Errors: as `read_toml`."""
    name, names = str(name_or_path), set_names(folder)
    if name in names:
        file = folder / f"{name}.toml"
        return named(TomlTable(Path(file.name), parsed(toml_text(file), file.name, kind), error), read)
    if not name.endswith(".toml"):
        raise error(unknown_name(noun, name, names, kind))
    return read_toml(name_or_path, kind, error, read)


def digest_of_set(content: Mapping[str, Any]) -> str:
    """SHA-256 of the contents of a set but its digest."""
    bare = {key: value for key, value in content.items() if key != "digest"}
    return hashlib.sha256(json.dumps(bare, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


class RowTable(Spec):
    """A row of a file with a set."""

    key: Text = Field(description="its name in the set")


class Keyed(Protocol):
    """A row of a set."""

    @property
    def key(self) -> str: ...


Listed = TypeVar("Listed", bound=RowTable)
Row = TypeVar("Row", bound=Keyed)


def base_name(file: SetFile, table: TomlTable, sets: Sequence[str]) -> str | None:
    """Name of the base; None where there is none. Errors: that of the file for an unknown one."""
    if file.base is not None and file.base not in sets:
        raise table.wrong(f"Stillhook has {', '.join(sets)}{nearest(file.base, sets)}", "base")
    return file.base


def rows_on_base(
    file: SetFile,
    table: TomlTable,
    name: str,
    listed: Sequence[Listed],
    base: Sequence[Row],
    row_of: Callable[[Listed, Row | None, TomlTable], Row],
) -> tuple[Row, ...]:
    """The rows of a set: those of the base in their order, changed by `row_of` or dropped, then new ones.

    Parameters: name of the list of tables; listed its tables; row_of: makes a row of one, the base's row with its key
    (None: it has none) and its place. Errors: that of the file.
    """
    rows = {row.key: row for row in base}
    if not listed and not rows:
        raise table.error(f"{name}: none. Write one table [[{name}]] for each.")
    for key in file.drop:
        if key not in rows:
            raise table.error(f"drop: the base has no {name} {quote(key)}{nearest(key, rows)}")
    keys = [row.key for row in listed]
    for i, row in enumerate(listed):
        place = table.at(name, i)
        if row.key in keys[:i] or row.key in file.drop:
            problem = "is given twice" if row.key in keys[:i] else "is dropped as well"
            raise place.wrong(f"{problem}. Write it once.")
        rows[row.key] = row_of(row, rows.get(row.key), place)
    return tuple(row for row in rows.values() if row.key not in file.drop)


def numbers_on_base(
    table: TomlTable,
    name: str,
    stated: Mapping[str, Any],
    allowed: Mapping[str, tuple[str, str]],
    base: Mapping[str, float],
    example: str,
) -> dict[str, float]:
    """The numbers of a set [SI]: those of its table `name` on top of those of the base, all above 0.

    Parameters: stated: that table; known: kind of quantity and meaning by name; example: a base that has all of them.
    Errors: that of the file; UnitError.
    """
    out = dict(base)
    for key in stated:
        if key not in allowed:
            known = f"{nearest(key, allowed)} Allowed: {', '.join(allowed)}"
            raise table.error(f"{table.place(name, key)}: unknown field{known}.")
        out[key], _ = table.quantity(allowed[key][0], name, key)
        if not out[key] > 0.0:
            raise table.wrong("must be more than zero.", name, key)
    for key, (_, meaning) in allowed.items():
        if key not in out:
            do = f'Add it, or start the file with base = "{example}".'
            raise table.error(f"{table.place(name, key)}: missing ({meaning}). {do}")
    return {key: out[key] for key in allowed}
