"""Results of a validation step: measures with intervals, verdicts line by line, and what is said of a result: a code
with its values, and the one template of each code (`notes.toml`).

Steps, names of the measures that they compute and criteria judge, and settings that a set of criteria passes to them:
`measures.toml`.
"""

from __future__ import annotations

import math
import string
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from enum import Enum, IntEnum, StrEnum
from importlib.resources import files
from typing import Any, Generic, TypeVar

import numpy as np

from stillhook.report.document import Table
from stillhook.report.formatting import percent
from stillhook.spec.crane import Crane
from stillhook.statistics.estimate import Estimate, extremes
from stillhook.units import KINDS, number, show

_SECTIONS = tomllib.loads((files("stillhook.validate.criteria") / "notes.toml").read_text(encoding="utf-8"))
NOTES: Mapping[str, str] = {code: text for section in _SECTIONS.values() for code, text in section.items()}
"""The template of every code."""


class _Format(string.Formatter):
    """Python's formats and: `pressure 3`: a quantity [SI] in its display unit to three digits; `# 3`: a number; `% 3`,
    `.2f%`: per cent; `ms`; `cm`; `|...`: magnitude; `?above|below`: word by sign; `+test|tests`: count. Of several
    values `or`: the word between them. Of a value by test: for the smallest and the largest test."""

    def format_field(self, value: Any, format_spec: str) -> str:
        kind, _, digits = format_spec.partition(" ")
        if isinstance(value, Mapping):
            numbers = {k: v.value if isinstance(v, Estimate) else v for k, v in value.items()}
            return extremes(numbers, lambda x: self.format_field(x, format_spec))
        if isinstance(value, list | tuple):
            return (f" {format_spec} " if format_spec else ", ").join(map(str, value))
        match format_spec[:1]:
            case "?":
                return format_spec[1:].split("|")[int(value <= 0.0)]
            case "|":
                return self.format_field(abs(value), format_spec[1:])
            case "+" if "|" in format_spec:
                return f"{value:g} {format_spec[1:].split('|')[value != 1]}"
        if kind == "ms":
            return f"{1e3 * value + 0.0:.0f} ms"
        if kind == "cm":
            return f"{100.0 * value:.3g} cm"
        if kind in ("#", "%"):
            return number(value, int(digits)) if kind == "#" else percent(value, int(digits))
        if kind in KINDS:
            return show(value, kind, int(digits or 4))
        if format_spec.endswith("%"):
            return f"{100.0 * value:{format_spec[:-1]}} %"
        return str(format(value, format_spec))


_FORMAT = _Format()


class Note(str):
    """A cause, a condition or a remark: code, and values [SI] that its template takes. As text, the sentence."""

    code: str
    values: Mapping[str, Any]

    def __new__(cls, code: str, /, **values: Any) -> Note:
        self = super().__new__(cls, _FORMAT.vformat(NOTES[code], (), values))
        self.code, self.values = code, values
        return self


E = TypeVar("E")

OF_SIGNAL = "signal "
"""Prefix of what a measure is of where it is of one signal."""
RISK = 0.025
"""Probability that a true value is beyond one end of a 95 % interval."""


class StepNumber(IntEnum):
    """The five verification steps of Moslatt 2020 paper F; DATA: the data set (table 2, 1a to 1d); PASSIVE: a step of
    this tool's own."""

    DATA = 0
    PARAMETERS = 1
    CONTROLLER = 2
    LIMITS = 3
    DYNAMICS = 4
    AHC = 5
    PASSIVE = 6


class Verdict(StrEnum):
    """Verdict of the data on a criterion, from the 95 % interval of its value alone.

    SHOWN: the complete interval meets the limit; REFUTED: no part of it does; NOT_SHOWN: some of it does; NOT_COVERED:
    the tests lack the data of the line, which says nothing of the crane; INFO: for comparison; NOT_JUDGED: the crane
    lacks what the line rests on. A figure without an interval (a count, a maximum) is shown or refuted by its value.
    """

    SHOWN = "shown"
    NOT_SHOWN = "not shown"
    NOT_COVERED = "not covered"
    REFUTED = "refuted"
    INFO = "for information"
    NOT_JUDGED = "not judged"


class Outcome(StrEnum):
    """Outcome of all lines together. PASSED: no line blocks; REFUTED: a line is refuted; NOT_SHOWN: none
    is, but something that must be shown is not, or is not covered by the tests; NOT_JUDGED: no line counts."""

    PASSED = "passed"
    NOT_SHOWN = "not shown"
    REFUTED = "refuted"
    NOT_JUDGED = "not judged"


