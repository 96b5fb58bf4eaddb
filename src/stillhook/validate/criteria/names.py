"""Names of the measures that the steps compute and criteria judge, and of the settings that a set of criteria passes to
the steps: `measures.toml`."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files

from stillhook.validate.criteria.results import StepNumber


@dataclass(frozen=True)
class Named:
    """A measure or setting: meaning in words; quantity a key of `stillhook.units.KINDS`, "" for a pure number."""

    meaning: str
    quantity: str = ""


@dataclass(frozen=True, kw_only=True)
class NamedMeasure(Named):
    """step that computes it; signals: logged signals that it depends on, and so judges; kinds of tests that it covers
    where it covers several at once, () all."""

    step: StepNumber
    signals: Sequence[str] = ()
    kinds: Sequence[str] = ()


_TABLE = tomllib.loads((files("stillhook.validate.criteria") / "measures.toml").read_text(encoding="utf-8"))

SETTINGS: Mapping[str, Named] = {name: Named(**row) for name, row in _TABLE.pop("settings").items()}
"""Settings that the steps compute their measures with. Every set of criteria states all of them."""

MEASURES: Mapping[str, NamedMeasure] = {
    name: NamedMeasure(step=StepNumber[step.upper()], **row)
    for step, rows in _TABLE.items()
    for name, row in rows.items()
}
"""Every measure that a criterion may name."""
