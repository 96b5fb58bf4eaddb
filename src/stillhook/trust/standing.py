"""How a signature stands with the keys that a user trusts, in one closed set of answers and one place of words."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date
from enum import StrEnum
from typing import Any

from stillhook.trust.signature import Signature, Signed
from stillhook.trust.trust_list import TrustList

SHORT = 16
"""Digits of a key's id in a sentence."""


class Standing(StrEnum):
    """Every answer. Only `TRUSTED` is credited; `ASSUMED` is what a user's own plan states without any signature, and
    counts as SYNTHETIC."""

    TRUSTED = "signed and trusted"
    UNSIGNED = "unsigned"
    UNKNOWN = "unknown key"
    REVOKED = "revoked"
    EXPIRED = "expired"
    NOT_YET = "not yet valid"
    ALTERED = "signature does not fit"
    ASSUMED = "assumed"


_SENTENCES = {
    Standing.TRUSTED: "signed by {by}, trusted by {list}",
    Standing.UNSIGNED: "unsigned, so that its origin is unknown",
    Standing.UNKNOWN: "signed by a key that is not trusted: {key}, with the unverified name {name}",
    Standing.REVOKED: "signed by {by}, which was revoked on {day}{reason}",
    Standing.EXPIRED: "signed by {by}, which was trusted until {day}",
    Standing.NOT_YET: "signed by {by}, which is trusted from {day} on",
    Standing.ALTERED: "changed since it was signed, or with a signature of something else: the signature does not fit",
    Standing.ASSUMED: "assumed by the plan and not signed",
}
_STEPS = {
    Standing.UNSIGNED: "let whoever validated sign it: stillhook certificate sign FILE",
    Standing.UNKNOWN: "trust the key after its owner has confirmed the id: stillhook certificate key trust PUBLIC.pem",
    Standing.REVOKED: "get it signed with another key",
    Standing.EXPIRED: "get it signed with another key, or trust this one for longer (--until)",
    Standing.NOT_YET: "check the clock of this machine and the day in the trust list",
    Standing.ALTERED: "get the file from its signer again",
}


@dataclass(frozen=True)
class Judgement:
    """standing; name: of the signer, by the trust list where that has the key, else as he calls himself; key: id; day:
    of revocation, end or begin; reason of the revocation; trust_list: whose list says so."""

    standing: Standing
    name: str = ""
    key: str = ""
    day: date | None = None
    reason: str = ""
    trust_list: str = ""

    @property
    def trusted(self) -> bool:
        """Whether a trusted key vouches for the contents."""
        return self.standing is Standing.TRUSTED

    @property
    def sentence(self) -> str:
        """The answer as the end of a sentence whose subject is the thing that is signed."""
        short = f"key {self.key[:SHORT]}"
        reason = f" ({self.reason})" if self.reason else ""
        return _SENTENCES[self.standing].format(
            by=f"{self.name} ({short})",
            key=short,
            name=f'"{self.name}"',
            day=self.day,
            reason=reason,
            list=self.trust_list,
        )

    @property
    def lines(self) -> tuple[str, ...]:
        """The same of a certificate in whole sentences: how it stands, and what to do or what a signature means."""
        step = _STEPS.get(self.standing)
        done = MEANING if step is None else f"It is not credited. To change that, {step}."
        return f"Signature: {self.sentence}.", done

    def to_dict(self) -> dict[str, Any]:
        """As plain data for JSON."""
        return {
            "standing": self.standing.value,
            "trusted": self.trusted,
            "signer": self.name or None,
            "key": self.key or None,
            "trust_list": self.trust_list or None,
            "statement": self.sentence,
        }


MEANING = (
    "A signature shows whose key signed, and that nothing has changed since. It does not show that the logs are what"
    " they are said to be: whoever must know recomputes from logs of a source of his own."
)
"""Printed wherever credit rests on a certificate."""
UNSIGNED = Judgement(Standing.UNSIGNED)
ASSUMED = Judgement(Standing.ASSUMED)


def judge(signature: Signature | None, kind: Signed, digest: str, trust: TrustList) -> Judgement:
    """How the signature of contents (kind, SHA-256) stands with a trust list on the day of its clock. Whether it fits
    comes first; a revoked key is trusted on no day, before its revocation neither."""
    if signature is None:
        return UNSIGNED
    key, of = signature.key, trust.entry(signature.key)
    name = signature.name if of is None else of.name
    if not signature.fits(kind, digest):
        return Judgement(Standing.ALTERED, name, key.id, trust_list=trust.label)
    if of is None:
        return Judgement(Standing.UNKNOWN, name, key.id, trust_list=trust.label)
    today = trust.clock()
    if of.revoked is not None:
        return Judgement(Standing.REVOKED, name, key.id, of.revoked, of.reason, trust_list=trust.label)
    if of.valid_from is not None and today < of.valid_from:
        return Judgement(Standing.NOT_YET, name, key.id, of.valid_from, trust_list=trust.label)
    if of.valid_until is not None and today > of.valid_until:
        return Judgement(Standing.EXPIRED, name, key.id, of.valid_until, trust_list=trust.label)
    return Judgement(Standing.TRUSTED, name, key.id, trust_list=trust.label)
