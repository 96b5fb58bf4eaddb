"""Parameter sets on disk."""

from __future__ import annotations

from pathlib import Path

from stillhook.base.atomic import atomic_file
from stillhook.library.parameter_sets.sets import FrictionSet, LossSet, set_toml


def save_set(item: FrictionSet | LossSet, path: str | Path) -> Path:
    """Write a set as a file that a crane file can name; the file appears only when it is complete. Errors:
    SimulationError."""
    target = Path(path)
    text = set_toml(item)
    with atomic_file(target) as part:
        part.write_text(text, encoding="utf-8")
    return target
