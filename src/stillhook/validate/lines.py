"""What a validation step found, and what the criteria make of it: measures with intervals, and verdicts line by line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum, StrEnum
from typing import Any

from stillhook.units import KINDS, in_display, number


class StepNumber(IntEnum):
    """The five verification steps of Moslatt 2020 paper F; DATA is the data set itself (table 2, 1a to 1d)."""

    DATA = 0
    PARAMETERS = 1
    CONTROLLER = 2
    LIMITS = 3
    DYNAMICS = 4
    AHC = 5


TITLES: Mapping[StepNumber, str] = {
    StepNumber.DATA: "data set",
    StepNumber.PARAMETERS: "variables and parameters",
    StepNumber.CONTROLLER: "controller in isolation",
    StepNumber.LIMITS: "velocity limits",
    StepNumber.DYNAMICS: "winch dynamics",
    StepNumber.AHC: "active heave compensation",
}


class Verdict(StrEnum):
    """pass, fail, "not shown" (the data cannot tell: counts as a no where the criterion is needed), "told" (shown, not judged)."""

    PASS = "pass"
    FAIL = "fail"
    NOT_SHOWN = "not shown"
    TOLD = "told"


@dataclass(frozen=True)
class Measure:
    """One number that a step found in the data, in SI.

    name: key in JSON, such as "e_c_pp_deviation"; quantity a key of `stillhook.units.KINDS`, "" for a pure number (shares, counts);
    low, high: 95 % interval, None where it has none; test: name of the test or load case that it is of, "" for all; data: what it rests
    on ("4 load cases, 2140 s, 71 effective windows"); note: what else a reader must know, such as the cause it points at, one line.
    value None: the data cannot tell, and `note` says why.
    """

    name: str
    value: float | None
    quantity: str = ""
    low: float | None = None
    high: float | None = None
    test: str = ""
    data: str = ""
    note: str = ""

    def to_dict(self) -> dict[str, Any]:
        """The measure as plain data for JSON, in SI."""
        names = ("name", "value", "low", "high", "quantity", "test", "data", "note")
        return {name: getattr(self, name) for name in names}


def say(value: float | None, quantity: str, digits: int = 3) -> str:
    """An SI value as text in its display unit; a pure number as it is; a dash where there is none."""
    if value is None:
        return "-"
    if not quantity:
        return number(value, digits)
    return f"{number(in_display(value, quantity), digits)} {KINDS[quantity].display}"


@dataclass(frozen=True)
class Line:
    """One line of the verdict: a criterion, the figure that was found, the limit and the data behind it.

    judged: whether the line counts for the verdict. limit as text ("at most 5 cm"); source of the criterion ("paper F table 2", "ours").
    """

    key: str
    step: StepNumber
    what: str
    verdict: Verdict
    measure: Measure | None
    limit: str
    judged: bool
    source: str
    said: str

    @property
    def no(self) -> bool:
        """Whether this line makes the verdict a no."""
        return self.judged and self.verdict in (Verdict.FAIL, Verdict.NOT_SHOWN)

    def to_dict(self) -> dict[str, Any]:
        """The line as plain data for JSON."""
        return {
            "key": self.key, "step": int(self.step), "what": self.what, "verdict": self.verdict.value, "judged": self.judged,
            "limit": self.limit, "source": self.source, "said": self.said,
            "measure": self.measure.to_dict() if self.measure is not None else None,
        }  # fmt: skip


@dataclass(frozen=True)
class Table:
    """A table of a step for people: header (may hold line breaks), rows of texts, title."""

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Step:
    """What one step found. measures go to the criteria; statements are lines for the reader, the most important first; tables for the
    reader; data: numbers behind the figures, SI, named as in `stillhook.variables`, for JSON. A step keeps what its figures need in a
    subclass."""

    number: StepNumber
    measures: tuple[Measure, ...]
    statements: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    data: Mapping[str, Any] = field(default_factory=dict)

    @property
    def title(self) -> str:
        return TITLES[self.number]

    def found(self, name: str) -> tuple[Measure, ...]:
        """The measures of a name, one for each test."""
        return tuple(m for m in self.measures if m.name == name)

    def to_dict(self) -> dict[str, Any]:
        """The step as plain data for JSON."""
        return {
            "step": int(self.number), "title": self.title, "measures": [m.to_dict() for m in self.measures],
            "statements": list(self.statements), "data": dict(self.data),
        }  # fmt: skip


def worst(measures: Sequence[Measure]) -> Measure:
    """The measure with the largest magnitude; one without a value comes before all."""
    return max(measures, key=lambda m: float("inf") if m.value is None else abs(m.value))
