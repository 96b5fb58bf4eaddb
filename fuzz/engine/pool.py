"""Inputs and findings as files: a line of JSON each, bytes that are not text as base64."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
CORPUS, CRASHES = ROOT / "corpus", ROOT / "crashes"


def line_of(data: bytes, **more: str) -> str:
    """An input as a line, with what is to be said of it."""
    try:
        shown: dict[str, Any] = {"text": data.decode("utf-8")}
    except UnicodeDecodeError:
        shown = {"base64": base64.b64encode(data).decode()}
    return json.dumps(shown | more, ensure_ascii=True)


def input_of(line: str) -> bytes:
    row = json.loads(line)
    return base64.b64decode(row["base64"]) if "base64" in row else row["text"].encode()


def rows(file: Path) -> Iterator[dict[str, Any]]:
    """The lines of a file that is there or not; a last line that is not complete is left out."""
    if file.exists():
        for line in file.read_text(encoding="utf-8").splitlines():
            try:
                yield json.loads(line)
            except ValueError:
                return


def inputs(file: Path) -> list[bytes]:
    return [input_of(json.dumps(row)) for row in rows(file)]


def stored(folder: Path, group: str, name: str) -> Path:
    """Where inputs of a target are kept."""
    return folder / group / f"{name}.jsonl"


def write(file: Path, lines: Iterable[str]) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")


def append(file: Path, line: str) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("a", encoding="utf-8") as stream:
        stream.write(line + "\n")
