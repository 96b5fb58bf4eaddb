"""Commands as users give them: their JSON, or the one line in which they are refused."""

from __future__ import annotations

import json
from typing import Any

import pytest

from stillhook.cli import run


def answer(capsys: pytest.CaptureFixture[str], *arguments: str, code: int = 0) -> Any:
    """What a command answers with --json."""
    assert run([*arguments, "--json"]) == code
    return json.loads(capsys.readouterr().out)


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The one line of an error: nothing else is printed, and the exit code is 2."""
    assert run([*arguments]) == 2
    out = capsys.readouterr()
    assert out.out == ""
    (line,) = out.err.strip().splitlines()
    assert line.startswith("error: ")
    return line
