"""Ed25519 keys as PEM files: the private one as PKCS8, its owner's alone and encrypted where a passphrase is given; the
public one as SubjectPublicKeyInfo. Source: RFC 8032 (Ed25519), RFC 8410 (its PEM), RFC 7468 (text before it)."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stillhook.base.atomic import atomic_files
from stillhook.base.gateway.access import read_text
from stillhook.base.gateway.budget import KEY
from stillhook.errors import TrustError
from stillhook.trust.home import open_to_others
from stillhook.units import quote

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

PASSPHRASE = "STILLHOOK_PASSPHRASE"
"""Environment variable with the passphrase of the private key."""
ID = 32
"""Hexadecimal digits of a key's id: 128 bits of its SHA-256."""
LONGEST = 80
_NAME = re.compile(r"^Name: (.*)$", re.MULTILINE)
_NEW = "Make a key: stillhook certificate key new --name NAME."
_GIVE = "Give the public.pem that stillhook certificate key new wrote."


@dataclass(frozen=True)
class PublicKey:
    """A public key. raw: its 32 bytes as hexadecimal digits; name: what its owner calls himself, which proves
    nothing."""

    raw: str
    name: str = field(default="", compare=False)

    @property
    def id(self) -> str:
        """The digits that people compare: from the SHA-256 of its SubjectPublicKeyInfo."""
        from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat

        der = _ed25519(self.raw).public_bytes(Encoding.DER, PublicFormat.SubjectPublicKeyInfo)
        return hashlib.sha256(der).hexdigest()[:ID]

    def pem(self) -> str:
        """Its file, or its part of a trust list."""
        from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat

        text = _ed25519(self.raw).public_bytes(Encoding.PEM, PublicFormat.SubjectPublicKeyInfo).decode()
        return f"Name: {self.name}\nKey id: {self.id}\n{text}" if self.name else text

    def fits(self, value: str, message: bytes) -> bool:
        """Whether a signature (hexadecimal digits) is one of this message by this key."""
        from cryptography.exceptions import InvalidSignature

        try:
            _ed25519(self.raw).verify(bytes.fromhex(value), message)
        except (InvalidSignature, ValueError):
            return False
        return True


@dataclass(frozen=True)
class SigningKey:
    """A private key in memory, and the name that it signs by."""

    name: str
    private: Ed25519PrivateKey = field(repr=False)

    @property
    def public(self) -> PublicKey:
        """Its public key."""
        return PublicKey(self.private.public_key().public_bytes_raw().hex(), self.name)

    def sign(self, message: bytes) -> str:
        """The signature as hexadecimal digits; the same of the same message."""
        return self.private.sign(message).hex()


def _ed25519(raw: str) -> Any:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

    return Ed25519PublicKey.from_public_bytes(bytes.fromhex(raw))


def checked_name(name: str) -> str:
    """The name of a signer: one printable line. Errors: TrustError."""
    if not name.strip() or not name.isprintable() or len(name) > LONGEST:
        raise TrustError(f"Name {quote(name)}: give one printable line of at most {LONGEST} characters.")
    return name.strip()


def new_key(name: str) -> SigningKey:
    """A new key. Errors: TrustError for the name."""
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

    return SigningKey(checked_name(name), Ed25519PrivateKey.generate())


def write_key(key: SigningKey, private: Path, public: Path, passphrase: str = "") -> None:
    """Write both files, the private one readable by its owner alone. Errors: TrustError where one exists;
    SimulationError where one cannot be written."""
    from cryptography.hazmat.primitives import serialization as s

    lock: Any = s.BestAvailableEncryption(passphrase.encode()) if passphrase else s.NoEncryption()
    text = key.private.private_bytes(s.Encoding.PEM, s.PrivateFormat.PKCS8, lock).decode()
    for path in (private, public):
        if os.path.lexists(path):
            raise TrustError(
                f"{path}: exists, and a key that is lost signs nothing any more. Choose another folder with --out."
            )
    try:
        private.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as problem:
        raise TrustError(f"{private}: cannot be written ({problem.strerror}). Choose another folder.") from None
    with atomic_files(private, public, modes=(0o600, 0o644)) as (of_private, of_public):
        of_private.write_text(f"Name: {key.name}\n{text}", encoding="utf-8", newline="\n")
        of_public.write_text(key.public.pem(), encoding="utf-8", newline="\n")


