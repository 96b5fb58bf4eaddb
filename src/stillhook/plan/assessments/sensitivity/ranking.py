"""How far factors move the limits of phases, from the facts of a result alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

NAME = "sensitivity_by_phase"
"""Key of the facts of a result."""
LIMITED, ABOVE, NOT_JUDGED = "limited", "above", "not judged"
"""Of a limit: a height, none up to the highest sea, or not known."""


class Lowered(NamedTuple):
    """A limit that a factor lowers: phase, the factor and its value in words, limit as planned and with it [m]."""

    phase: str
    factor: str
    title: str
    text: str
    base: float
    Hs: float

    @property
    def by(self) -> float:
        """How much the limit falls [m]."""
        return self.base - self.Hs


def base_of(phase: Mapping[str, Any], top: float) -> float:
    """Limit of a phase as planned, up to the highest sea [m]."""
    return float(phase["Hs"]) if phase["verdict"] == LIMITED else top


def height_of(end: Mapping[str, Any], top: float) -> float | None:
    """Limit at an end of a factor, up to the highest sea [m]; None where it is not known."""
    if end["verdict"] == NOT_JUDGED:
        return None
    return top if end["verdict"] == ABOVE else float(end["Hs"])


def swing(factor: Mapping[str, Any], phase: Mapping[str, Any], top: float) -> float:
    """How far a factor moves a limit at the most [m]; 0 where no end is distinguished from the scatter of the runs."""
    heights = [height_of(end, top) for end in factor["ends"] if end["resolved"]]
    return max((abs(Hs - base_of(phase, top)) for Hs in heights if Hs is not None), default=0.0)


def ranked(phase: Mapping[str, Any], top: float) -> list[Mapping[str, Any]]:
    """Factors that move a phase's limit, the strongest first."""
    moving = [f for f in phase["factors"] if any(end["resolved"] for end in f["ends"])]
    return sorted(moving, key=lambda f: -swing(f, phase, top))


def lowered(of: Mapping[str, Any]) -> list[Lowered]:
    """Every limit that a factor lowers, the most first."""
    top = float(of["Hs_highest"])
    rows = [
        Lowered(phase["phase"], f["factor"], f["title"], end["text"], base_of(phase, top), Hs)
        for phase in of["phases"]
        for f in phase["factors"]
        for end in f["ends"]
        if end["resolved"] and (Hs := height_of(end, top)) is not None and Hs < base_of(phase, top)
    ]
    return sorted(rows, key=lambda row: -row.by)