@dataclass(frozen=True)
class Measure:
    """One number that a step computed from the data, in SI. quantity: a key of `stillhook.units.KINDS`, "" for a pure
    number; low, high: total 95 % interval, None where it has none; structural: its half width due to the form of a law;
    test: test or load case that it is of, "" for all; data: what it is based on; notes: such as the likely cause. value
    None: not determined by the data; `note` gives the reason. undetectable: a deviation of the size of the limit would
    not be detected: the value is stated, and not judged."""

    name: str
    value: float | None
    quantity: str = ""
    low: float | None = None
    high: float | None = None
    test: str = ""
    data: str = ""
    notes: tuple[str, ...] = ()
    structural: float = 0.0
    undetectable: bool = False

    @classmethod
    def of(
        cls,
        name: str,
        x: Estimate | float | None,
        *notes: str,
        test: str = "",
        data: str = "",
        undetectable: bool = False,
    ) -> Measure:
        """A measure of `MEASURES` from an estimate, a number, or nothing; one that is not finite counts as nothing,
        empty notes do not count."""
        e = x if isinstance(x, Estimate) else Estimate(math.nan if x is None else float(x))
        value = e.value if math.isfinite(e.value) else None
        low, high = (e.low, e.high) if math.isfinite(e.low) and math.isfinite(e.high) else (None, None)
        kept = tuple(filter(None, notes))
        return cls(name, value, MEASURES[name].quantity, low, high, test, data, kept, e.structural, undetectable)

    @property
    def note(self) -> str:
        """Its notes in one line; without any and without a value, what the table of measures says."""
        if not self.notes and self.value is None and self.name in MEASURES:
            return MEASURES[self.name].without
        return "; ".join(self.notes)

    def to_dict(self) -> dict[str, Any]:
        """The measure as plain data for JSON, in SI; causes: codes of its notes."""
        names = ("name", "value", "low", "high", "structural", "quantity", "test", "data", "note", "undetectable")
        causes = [note.code for note in self.notes if isinstance(note, Note)]
        return {**{name: getattr(self, name) for name in names}, "causes": causes}


@dataclass(frozen=True)
class CriterionResult:
    """One line of the verdict. weight: required, supporting or information; judged: whether it counts for the verdict;
    required: whether it blocks the certificate where it is not shown or not covered; message: all of it in one
    sentence; used: the farthest end of the interval (else the figure) as a part of the limit, above 1 beyond it, NaN
    where there is none; figures: how many figures with an interval were judged (one a test or load case), 0 where the
    line was judged by a value or not at all."""

    key: str
    step: StepNumber
    title: str
    verdict: Verdict
    measure: Measure | None
    limit: str
    weight: str
    judged: bool
    source: str
    message: str
    required: bool = True
    used: float = math.nan
    figures: int = 0

    @property
    def failed(self) -> bool:
        """Whether this line blocks a certificate."""
        open_ = self.verdict in (Verdict.NOT_SHOWN, Verdict.NOT_COVERED)
        return self.judged and (self.verdict is Verdict.REFUTED or (open_ and self.required))

    @property
    def consumer_risk(self) -> float | None:
        """Chance that the line is "shown" though a true figure is at or beyond the limit, at most; None for a line
        without an interval."""
        return RISK if self.judged and self.figures else None

    @property
    def producer_risk(self) -> float | None:
        """Chance that the line is "refuted" though all true figures meet the limit, at most; None for a line without an
        interval."""
        return min(1.0, self.figures * RISK) if self.judged and self.figures else None

    def to_dict(self) -> dict[str, Any]:
        """The line as plain data for JSON."""
        derived = {name: getattr(self, name) for name in ("failed", "consumer_risk", "producer_risk")}
        return {**plain(self), **derived, "measure": self.measure.to_dict() if self.measure is not None else None}


@dataclass(frozen=True)
class Step(Generic[E]):
    """Results of one step. measures go to the criteria; statements: causes and conditions that no measure holds; data:
    estimates for JSON, by name; estimates: all of them, None where the step could not be taken."""

    number: StepNumber
    measures: tuple[Measure, ...]
    statements: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    data: Mapping[str, Any] = field(default_factory=dict)
    estimates: E | None = None

    @property
    def title(self) -> str:
        return STEPS[self.number].meaning

    def measures_of(self, name: str) -> tuple[Measure, ...]:
        """The measures with a name, one per test."""
        return tuple(m for m in self.measures if m.name == name)

    def to_dict(self) -> dict[str, Any]:
        """The step as plain data for JSON, numbers in SI."""
        return {
            "step": int(self.number),
            "title": self.title,
            "measures": [m.to_dict() for m in self.measures],
            "statements": list(self.statements),
            "data": plain(self.data),
        }


