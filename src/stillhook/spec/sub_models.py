"""Levels of the sub-models of a winch's twin: 2 where the data of the crane verified what judges it, else 1."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from fnmatch import fnmatch
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from stillhook.spec.crane import Crane

SUB_MODELS: Mapping[str, Mapping[str, Any]] = tomllib.loads(
    Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
)
"""Sub-models by name: title, and the lines that judge each."""
VERIFIED = "shown"
"""Verdict of a line that verifies."""


def parts_of(crane: Crane) -> tuple[str, ...]:
    """The sub-models that the twin of this crane has."""
    return tuple(name for name, one in SUB_MODELS.items() if vars(crane).get(one.get("needs", "plant")) is not None)


def levels_of(crane: Crane, lines: Iterable[Mapping[str, Any]]) -> dict[str, int]:
    """The level of every sub-model, from the lines of a validation (key, verdict, judged, failed): 2 where a judged one
    was shown and none failed."""
    judged = [line for line in lines if line["judged"]]
    found = {}
    for name in parts_of(crane):
        of = [line for line in judged if any(fnmatch(line["key"], key) for key in SUB_MODELS[name]["lines"])]
        verified = any(line["verdict"] == VERIFIED for line in of) and not any(line["failed"] for line in of)
        found[name] = 2 if verified else 1
    return found


def levels_text(levels: Mapping[str, int]) -> str:
    """The levels in one line."""
    by_level = {n: [SUB_MODELS[name]["title"] for name in levels if levels[name] == n] for n in (2, 1)}
    return "; ".join(f"level {n}: {', '.join(titles)}" for n, titles in by_level.items() if titles)
