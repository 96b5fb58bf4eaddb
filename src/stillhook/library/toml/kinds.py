"""What a TOML file is, by its tables, and which command reads it: a file handed to the wrong command is named in one
line."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from enum import Enum
from importlib.resources import files
from pathlib import Path
from typing import Any

from stillhook.errors import SpecError


class FileKind(Enum):
    """Kinds of TOML files: what it is called, and what reads it."""

    PLAN = ("a lift plan", "stillhook plan reads it")
    LIFT = ("a lift file", "stillhook lower and stillhook response read it")
    CASE = ("a case file", "stillhook run and stillhook uncertainty read it")
    CRANE = ("a crane file", "stillhook crane and every option --crane read it, and the files that name it as crane")
    PAYLOAD = (
        "a payload file",
        "stillhook payload show reads it, and the lift files and plans that name it as payload",
    )
    CONTROLLER = (
        "a controller file",
        "stillhook map, stillhook envelope and stillhook uncertainty read it, among the controllers",
    )
    FRICTION = ("a friction set", "stillhook friction compare reads it, and the crane files that name it")
    MOTOR = ("a motor set", "stillhook friction draws reads it, and the crane files that name it")
    FRICTION_CAMPAIGN = ("a campaign of friction tests", "stillhook identify friction reads it")
    CAMPAIGN = ("a validation campaign", "stillhook validate reads it")
    CRITERIA = ("a set of acceptance criteria", "stillhook validate reads it, by criteria in the campaign")
    RULES = ("a set of rules", "stillhook plan reads it, by rules in the plan")
    ALPHA = ("a table of forecast factors", "stillhook weather and stillhook plan read it, by --table and --alpha")
    FACTORS = ("a table of uncertain factors", "stillhook uncertainty reads it, by --factors")
    MAPPING = ("a mapping of log signals", "stillhook identify curve reads it, by --mapping")
    COLUMNS = ("a mapping of columns", "stillhook identify motor reads it, by --mapping")

    @property
    def noun(self) -> str:
        """What it is, with its article."""
        return self.value[0]

    @property
    def read_by(self) -> str:
        """Which command reads it."""
        return self.value[1]


_MARKS: tuple[tuple[FileKind, frozenset[str]], ...] = (
    (FileKind.PLAN, frozenset({"phase"})),
    (FileKind.LIFT, frozenset({"stage"})),
    (FileKind.CASE, frozenset({"scenario"})),
    (FileKind.CRITERIA, frozenset({"criterion"})),
    (FileKind.RULES, frozenset({"rule"})),
    (FileKind.FACTORS, frozenset({"factors"})),
    (FileKind.COLUMNS, frozenset({"columns"})),
    (FileKind.ALPHA, frozenset({"row", "restricted"})),
    (FileKind.PLAN, frozenset({"environment", "payload"})),
    (FileKind.LIFT, frozenset({"payload", "start"})),
    (FileKind.PAYLOAD, frozenset({"mass", "shape"})),
    (FileKind.PAYLOAD, frozenset({"mass", "levels"})),
    (FileKind.FRICTION, frozenset({"Y_1", "Y_6"})),
    (FileKind.MOTOR, frozenset({"loss", "D_max"})),
    (FileKind.CRANE, frozenset({"drum"})),
    (FileKind.CRANE, frozenset({"SWL"})),
    (FileKind.CRANE, frozenset({"plant"})),
)
"""Fields that only one kind of file has all of, the surest first."""
_OF_CONTROLLER = frozenset({"mode", "control", "active"})
_OF_CRANE = frozenset({"control", "active", "passive", "friction", "certificate", "hook_mass", "inertia"})
_OF_VALIDATION = frozenset({"criteria", "date", "delay", "modes", "remarks"})


def kind_of(table: Mapping[str, Any]) -> FileKind | None:
    """The kind of a parsed TOML file; None where its tables do not determine it."""
    if "test" in table:
        tests = table["test"] if isinstance(table["test"], list) else []
        validation = _OF_VALIDATION & table.keys() or any(
            isinstance(t, Mapping) and {"kind", "mode"} & t.keys() for t in tests
        )
        return FileKind.CAMPAIGN if validation else FileKind.FRICTION_CAMPAIGN
    kind = next((kind for kind, marks in _MARKS if marks <= table.keys()), None)
    if kind is not None:
        return kind
    if set(table) == {"signals"}:
        return FileKind.MAPPING
    if "mode" in table and table.keys() <= _OF_CONTROLLER:
        return FileKind.CONTROLLER
    return FileKind.CRANE if "base" in table and _OF_CRANE & table.keys() else None


def refuse_other(table: Mapping[str, Any], name: str, *wanted: FileKind) -> None:
    """Refuse a file that is known to be of another kind than those wanted. Errors: SpecError that names its kind and
    what reads it."""
    actual = kind_of(table)
    if wanted and actual is not None and actual not in wanted:
        nouns = " or ".join(kind.noun for kind in wanted)
        raise SpecError(f"{name} is {actual.noun}, not {nouns}: {actual.read_by}. Give {nouns} here.")


def other_kind(name: str, wanted: FileKind) -> str:
    """A sentence for a name that the library has as something else than what is wanted; empty where it has none
    such."""
    actual = kind_on_shelf(name) if name.isprintable() and not {"/", "\\"} & set(name) else None
    return "" if actual in (None, wanted) else f" The library has it as {actual.noun}: {actual.read_by}."


def kind_of_toml(text: str) -> FileKind | None:
    """The kind of a TOML text; None where it is not TOML, or of no known kind."""
    try:
        return kind_of(tomllib.loads(text))
    except (tomllib.TOMLDecodeError, RecursionError, ValueError):
        return None


_SHELVES = {
    "cranes": FileKind.CRANE,
    "payloads": FileKind.PAYLOAD,
    "lifts": FileKind.LIFT,
    "plans": FileKind.PLAN,
    "friction": FileKind.FRICTION,
    "motors": FileKind.MOTOR,
}
"""Shelves of the library."""


def kind_on_shelf(name: str) -> FileKind | None:
    """The kind of what the library has under this name."""
    for shelf, kind in _SHELVES.items():
        if (files("stillhook.library") / "data" / shelf / f"{name}.toml").is_file():
            return kind
    return None


def toml_instead(path: str | os.PathLike[str], wanted: str) -> str:
    """A line on a TOML file in place of data (wanted: what they are called, with an article); empty for any
    other file."""
    file = Path(path)
    if file.suffix.lower() != ".toml" or not file.is_file():
        return ""
    kind = kind_of_toml(file.read_bytes().decode("utf-8-sig", errors="replace"))
    return "" if kind is None else f"{file.name} is {kind.noun}, not {wanted}: {kind.read_by}. Give {wanted} here."


def kind_of_text(text: str) -> str:
    """What a text that is no TOML is, where it is a vessel file: what to say of it; empty otherwise."""
    start = text[:1000]
    if not ("omega [rad/s]" in start or "TRANSFER FUNCTION" in start.upper() or "VesselTypes:" in text[:100_000]):
        return ""
    return (
        "is a vessel file, not TOML: stillhook vessel check reads it, and the lift files and plans that name it as"
        " vessel"
    )
