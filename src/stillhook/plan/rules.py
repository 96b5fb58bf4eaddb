"""Rules that a phase must meet: named, sourced, editable. A rule says which quantity, which limit, in which phases, by which clause."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from stillhook.plan.phases import PhaseKind


class Sense(StrEnum):
    """Which side of the limit is good."""

    AT_MOST = "at-most"
    AT_LEAST = "at-least"


class Level(StrEnum):
    """Which largest value of the phase is held against the limit: the most probable one, or what 90 % of such phases stay below."""

    MPM = "mpm"
    P90 = "p90"


@dataclass(frozen=True)
class Rule:
    """One criterion.

    key: its name, as in tables and in `Phase.limits`; title in words; quantity: name of `stillhook.variables` that a `Demand` tells; limit:
    a number in SI, or the name of a capacity of the plan (`stillhook.plan.capacities`); sense; level: largest value that counts; phases it
    belongs to; standard, edition, clause: what it is from, "check against your edition" where it is recalled; note: why, or what it leaves.
    """

    key: str
    title: str
    quantity: str
    limit: float | str
    sense: Sense
    level: Level
    phases: tuple[PhaseKind, ...]
    standard: str
    edition: str = ""
    clause: str = ""
    note: str = ""


@dataclass(frozen=True)
class RuleSet:
    """Rules of a plan with where they are from. changes: what a user's file did to its base, a line each; digest of its content."""

    name: str
    version: str
    rules: tuple[Rule, ...]
    changes: tuple[str, ...] = ()
    digest: str = ""

    def of(self, kind: PhaseKind) -> Mapping[str, Rule]:
        """Rules that belong to a kind of phase, by key."""
        return {rule.key: rule for rule in self.rules if kind in rule.phases}


@dataclass(frozen=True)
class Limited:
    """A rule with its limit [SI] as it stands for one phase under one alternative; why: what the limit is of, in words."""

    rule: Rule
    limit: float
    why: str = field(default="")
