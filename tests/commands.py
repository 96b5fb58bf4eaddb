"""Commands as users give them: their JSON, or the one line in which they are refused."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from stillhook.cli import _command, run


def commands() -> dict[str, Any]:
    """Every command of the program by its words."""

    def walk(group: Any, words: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
        for name in group.commands:
            command = group.commands[name]
            if hasattr(command, "commands"):
                yield from walk(command, (*words, name))
            else:
                yield " ".join((*words, name)), command

    return dict(walk(_command(), ()))


def case_file(folder: Path, crane: str = "nov-250t", settings: str = "", step: str = "", **scenario: str) -> str:
    """Path of a case file: the usual lift with other fields, rows of its table [settings], and its time step."""
    fields = {"load": "100 t", "s_w": "100 m", "tip": "sine 1 m 10 s"} | scenario
    rows = [f'crane = "{crane}"', *([f'step = "{step}"'] if step else []), "[scenario]"]
    rows += [f"{name} = {value if value[:1] == '{' else json.dumps(value)}" for name, value in fields.items()]
    file = folder / "case.toml"
    file.write_text("\n".join([*rows, "[settings]", settings, ""]), encoding="utf-8")
    return str(file)


def answer(capsys: pytest.CaptureFixture[str], *arguments: str, code: int = 0) -> Any:
    """What a command answers with --json."""
    assert run([*arguments, "--json"]) == code
    return json.loads(capsys.readouterr().out)


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> str:
    """The one line of an error: nothing else is printed, and the exit code is 2."""
    assert run([*map(str, arguments)]) == 2
    out = capsys.readouterr()
    assert out.out == ""
    (line,) = out.err.strip().splitlines()
    assert line.startswith("error: ")
    return line
