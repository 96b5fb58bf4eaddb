"""What a certificate says of a crane wherever the crane goes: for what its twin was validated, and whether that holds
for this run.

The certificate itself is a file (`stillhook.validate`); a `Crane` carries the small record below, which stays with it
in stored runs. A signature is over this record, which holds the digest of the complete certificate, so that it vouches
for both; whether its key is trusted is judged where a record is read, and is never in a file. Conditions are judged by
a box: every number alone must lie within what the tests covered.
docs/explanation/validated-envelope.md says why.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from typing import Any, NamedTuple, Self

from pydantic import Field, PrivateAttr, field_validator, model_validator

from stillhook import units as u
from stillhook.tables.table import Spec, Text
from stillhook.trust.signature import Signature, Signed, signature_of
from stillhook.trust.standing import ASSUMED, UNSIGNED, Judgement, Standing, judge
from stillhook.trust.trust_list import TrustList

CAP = 0.80
"""Largest compensation efficiency that may be credited where the twin is not validated [-]: without a verified model of
the heave compensator, simplified models are approved that are proven conservative and do not exceed 80 %. Source:
criterion of Moslatt 2020, section 2.6, which cites DNV GL (reference 46) without a clause; none was found."""
EDGE = 0.01
"""Part of an end of the envelope by which a condition may lie beyond it: load cells, encoders and motion sensors are
hardly better, and a test repeated as it was is not an extrapolation."""
SHORT = 12
"""Digits of a digest that people are shown."""


class Conditions(NamedTuple):
    """Conditions of a run: payload [kg]; least and most wire out with the motion [m]; largest 30 s peak-to-peak of the
    tip [m]; mean period of its motion [s] (both NaN where nothing follows the tip, as in manual mode); modes by name;
    faults that it has, in words.
    """

    load: float
    s_w_min: float
    s_w_max: float
    s_tip_pp: float
    period: float
    modes: tuple[str, ...]
    faults: tuple[str, ...] = ()


class Envelope(Spec):
    """What the tests of a validation covered, each as least and most value."""

    load: tuple[u.Mass, u.Mass] = Field(description="payload on the hook")
    s_w: tuple[u.Length, u.Length] = Field(description="wire out, with its motion")
    s_tip_pp: tuple[u.Length, u.Length] = Field(description="peak-to-peak of the tip over 30 s")
    period: tuple[u.Time, u.Time] = Field(description="period of the tip's motion")
    modes: tuple[Text, ...] = Field(description="modes of the controller")

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        for name, (lo, hi) in self.ranges().items():
            if lo > hi:
                raise ValueError(f"{name}: from {lo:g} to {hi:g}: the second is the larger one.")
        return self

    def ranges(self) -> dict[str, tuple[float, float]]:
        """Name of every range -> its ends [SI]."""
        return {"load": self.load, "s_w": self.s_w, "s_tip_pp": self.s_tip_pp, "period": self.period}

    def outside(self, conditions: Conditions) -> tuple[str, ...]:
        """Why conditions are outside, each with what was validated: "load 200 t (validated 82 t to 164 t)"; empty
        inside."""
        reasons = [
            _beyond("load", (conditions.load, conditions.load), self.load, "mass"),
            _beyond("wire out", (conditions.s_w_min, conditions.s_w_max), self.s_w, "length", 4),
            _beyond("tip motion over 30 s", (conditions.s_tip_pp, conditions.s_tip_pp), self.s_tip_pp, "length"),
            _beyond("period of the tip", (conditions.period, conditions.period), self.period, "time"),
        ]
        unknown = [m for m in dict.fromkeys(conditions.modes) if m not in self.modes]
        if unknown:
            reasons.append(f"mode {', '.join(unknown)} (validated {', '.join(self.modes)})")
        reasons += [f"{fault} (not validated)" for fault in conditions.faults]
        return tuple(text for text in reasons if text)

    def says(self) -> dict[str, str]:
        """Every range in words, by what it is of."""
        return {
            "payload on the hook": _range(self.load, "mass"),
            "wire paid out": _range(self.s_w, "length", 4),
            "crane tip, peak-to-peak over 30 s": _range(self.s_tip_pp, "length"),
            "period of the crane tip's motion": _range(self.period, "time"),
            "controller modes": ", ".join(self.modes),
        }


def _range(ends: tuple[float, float], kind: str, digits: int = 3) -> str:
    return f"{u.show(ends[0], kind, digits)} to {u.show(ends[1], kind, digits)}"


def _beyond(
    quantity: str, ends: tuple[float, float], validated: tuple[float, float], kind: str, digits: int = 3
) -> str:
    """What a run has and what was validated, where the first is not within the second."""
    (least, most), (lo, hi) = ends, validated
    if math.isnan(least) or (least >= lo - EDGE * abs(lo) and most <= hi + EDGE * abs(hi)):
        return ""
    value = u.show(least, kind, digits) if least == most else _range(ends, kind, digits)
    return f"{quantity} {value} (validated {_range(validated, kind, digits)})"


class Condition(Spec):
    """What dated campaigns say of a certified crane (`stillhook condition`). valid: for planning; date: of the last
    campaign, or of the one that showed the drift; reason: why not valid; digest: of the state's file."""

    valid: bool
    date: Text
    digest: Text
    reason: Text | None = None
    _judgement: Judgement = PrivateAttr(default=UNSIGNED)

    def __eq__(self, other: object) -> bool:
        """Equal in all that a file has; who vouches for it is not in a file."""
        return isinstance(other, Condition) and self.__dict__ == other.__dict__

    def judged(self, judgement: Judgement) -> Self:
        """The same with who vouches for the state's file."""
        condition = self.model_copy()
        condition._judgement = judgement
        return condition

    @property
    def judgement(self) -> Judgement:
        """Who vouches for the state's file; unsigned where it was not asked. It is reported, and decides nothing."""
        return self._judgement

    @property
    def statement(self) -> str:
        """In one line."""
        if self.valid:
            return f"valid for planning by the campaigns until {self.date}"
        return f"validity for planning withdrawn by the campaign of {self.date}: {self.reason}"


