"""Acceptance criteria as data: what must be shown, the limit and its source. `stillhook.validate.criteria.judge`
applies them to the measures.

Detection limits: the smallest size of each defect that the method detects, from trials with simulated cranes.
Certificates print them.
"""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from enum import StrEnum
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from stillhook.base.choice import nearest
from stillhook.errors import ValidateError
from stillhook.library.toml.file import (
    RowTable,
    SetFile,
    TomlTable,
    base_name,
    digest_of_set,
    load_set,
    numbers_on_base,
    rows_on_base,
    set_names,
)
from stillhook.library.toml.kinds import FileKind
from stillhook.tables.table import Flag, Text
from stillhook.validate.criteria.results import MEASURES, SETTINGS, StepNumber

SETS = Path(__file__).with_name("criteria_sets")
OURS = "ours"
INFORMATION = "information"
"""Kind of a line that is not judged."""


class Limit(StrEnum):
    """Kind of a limit; "within" is a tolerance about zero."""

    AT_LEAST = "at least"
    AT_MOST = "at most"
    WITHIN = "within"


class Requirement(StrEnum):
    """Weight of a judged line. REQUIRED: the data must show that the limit is met; SUPPORTING: they must not refute it,
    for a limit that data can refute but hardly prove; then "not shown" blocks the certificate only where the
    estimate itself misses the limit.
    """

    REQUIRED = "required"
    SUPPORTING = "supporting"


_LIMITS = {kind.replace(" ", "_"): kind for kind in Limit}


@dataclass(frozen=True)
class Criterion:
    """One criterion. limit in SI; written: as the file has it ("5 cm"); ask: weight of the line where it is judged;
    judged: counts for the verdict; needed: missing data count as a failure."""

    key: str
    step: StepNumber
    title: str
    measure: str
    kind: Limit
    limit: float
    quantity: str
    written: str
    ask: Requirement = Requirement.REQUIRED
    judged: bool = True
    needed: bool = True
    source: str = ""
    reason: str = ""

    @property
    def weight(self) -> str:
        """Kind of the line in a word: required, supporting or information."""
        return self.ask.value if self.judged else INFORMATION

    @property
    def limit_text(self) -> str:
        """The limit in words: "at most 5 cm"."""
        return f"{self.kind.value} {'+-' if self.kind is Limit.WITHIN else ''}{self.written}"


@dataclass(frozen=True)
class Criteria:
    """A set of criteria with a version; settings that steps compute their measures with [SI]; changes from the base
    set, one line each."""

    name: str
    version: str
    source: str
    criteria: tuple[Criterion, ...]
    settings: Mapping[str, float]
    changes: tuple[str, ...] = ()
    digest: str = field(default="", compare=False)
    """SHA-256 of all of the above."""

    @property
    def label(self) -> str:
        """Name and version, as printed on every result judged by this set."""
        return f"{self.name} version {self.version}"

    def to_dict(self) -> dict[str, Any]:
        """The set as plain data for JSON, in SI."""
        rows = [{**asdict(c), "step": int(c.step), "kind": c.kind.value, "ask": c.ask.value} for c in self.criteria]
        return {
            "name": self.name,
            "version": self.version,
            "source": self.source,
            "settings": dict(self.settings),
            "changes": list(self.changes),
            "criteria": rows,
            "digest": self.digest,
        }


class CriterionTable(RowTable):
    """A table [[criterion]]; what it leaves out keeps its value of the base."""

    step: Annotated[int, Field(strict=True)] | None = Field(default=None, description="step of the validation")
    title: Text | None = Field(default=None, description="what is required, in words")
    measure: Text | None = Field(default=None, description="measure that it judges")
    at_least: Any = Field(default=None, description="limit, or at_most, or within (of zero)")
    at_most: Any = None
    within: Any = None
    ask: Requirement | None = Field(default=None, description="weight of the line: required or supporting")
    judged: Flag | None = Field(default=None, description="false: for information")
    needed: Flag | None = Field(default=None, description="false: does not count where there are no data")
    source: Text | None = Field(default=None, description="where the limit is from")
    reason: Text | None = Field(default=None, description="reason of the limit")


class CriteriaFile(SetFile):
    """A set of acceptance criteria."""

    settings: Mapping[str, Any] = Field(default_factory=dict, description="numbers that measures are computed with")
    criterion: tuple[CriterionTable, ...] = Field(default=(), description="one [[criterion]] table for each row")


