"""Command lines: every word and option of the commands that take no long time."""

from __future__ import annotations

import contextlib
import io
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

from fuzz.targets.logs import CSV
from fuzz.targets.registry import Form, Target, text
from stillhook.cli import INTERNAL, run

QUICK = (
    "list",
    "crane",
    "sea",
    "calc",
    "inspect",
    "payload",
    "vessel",
    "weather",
    "convert",
    "new",
    "example",
    "friction",
    "certificate",
    "plc",
)
"""Commands whose answer takes no run of the twin."""
NOT_HERE = {"run", "compare", "lift", "export", "draws"}
"""Words after which one of them would take long, or serve."""
EXAMPLES = (
    "list cranes",
    "list motors --json",
    "crane nov-250t --json",
    "crane nov-250t --check",
    "sea jonswap Hs=2 m Tp=9 s|heading",
    "calc speed nov-250t",
    "inspect log.csv --json",
    "inspect log.csv --column a=b",
    "payload manifold-60t --json",
    "vessel supply-vessel-82m --check",
    "weather show log.csv",
    "weather alpha --hs 2 m --t-pop 24 h",
    "convert log.csv x.xlsx",
    "new crane x.toml",
    "new case",
    "example motor-map x",
    "friction compare crane-1 crane-2 --json",
    "certificate check log.csv --quick",
    "plc check log.csv",
    "--version",
    "--help",
    "crane --help",
    "nothing",
    "",
)


def arguments(line: str) -> list[str]:
    """A line as arguments: apart at blanks, where a | stands for a blank within one."""
    words = [word.replace("|", " ") for word in line.split(" ")]
    if words[0] not in QUICK and words[0][:1] != "-":
        words.insert(0, QUICK[len(line) % len(QUICK)])
    return [word for word in words if word not in NOT_HERE][:30]


def _command(data: bytes) -> None:
    """An exit code that is documented, and lines on standard error that begin as they must."""
    before, errors, output = os.getcwd(), io.StringIO(), io.StringIO()
    with tempfile.TemporaryDirectory(dir="/dev/shm" if os.path.isdir("/dev/shm") else None) as folder:
        Path(folder, "log.csv").write_bytes(CSV)
        os.chdir(folder)
        try:
            with contextlib.redirect_stderr(errors), contextlib.redirect_stdout(output):
                code = run(arguments(text(data)))
        finally:
            os.chdir(before)
    said = errors.getvalue() or output.getvalue()  # a group of commands without one answers with its help
    assert code in (0, 1, 2), f"exit code {code}: {said}"
    assert code != INTERNAL, said
    assert code != 2 or said.startswith(("error: ", "note: ", "Usage", "usage")), (
        f"not a line of an error: {said[:200]!r}"
    )
    assert "Traceback" not in said, said


def _lines() -> Iterator[bytes]:
    return (line.encode() for line in EXAMPLES)


TARGETS = (Target("arguments", Form.WORDS, _command, seeds=_lines, share=2),)
