"""A certificate's file, as far as a crane needs it: complete and unchanged, in short form. In full:
`stillhook.validate`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from stillhook.base.gateway.guard import reader
from stillhook.base.kept.sealed import SIGNATURE, read_sealed
from stillhook.errors import ValidateError
from stillhook.spec.validity import Certified
from stillhook.units import KINDS

FORMAT = "stillhook certificate 4"
"""What a certificate's file begins to say; the number changes with the meaning of its contents."""
_GIVE = "Give the certificate.json that stillhook validate wrote, or validate again."
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


@reader(ValidateError)
def read_certificate(path: Path) -> dict[str, Any]:
    """Contents of a certificate's file, if it is complete and unchanged. Errors: ValidateError of one line."""
    data = read_sealed(path, FORMAT, "a certificate", _GIVE, ValidateError)
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
            sub_models=data["twin"].get("sub_models", {}),
            signature=data.get(SIGNATURE),
        )
    except (KeyError, TypeError, ValueError, AttributeError, ValidationError) as problem:
        reason = " ".join(str(problem).split())[:120]
        raise ValidateError(f"{label}: not a complete certificate ({reason}). Validate again.") from None
