"""Acceptance criteria as data: what must be shown, the limit and its source. `stillhook.validate.criteria.judge`
applies them to the measures."""

from __future__ import annotations

import functools
import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from enum import StrEnum
from importlib.resources import files
from pathlib import Path
from typing import Any

from stillhook.base.nearest import nearest
from stillhook.errors import StillhookError, ValidateError
from stillhook.formats.toml_fields import Fields
from stillhook.library.toml.kinds import FileKind
from stillhook.library.toml.tree import parsed, toml_text
from stillhook.units import quote
from stillhook.validate.criteria.names import MEASURES, SETTINGS
from stillhook.validate.criteria.results import StepNumber

TOP = ("base", "name", "version", "source", "drop", "settings", "criterion")
OURS = "ours"


class Limit(StrEnum):
    """Kind of a limit; "within" is a tolerance about zero."""

    AT_LEAST = "at least"
    AT_MOST = "at most"
    WITHIN = "within"


class Requirement(StrEnum):
    """Verdict that a line requires. SHOWN: the data must show that the limit is met; NOT_REFUTED: they must not refute
    it, for a limit that data can refute but hardly prove; then "not shown" stands in the way only where the estimate
    itself misses the limit.
    """

    SHOWN = "shown"
    NOT_REFUTED = "not refuted"


_LIMITS = {kind.replace(" ", "_"): kind for kind in Limit}
ROW = ("key", "step", "title", "measure", *_LIMITS, "ask", "judged", "needed", "source", "reason")
BEFORE = "by"
"""Field of criteria files until criteria set version 1: which part of the interval counted."""


@dataclass(frozen=True)
class Criterion:
    """One criterion. measure: name of the measure that it judges; kind of limit; limit in SI; quantity of the measure;
    written: the limit as the file has it ("5 cm"); ask: verdict that the line requires; judged: counts for the verdict;
    needed: missing data count as a failure; source and reason of the limit."""

    key: str
    step: StepNumber
    title: str
    measure: str
    kind: Limit
    limit: float
    quantity: str
    written: str
    ask: Requirement = Requirement.SHOWN
    judged: bool = True
    needed: bool = True
    source: str = ""
    reason: str = ""

    @property
    def limit_text(self) -> str:
        """The limit in words: "at most 5 cm"."""
        return f"{self.kind.value} {'+-' if self.kind is Limit.WITHIN else ''}{self.written}"


@dataclass(frozen=True)
class Criteria:
    """A set of criteria with a version; settings: numbers that steps compute their measures with, such as the window
    [SI]; changes: differences from the base set, one line each."""

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


