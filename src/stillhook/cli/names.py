"""What older versions called commands and options.

Old names work for this version: the command line is rewritten before it is read, and a note on standard error says the
new one. What moved into a file is refused with the key that it has there. `tests/api/test_command_names.py` holds every
command against these tables, and against that of the options with the one meaning of each (`tests/api/options.toml`).
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from stillhook.errors import CommandError


class Renamed(NamedTuple):
    """What an older version called a command: its words, those of today, and an option that they need."""

    words: tuple[str, ...]
    option: str = ""


_NAMES: dict[str, Any] = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))


def _renamed_command(words: str) -> Renamed:
    """The words of today, with the option that they need."""
    new, mark, option = words.partition(" --")
    return Renamed(tuple(new.split()), f"--{option}" if mark else "")


OLD_COMMANDS = {tuple(old.split()): _renamed_command(new) for old, new in _NAMES["commands"].items()}
OLD_OPTIONS = {tuple(command.split()): options for command, options in _NAMES["options"].items()}
"""Options by the command of today; NAME= is an argument NAME=VALUE now."""
MOVED: dict[tuple[str, ...], dict[str, str]] = {}
"""Options that moved into files or other options, and where each is now."""
for _row in _NAMES["moved"]:
    for _command in _row["commands"]:
        _places = {option: f"{key} in {_row['file']}" for option, key in _row["keys"].items()}
        MOVED[tuple(_command.split())] = MOVED.get(tuple(_command.split()), {}) | _places


def modern(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """A command line in the names of today, and a note for each old one in it. Errors: CommandError for an option that
    moved into a file."""
    words, notes = list(arguments), []
    for old, new in OLD_COMMANDS.items():
        if tuple(words[: len(old)]) == old:
            words = [*new.words, *words[len(old) :], *([new.option] if new.option else [])]
            called = " ".join((*new.words, *(["..."] if new.option else []), new.option)).strip()
            notes.append(f'"stillhook {" ".join(old)}" is called "stillhook {called}" now')
            break
    for command, options in OLD_OPTIONS.items():
        if tuple(words[: len(command)]) == command:
            words = list(command) + _renamed(words[len(command) :], options, notes)
    for command, places in MOVED.items():
        if tuple(words[: len(command)]) == command:
            _refuse_moved(words, places)
    return words, list(dict.fromkeys(notes))


def _refuse_moved(words: Sequence[str], places: Mapping[str, str]) -> None:
    for word in words[: words.index("--")] if "--" in words else words:
        name = word.partition("=")[0]
        if name in places:
            raise CommandError(f"{name}: moved. Write {places[name]}.")


def _renamed(words: Sequence[str], options: Mapping[str, str], notes: list[str]) -> list[str]:
    out: list[str] = []
    rest = iter(words)
    for word in rest:
        if word == "--":
            return [*out, word, *rest]
        name, sign, value = word.partition("=")
        if name not in options:
            out.append(word)
            continue
        new = options[name]
        if new.endswith("="):
            out.append(new + (value if sign else next(rest, "")))
            notes.append(f"{name} VALUE is written {new}VALUE now")
        elif new:
            out.append(f"{new}{sign}{value}")
            notes.append(f"{name} is called {new} now")
        else:
            out += [value] if sign else []
            notes.append(f"{name} is an argument now: leave its name out")
    return out
