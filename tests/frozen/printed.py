"""Cases of what people read: the whole answer of commands in the terminal, and the texts of files that they write."""

import contextlib
import io
import json
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from stillhook.cli import run

WIDTH = "100"
"""Columns of the terminal."""
LONGEST = 150
"""Characters of a line as it is stored, so that the numbers of all of it are compared."""
ONCE = "compiling the winch model"
"""Begin of a notice that comes where a kernel is not compiled yet."""
TAG = re.compile(r"<(?:script|style|svg)\b.*?</(?:script|style|svg)>|<[^>]*>", re.DOTALL)
FRAME, ROOM = re.compile(r"\s*[\u2500-\u257f]+\s*"), re.compile(r"[ \t]+")
"""Lines that tables are drawn with, and what fills their columns."""


def lines(text: str) -> dict[str, str]:
    """Lines of a text by their number, as a long list of texts would be stored by a few of them alone; of a table its
    cells without the frame and the room between them."""
    rows = (ROOM.sub(" ", FRAME.sub("|", line)).strip(" |") for line in text.splitlines())
    parts = (row[i : i + LONGEST] for row in rows for i in range(0, len(row), LONGEST))
    return {f"{i:04d}": part for i, part in enumerate(parts, 1)}


def cli(*arguments: str) -> dict[str, Any]:
    """Exit code and JSON of one command line."""
    out, error = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
        code = run([*arguments, "--json"])
    if code not in (0, 1):
        raise RuntimeError(f"stillhook {' '.join(arguments)}: exit code {code}: {error.getvalue().strip()}")
    return {"exit_code": code, "json": json.loads(out.getvalue())}


def printed(*arguments: str, verbose: bool = True) -> dict[str, Any]:
    """Exit code, and what a command prints in brief; with verbose what it prints in full as well."""
    brief = _run(arguments)
    return brief | ({"full": _run([*arguments, "--verbose"])} if verbose else {})


def _run(arguments: Any) -> dict[str, Any]:
    out, error = io.StringIO(), io.StringIO()
    with columns(), contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
        code = run([*arguments])
    notices = [line for line in error.getvalue().splitlines() if not line.startswith(ONCE)]
    return {"code": code, "out": lines(out.getvalue()), "error": lines("\n".join(notices))}


@contextlib.contextmanager
def columns() -> Iterator[None]:
    """A terminal of `WIDTH`."""
    before = os.environ.get("COLUMNS")
    os.environ["COLUMNS"] = WIDTH
    try:
        yield
    finally:
        os.environ.pop("COLUMNS")
        if before is not None:
            os.environ["COLUMNS"] = before


def texts(folder: str, *suffixes: str) -> dict[str, Any]:
    """Lines of the text files of a folder, of HTML what is read of it."""
    found = {}
    for path in sorted(p for p in Path(folder).rglob("*") if p.suffix in suffixes):
        text = path.read_text(encoding="utf-8")
        found[path.name] = lines(re.sub(r"\n\s*\n+", "\n", TAG.sub("\n", text)) if path.suffix == ".html" else text)
    return found
