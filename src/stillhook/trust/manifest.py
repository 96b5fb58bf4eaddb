"""Manifest: one JSON file of name, size and SHA-256 of every part of a result, of what made it, and a signature.

Sealed and canonical (`stillhook.base.kept.sealed`), without clock and random numbers: the same result has the same
manifest, signed by the same key or by none. A hash finds damage and mix-ups; only a signature shows whose
manifest it is.
"""

from __future__ import annotations

import functools
import hashlib
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath
from typing import Any, BinaryIO

from stillhook._version import __version__
from stillhook.base.extensions import extension_sources
from stillhook.base.gateway.access import sha256_of
from stillhook.base.kept.sealed import SIGNATURE, digest_of, read_sealed, sealed, unsealed
from stillhook.base.kept.sources import PACKAGE
from stillhook.errors import StillhookError, TrustError
from stillhook.trust.keys import SigningKey
from stillhook.trust.signature import Signature, Signed, sign, signature_of
from stillhook.trust.standing import Judgement, judge
from stillhook.trust.trust_list import TrustList
from stillhook.units import quote

NAME = "stillhook-manifest.json"
"""Of the file, in a folder; in an archive in the folder `IN_ARCHIVE`."""
IN_ARCHIVE = f"resources/{NAME}"
FORMAT = "stillhook manifest 1"
"""First words of a manifest; the number changes with the meaning of its contents."""
MOST_PARTS = 200_000
LONGEST_NAME = 400
ADVICE = "Get the folder or file from its maker again, or write it again."
_HEX = re.compile(r"[0-9a-f]+")
_BLOCK = 1 << 20


@dataclass(frozen=True)
class Part:
    """size [bytes] and SHA-256 of a file."""

    size: int
    sha256: str

    @classmethod
    def of(cls, data: bytes) -> Part:
        """The part that these bytes are."""
        return cls(len(data), hashlib.sha256(data).hexdigest())

    @classmethod
    def of_stream(cls, stream: BinaryIO) -> Part:
        """The part that is left of a stream."""
        digest, size = hashlib.sha256(), 0
        while block := stream.read(_BLOCK):
            digest.update(block)
            size += len(block)
        return cls(size, digest.hexdigest())

    @classmethod
    def of_file(cls, path: Path) -> Part:
        """The part that a file is. Errors: OSError."""
        with path.open("rb") as stream:
            return cls.of_stream(stream)


@functools.cache
def package_hash() -> str:
    """Hash of every file of the package and of the user's own modules: of all that makes a result."""
    return PACKAGE.hash(PACKAGE.names, others=extension_sources())[:16]


@dataclass(frozen=True, order=True)
class Made:
    """What made a set of parts. what: its subject, such as "plan"; cranes: name and hash of the contents of each;
    version and code: of the package; inputs: name and SHA-256 of each file that it follows from."""

    what: str
    cranes: tuple[tuple[str, str], ...] = ()
    version: str = __version__
    code: str = field(default_factory=package_hash)
    inputs: tuple[tuple[str, str], ...] = ()

    @classmethod
    def of(cls, what: str, cranes: Iterable[tuple[str, str]] = (), inputs: Iterable[Path] = ()) -> Made:
        """By this version. cranes: name and hash of each (`stillhook.spec.crane.identity`); inputs: files. Errors:
        TrustError for one that cannot be read."""
        of = sorted({_plain(name): _plain(digest) for name, digest in cranes}.items())
        read = sorted({(_plain(path.name), sha256_of(path, TrustError)) for path in inputs})
        return cls(_plain(what), tuple(of), inputs=tuple(read))

    def to_dict(self) -> dict[str, Any]:
        """As plain data; inputs only where there are some."""
        inputs = [{"name": name, "sha256": digest} for name, digest in self.inputs]
        of = {"what": self.what, "cranes": dict(self.cranes), "version": self.version, "code": self.code}
        return {**of, "inputs": inputs} if inputs else of


Sets = Mapping[Made, Mapping[str, Part]]