def read_key(path: Path, passphrase: Callable[[], str]) -> SigningKey:
    """The private key of a file; passphrase: called where it is encrypted. Errors: TrustError, one line."""
    from cryptography.exceptions import UnsupportedAlgorithm
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
    from cryptography.hazmat.primitives.serialization import load_pem_private_key

    text = read_text(path, "private key", TrustError, KEY)
    if rights := open_to_others(path, 0o077):
        raise TrustError(f"{path}: others may read or change it (rights {rights}). Take them away: chmod 600 {path}.")
    word = passphrase().encode() if "ENCRYPTED" in text else None
    try:
        private = load_pem_private_key(text.encode(), word)
    except (ValueError, TypeError, UnsupportedAlgorithm):
        reason = (
            f"wrong passphrase in {PASSPHRASE} or typed, or damaged"
            if word is not None
            else "damaged, or of another kind"
        )
        raise TrustError(f"{path}: not a private key ({reason}). {_NEW}") from None
    if not isinstance(private, Ed25519PrivateKey):
        raise TrustError(f"{path}: a key of another algorithm than Ed25519. {_NEW}")
    return SigningKey(checked_name(_name_in(text) or path.stem), private)


def read_public(path: Path) -> PublicKey:
    """The public key of a file. Errors: TrustError, one line."""
    return public_of(read_text(path, "public key", TrustError, KEY), path.name)


def public_of(pem: str, label: str) -> PublicKey:
    """The public key of a PEM text; label: its place in errors (TrustError, one line)."""
    from cryptography.exceptions import UnsupportedAlgorithm
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
    from cryptography.hazmat.primitives.serialization import load_pem_public_key

    if "PRIVATE KEY" in pem:
        raise TrustError(f"{label}: a private key, which its owner keeps. {_GIVE}")
    try:
        public = load_pem_public_key(pem.encode())
    except (ValueError, UnsupportedAlgorithm):
        raise TrustError(f"{label}: not a public key in PEM. {_GIVE}") from None
    if not isinstance(public, Ed25519PublicKey):
        raise TrustError(f"{label}: a key of another algorithm than Ed25519. {_GIVE}")
    raw = public.public_bytes_raw()
    if _of_small_order(raw):
        raise TrustError(f"{label}: a key of small order, for which signatures need no private key. {_GIVE}")
    return PublicKey(raw.hex(), _name_in(pem))


_P = 2**255 - 19
_D = -121665 * pow(121666, -1, _P) % _P
"""Field and constant of the curve -x^2 + y^2 = 1 + d x^2 y^2: RFC 8032, section 5.1."""


def _of_small_order(raw: bytes) -> bool:
    """Whether 8 times the point is the identity, which has y = 1: of such a key one signature fits many messages, and
    needs no private key. Bytes of y that are not below the field's prime count as what they are modulo it."""
    y = int.from_bytes(raw, "little") % 2**255  # the highest bit is the sign of x, which doubling does not need
    for _ in range(3):
        yy = y * y % _P
        xx = (yy - 1) * pow(_D * yy + 1, -1, _P) % _P
        y = (yy + xx) * pow(1 - _D * xx * yy, _P - 2, _P) % _P  # the inverse, and 0 of 0, which no point has
    return y == 1


def _name_in(pem: str) -> str:
    """The name before a PEM block, "" where there is none that can be shown."""
    stated = _NAME.search(pem.partition("-----BEGIN")[0])
    name = stated[1].strip() if stated else ""
    return name if name.isprintable() and len(name) <= LONGEST else ""
