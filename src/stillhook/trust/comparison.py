"""A folder, an FMU or a system of FMUs against its manifest: which parts are missing, changed or added, and who
signed."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stillhook.base.atomic import atomic_file
from stillhook.errors import TrustError
from stillhook.trust.archive import ENDINGS, in_archive, put_manifest
from stillhook.trust.keys import SigningKey
from stillhook.trust.manifest import ADVICE, MOST_PARTS, NAME, Manifest, Part, read_manifest
from stillhook.trust.standing import Judgement
from stillhook.trust.trust_list import TrustList


@dataclass(frozen=True)
class Comparison:
    """Names of parts that are absent, changed (in size, in content, or a link instead of a file), or in no manifest."""

    manifest: Manifest
    judgement: Judgement
    missing: tuple[str, ...]
    changed: tuple[str, ...]
    added: tuple[str, ...]

    @property
    def complete(self) -> bool:
        """Whether files and manifest are the same."""
        return not (self.missing or self.changed or self.added)

    @property
    def holds(self) -> bool:
        """Whether they are, and a trusted key vouches for it."""
        return self.complete and self.judgement.trusted

    def to_dict(self) -> dict[str, Any]:
        """As plain data for JSON."""
        made = [{**of.to_dict(), "parts": len(parts)} for of, parts in sorted(self.manifest.sets.items())]
        return {
            "holds": self.holds,
            "complete": self.complete,
            "parts": len(self.manifest.parts),
            "missing": self.missing,
            "changed": self.changed,
            "added": self.added,
            "made": made,
            "digest": self.manifest.digest,
            "signature": self.judgement.to_dict(),
        }


def has_manifest(path: Path) -> bool:
    """Whether a path is of what carries a manifest: a folder, the manifest in one, an FMU or a system of FMUs."""
    return path.is_dir() or path.name == NAME or path.suffix.lower() in ENDINGS


def sign_parts(path: Path, key: SigningKey) -> Manifest:
    """Sign the manifest of a folder, an FMU or a system in place of any signature before. Gives it as it is signed now.
    Errors: TrustError where a part is missing or changed, and as of `compare`."""
    place = path.parent if path.name == NAME else path
    result = compare(place, TrustList(place))
    if odd := (*result.missing, *result.changed):
        raise TrustError(f"{place}: {odd[0]} is not what the manifest says, so it is not signed. Write it again.")
    made = result.manifest.signed(key)
    if not place.is_dir():
        put_manifest(place, made)
        return made
    with atomic_file(place / NAME) as part:
        part.write_text(made.text(), encoding="utf-8", newline="\n")
    return made


def compare(path: Path, trust: TrustList) -> Comparison:
    """A folder (or the manifest in it), an FMU or a system against its manifest. Errors: TrustError, one line, where
    there is no manifest or it is damaged, and for what is no such file."""
    if path.name == NAME:
        path = path.parent
    if path.is_dir():
        if not os.path.lexists(path / NAME):
            raise TrustError(f"{path}: no {NAME} in it, so that nothing says what belongs to it. {ADVICE}")
        manifest = read_manifest(path / NAME)
        return _compared(manifest, trust, *_in_folder(path, manifest))
    if not path.exists():
        raise TrustError(f"{path}: no such file or folder. Give a folder that a command wrote, or an FMU.")
    if path.suffix.lower() in ENDINGS:
        manifest, there, others = in_archive(path)
        return _compared(manifest, trust, there, others)
    raise TrustError(f"{path.name}: neither a folder nor an FMU. Give the folder that a command wrote, or an FMU.")


def _compared(manifest: Manifest, trust: TrustList, there: dict[str, Part | None], others: set[str]) -> Comparison:
    """there: parts that there are, None for one that is changed without a look inside."""
    parts = manifest.parts
    missing = tuple(sorted(parts.keys() - there.keys()))
    changed = tuple(sorted(name for name, part in there.items() if part != parts[name]))
    return Comparison(manifest, manifest.judged(trust), missing, changed, tuple(sorted(others)))


def _in_folder(folder: Path, manifest: Manifest) -> tuple[dict[str, Part | None], set[str]]:
    """Parts of the manifest that are in a folder, and names of the other files. No link is followed."""
    there: dict[str, Part | None] = {}
    others: set[str] = set()
    for path, is_file in _files(folder):
        name = path.relative_to(folder).as_posix()
        of = manifest.parts.get(name)
        if name == NAME:
            continue
        if of is None:
            others.add(name)
        else:
            there[name] = _part(path, of) if is_file else None
        if len(there) + len(others) > 2 * MOST_PARTS:
            raise TrustError(f"{folder}: more than {2 * MOST_PARTS} files. Give the folder that a command wrote.")
    return there, others


def _files(folder: Path) -> Any:
    """Every file below a folder, and whether it is one rather than a link or a device."""
    for where, folders, files in os.walk(folder):
        links = [name for name in folders if (Path(where) / name).is_symlink()]
        for name in (*files, *links):
            path = Path(where) / name
            yield path, path.is_file() and not path.is_symlink()


def _part(path: Path, of: Part) -> Part | None:
    """What a file is, None where its size shows that it is not the part, or it cannot be read."""
    try:
        return Part.of_file(path) if path.stat().st_size == of.size else None
    except OSError:
        return None
