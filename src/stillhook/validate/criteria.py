"""Acceptance criteria as data: what must be shown, the limit, where it is from; and how a measure is judged by them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from stillhook.validate.lines import Line, Measure, StepNumber


@dataclass(frozen=True)
class Criterion:
    """One criterion. measure: name of the measure that it judges; kind: "at least", "at most" or "within" (of zero); limit in SI;
    by: "value", "whole" (the whole 95 % interval must meet it) or "any" (it fails only if the whole interval misses it);
    judged: counts for the verdict; needed: data that cannot tell count as a no."""

    key: str
    step: StepNumber
    what: str
    measure: str
    kind: str
    limit: float
    quantity: str
    by: str
    judged: bool
    needed: bool
    source: str


@dataclass(frozen=True)
class Criteria:
    """A set of criteria with a version; settings: numbers that steps compute their measures with, such as the window [SI]."""

    name: str
    version: str
    source: str
    criteria: tuple[Criterion, ...]
    settings: dict[str, float]
    digest: str
    """Hash of the file's content."""


def load_criteria(name_or_path: str | Path) -> Criteria:
    """Criteria of the library by name ("paper-f"), or from a TOML file. Errors: ValidateError of one line."""
    raise NotImplementedError


def judge(criteria: Criteria, measures: tuple[Measure, ...], steps: tuple[StepNumber, ...]) -> tuple[Line, ...]:
    """The verdict line of every criterion that belongs to one of these steps."""
    raise NotImplementedError
