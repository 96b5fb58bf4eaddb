"""What a TOML file is, by its tables, and which command reads it: a file handed to the wrong command is named in one
line."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping, Sequence
from enum import Enum, auto
from pathlib import Path
from typing import Any

from stillhook.base.choice import nearest
from stillhook.base.gateway.access import read_text
from stillhook.base.gateway.budget import TOML
from stillhook.base.gateway.parse import from_toml
from stillhook.errors import SpecError, UnreadableError
from stillhook.units import quote

_TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
LIBRARY = Path(__file__).resolve().parents[1] / "data"
"""Folder of the library's files."""


class FileKind(Enum):
    """Kinds of TOML files; what they are called, and what reads them, is in `kinds.toml`."""

    LIFT = auto()
    CASE = auto()
    CRANE = auto()
    PAYLOAD = auto()
    COMPENSATOR = auto()
    VESSEL = auto()
    CONTROLLER = auto()
    FRICTION = auto()
    MOTOR = auto()
    FRICTION_CAMPAIGN = auto()
    CAMPAIGN = auto()
    CRITERIA = auto()
    RULES = auto()
    ALPHA = auto()
    FACTORS = auto()
    MAPPING = auto()
    WEATHER = auto()
    LIVE = auto()
    REGISTERS = auto()
    PLC = auto()
    SCRIPT = auto()
    EVENTS = auto()
    COSTS = auto()

    @property
    def noun(self) -> str:
        """What it is, with its article."""
        return str(_TABLE["kinds"][self.name]["noun"])

    @property
    def read_by(self) -> str:
        """Which command reads it."""
        return str(_TABLE["kinds"][self.name]["read_by"])


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
    name = next((name for name, *marks in _TABLE["marks"] if table.keys() >= set(marks)), None)
    if name is not None:
        return FileKind[name]
    if "signals" in table and table.keys() <= {"signals", "curve"}:
        return FileKind.MAPPING
    if "mode" in table and table.keys() <= _OF_CONTROLLER:
        return FileKind.CONTROLLER
    return FileKind.CRANE if "base" in table and _OF_CRANE & table.keys() else None


def refuse_other(table: Mapping[str, Any], name: str, *wanted: FileKind) -> None:
    """Refuse a file that is known to be of another kind than those wanted. Errors: SpecError."""
    actual = kind_of(table)
    if wanted and actual is not None and actual not in wanted:
        nouns = " or ".join(kind.noun for kind in wanted)
        raise SpecError(f"{name} is {actual.noun}, not {nouns}: {actual.read_by}. Give {nouns} here.")


def unknown_name(noun: str, name: str, names: Sequence[str], wanted: FileKind) -> str:
    """A line for a name that is neither one of the library's names nor the path of a TOML file."""
    have = f"{', '.join(names)}{nearest(name, names)}"
    shelves = [
        kind
        for shelf, kind in _TABLE["shelves"].items()
        if f"{name}.toml" in {file.name for file in (LIBRARY / shelf).rglob("*.toml")}
    ]
    other = FileKind[shelves[0]] if shelves else wanted
    elsewhere = "" if other is wanted else f" The library has it as {other.noun}: {other.read_by}."
    return f"No {noun} {quote(name)}: the library has {have} A file's name ends in .toml.{elsewhere}"


def kind_of_toml(text: str) -> FileKind | None:
    """The kind of a TOML text; None where it is not TOML, or of no known kind."""
    try:
        return kind_of(from_toml(text))
    except UnreadableError:
        return None


def toml_instead(path: str | os.PathLike[str], wanted: str) -> str:
    """A line on a TOML file in place of data (wanted: what they are called, with an article); else empty."""
    file = Path(path)
    if file.suffix.lower() != ".toml" or not file.is_file():
        return ""
    kind = kind_of_toml(read_text(file, "TOML file", SpecError, TOML, errors="replace"))
    return "" if kind is None else f"{file.name} is {kind.noun}, not {wanted}: {kind.read_by}. Give {wanted} here."


def kind_of_text(text: str) -> str:
    """What a text that is not TOML is, where it is a vessel file: what to say of it; empty otherwise."""
    start = text[:1000]
    if not ("omega [rad/s]" in start or "TRANSFER FUNCTION" in start.upper() or "VesselTypes:" in text[:100_000]):
        return ""
    return "is a vessel file, not TOML: stillhook vessel reads it, and the lift files that name it as vessel"
