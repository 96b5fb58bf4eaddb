"""Own certificate and trusted clients, in a folder that is its owner's alone.

own/certificate.der and own/key.pem are made at the first start. trusted/ holds the certificates of clients that may
have a session, as they are: no chains, no names. rejected/ keeps the last ones that were refused, so that one which is
meant can be moved over.
"""

from __future__ import annotations

import hashlib
import os
import socket
from datetime import UTC, datetime
from pathlib import Path

from stillhook.base.atomic import atomic_file, atomic_files
from stillhook.base.extras import need
from stillhook.base.gateway.access import read_bytes
from stillhook.base.gateway.budget import PROGRAM
from stillhook.errors import LiveError, SimulationError

DAYS = 5 * 365
"""Days for which an own certificate is valid."""
MOST_REJECTED = 20
"""Rejected certificates that are kept, the newest ones."""
MOST_BYTES = 16_384
"""Bytes of a certificate at most."""
URI = "urn:{host}:stillhook:{name}"


class TrustFolder:
    """The folder. Parameters: path; name of the application, for its own certificate.

    Errors: LiveError, one line, where it cannot be made, others may read its key, or its certificate is over.
    """

    def __init__(self, path: Path, name: str = "live") -> None:
        need("asyncua", "OPC UA", LiveError)
        self.path = path
        self.trusted, self.rejected = path / "trusted", path / "rejected"
        self.certificate, self.key = path / "own" / "certificate.der", path / "own" / "key.pem"
        self.uri = URI.format(host=socket.gethostname(), name=name)
        try:
            for folder in (path, path / "own", self.trusted, self.rejected):
                folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            if not self.key.exists() or not self.certificate.exists():
                make_certificate(self.certificate, self.key, self.uri, f"Stillhook {name}")
        except OSError as problem:
            raise LiveError(f"{path}: {problem.strerror}. Choose another folder for certificates.") from None
        except SimulationError as problem:
            raise LiveError(str(problem)) from None
        self._check()

    def _check(self) -> None:
        from cryptography import x509

        if os.name == "posix" and (mode := self.key.stat().st_mode & 0o077):
            raise LiveError(
                f"{self.key}: others may read it (rights {mode:03o}). Take them away: chmod 600 {self.key}."
            )
        try:
            certificate = x509.load_der_x509_certificate(
                read_bytes(self.certificate, "certificate", LiveError, PROGRAM)
            )
        except (ValueError, LiveError):
            raise LiveError(f"{self.certificate}: no certificate. Move own/ away; a new one is made then.") from None
        if certificate.not_valid_after_utc < datetime.now(UTC):
            over = certificate.not_valid_after_utc.date()
            raise LiveError(f"{self.certificate}: over since {over}. Move own/ away; a new one is made then.")

    def trusts(self, certificate: bytes | None) -> bool:
        """Whether a certificate (DER) is in trusted/ and within its dates. The folder is read each time."""
        if not certificate or len(certificate) > MOST_BYTES or not _within_dates(certificate):
            return False
        paths = sorted(self.trusted.iterdir()) if self.trusted.is_dir() else []
        return any(_der_of(path) == certificate for path in paths if path.is_file())

    def reject(self, certificate: bytes | None) -> str:
        """Keep a certificate that was refused, and say which: its fingerprint, and the file."""
        if not certificate:
            return "without a certificate"
        name = fingerprint(certificate)
        if len(certificate) > MOST_BYTES:
            return f"with a certificate of {len(certificate)} bytes"
        path = self.rejected / f"{name}.der"
        try:
            if not path.exists():
                with atomic_file(path) as part:
                    part.write_bytes(certificate)
                kept = sorted(self.rejected.glob("*.der"), key=lambda p: p.stat().st_mtime)
                for old in kept[:-MOST_REJECTED]:
                    old.unlink(missing_ok=True)
        except (OSError, SimulationError) as problem:
            return f"with certificate {name}, which could not be kept ({getattr(problem, 'strerror', problem)})"
        return f"with certificate {name}, kept in {path}"


def fingerprint(certificate: bytes) -> str:
    """The first 16 digits of its SHA-256."""
    return hashlib.sha256(certificate).hexdigest()[:16]


def make_certificate(certificate: Path, key: Path, uri: str, name: str, days: int = DAYS) -> None:
    """A key and a certificate that it signs itself, for client and server, readable by their owner alone."""
    from asyncua.crypto import cert_gen
    from cryptography import x509
    from cryptography.hazmat.primitives.serialization import Encoding
    from cryptography.x509.oid import ExtendedKeyUsageOID

    private = cert_gen.generate_private_key()
    names = [x509.UniformResourceIdentifier(uri), x509.DNSName(socket.gethostname()), x509.DNSName("localhost")]
    uses = [ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH]
    made = cert_gen.generate_self_signed_app_certificate(private, name, {}, names, uses, days)
    for path in (key, certificate):
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    with atomic_files(key, certificate, modes=(0o600, 0o600)) as (of_key, of_certificate):
        of_key.write_bytes(cert_gen.dump_private_key_as_pem(private))
        of_certificate.write_bytes(made.public_bytes(Encoding.DER))


def _der_of(path: Path) -> bytes | None:
    """A certificate's file as DER, of DER or PEM; None for anything else."""
    from cryptography import x509
    from cryptography.hazmat.primitives.serialization import Encoding

    try:
        data = read_bytes(path, "certificate", LiveError, PROGRAM)
        if data.lstrip().startswith(b"-----BEGIN"):
            return x509.load_pem_x509_certificate(data).public_bytes(Encoding.DER)
    except (LiveError, ValueError):
        return None
    return data


def _within_dates(certificate: bytes) -> bool:
    from cryptography import x509

    try:
        of = x509.load_der_x509_certificate(certificate)
    except ValueError:
        return False
    return of.not_valid_before_utc <= datetime.now(UTC) <= of.not_valid_after_utc