class Certified(Spec):
    """A certificate in short. digest: of the certificate; date: that it bears; criteria: name and version; synthetic:
    the logs were simulated, so that no crane was validated; level, variant: of the twin by Moslatt 2020 table 2.7;
    content: part of the crane -> hash of what was validated (`stillhook.spec.crane.content`); code: `results_hash` of
    the Stillhook that did it; envelope: None where not passed; condition: None where no campaign followed;
    sub_models: level of each part of the twin, nothing in certificates of version 0.11 and before; signature: as
    `stillhook.trust.signature.Signature.to_dict`, None for none."""

    digest: Text
    date: Text
    criteria: Text
    passed: bool
    synthetic: bool
    level: int
    variant: int
    version: Text
    code: Text
    content: Mapping[str, str]
    envelope: Envelope | None
    condition: Condition | None = None
    sub_models: Mapping[str, int] = {}
    signature: Mapping[str, str] | None = None
    seal: Text
    _judgement: Judgement = PrivateAttr(default=UNSIGNED)
    _file: str = PrivateAttr(default="")
    _against: tuple[str, ...] = PrivateAttr(default=())

    @field_validator("signature")
    @classmethod
    def _is_one(cls, value: Mapping[str, str] | None) -> Mapping[str, str] | None:
        signature_of(value)
        return value

    @model_validator(mode="after")
    def _sealed(self) -> Self:
        if self.seal != _seal(self):
            raise ValueError(
                "a record that was changed manually. Name the certificate itself in the crane file: certificate ="
                ' "certificate.json".'
            )
        return self

    @classmethod
    def of(cls, **fields: Any) -> Self:
        """A record with its seal; fields as they come from a file, quantities as texts."""
        bare = cls.model_construct(**fields)
        if isinstance(fields.get("envelope"), Mapping):
            bare = bare.model_copy(update={"envelope": Envelope.model_validate(fields["envelope"])})
        return cls.model_validate({**fields, "seal": _seal(bare)})

    def followed(self, condition: Condition) -> Self:
        """The record with what campaigns say since, sealed again."""
        record = self.model_copy(update={"condition": condition})
        return record.model_copy(update={"seal": _seal(record)})

    def __eq__(self, other: object) -> bool:
        """Equal in all that a file has; who vouches for it is not in a file."""
        return isinstance(other, Certified) and self.__dict__ == other.__dict__

    @property
    def statement(self) -> str:
        """What a signature is over: SHA-256 of the record without what campaigns said since, the digest of the complete
        certificate among it."""
        return _hash_of(self, {"condition"})

    def judged(self, trust: TrustList, file: str = "") -> Self:
        """The record with what a trust list says of its signature; file: of the certificate, where it was read from
        that."""
        signature: Signature | None = signature_of(self.signature)
        return self._with(_judgement=judge(signature, Signed.CERTIFICATE, self.statement, trust), _file=file)

    def assumed(self) -> Self:
        """The record as one that a plan assumes, which no signature is expected of; it is SYNTHETIC."""
        return self._with(_judgement=ASSUMED)

    def checked(self, against: tuple[str, ...]) -> Self:
        """The record with what a check of the complete certificate found against it."""
        return self._with(_against=against)

    def _with(self, **private: Any) -> Self:
        record = self.model_copy()
        for name, value in private.items():
            setattr(record, name, value)
        return record

    @property
    def judgement(self) -> Judgement:
        """Who vouches for it; unsigned where no trust list was asked."""
        return self._judgement

    @property
    def file(self) -> str:
        """The file of the complete certificate, "" where only the record is there."""
        return self._file

    @property
    def vouched(self) -> bool:
        """Whether it may count at all: a trusted key signed it, or the user's own plan assumes it."""
        return self._judgement.trusted or self._judgement.standing is Standing.ASSUMED

    @property
    def real(self) -> bool:
        """Whether it is of a crane: of measured logs, by a signer who is trusted. What nobody vouches for may as well
        be of simulated logs."""
        return self._judgement.trusted and not self.synthetic

    @property
    def mark(self) -> str:
        """Why a certificate is not of a crane: "SYNTHETIC", "UNTRUSTED", or both; "" for one that is."""
        marks = ("SYNTHETIC" if self.synthetic else "", "" if self.vouched else "UNTRUSTED")
        return " ".join(filter(None, marks))

    @property
    def variant_now(self) -> int:
        """Variant of table 2.7: 3 instead of 2 since batches of data are watched (`stillhook condition`)."""
        return 3 if self.variant == 2 and self.condition is not None else self.variant

    @property
    def short(self) -> str:
        """The digest as people are shown it."""
        return self.digest[:SHORT]

    def objections(self, content: Mapping[str, str], code: str) -> tuple[str, ...]:
        """Why it does not hold for a crane of this content on this code; empty where it holds."""
        reasons = [] if self.passed and self.envelope is not None else ["the validation was not passed"]
        if not self.vouched:
            reasons.append(f"it is {self.judgement.sentence}")
        if self.condition is not None and not self.condition.valid:
            reasons.append(self.condition.statement)
        parts = sorted(name for name in {*content, *self.content} if content.get(name) != self.content.get(name))
        if parts:
            reasons.append(f"the crane was changed since in {', '.join(parts)}")
        if code != self.code:
            reasons.append(
                f"this Stillhook computes with other code ({code}) than the validated one ({self.code}, version"
                f" {self.version})"
            )
        return (*reasons, *self._against)

    def outside(self, conditions: Conditions) -> tuple[str, ...]:
        """Why a run is outside of what was validated, a reason each; empty inside. Everything is outside where nothing
        was."""
        return self.envelope.outside(conditions) if self.envelope is not None else ("the validation was not passed",)


def _seal(record: Certified) -> str:
    return _hash_of(record, set())[:16]


def _hash_of(record: Certified, without: set[str]) -> str:
    """SHA-256 of a record without its seal, its signature, some fields, and what came later and is empty."""
    bare = {"seal", "signature"} | without | {name for name in ("condition", "sub_models") if not getattr(record, name)}
    data = record.model_dump(mode="json", exclude=bare)
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()