def criteria_sets() -> tuple[str, ...]:
    """Names of the sets included in Stillhook."""
    return set_names(SETS)


def load_criteria(name_or_path: str | Path) -> Criteria:
    """Criteria of the library by name ("paper-f"), or from a TOML file::

        base = "paper-f"              # if left out, every setting and criterion must be stated
        version = "2026-11"
        drop = ["2d-correlation"]
        [settings]
        window = "20 s"
        [[criterion]]                 # changes the row with this key; fields left out keep their value
        key = "2b"
        at_most = "6 cm"              # or at_least, or within (of zero)
        source = "agreement with the owner, 3 May"
        [[criterion]]                 # a key that the base does not have adds a row
        key = "own"
        step = 5
        title = "Standard deviation of the deviation"
        measure = "e_c_pp_deviation_s"
        at_most = "2 cm"
        ask = "required"              # default; "supporting": a limit that data can refute but hardly prove
        judged = true                 # false: for information
        needed = true                 # false: does not count where there are no data

    Parameters
    ----------
    name_or_path : str or Path
        Name in the library, or path of the file.

    Returns
    -------
    Criteria
        Settings and criteria.

    Raises
    ------
    ValidateError
        One line that names file, row, value and what is allowed; SpecError where it is not TOML.
    """
    return load_set(name_or_path, SETS, "criteria", FileKind.CRITERIA, ValidateError, _criteria)


def _criteria(table: TomlTable) -> Criteria:
    file, label = table.read(CriteriaFile), table.path.name
    name = base_name(file, table, criteria_sets())
    base = None if name is None else load_criteria(name)
    rows = base.criteria if base else ()
    combined = rows_on_base(file, table, "criterion", file.criterion, rows, functools.partial(_row, label=label))
    allowed_settings = {n: (setting.quantity, setting.meaning) for n, setting in SETTINGS.items()}
    settings = numbers_on_base(
        table, "settings", file.settings, allowed_settings, base.settings if base else {}, example="paper-f"
    )
    if not any(c.judged for c in combined):
        raise ValidateError(
            "criterion: no row is judged, so every validation would pass. Keep at least one judged row."
        )
    source = file.source or (f"{label}, on {base.label}" if base else label)
    changes = _changes(base, combined, settings) if base else ()
    criteria = Criteria(file.name or table.path.stem, file.version, source, combined, settings, changes)
    return replace(criteria, digest=digest_of_set(criteria.to_dict()))


def _row(row: CriterionTable, old: Criterion | None, table: TomlTable, *, label: str) -> Criterion:
    """A row of the file applied to the base row with the same key."""
    for key in ("step", "title", "measure") if old is None else ():
        if getattr(row, key) is None:
            raise table.missing(key)
    measure = row.measure or (old.measure if old else "")
    if measure not in MEASURES:
        raise table.wrong(f"no such measure{nearest(measure, MEASURES)} Known: {', '.join(MEASURES)}.", "measure")
    definition = MEASURES[measure]
    if row.step is not None and row.step != int(definition.step):
        raise table.wrong(f"{measure} belongs to step {int(definition.step)}.", "step")
    kind, limit, written = _limit(row, old, table, measure)
    new = Criterion(
        key=row.key,
        step=definition.step,
        title=row.title or (old.title if old else ""),
        measure=measure,
        kind=kind,
        limit=limit,
        quantity=definition.quantity,
        written=written,
        ask=row.ask or (old.ask if old else Requirement.REQUIRED),
        judged=row.judged if row.judged is not None else old is None or old.judged,
        needed=row.needed if row.needed is not None else old is None or old.needed,
        source=row.source or (old.source if old else f"given in {label}"),
    )
    source, reason = _source_and_reason(row, new, old, table, label)
    return replace(new, source=source, reason=reason)


def _limit(row: CriterionTable, old: Criterion | None, table: TomlTable, measure: str) -> tuple[Limit, float, str]:
    """Kind of the limit, the limit in SI, and as it is written."""
    stated = [key for key in _LIMITS if getattr(row, key) is not None]
    if len(stated) == 1:
        kind, (limit, written) = Limit(_LIMITS[stated[0]]), table.quantity(MEASURES[measure].quantity, stated[0])
        if kind is Limit.WITHIN and limit < 0.0:
            raise table.wrong("a tolerance about zero cannot be negative. State a positive value.", stated[0])
        return kind, limit, written
    if stated or old is None or measure != old.measure:
        raise table.wrong(f"state exactly one of {', '.join(_LIMITS)}.")
    return old.kind, old.limit, old.written


