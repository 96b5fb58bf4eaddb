"""What one campaign says: the numbers that are followed, by `validate`'s own steps on some of its tests, and criteria
2b and 3 of crane files on those that it holds out."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from stillhook.base.atomic import atomic_file
from stillhook.base.gateway.parse import json_file
from stillhook.base.kept.checked import OTHER, Kept, note
from stillhook.base.kept.sealed import digest_of, sealed
from stillhook.errors import LiveError, StillhookError
from stillhook.live.condition.followed import FOLLOWED, TABLE_HASH, Followed
from stillhook.spec.crane import Crane, content
from stillhook.validate.certificate.content import sha256_of, versions
from stillhook.validate.criteria.results import Measure, Note, has
from stillhook.validate.data_set.campaign import Campaign, CraneTest, Kind
from stillhook.validate.validation import Validation, validate

FORMAT = "stillhook followed campaign 1"
HELD = 3
"""One of so many tests in heave compensation is held out: the second, the fifth and so on, in the order of the file."""
JUDGED = {"2b": "e_c_pp_deviation", "3": "u_p_deviation"}
"""Criteria that crane files are compared by, with the measures behind them."""


def split(campaign: Campaign) -> tuple[Campaign, Campaign | None]:
    """The campaign without the tests that it holds out, and these alone; None where it has one test in heave
    compensation only."""
    held = {t.name for t in campaign.of(Kind.AHC)[1::HELD]}
    fit = tuple(t for t in campaign.tests if t.name not in held)
    out = tuple(t for t in campaign.tests if t.name in held)
    return replace(campaign, tests=fit), replace(campaign, tests=out) if out else None


@dataclass(frozen=True)
class Number:
    """A number of a campaign, relative to the crane file; structural: half width due to the form of a law."""

    value: float
    low: float
    high: float
    structural: float

    @property
    def half(self) -> float:
        return max(self.high - self.value, self.value - self.low)


@dataclass
class Measured:
    """One campaign. key: hash of all that its numbers follow from; numbers by name; reasons: why others are not
    there; judged: by content of a crane, criterion to value and limit on the tests that are held out."""

    campaign: Campaign
    key: str
    logs: Mapping[str, str]
    numbers: dict[str, Number] = field(default_factory=dict)
    reasons: dict[str, str] = field(default_factory=dict)
    judged: dict[str, dict[str, float]] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Name of its file of evidence."""
        return f"{self.campaign.date.isoformat()}-{self.key[:12]}.json"

    def to_dict(self) -> dict[str, Any]:
        """Its evidence as plain data."""
        fit, held = split(self.campaign)
        return {
            "format": FORMAT,
            "key": self.key,
            "title": self.campaign.title,
            "date": self.campaign.date.isoformat(),
            "file": str(self.campaign.file),
            "synthetic": self.campaign.synthetic,
            "logs": dict(self.logs),
            "fitted": [t.name for t in fit.tests],
            "held_out": [t.name for t in held.tests] if held else [],
            "numbers": {name: vars(x) for name, x in self.numbers.items()},
            "reasons": self.reasons,
            "judged": self.judged,
            "made_by": versions(),
        }


def hash_of(crane: Crane) -> str:
    """One hash of all that results of a crane follow from."""
    return hashlib.sha256(json.dumps(content(crane), sort_keys=True).encode()).hexdigest()[:16]


def log_hashes(tests: tuple[CraneTest, ...]) -> dict[str, str]:
    """SHA-256 of the log of each test. Errors: ValidateError."""
    return {t.name: sha256_of(t.log) for t in tests}


def key_of(campaign: Campaign, logs: Mapping[str, str]) -> str:
    """Hash of all that the numbers of a campaign follow from."""
    code = versions()
    parts = (sha256_of(campaign.file), hash_of(campaign.crane), dict(logs), campaign.criteria.digest, TABLE_HASH)
    text = json.dumps([*parts, code["code"], code["method"], FORMAT], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def stored(campaign: Campaign, key: str, logs: Mapping[str, str], folder: Path | None) -> Measured:
    """What is known of a campaign already; nothing where its file is absent and, with a note, where it was changed."""
    known = Measured(campaign, key, logs)
    if folder is None or not (file := folder / known.name).is_file():
        return known
    try:
        data = json_file(file, "what is known of a campaign", "", LiveError)
        if data["digest"] != digest_of(data):
            raise ValueError
        if data["format"] == FORMAT and data["key"] == key:
            known.numbers = {name: Number(**x) for name, x in data["numbers"].items()}
            known.reasons, known.judged = data["reasons"], data["judged"]
    except (StillhookError, ValueError, KeyError, TypeError, AttributeError):
        note(file, OTHER, Kept.CAMPAIGN)
    return known


def save(measured: Measured, folder: Path | None) -> None:
    """Keep what is known of a campaign. Errors: SimulationError where it cannot be written."""
    if folder is None:
        return
    with atomic_file(folder / measured.name) as part:
        part.write_text(sealed(measured.to_dict()), encoding="utf-8")


def measure(measured: Measured) -> None:
    """Take the steps of `validate` that the numbers come from, on the tests that are not held out."""
    fit, _ = split(measured.campaign)
    meaningful = [f for f in FOLLOWED.values() if not (f.name == "gas" and "passive" not in has(fit.crane))]
    steps = {f.step for f in meaningful if f.step != 4 or fit.of(Kind.DYNAMICS)}
    validation = validate(fit, steps=steps)
    for of in FOLLOWED.values():
        of_name = [m for step in validation.steps for m in step.measures if m.name == of.measure]
        number, reason = _number(of, of_name[0] if of_name else None)
        if number is not None:
            measured.numbers[of.name] = number
        else:
            measured.reasons[of.name] = reason


def _number(of: Followed, m: Measure | None) -> tuple[Number | None, str]:
    if m is None:
        return None, "the campaign has no test for it"
    if m.value is None:
        return None, m.note
    if m.low is None or m.high is None:
        return None, "no interval: too few data"
    if of.note and of.note not in [note.code for note in m.notes if isinstance(note, Note)]:
        return None, "the pressure that is held by make-up is not the charge: log V_acc"
    return Number(m.value, m.low, m.high, m.structural), ""


def judge(measured: Measured, crane: Crane) -> dict[str, float]:
    """Criteria 2b and 3 of a crane file on the tests that the campaign holds out, the worst of them; empty where there
    are none."""
    _, held = split(measured.campaign)
    key = hash_of(crane)
    if held is None:
        return {}
    if key not in measured.judged:
        bare = crane.model_copy(update={"certified": None})
        measured.judged[key] = _judged(validate(replace(held, crane=bare), steps=[2, 5]))
    return measured.judged[key]


def _judged(validation: Validation) -> dict[str, float]:
    out = {}
    for key, name in JUDGED.items():
        values = [m.value for step in validation.steps for m in step.measures if m.name == name and m.value is not None]
        if values:
            out[key] = max(values)
    return {key: x for key, x in out.items() if math.isfinite(x)}


def read(campaign: Campaign, folder: Path | None) -> Measured:
    """What a campaign says, computed where it is not known. folder: of evidence. Errors: StillhookError of one line."""
    logs = log_hashes(campaign.tests)
    known = stored(campaign, key_of(campaign, logs), logs, folder)
    if not (known.numbers or known.reasons):
        try:
            measure(known)
        except StillhookError as problem:
            raise type(problem)(f"{campaign.file}: {problem}") from None
        save(known, folder)
    return known
