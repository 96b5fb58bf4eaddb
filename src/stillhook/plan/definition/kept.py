"""Answers about a crane that take seconds to work out, kept in the cache folder under everything that they follow
from."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import json
from collections.abc import Callable
from pathlib import Path

from stillhook.base.atomic import atomic_file
from stillhook.errors import StillhookError
from stillhook.kernels.build import results_hash
from stillhook.kernels.cache import cache_root
from stillhook.spec.crane import Crane, content

PACKAGE = Path(__file__).resolve().parents[2]
ROOMS = ("analysis", "plan/definition")
"""Rooms whose code makes such answers, on top of what every run follows from."""


@functools.cache
def code() -> str:
    """Hash of all code that an answer follows from."""
    digest = hashlib.sha256(results_hash().encode())
    for path in (path for room in ROOMS for path in sorted((PACKAGE / room).rglob("*.py"))):
        digest.update(path.relative_to(PACKAGE).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def kept(
    crane: Crane, question: tuple[float | str, ...], work_out: Callable[[], tuple[float, str]]
) -> tuple[float, str]:
    """The answer to a question about a crane, a number and its basis in words; worked out where it is not kept. A
    damaged file, or a folder that cannot be written to, costs the time again and nothing else."""
    text = json.dumps([code(), content(crane), question])
    file = cache_root() / "capacities" / f"{hashlib.sha256(text.encode()).hexdigest()[:32]}.json"
    with contextlib.suppress(OSError, ValueError, TypeError):
        value, basis = json.loads(file.read_text(encoding="utf-8"))
        return float(value), str(basis)
    answer = work_out()
    with contextlib.suppress(StillhookError, OSError), atomic_file(file) as part:
        part.write_text(json.dumps(answer), encoding="utf-8")
    return answer
