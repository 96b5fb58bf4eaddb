"""Files of JSON with a checksum over all else that they say: a change is noticed. It is not a signature; one that is
in the file as well (`stillhook.trust`) is over that checksum and more, and not part of it."""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from stillhook.base.gateway.access import read_bytes
from stillhook.base.gateway.budget import JSON
from stillhook.base.gateway.parse import from_json
from stillhook.errors import StillhookError, UnreadableError
from stillhook.units import quote

DIGEST, SIGNATURE = "digest", "signature"
"""Keys of the checksum and of a signature, which the checksum is not of."""
DIGITS, EXACT = 10, 17
"""Significant digits of a number: as a certificate has it, and to the bit."""


def canonical(data: Mapping[str, Any], digits: int = DIGITS) -> str:
    """The one text of these contents: keys in order, numbers with so many digits, what is not a number null."""
    return json.dumps(_rounded(data, digits), sort_keys=True, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _rounded(x: Any, digits: int) -> Any:
    if isinstance(x, Mapping):
        return {str(k): _rounded(v, digits) for k, v in x.items()}
    if isinstance(x, list | tuple):
        return [_rounded(v, digits) for v in x]
    if isinstance(x, float):
        return float(f"{x:.{digits}g}") + 0.0 if math.isfinite(x) else None
    return x


def digest_of(data: Mapping[str, Any], digits: int = DIGITS) -> str:
    """SHA-256 of all contents but the digest itself and a signature."""
    content = {k: v for k, v in data.items() if k not in (DIGEST, SIGNATURE)}
    return hashlib.sha256(canonical(content, digits).encode()).hexdigest()


def sealed(data: Mapping[str, Any], digits: int = DIGITS) -> str:
    """The text of these contents with their digest."""
    return canonical({**data, DIGEST: digest_of(data, digits)}, digits)


def read_sealed(
    path: Path,
    form: str,
    noun: str,
    advice: str,
    error: type[StillhookError],
    *,
    absent: str = "",
    digits: int = DIGITS,
) -> dict[str, Any]:
    """Contents of a sealed file, as `unsealed` has them; absent: more about a file that is not there."""
    if not os.path.lexists(path):
        raise error(f"{quote(str(path))}: no such file{absent}. {advice}")
    content = read_bytes(path, noun.partition(" ")[2], error, JSON)
    return unsealed(content, path.name, form, noun, advice, error, digits=digits)


def unsealed(
    content: bytes,
    label: str,
    form: str,
    noun: str,
    advice: str,
    error: type[StillhookError],
    *,
    digits: int = DIGITS,
) -> dict[str, Any]:
    """Contents of the bytes of a sealed file, unchanged; `error` of one line for any other. A file that says the same
    in another text (a key twice, more digits than were summed) counts as changed: its readers could see different
    things.

    Parameters: label: of the file, for errors; form: its "format", with a number at the end; noun: what it is, with an
    article; advice: what to do without it, a sentence.
    """
    try:
        data = from_json(written := content.decode("utf-8").replace("\r\n", "\n"))
    except (UnreadableError, UnicodeDecodeError) as problem:
        raise error(f"{label}: not {noun} ({problem}). {advice}") from None
    digest = digest_of(data, digits) if isinstance(data, dict) else ""
    came = data.get("format") if isinstance(data, dict) else None
    if not str(came).startswith(form.rpartition(" ")[0]):
        raise error(f"{label}: JSON, but not {noun}. {advice}")
    if came != form:
        raise error(f"{label}: format {quote(came)}: this Stillhook reads {quote(form)}. {advice}")
    if data.get("digest") != digest:
        raise error(f"{label}: was changed after it was written: its digest does not fit. {advice}")
    if written != canonical(data, digits):
        raise error(f"{label}: was changed after it was written: not in the one form that is written. {advice}")
    return dict(data)
