"""The numbers of a crane that campaigns follow (`followed.toml`), and a crane file that has them as followed."""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

from stillhook.library.crane_file import changed
from stillhook.library.write import items
from stillhook.spec.crane import Crane
from stillhook.statistics.estimate import Estimate
from stillhook.units import KINDS, in_display, number
from stillhook.validate.criteria.criteria import Criteria
from stillhook.validate.dynamics.model import PLACE, UNKNOWNS, scaled

DIGITS = 8
"""Significant digits of a number in a crane file."""


@dataclass(frozen=True)
class Followed:
    """A number, relative to the crane file. meaning in words; measure of `stillhook.validate` and its step; criterion:
    key of the one whose limit ends its use; calibration: half width of what no average takes away; season, scatter,
    rate [1/yr], walk [1/sqrt(yr)]: deviations before any data; paths, unknown: what is scaled in a crane file; note:
    code that the measure must carry."""

    name: str
    meaning: str
    measure: str
    step: int
    criterion: str
    calibration: float
    season: float
    scatter: float
    rate: float
    walk: tuple[float, float]
    paths: tuple[str, ...] = ()
    unknown: str = ""
    note: str = ""

    def limit(self, criteria: Criteria) -> float | None:
        """Deviation from the crane file that the criteria accept [-]; None where they have no such line."""
        return next((c.limit for c in criteria.criteria if c.key == self.criterion), None)

    def apply(self, crane: Crane, factor: float) -> Crane:
        """The crane with this number times a factor; sources as they were."""
        if self.unknown:
            crane = UNKNOWNS[PLACE[self.unknown]].bend(crane, factor)
        return scaled(crane, factor, *self.paths)


_TEXT = (files("stillhook.live.condition") / "followed.toml").read_text(encoding="utf-8")


def _followed(name: str, row: Mapping[str, Any]) -> Followed:
    fields: dict[str, Any] = {key: tuple(x) if isinstance(x, list) else x for key, x in row.items()}
    return Followed(name=name, **fields)


FOLLOWED: Mapping[str, Followed] = {name: _followed(name, row) for name, row in tomllib.loads(_TEXT).items()}
"""Every number that is followed."""
TABLE_HASH = hashlib.sha256(_TEXT.encode()).hexdigest()


def followed_crane(crane: Crane, values: Mapping[str, Estimate], evidence: str) -> Crane:
    """The crane with numbers as followed, each with its source.

    Parameters: values by name, relative to the crane's own (0: unchanged); evidence: what they rest on, in words.
    """
    bare = crane.model_copy(update={"certified": None})
    leaves: dict[str, Any] = {}
    before = {item.path: item for item in items(bare)}
    for name, x in values.items():
        of = FOLLOWED[name]
        factor = 1.0 + x.value
        source = (
            f"{of.meaning} {evidence}: {factor:.4g} times that of {crane.name}"
            f" (95 %: {1.0 + x.low:.4g} to {1.0 + x.high:.4g})"
        )
        for item in items(of.apply(bare, factor)):
            if item.path in before and item.value == before[item.path].value:
                continue
            kind = item.quantity
            text = f"{number(in_display(item.value, kind), DIGITS)} {KINDS[kind].display}" if kind else None
            leaf = {"value": text or float(f"{item.value:.{DIGITS}g}"), "kind": "fitted", "source": source}
            _place(leaves, item.path.split("."), leaf)
    return changed(bare, leaves) if leaves else bare


def _place(tree: dict[str, Any], path: list[str], leaf: Mapping[str, Any]) -> None:
    for name in path[:-1]:
        tree = tree.setdefault(name, {})
    tree[path[-1]] = leaf