def plain(x: Any) -> Any:
    """Data for JSON: fields by name, without series of samples, records and the crane; a number that is not finite is
    null."""
    if isinstance(x, Enum):
        return x.value
    if isinstance(x, float | np.floating):
        return float(x) if math.isfinite(x) else None
    if isinstance(x, Mapping):
        return {str(k): plain(v) for k, v in x.items() if _is_plain(v)}
    if is_dataclass(x):
        return {f.name: plain(v) for f in fields(x) if f.init and _is_plain(v := getattr(x, f.name))}
    if isinstance(x, tuple) and hasattr(x, "_asdict"):
        return plain(x._asdict())
    return [plain(v) for v in x if _is_plain(v)] if isinstance(x, tuple | list | frozenset) else x


def _is_plain(x: Any) -> bool:
    kinds = (str, int, float, np.floating, Mapping, tuple, list, frozenset)
    return x is None or isinstance(x, kinds) or (is_dataclass(x) and not hasattr(x, "record"))


def nothing(number: StepNumber, reason: str, *notes: str) -> Step[Any]:
    """A step that the data do not allow: its measures without a value, each with the reason."""
    names = (name for name, m in MEASURES.items() if m.step is number)
    return Step(number, tuple(Measure.of(name, None, reason) for name in names), (f"{reason}.", *notes))


@dataclass(frozen=True)
class Named:
    """A measure, setting or step: meaning in words; quantity a key of `stillhook.units.KINDS`, "" for a pure number;
    question that a step answers."""

    meaning: str
    quantity: str = ""
    question: str = ""


@dataclass(frozen=True, kw_only=True)
class NamedMeasure(Named):
    """signals: logged signals that it depends on, and so judges; kinds of tests that it covers, () all; needs: circuits
    of the crane, and own signals of its winch type, without which it has no meaning; coverage: it counts what the tests
    contain, so that it can refute nothing; without: what to log, or why there is none, where the data give no value."""

    step: StepNumber
    signals: Sequence[str] = ()
    kinds: Sequence[str] = ()
    needs: Sequence[str] = ()
    coverage: bool = False
    without: str = ""


_TABLE = tomllib.loads((files("stillhook.validate.criteria") / "measures.toml").read_text(encoding="utf-8"))

STEPS: Mapping[StepNumber, Named] = {StepNumber[n.upper()]: Named(**row) for n, row in _TABLE.pop("steps").items()}
"""Every step: its title, and the question that it answers."""

SETTINGS: Mapping[str, Named] = {name: Named(**row) for name, row in _TABLE.pop("settings").items()}
"""Settings that the steps compute their measures with. Every set of criteria states all of them."""

MEASURES: Mapping[str, NamedMeasure] = {
    name: NamedMeasure(step=StepNumber[step.upper()], **row)
    for step, rows in _TABLE.items()
    for name, row in rows.items()
}
"""Every measure that a criterion may name."""

CIRCUIT_WORDS = {
    "active": "closed circuit",
    "passive": "passive circuit",
    "omega_m": "motors on its drum (signal omega_m)",
}
"""What a measure needs in words; what is not a circuit is a signal."""


def has(crane: Crane) -> frozenset[str]:
    """Circuits of the crane, and own signals of its winch type."""
    return frozenset(crane.circuits) | {row.name for row in crane.plant.type.rows}


def lacks(crane: Crane) -> dict[str, str]:
    """Measures that have no meaning for the crane, each with the reason."""
    there, out = has(crane), {}
    for name, measure in MEASURES.items():
        missing = [CIRCUIT_WORDS.get(need, f"signal {need}") for need in measure.needs if need not in there]
        if missing:
            out[name] = f'winch type "{crane.plant.value}" has no {" and no ".join(missing)}'
    return out


def step_lacks(crane: Crane, step: StepNumber) -> str:
    """Reason why no measure of a step has a meaning for the crane; "" where one does."""
    reasons = lacks(crane)
    of_step = [name for name, measure in MEASURES.items() if measure.step is step]
    return reasons[of_step[0]] if all(name in reasons for name in of_step) else ""


def usual_criteria(crane: Crane) -> str:
    """Criteria where a campaign names none: paper F's for a closed circuit; for other drives those that have a meaning,
    with the drive's own signals."""
    return "paper-f" if "active" in crane.circuits else "any-drive"