@functools.cache
def criteria_sets() -> tuple[str, ...]:
    """Names of the sets included in Stillhook."""
    entries = (files("stillhook.validate.criteria") / "criteria_sets").iterdir()
    return tuple(sorted(e.name.removesuffix(".toml") for e in entries if e.name.endswith(".toml")))


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
        ask = "shown"                 # default; "not refuted": a limit that data can refute but hardly prove
        judged = true                 # false: for information
        needed = true                 # false: does not count where there are no data

    Errors: ValidateError (SpecError where it is no TOML) of one line that names file, row, value and what is
    allowed.
    """
    name = str(name_or_path)
    if name in criteria_sets():
        text = (files("stillhook.validate.criteria") / "criteria_sets" / f"{name}.toml").read_text(encoding="utf-8")
        return _read(text, f"{name}.toml", name)
    if not name.endswith(".toml"):
        have = ", ".join(criteria_sets())
        raise ValidateError(
            f"Unknown criteria {quote(name)}. Choose {have}{nearest(name, criteria_sets())} The name of a"
            " file ends in .toml."
        )
    path = Path(name_or_path)
    return _read(toml_text(path), path.name, path.stem)


def _read(text: str, label: str, stem: str) -> Criteria:
    data = parsed(text, label, FileKind.CRITERIA)
    try:
        return _criteria(data, label, stem)
    except StillhookError as e:
        message = str(e)
        raise type(e)(message if message.startswith(label) else f"{label}: {message}") from None


def _criteria(data: Mapping[str, Any], label: str, stem: str) -> Criteria:
    top = Fields(data, "", ValidateError)
    top.refuse_unknown(TOP)
    top.need("version")
    base = _base(top)
    rows = {c.key: c for c in base.criteria} if base else {}
    drop = _drop(top, rows)
    tables = data.get("criterion", [])
    if not isinstance(tables, list) or not (tables or base):
        raise ValidateError("criterion: write one [[criterion]] table for each row.")
    seen: set[str] = set()
    for i, row in enumerate(tables):
        key = Fields(row, f"criterion {i + 1}: ", ValidateError).text("key")
        if key in seen or key in drop:
            raise ValidateError(
                f"criterion {quote(key)}: {'comes twice' if key in seen else 'is dropped as well'}. Write it once."
            )
        seen.add(key)
        rows[key] = _row(Fields(row, f'criterion "{key}": ', ValidateError), rows.get(key), label)
    settings = _settings(top, base)
    kept = tuple(c for c in rows.values() if c.key not in drop)
    if not any(c.judged for c in kept):
        raise ValidateError(
            "criterion: no row is judged, so every validation would pass. Keep at least one judged row."
        )
    name = top.text("name", stem)
    source = top.text("source", f"{label}, on {base.label}" if base else label)
    changes = _changes(base, kept, settings) if base else ()
    return _digested(Criteria(name, top.text("version"), source, kept, settings, changes))


def _base(top: Fields) -> Criteria | None:
    if "base" not in top:
        return None
    name = top.text("base")
    if name not in criteria_sets():
        raise top.wrong("base", f"Stillhook has {', '.join(criteria_sets())}{nearest(name, criteria_sets())}")
    return load_criteria(name)


def _drop(top: Fields, rows: Mapping[str, Criterion]) -> tuple[str, ...]:
    drop = top.table.get("drop", [])
    if not isinstance(drop, list) or not all(isinstance(x, str) for x in drop):
        raise top.wrong("drop", "give a list of keys.")
    for key in drop:
        if key not in rows:
            raise ValidateError(f"drop: the base has no criterion {quote(key)}{nearest(key, rows)}")
    return tuple(drop)


def _settings(top: Fields, base: Criteria | None) -> dict[str, float]:
    table = Fields(top.table.get("settings", {}), "settings: ", ValidateError)
    table.refuse_unknown(tuple(SETTINGS))
    out = dict(base.settings) if base else {}
    for name in table.table:
        out[name] = table.figure(name, SETTINGS[name].quantity)[0]
        if not out[name] > 0.0:
            raise table.wrong(name, "must be more than zero.")
    for name in SETTINGS:
        if name not in out:
            raise ValidateError(
                f"settings: {name}: missing ({SETTINGS[name].meaning}). State it, or start the file with base ="
                ' "paper-f".'
            )
    return {name: out[name] for name in SETTINGS}


def _row(row: Fields, old: Criterion | None, label: str) -> Criterion:
    """A row of the file applied to the base row with the same key."""
    if BEFORE in row:
        raise ValidateError(
            f"{row.place}{BEFORE} is no longer a field: the complete 95 % interval decides. Leave it out, or write "
            'ask = "not refuted" where it was "any".'
        )
    row.refuse_unknown(ROW)
    if old is None:
        row.need("step", "title", "measure")
    measure = row.text("measure", old.measure if old else None)
    if measure not in MEASURES:
        raise row.wrong("measure", f"no such measure{nearest(measure, MEASURES)} Known: {', '.join(MEASURES)}.")
    kinds = [k for k in _LIMITS if k in row]
    if len(kinds) > 1 or (not kinds and (old is None or measure != old.measure)):
        raise ValidateError(f"{row.place}state exactly one of {', '.join(_LIMITS)}.")
    known = MEASURES[measure]
    step = row.table.get("step", int(known.step))
    if isinstance(step, bool) or step != int(known.step):
        raise row.wrong("step", f"{measure} belongs to step {int(known.step)}.")
    ask = row.text("ask", old.ask.value if old else Requirement.SHOWN.value)
    if ask not in list(Requirement):
        raise row.wrong("ask", f"not one of {', '.join(Requirement)}.")
    if kinds:
        kind, (limit, written) = Limit(_LIMITS[kinds[0]]), row.figure(kinds[0], known.quantity)
        if kind is Limit.WITHIN and limit < 0.0:
            raise row.wrong(kinds[0], "a tolerance about zero cannot be negative. State a positive value.")
    else:
        assert old is not None
        kind, limit, written = old.kind, old.limit, old.written
    new = Criterion(
        key=row.text("key"),
        step=known.step,
        title=row.text("title", old.title if old else None),
        measure=measure,
        kind=kind,
        limit=limit,
        quantity=known.quantity,
        written=written,
        ask=Requirement(ask),
        judged=row.flag("judged", old.judged if old else True),
        needed=row.flag("needed", old.needed if old else True),
        source=row.text("source", old.source if old else f"given in {label}"),
    )
    source, reason = _source_and_reason(row, new, old, label)
    return replace(new, source=source, reason=reason)


def _source_and_reason(row: Fields, new: Criterion, old: Criterion | None, label: str) -> tuple[str, str]:
    """Source and reason: a changed row does not keep the source of its base."""
    reason = row.text("reason", " ").strip()
    if new.source == OURS and not (reason or (old and old.reason)):
        raise ValidateError(f'{row.place}reason: missing. A criterion with source = "{OURS}" must state its reason.')
    if old is None or "source" in row:
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
    return (
        f"{c.measure} {c.limit_text}, to be"
        f" {c.ask.value}{'' if c.judged else ', for information'}{'' if c.needed else ', not needed'}"
    )


def _digested(criteria: Criteria) -> Criteria:
    content = {k: v for k, v in criteria.to_dict().items() if k != "digest"}
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return replace(criteria, digest=hashlib.sha256(text.encode()).hexdigest())
