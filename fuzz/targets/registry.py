"""What is fuzzed: a name, how an input reaches the code, and what an input looks like."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from enum import Enum
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

GROUPS = ("words", "crane", "plan", "logs", "sea", "stored", "live", "commands")
"""Modules of this folder that declare `TARGETS`."""


class Form(Enum):
    """What an input is made of, which decides how it is changed."""

    WORDS = "words"
    """A line that a person types."""
    TOML = "toml"
    JSON = "json"
    SEALED = "sealed"
    """JSON with the checksum of `stillhook.base.kept.sealed`."""
    STATE = "state"
    """Head, numbers and checksum of `stillhook.engine.saved`."""
    TABLE = "table"
    """Lines of text with numbers."""
    GZIP = "gzip"
    """The same, compressed."""
    ZIP = "zip"
    NPZ = "npz"
    NETCDF = "netcdf"
    PACKET = "packet"
    BINARY = "binary"


class Target(NamedTuple):
    """A target.

    read: takes the path of a file with the input where there is a `file`, else the bytes; its value does not matter.
    file: name of the input's file; "" for bytes. beside: further files of the folder, by name.
    seeds: inputs beyond those of the corpus. share: of the time of a campaign, relative to the others.
    """

    name: str
    form: Form
    read: Callable[[Any], object]
    file: str = ""
    beside: Mapping[str, bytes] = {}
    seeds: Callable[[], Iterator[bytes]] = lambda: iter(())
    share: float = 1.0
    group: str = ""


def targets(groups: Sequence[str] = GROUPS) -> dict[str, Target]:
    """Every target of some groups by name."""
    found: dict[str, Target] = {}
    for group in groups:
        for target in import_module(f"fuzz.targets.{group}").TARGETS:
            assert target.name not in found, target.name
            found[target.name] = target._replace(group=group)
    return found


def files(folder: Path, pattern: str) -> Callable[[], Iterator[bytes]]:
    """Seeds: the contents of files that are there already."""
    return lambda: (path.read_bytes() for path in sorted(folder.rglob(pattern)))


def text(data: bytes) -> str:
    """Bytes as the system hands over an argument of a command line."""
    return data.decode("utf-8", "surrogateescape")