@dataclass(frozen=True)
class Manifest:
    """Parts by name, in sets that were made together, and the signature of all of them."""

    sets: Sets
    signature: Signature | None = None

    @functools.cached_property
    def parts(self) -> dict[str, Part]:
        """Every part by its name."""
        return {name: part for parts in self.sets.values() for name, part in parts.items()}

    @functools.cached_property
    def digest(self) -> str:
        """SHA-256 of its contents without the signature."""
        return digest_of(self._data())

    def _data(self) -> dict[str, Any]:
        return {
            "format": FORMAT,
            "sets": [
                {
                    **made.to_dict(),
                    "parts": {name: {"size": part.size, "sha256": part.sha256} for name, part in parts.items()},
                }
                for made, parts in sorted(self.sets.items())
            ],
        }

    def text(self) -> str:
        """Its file."""
        data = self._data()
        return sealed(data if self.signature is None else {**data, SIGNATURE: self.signature.to_dict()})

    def signed(self, key: SigningKey | None) -> Manifest:
        """With a signature of this key in place of any before; of no key without one."""
        return replace(self, signature=None if key is None else sign(Signed.MANIFEST, self.digest, key))

    def signed_by(self, key: SigningKey) -> bool:
        """Whether its signature is one of this key, and fits."""
        of = self.signature
        return of is not None and of.public == key.public.raw and of.fits(Signed.MANIFEST, self.digest)

    def judged(self, trust: TrustList) -> Judgement:
        """How its signature stands with a trust list."""
        return judge(self.signature, Signed.MANIFEST, self.digest, trust)

    def with_set(self, made: Made, parts: Mapping[str, Part], remains: Callable[[str], bool]) -> Manifest:
        """With another set, unsigned; its names leave the sets before. remains: whether a file is still there; what the
        same maker has taken away is no part any more."""
        sets: dict[Made, dict[str, Part]] = {}
        for before, of in self.sets.items():
            kept = {n: p for n, p in of.items() if n not in parts and (before.what != made.what or remains(n))}
            if kept:
                sets[before] = kept
        if parts:
            sets[made] = {**sets.get(made, {}), **parts}
        return Manifest(sets)


def read_manifest(path: Path) -> Manifest:
    """The manifest in a file. Errors: TrustError, one line."""
    return _checked(read_sealed(path, FORMAT, "a manifest", ADVICE, TrustError), path.name)


def manifest_of(content: bytes, label: str) -> Manifest:
    """The manifest that the bytes of a file are; label: of the file. Errors: as `read_manifest`."""
    return _checked(unsealed(content, label, FORMAT, "a manifest", ADVICE, TrustError), label)


def _checked(data: Mapping[str, Any], label: str) -> Manifest:
    try:
        return _manifest(data)
    except (ValueError, TypeError, KeyError, AttributeError, StillhookError) as problem:
        reason = " ".join(str(problem).split())[:120]
        raise TrustError(f"{label}: not a manifest ({reason}). {ADVICE}") from None


def _manifest(data: Mapping[str, Any]) -> Manifest:
    """Of a file's data. Errors: ValueError, TypeError, KeyError, AttributeError for anything that is none."""
    if {*data} - {SIGNATURE} != {"format", "sets", "digest"}:
        raise ValueError("other fields than sets, digest and signature")
    sets: dict[Made, dict[str, Part]] = {}
    names: set[str] = set()
    for row in data["sets"]:
        cranes = tuple(sorted((_line(name), _line(of)) for name, of in row["cranes"].items()))
        inputs = tuple(sorted({*map(_input, row.get("inputs", ()))}))
        made = Made(_line(row["what"]), cranes, _line(row["version"]), _line(row["code"]), inputs)
        if row != {**made.to_dict(), "parts": row["parts"]}:
            raise ValueError("a set of other fields, or in another order")
        if made in sets:
            raise ValueError("a set twice")
        parts = sets[made] = {checked_name(name): _part(of) for name, of in row["parts"].items()}
        if twice := names & parts.keys():
            raise ValueError(f"{quote(min(twice))} twice")
        names |= parts.keys()
        if len(names) > MOST_PARTS:
            raise ValueError(f"more than {MOST_PARTS} parts")
    return Manifest(sets, signature_of(data.get(SIGNATURE)))


def checked_name(name: Any) -> str:
    """The name of a part: of a file inside the folder, with "/" between folders. Errors: ValueError."""
    text = _line(name)
    plain = text == PurePosixPath(text).as_posix() and not PurePosixPath(text).is_absolute()
    if not plain or ".." in text.split("/") or text == "." or set(text) & set("\\:"):
        raise ValueError(f"{quote(text)} names no file inside the folder")
    if text in (NAME, IN_ARCHIVE):
        raise ValueError(f"{quote(text)} would be a part of itself")
    return text


def _plain(text: str) -> str:
    """A text as one printable line."""
    return "".join(c if c.isprintable() else "?" for c in text)[:LONGEST_NAME] or "?"


def _line(text: Any) -> str:
    if not isinstance(text, str) or not text.isprintable() or not text or len(text) > LONGEST_NAME:
        raise ValueError(f"{quote(text)} is not one printable line")
    return text


def _part(of: Any) -> Part:
    size = of["size"]
    if {*of} != {"size", "sha256"} or type(size) is not int or size < 0:
        raise ValueError("a part of other fields than size and sha256")
    return Part(size, _sha256(of["sha256"]))


def _input(of: Any) -> tuple[str, str]:
    if {*of} != {"name", "sha256"}:
        raise ValueError("an input of other fields than name and sha256")
    return _line(of["name"]), _sha256(of["sha256"])


def _sha256(digits: Any) -> str:
    if not isinstance(digits, str) or len(digits) != 64 or not _HEX.fullmatch(digits):
        raise ValueError("a SHA-256 that is not 64 hexadecimal digits")
    return digits
