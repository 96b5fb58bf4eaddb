"""States as bytes that can be trusted: a format with its version, what it belongs to, its length, a checksum.

Layout: a line "stillhook KIND VERSION", a line of JSON, numbers as little-endian doubles, the SHA-256 of all before.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import SimulationError

DIGEST = 32
"""Bytes of a SHA-256."""


def seal(kind: str, version: int, head: Mapping[str, Any], numbers: Sequence[FloatArray]) -> bytes:
    """Head and numbers as bytes."""
    flat = np.concatenate([np.ravel(a) for a in numbers]) if numbers else np.empty(0)
    line = json.dumps({**head, "numbers": len(flat)}).encode()
    body = f"stillhook {kind} {version}\n".encode() + line + b"\n" + flat.astype("<f8").tobytes()
    return body + hashlib.sha256(body).digest()


def unseal(kind: str, version: int, data: bytes, label: str) -> tuple[dict[str, Any], FloatArray]:
    """Head and numbers of what `seal` gave. Errors: SimulationError, one line that begins with label, for what is no
    such state, of another version of the format, not complete or damaged."""
    name = f"stillhook {kind} ".encode()
    first, _, rest = data.partition(b"\n")
    if not first.startswith(name):
        raise SimulationError(f"{label}: not a saved {kind}. Give what save returned or wrote.")
    if first != name + str(version).encode():
        raise SimulationError(
            f"{label}: {printable(first)} is another format than {version}, which this version of Stillhook reads."
            " Save it again with this version."
        )
    if len(data) < DIGEST or hashlib.sha256(data[:-DIGEST]).digest() != data[-DIGEST:]:
        raise SimulationError(
            f"{label}: damaged or not complete: its checksum is not that of its bytes. Save it again."
        )
    line, _, body = rest[:-DIGEST].partition(b"\n")
    try:
        head = json.loads(line)
        count = head["numbers"]
    except (ValueError, KeyError, TypeError, RecursionError):
        raise SimulationError(
            f"{label}: damaged: its head is no JSON with a count of numbers. Save it again."
        ) from None
    if type(count) is not int or len(body) != 8 * count:
        raise SimulationError(
            f"{label}: damaged: {len(body)} bytes of numbers, not {printable(count)} times 8. Save it again."
        )
    return head, np.frombuffer(body, dtype="<f8").astype(np.float64)


def bytes_of(state: bytes | str | Path) -> tuple[bytes, str]:
    """A state given as bytes or as the path of its file, and what messages call it. Errors: SimulationError where the
    file cannot be read."""
    if isinstance(state, bytes | bytearray | memoryview):
        return bytes(state), "saved state"
    try:
        return Path(state).read_bytes(), str(state)
    except (OSError, ValueError, TypeError) as problem:
        reason = getattr(problem, "strerror", None) or problem
        raise SimulationError(f"{state}: {reason}. Give bytes of Session.save, or a file that it wrote.") from None


def printable(value: object) -> str:
    """A value out of a damaged state, short and on one line."""
    text = value.decode("ascii", "replace") if isinstance(value, bytes) else repr(value)
    text = "".join(c if c.isprintable() else "?" for c in text)
    return text if len(text) <= 40 else f"{text[:37]}..."