def _source_and_reason(
    row: CriterionTable, new: Criterion, old: Criterion | None, table: TomlTable, label: str
) -> tuple[str, str]:
    """Source and reason: a changed row does not keep the source of its base."""
    reason = (row.reason or "").strip()
    if new.source == OURS and not (reason or (old and old.reason)):
        place = table.place("reason")
        raise ValidateError(f'{place}: missing. A criterion with source = "{OURS}" must state its reason.')
    if old is None or row.source is not None:
        return new.source, reason
    if _meaning(new) == _meaning(old):
        return old.source, reason or old.reason
    return f"changed in {label}; {old.limit_text} in {old.source}", reason


def _meaning(c: Criterion) -> tuple[Any, ...]:
    return c.measure, c.kind, c.limit, c.ask, c.judged, c.needed


def _changes(base: Criteria, kept: tuple[Criterion, ...], settings: Mapping[str, float]) -> tuple[str, ...]:
    """Differences of a set from its base."""
    old, new = {c.key: c for c in base.criteria}, {c.key: c for c in kept}
    changes = [
        f"setting {n}: {settings[n]:g} in place of {base.settings[n]:g} (SI)"
        for n in settings
        if settings[n] != base.settings[n]
    ]
    changes += [f"{c.key} ({c.title}, {c.limit_text}) dropped" for key, c in old.items() if key not in new]
    changes += [f"{c.key} ({c.title}, {c.limit_text}) added" for key, c in new.items() if key not in old]
    for key, c in new.items():
        if key in old and _meaning(c) != _meaning(old[key]):
            changes.append(f"{c.key}: {_terms(c)} in place of {_terms(old[key])}")
    return tuple(changes)


def _terms(c: Criterion) -> str:
    return f"{c.measure} {c.limit_text}, {c.weight}{'' if c.needed else ', not needed'}"


LIMITS_FILE = Path(str(files("stillhook.validate.criteria") / "detection_limits.toml"))
"""Written by trials/defects/detection_limits.py from its outcomes.json."""
NONE = "This version contains no trials with known defects: the detection limits are not known."


@dataclass(frozen=True)
class DetectionLimit:
    """A defect of one sign. smallest: size at which every campaign with it was refused or named [SI], None where not
    even the largest was; largest that was tried; texts: the defect in words at these sizes; campaigns that were
    tried."""

    defect: str
    smallest: float | None
    largest: float
    smallest_text: str
    largest_text: str
    campaigns: int


@dataclass(frozen=True)
class DetectionLimits:
    """All defects tested; code, date of the newest campaign; campaigns of healthy cranes, and how many were refused."""

    code: str
    date: str
    healthy: int
    refused: int
    limits: tuple[DetectionLimit, ...]

    def sentences(self) -> Iterator[str]:
        """Text of the certificate."""
        if not self.limits:
            yield NONE
            return
        when = ", ".join(filter(None, (self.date, f"code {self.code}")))
        yield (
            f"Tried on simulated cranes with one defect each ({when}). Of {self.healthy} such cranes without a defect"
            f" {self.refused} were refused. A real crane differs in more than these cranes do: its limits may be"
            " larger."
        )
        for x in self.limits:
            if x.smallest is not None:
                yield f"Detected at this size and above, in all {x.campaigns} campaigns: {x.smallest_text}."
        for x in self.limits:
            if x.smallest is None:
                yield f"Not detected: {x.largest_text} (the largest size tried)."

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON, sizes in SI."""
        return {**asdict(self), "limits": [asdict(limit) for limit in self.limits]}


@functools.cache
def detection_limits() -> DetectionLimits:
    """The table of this version."""
    data = tomllib.loads(LIMITS_FILE.read_text(encoding="utf-8"))
    rows = (DetectionLimit(**{"smallest": None} | row) for row in data.get("limit", []))
    return DetectionLimits(data["code"], data["date"], data["healthy"], data["refused"], tuple(rows))
