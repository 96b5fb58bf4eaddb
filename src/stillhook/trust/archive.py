"""FMUs and systems of FMUs, which are zip files: what their members are against the manifest in them, and that manifest
put in anew."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from stillhook.base.atomic import atomic_file
from stillhook.base.gateway.access import opened
from stillhook.base.gateway.budget import JSON
from stillhook.errors import TrustError
from stillhook.trust.manifest import ADVICE, IN_ARCHIVE, MOST_PARTS, Manifest, Part, manifest_of

ENDINGS = (".fmu", ".ssp")
OUTSIDE = "bytes outside of every member"
"""Stands among the names of other members for bytes before, between and after those, and for a comment of the archive,
in none of which Stillhook writes anything."""
STREAMED, DESCRIPTORS = 0x08, (12, 16, 20, 24)
"""Flag of members that were written without a seek, and bytes that follow those: checksum and sizes."""
LARGEST = 4_000_000_000
"""Bytes of an archive's members together, unpacked."""


def in_archive(path: Path) -> tuple[Manifest, dict[str, Part | None], set[str]]:
    """The manifest in an archive, its parts that are there (None: changed, without a look inside), and names of other
    members. Errors: TrustError, one line."""
    with _guarded(path), opened(path, "FMU", TrustError) as stream, zipfile.ZipFile(stream) as archive:
        members = [each for each in archive.infolist() if not each.is_dir()]
        count = Counter(each.filename for each in members)
        if sum(each.file_size for each in members) > LARGEST or len(members) > MOST_PARTS:
            raise ValueError(f"unpacked larger than {LARGEST // 1_000_000_000} GB, or of too many members")
        if count[IN_ARCHIVE] != 1:
            reason = "twice" if count[IN_ARCHIVE] else "no"
            raise TrustError(f"{path.name}: {reason} {IN_ARCHIVE} in it. {ADVICE}")
        if archive.getinfo(IN_ARCHIVE).file_size > JSON.size:
            raise ValueError(f"its manifest is larger than {JSON.size // 1_000_000} MB")
        manifest = manifest_of(archive.read(IN_ARCHIVE), path.name)
        there: dict[str, Part | None] = {}
        for each in members:
            of = manifest.parts.get(each.filename)
            if of is not None:
                alone = count[each.filename] == 1 and each.file_size == of.size
                there[each.filename] = _member(archive, each) if alone else None
        others = {*count} - {IN_ARCHIVE} - manifest.parts.keys()
        return manifest, there, others if _gapless(stream, archive.infolist()) else others | {OUTSIDE}


def put_manifest(path: Path, manifest: Manifest) -> None:
    """Write a manifest of the same parts into an archive in place of its own; every other member keeps its place, date
    and contents. Errors: TrustError, one line, where a part is another one now; SimulationError where the file cannot
    be written."""
    with opened(path, "FMU", TrustError) as stream:
        content = stream.read()  # closed before it is replaced
    seen: set[str] = set()
    with atomic_file(path) as target, zipfile.ZipFile(target, "w") as after:
        with _guarded(path):
            before = zipfile.ZipFile(io.BytesIO(content))
        for each in before.infolist():
            with _guarded(path):
                data = manifest.text().encode() if each.filename == IN_ARCHIVE else before.read(each)
            of = manifest.parts.get(each.filename)
            if each.filename in seen or (of is not None and Part.of(data) != of):
                raise TrustError(f"{path}: {each.filename} is there twice, or not what the manifest says. {ADVICE}")
            seen.add(each.filename)
            after.writestr(each, data)


@contextmanager
def _guarded(path: Path) -> Iterator[None]:
    """Around what reads an archive. Errors: TrustError, one line, for all that an archive and its members raise."""
    try:
        yield
    except (
        OSError,
        struct.error,
        ValueError,
        EOFError,
        zlib.error,
        zipfile.BadZipFile,
        NotImplementedError,
        RuntimeError,
    ) as problem:
        reason = getattr(problem, "strerror", None) or " ".join(str(problem).split())[:120]
        raise TrustError(f"{path.name}: not an FMU or a system of FMUs ({reason}). {ADVICE}") from None


def _gapless(stream: BinaryIO, members: Sequence[zipfile.ZipInfo]) -> bool:
    """Whether members begin at the first byte and follow one another up to the list of them, which with its end of 22
    bytes is the rest of the file. Source: PKWARE, APPNOTE.TXT 6.3.10, sections 4.3.7, 4.3.9 and 4.3.16."""
    size = stream.seek(-22, io.SEEK_END) + 22
    signature, length, begin, comment = struct.unpack("<4s8xIIH", stream.read(22))
    if signature != b"PK\5\6" or comment or begin + length + 22 != size:
        return False
    may_begin = {0}
    for each in sorted(members, key=lambda member: member.header_offset):
        if each.header_offset not in may_begin:
            return False
        stream.seek(each.header_offset + 26)
        name, extra = struct.unpack("<HH", stream.read(4))
        end = each.header_offset + 30 + name + extra + each.compress_size
        may_begin = {end + after for after in (DESCRIPTORS if each.flag_bits & STREAMED else (0,))}
    return begin in may_begin


def _member(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> Part | None:
    """What a member is, None where it is damaged."""
    try:
        with archive.open(member) as stream:
            return Part.of_stream(stream)  # type: ignore[arg-type]
    except (zipfile.BadZipFile, zlib.error, EOFError):
        return None
