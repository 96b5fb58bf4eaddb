"""Answers about a crane that take tenths of a second and more to work out, kept in the cache folder under everything
that they follow from. Those of the library's plans come with a wheel, as residuals do
(docs/decisions/0021-what-a-wheel-holds.md)."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import json
from collections.abc import Callable
from typing import Any

from stillhook.base.kept.checked import OTHER, Kept, note, read_checked, write_checked
from stillhook.base.kept.sources import PACKAGE
from stillhook.errors import StillhookError
from stillhook.kernels.build import model_hash, results_hash
from stillhook.kernels.cache import SHIPPED, cache_root
from stillhook.spec.crane import Crane, content, rounded

ROOM = "analysis"
FOLDER = "capacities"
"""Folder of the answers, in the cache and in what a wheel is made with."""
DIGITS = 9
"""Digits of a number that count in the name of an answer of a wheel: machines round the last ones differently."""
Question = tuple[float | str, ...]


@functools.cache
def code(rooms: tuple[str, ...]) -> str:
    """Hash of the code of some rooms that an answer follows from, on top of what every run follows from."""
    return PACKAGE.hash(PACKAGE.inside(rooms, (".py",)))


def kept(
    crane: Crane, question: Question, work_out: Callable[[], tuple[float, str]], rooms: tuple[str, ...] = (ROOM,)
) -> tuple[float, str]:
    """The answer to a question about a crane, a number and its basis in words; worked out where it is not kept. A
    damaged file, which is noted, or a folder that cannot be written to, costs the time again and nothing else.

    rooms: folders of the package whose code makes the answer.
    """
    own = cache_root() / FOLDER / _name([results_hash(), code(rooms), content(crane), question])
    with_wheel = SHIPPED / FOLDER / shared_name(crane, question, rooms) if SHIPPED.exists() else None
    for file in (with_wheel, own):
        if file is not None and (stored := read_checked(file, Kept.ANSWER)) is not None:
            try:
                value, basis, _ = json.loads(stored)
                return float(value), str(basis)
            except (ValueError, TypeError):
                note(file, OTHER, Kept.ANSWER)
    value, basis = work_out()
    with contextlib.suppress(StillhookError, OSError):
        write_checked(own, json.dumps([value, basis, shared_name(crane, question, rooms)]).encode())
    return value, basis


def shared_name(crane: Crane, question: Question, rooms: tuple[str, ...] = (ROOM,)) -> str:
    """Name of an answer on all machines, with any versions of their libraries."""
    return _name([model_hash(), code(rooms), content(crane, digits=DIGITS), rounded(list(question), DIGITS)])


def _name(follows_from: list[Any]) -> str:
    return f"{hashlib.sha256(json.dumps(follows_from).encode()).hexdigest()[:32]}.json"
