"""The one way in which a folder of results is written, so that each has its manifest; and what is said where files that
are read back are not those of it."""

from __future__ import annotations

import hashlib
import logging
import os
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from stillhook.base.atomic import atomic_file, atomic_folder
from stillhook.base.gateway.inputs import doubted, inputs, note_doubted
from stillhook.base.kept.one_at_a_time import one_at_a_time
from stillhook.errors import TrustError
from stillhook.trust.home import KEY, home
from stillhook.trust.keys import PASSPHRASE, SigningKey, read_key
from stillhook.trust.manifest import NAME, Made, Manifest, Part, read_manifest

LOG = logging.getLogger("stillhook")
Cranes = Iterable[tuple[str, str]]
"""Name and hash of each crane that a result follows from (`stillhook.spec.crane.identity`)."""


@contextmanager
def result_folder(
    target: Path, what: str, cranes: Cranes = (), *, key: SigningKey | None = None, kept: Iterable[str] = ()
) -> Iterator[Path]:
    """`stillhook.base.atomic.atomic_folder` with a manifest, which appears with the files.

    Parameters: what: subject of the files, such as "plan"; cranes: those that they follow from; kept: names of further
    parts, which are in the folder already; key: signs the manifest, by default the user's own where it can be used
    without asking for a passphrase. Of a command the manifest names the files that it follows from
    (`stillhook.base.gateway.inputs`).
    """
    with atomic_folder(target) as part:
        yield part
        files = sorted(path for path in part.rglob("*") if path.is_file())
        parts = {path.relative_to(part).as_posix(): Part.of_file(path) for path in files if path.name != NAME}
        parts |= {name: Part.of_file(target / name) for name in kept}
        text = added_to(target, Made.of(what, cranes, inputs()), parts, key or own_key()).text()
        (part / NAME).write_text(text, encoding="utf-8", newline="\n")


def added_to(folder: Path, made: Made, parts: Mapping[str, Part], key: SigningKey | None) -> Manifest:
    """The manifest of a folder with another set of parts. What others wrote there stays in it as they recorded it; it
    is signed where this key signed that as well, so that nobody signs for what he has not written."""
    before = Manifest({})
    if os.path.lexists(folder / NAME):
        try:
            before = read_manifest(folder / NAME)
        except TrustError as problem:
            LOG.warning(f"{folder / NAME}: replaced by one of the new files alone: {problem}")
    made_of = before.with_set(made, parts, lambda name: (folder / name).exists())
    foreign = made_of.parts.keys() - parts.keys()
    if key is not None and foreign and not before.signed_by(key):
        LOG.warning(
            f"{folder / NAME}: not signed, as {min(foreign)} was there before and is not signed by {key.name}. Check"
            f" it, then sign: stillhook certificate sign {folder}"
        )
        return made_of
    return made_of.signed(key)


def with_renewed_parts(contents: Mapping[Path, bytes], key: SigningKey) -> dict[Path, bytes]:
    """Files of one folder that are to be written anew on purpose, and its manifest with them, if it has one and they
    are parts of it. It stays signed where this key signed it; a damaged one stays as it is, with a line on standard
    error."""
    folder = next(iter(contents)).parent
    if (before := _manifest_in(folder)) is None:
        return dict(contents)
    now = {path.name: Part.of(data) for path, data in contents.items()}
    sets = {made: {name: now.get(name, part) for name, part in of.items()} for made, of in before.sets.items()}
    made = Manifest(sets).signed(key if before.signed_by(key) else None)
    return {**contents, folder / NAME: made.text().encode()}


def own_key() -> SigningKey | None:
    """The user's own key, None where there is none, or, with a line on standard error, where it cannot be used without
    asking, or the command read a file that is another one than its manifest says: results are written in any case."""
    path = home() / KEY
    if not path.exists():
        return None
    if files := doubted():
        LOG.warning(
            f"Manifests are not signed, as {files[0]} is not what a manifest says. Check it, then sign: stillhook"
            " certificate sign FOLDER"
        )
        return None
    try:
        return read_key(path, lambda: os.environ.get(PASSPHRASE, ""))
    except TrustError as problem:
        advice = f"Set {PASSPHRASE}, or sign afterwards: stillhook certificate sign FOLDER"
        LOG.warning(f"Manifests are not signed: {problem} {advice}")
        return None


def add_parts(folder: Path, what: str, parts: Mapping[str, Part]) -> None:
    """Enter parts that were written into a folder one by one into its manifest. Of several processes each enters its
    own."""
    place = hashlib.sha256(str(folder.resolve()).encode()).hexdigest()[:16]
    with one_at_a_time(Path(tempfile.gettempdir()) / f"stillhook-{place}.lock"), atomic_file(folder / NAME) as part:
        text = added_to(folder, Made.of(what), parts, own_key()).text()
        part.write_text(text, encoding="utf-8", newline="\n")


def misfits(folder: Path, names: Iterable[str]) -> list[str]:
    """Which of the files of a folder are other ones than its manifest says; one that it does not have is none."""
    if not (files := list(names)) or (manifest := _manifest_in(folder)) is None:
        return []
    return [name for name in files if (of := manifest.parts.get(name)) and not _is(folder / name, of)]


def note_misfit(*files: Path) -> None:
    """Say on standard error where files that are read are not those of the manifest in their folder; the user's key
    then signs nothing that the command writes. Nothing is said of a folder without a manifest: who can change files
    can remove it as well."""
    folder = files[0].parent
    if (manifest := _manifest_in(folder)) is None:
        return
    for file in files:
        with suppress(OSError):
            of = manifest.parts.get(file.name)
            if of is None:
                line = "is not in the manifest of its folder"
            elif not _is(file, of):
                line = "is not what the manifest of its folder says"
            else:
                continue
            note_doubted(file)
            LOG.warning(f"{file}: {line}. See what changed: stillhook manifest {folder}")


def _is(file: Path, part: Part) -> bool:
    """Whether a file is this part; one that cannot be read is not."""
    try:
        return file.stat().st_size == part.size and Part.of_file(file) == part
    except OSError:
        return False


def _manifest_in(folder: Path) -> Manifest | None:
    """The manifest of a folder; None where there is none and, with a line on standard error, where it is damaged."""
    if not os.path.lexists(folder / NAME):
        return None
    try:
        return read_manifest(folder / NAME)
    except TrustError as problem:
        LOG.warning(f"{folder}: {problem}")
        return None
