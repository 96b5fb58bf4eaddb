"""Structured Text of a block, and the checksum in it."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from stillhook.export.plc.block import PlcError
from stillhook.export.plc.program import Block, Structure, Unit, Variable
from stillhook.export.plc.translate import comment

MARK = "(* SHA-256 of this text without this line: "
LINE = re.compile(re.escape(MARK) + r"([0-9a-f]{64}) \*\)\n")


def normalised(text: str) -> str:
    """The text with line ends of one character, without the line of the checksum."""
    return LINE.sub("", text.replace("\r\n", "\n").replace("\r", "\n").removeprefix("\ufeff"), count=1)


def checksum(text: str) -> str:
    """SHA-256 of a text, whatever its line ends, without the line that names it."""
    return hashlib.sha256(normalised(text).encode()).hexdigest()


def verify(file: Path) -> tuple[str, str]:
    """Checksum that a file names, and the one that it has. Errors: PlcError for a file that cannot be read or that
    names none."""
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, ValueError) as e:
        reason = getattr(e, "strerror", None) or "no text in UTF-8"
        raise PlcError(f"{file}: cannot be read ({reason}). Give a text that stillhook plc export wrote.") from None
    found = LINE.search(text)
    if found is None:
        raise PlcError(f"{file}: names no checksum. Give a text that stillhook plc export wrote.")
    return found[1], checksum(text)


def structured_text(block: Block) -> str:
    """The complete text: head, structures, functions, function block."""
    head, *more = comment("\n".join(block.head))
    parts = [
        "\n".join([head, *more]),
        *("\n".join(structure(s)) for s in block.structures),
        *("\n".join(unit(f)) for f in (*block.functions, block.block)),
    ]
    text = "\n\n".join(parts) + "\n"
    end = text.index("\n") + 1 if not more else text.index("*)\n") + 3
    return f"{text[:end]}{MARK}{checksum(text)} *)\n{text[end:]}"


def structure(s: Structure) -> Iterator[str]:
    """A structured type, in a declaration of its own: TwinCAT takes one type at a time."""
    yield from comment(s.comment)
    yield "TYPE"
    yield f"    {s.name} : STRUCT"
    for member in s.members:
        yield f"        {declaration(member)}"
    yield "    END_STRUCT;"
    yield "END_TYPE"


def declaration(v: Variable) -> str:
    """One variable."""
    initial = f" := {v.initial}" if v.initial else ""
    return f"{v.name} : {v.type}{initial};" + (f" (* {v.comment} *)" if v.comment else "")


def interface(u: Unit) -> Iterator[str]:
    """Inputs, outputs and variables."""
    for word, group in (("VAR_INPUT", u.inputs), ("VAR_OUTPUT", u.outputs), ("VAR", u.variables)):
        if group:
            yield f"    {word}"
            for v in group:
                yield f"        {declaration(v)}"
            yield "    END_VAR"


def unit(u: Unit) -> Iterator[str]:
    """A function or the function block."""
    yield from comment(u.comment)
    yield f"FUNCTION {u.name} : {u.result}" if u.result else f"FUNCTION_BLOCK {u.name}"
    yield from interface(u)
    for line in u.body:
        yield f"    {line}" if line else ""
    yield "END_FUNCTION" if u.result else "END_FUNCTION_BLOCK"


def settings(block: Block, text: str) -> dict[str, Any]:
    """What the settings file says: crane, controller, cycle, checksum, and every setting by its path."""
    return {
        "crane": block.crane,
        "controller": block.controller,
        "function_block": block.block.name,
        "mode": block.code,
        "t_cycle": block.t_cycle,
        "sha256": checksum(text),
        "settings": {path: value for path, value, _ in block.settings},
    }
