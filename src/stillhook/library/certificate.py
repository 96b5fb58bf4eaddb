"""A certificate's file, as far as a crane needs it: complete and unchanged, in short form. In full:
`stillhook.validate`."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from stillhook.errors import ValidateError
from stillhook.spec.validity import Certified
from stillhook.units import KINDS, quote

FORMAT = "stillhook certificate 4"
"""What a certificate's file begins to say; the number changes with the meaning of its contents."""
LARGEST = 50_000_000
"""Bytes; a certificate has some hundred kB."""
DIGITS = 10
"""Significant digits of a number in a certificate."""
_GIVE = "Give the certificate.json that stillhook validate wrote."
_LOG = {"test": str, "file": str, "sha256": str}
_CELLS = {"key": str, "title": str, "value": str, "limit": str, "verdict": str}
_LINE = {"key": str, "verdict": str, "message": str, "failed": bool, "cells": _CELLS}
_DECIDES = {"verdict": str, "key": str, "text": str}
_ANNEX = (dict, type(None))
_TWIN = {"statement": str, "version": str, "code": str, "method": str, "level": int, "variant": int, "libraries": {}}
_REQUIRED: dict[str, Any] = {
    "title": str,
    "date": str,
    "verdict": str,
    "outcome": str,
    "synthetic": bool,
    "passed": bool,
    "twin": _TWIN,
    "campaign": {"file": str, "sha256": str, "logs": [_LOG]},
    "crane": {"name": str, "title": str, "content": {}, "toml": str},
    "criteria": {"name": str, "version": str, "digest": str},
    "lines": [_LINE],
    "decisive": [_DECIDES],
    "risks": str,
    "data": [{"duration": float | int}],
    "annex": _ANNEX,
}
"""Fields read of a certificate, by type."""
_KINDS = {"load": "mass", "s_w": "length", "s_tip_pp": "length", "period": "time"}


def canonical(data: Mapping[str, Any]) -> str:
    """The one text of a certificate: keys in order, numbers with DIGITS digits, what is no number null."""
    return json.dumps(_rounded(data), sort_keys=True, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _rounded(x: Any) -> Any:
    if isinstance(x, Mapping):
        return {str(k): _rounded(v) for k, v in x.items()}
    if isinstance(x, list | tuple):
        return [_rounded(v) for v in x]
    if isinstance(x, float):
        return float(f"{x:.{DIGITS}g}") + 0.0 if math.isfinite(x) else None
    return x


def digest_of(data: Mapping[str, Any]) -> str:
    """SHA-256 of all contents of a certificate but the digest itself."""
    return hashlib.sha256(canonical({k: v for k, v in data.items() if k != "digest"}).encode()).hexdigest()


def read_certificate(path: Path) -> dict[str, Any]:
    """Contents of a certificate's file, if it is complete and unchanged. Errors: ValidateError of one line."""
    try:
        if path.is_file() and path.stat().st_size > LARGEST:
            raise ValidateError(
                f"{path.name}: larger than {LARGEST // 1_000_000} MB, so it is not a certificate. {_GIVE}"
            )
        data = json.loads(path.read_bytes().decode("utf-8"))
    except FileNotFoundError:
        raise ValidateError(f"{quote(str(path))}: no such file. Put the certificate back, or validate again.") from None
    except (OSError, ValueError, RecursionError) as problem:
        reason = getattr(problem, "strerror", None) or " ".join(str(problem).split())
        raise ValidateError(f"{path.name}: not a certificate ({reason}). {_GIVE}") from None
    if not isinstance(data, dict) or not str(data.get("format", "")).startswith("stillhook certificate"):
        raise ValidateError(f"{path.name}: JSON, but not a certificate. {_GIVE}")
    if data["format"] != FORMAT:
        came = f"format {quote(data['format'])}"
        raise ValidateError(f'{path.name}: {came}: this Stillhook reads "{FORMAT}". Validate again.')
    try:
        digest = digest_of(data)
    except (ValueError, RecursionError):
        digest = ""
    if data.get("digest") != digest:
        line = "was changed after it was written: its digest does not fit. Use the original, or validate again."
        raise ValidateError(f"{path.name}: {line}")
    missing = _first_missing(data, _REQUIRED)
    if missing:
        raise ValidateError(
            f"{path.name}: not a complete certificate ({missing} is missing or of another kind). Validate again."
        )
    return data


def _first_missing(x: Any, wanted: Any, place: str = "") -> str:
    """The first place at which data are not of the kind that is wanted; empty where all are."""
    if isinstance(wanted, dict):
        if not isinstance(x, dict):
            return place
        return next(
            (
                missing
                for k, w in wanted.items()
                if (missing := _first_missing(x.get(k), w, f"{place}.{k}".lstrip(".")))
            ),
            "",
        )
    if isinstance(wanted, list):
        if not isinstance(x, list):
            return place
        return next(
            (missing for i, y in enumerate(x) if (missing := _first_missing(y, wanted[0], f"{place}[{i}]"))), ""
        )
    return "" if isinstance(x, wanted) else place


def read_certified(path: Path) -> Certified:
    """A certificate in short. Errors: ValidateError of one line."""
    return certified_of(read_certificate(path), path.name)


def certified_of(data: Mapping[str, Any], label: str) -> Certified:
    """Record of a certificate in a crane; label names it in errors (ValidateError of one line)."""
    try:
        ranges = data["envelope"]
        envelope = ranges and {
            name: tuple(f"{end!r} {KINDS[kind].si}" for end in ranges[name]) for name, kind in _KINDS.items()
        } | {"modes": tuple(ranges["modes"])}
        return Certified.of(
            digest=data["digest"],
            date=data["date"],
            criteria=f"{data['criteria']['name']} version {data['criteria']['version']}",
            passed=data["passed"],
            synthetic=data["synthetic"],
            level=data["twin"]["level"],
            variant=data["twin"]["variant"],
            version=data["twin"]["version"],
            code=data["twin"]["code"],
            content=data["crane"]["content"],
            envelope=envelope,
        )
    except (KeyError, TypeError, ValueError, AttributeError, ValidationError) as problem:
        reason = " ".join(str(problem).split())[:120]
        raise ValidateError(f"{label}: not a complete certificate ({reason}). Validate again.") from None
