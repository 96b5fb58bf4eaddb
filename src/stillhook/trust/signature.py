"""A signature: who signed what kind of thing, of which contents.

What is signed has neither clock nor random numbers, so that signing twice gives the same bytes; the kind is part of it,
so that a signature of one kind is none of another.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from stillhook.trust.keys import ID, LONGEST, PublicKey, SigningKey

FORM = "stillhook signature 1"
"""First words of what is signed; the number changes with its meaning."""


class Signed(StrEnum):
    """What a signature is of."""

    CERTIFICATE = "certificate"
    MANIFEST = "manifest"
    CONDITION = "condition"


@dataclass(frozen=True)
class Signature:
    """name: what the signer calls himself, which is signed as well; public: the key's 32 bytes, value: the signature's
    64, as hexadecimal digits."""

    name: str
    public: str
    value: str

    @property
    def key(self) -> PublicKey:
        """The key that it says it is of."""
        return PublicKey(self.public, self.name)

    def fits(self, kind: Signed, digest: str) -> bool:
        """Whether the key signed contents of this kind and digest. It says nothing about whose key that is."""
        return self.key.fits(self.value, message(kind, digest, self.key))

    def to_dict(self) -> dict[str, str]:
        """For a file; the key's id is for readers, and derived."""
        return {"signer": self.name, "key": self.key.id, "public": self.public, "ed25519": self.value}


def sign(kind: Signed, digest: str, key: SigningKey) -> Signature:
    """The signature of contents: kind, and the SHA-256 of their canonical text."""
    return Signature(key.name, key.public.raw, key.sign(message(kind, digest, key.public)))


def message(kind: Signed, digest: str, key: PublicKey) -> bytes:
    """What is signed."""
    return json.dumps([FORM, kind.value, digest, key.raw, key.name]).encode()


def signature_of(data: Any) -> Signature | None:
    """The signature in a file's data; None for none. Errors: ValueError for anything else."""
    if data is None:
        return None
    lengths = {"key": ID, "public": 64, "ed25519": 128}
    if not isinstance(data, Mapping) or {*data} != {"signer", *lengths}:
        raise ValueError("signature: not of signer, key, public and ed25519")
    name = data["signer"]
    if not isinstance(name, str) or not name or not name.isprintable() or len(name) > LONGEST:
        raise ValueError("signature: signer is not one printable line")
    for field, length in lengths.items():
        digits = data[field]
        if not isinstance(digits, str) or len(digits) != length or not set(digits) <= set("0123456789abcdef"):
            raise ValueError(f"signature: {field} is not {length} hexadecimal digits")
    signature = Signature(name, data["public"], data["ed25519"])
    if signature.key.id != data["key"]:
        raise ValueError("signature: its key id is not that of its key")
    return signature
