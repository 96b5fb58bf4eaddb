"""Summaries of runs, and a folder that keeps them under what they follow from: crane, case, step and code.

Every file is complete or absent; one file a task, so that an interrupted batch continues where it stopped. A file has a
checksum: the cases of one that is damaged are computed again, and it is removed as soon as something is kept.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import json
import re
import threading
from array import array
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import cannot_write, check_folder
from stillhook.base.kept.arrays import packed, read_arrays
from stillhook.base.kept.checked import OTHER, Kept, note, read_checked, write_checked
from stillhook.engine.certificate import objections
from stillhook.kernels.build import results_hash
from stillhook.spec.crane import Crane
from stillhook.trust.manifest import Part
from stillhook.trust.results import add_parts, misfits

SUFFIX = ".2.cases.npz"
"""Second format: with a checksum. Files of the first end otherwise; none of their cases is one of this version."""
MISFIT = "not what the manifest of the store says"
"""Why a file is not believed."""
KEY = 32
"""Length of a key [bytes]."""


@functools.lru_cache(maxsize=256)
def _places(names: tuple[str, ...]) -> dict[str, int]:
    return {name: i for i, name in enumerate(names)}


class Summary(Mapping[str, Any]):
    """What a batch keeps of a run, by name: "status", numbers [SI] in the order of their names, "notes"; small in
    memory."""

    __slots__ = ("notes", "numbers", "places", "status")

    def __init__(self, names: tuple[str, ...], status: str, numbers: Iterable[float], notes: Iterable[str]) -> None:
        self.places, self.status = _places(names), status
        self.numbers, self.notes = array("d", numbers), list(notes)

    def __getitem__(self, name: str) -> Any:
        return getattr(self, name) if name in ("status", "notes") else self.numbers[self.places[name]]

    def __iter__(self) -> Iterator[str]:
        return iter(("status", *self.places, "notes"))

    def __len__(self) -> int:
        return len(self.places) + 2

    def __repr__(self) -> str:
        return repr(dict(self))

    def some(self, names: tuple[str, ...]) -> FloatArray:
        """Its numbers of these names, NaN for those that it has not."""
        if names == tuple(self.places):
            return np.frombuffer(self.numbers)
        return np.array([self.get(name, np.nan) for name in names])


_NAME = re.compile(rf"[0-9a-f]{{{KEY}}}{re.escape(SUFFIX)}")


class _Index(NamedTuple):
    """files that were sound; places: key -> file and row in it; damaged: files that were not."""

    files: set[str]
    places: dict[bytes, tuple[str, int]]
    damaged: set[str]


class _Content(NamedTuple):
    """keys (n), status and notes (texts), numbers (n, width) of the n cases of a file."""

    keys: NDArray[Any]
    status: NDArray[Any]
    numbers: FloatArray
    notes: NDArray[Any]

    @classmethod
    def read(cls, stored: bytes) -> _Content:
        """The cases of a file. Errors: of many kinds, where a store did not write it."""
        arrays = read_arrays(stored)
        of = cls(*(arrays[name] for name in cls._fields))
        n = len(of.keys)
        if of.keys.dtype != np.dtype(f"V{KEY}") or of.numbers.dtype != np.float64 or of.numbers.shape[:1] != (n,):
            raise ValueError
        if of.numbers.ndim != 2 or {of.keys.shape, of.status.shape, of.notes.shape} != {(n,)}:
            raise ValueError
        return of

    def summary(self, row: int, names: tuple[str, ...]) -> Summary | None:
        """The case of a row; None where its numbers are not those of these names, or its notes no texts."""
        numbers = self.numbers[row].tolist()
        try:
            notes = json.loads(str(self.notes[row]))
        except (ValueError, RecursionError):
            return None
        texts = isinstance(notes, list) and all(isinstance(each, str) for each in notes)
        return Summary(names, str(self.status[row]), numbers, notes) if texts and len(numbers) == len(names) else None


_INDICES: dict[Path, _Index] = {}


class _Written:
    """What this process has put into a store: all of it, and what its manifest has not yet; how many runs are
    within."""

    def __init__(self) -> None:
        self.all: set[str] = set()
        self.parts: dict[str, Part] = {}
        self.runs = 0


_WRITTEN: defaultdict[Path, _Written] = defaultdict(_Written)
_LOCK = threading.Lock()


@contextlib.contextmanager
def one_manifest(folder: str | Path | None) -> Iterator[None]:
    """Work on a store: its manifest is written once, at the end of the outermost such work, however that ends."""
    if folder is None:
        yield
        return
    path = Path(folder).resolve()
    of = _WRITTEN[path]
    with _LOCK:
        of.runs += 1
    try:
        yield
    finally:
        with _LOCK:
            of.runs -= 1
            if not of.runs and of.parts and path.is_dir():
                parts, of.parts = of.parts, {}
                add_parts(path, "store", {name: part for name, part in parts.items() if (path / name).exists()})


class Store:
    """A folder of result files, each with the keys of its cases."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as e:
            raise cannot_write(folder, e) from None

    def check_room(self) -> None:
        """Refuse a folder that nothing can be kept in, before the work is done: also one with folders in place of its
        files, whose contents are another person's. Errors: SimulationError."""
        names = (path.name for path in self.folder.glob(f"*{SUFFIX}"))
        check_folder(self.folder, tuple(name for name in names if _NAME.fullmatch(name)))

    def find(self, keys: Sequence[bytes], names: Callable[[int], tuple[str, ...]]) -> dict[int, Summary]:
        """Place in `keys` -> summary, for what is present; names of the numbers by place."""
        index = self._index()
        hits: dict[str, list[tuple[int, int]]] = {}
        for i, key in enumerate(keys):
            if key in index.places:
                file, row = index.places[key]
                hits.setdefault(file, []).append((row, i))
        results: dict[int, Summary] = {}
        for file, rows in hits.items():
            content = self._content(file)
            if content is None:  # damaged or removed since it was read first
                index.files.discard(file)
                index.damaged.add(file)
                continue
            for row, i in rows:
                if content.keys[row].tobytes() == keys[i] and (found := content.summary(row, names(i))) is not None:
                    results[i] = found
        return results

    def _index(self) -> _Index:
        """Location of every key. Files never change, so each is read once in the life of this process; a damaged one is
        read again, for it may have been replaced."""
        present = {path.name for path in self.folder.glob(f"*{SUFFIX}")}
        index = _INDICES.get(self.folder.resolve())
        if index is None or not index.files <= present:
            index = _INDICES[self.folder.resolve()] = _Index(set(), {}, set())
        new, own = sorted(present - index.files), _WRITTEN[self.folder.resolve()].all
        for file in misfits(self.folder, [file for file in new if file not in own]):
            note(self.folder / file, MISFIT, Kept.CASES)
            index.damaged.add(file)
            new.remove(file)
        for file in new:
            if (content := self._content(file)) is None:
                index.damaged.add(file)
            else:
                index.places.update({key.tobytes(): (file, row) for row, key in enumerate(content.keys)})
                index.files.add(file)
        return index

    def _content(self, file: str) -> _Content | None:
        """What a file holds; None where it is absent and, with a note, where it is damaged."""
        stored = read_checked(self.folder / file, Kept.CASES)
        if stored is None:
            return None
        try:
            return _Content.read(stored)
        except Exception:  # of what another program wrote, many kinds come
            note(self.folder / file, OTHER, Kept.CASES)
            return None

    def put(self, keys: Sequence[bytes], summaries: Sequence[Summary]) -> None:
        """Keep the results of one task, which have the same names. The file appears under its name only when it is
        complete; damaged files are removed, which had no other use than these."""
        name = hashlib.sha256(b"".join(keys)).hexdigest()[:KEY]
        content = packed(
            {
                "keys": np.frombuffer(b"".join(keys), dtype=f"V{KEY}"),
                "status": np.array([s.status for s in summaries]),
                "numbers": np.array([s.numbers for s in summaries], dtype=np.float64),
                "notes": np.array([json.dumps(s.notes) for s in summaries]),
            }
        )
        file, of = self.folder / f"{name}{SUFFIX}", _WRITTEN[self.folder.resolve()]
        write_checked(file, content)
        with _LOCK:
            of.all.add(file.name)
            of.parts[file.name] = Part.of_file(file)
        self._remove_damaged(of.all)

    def _remove_damaged(self, own: set[str]) -> None:
        """Remove files of a store's name that are still damaged: this process (own) or another may have replaced one
        meanwhile."""
        index = _INDICES.get(self.folder.resolve())
        while index is not None and index.damaged:
            file = index.damaged.pop()
            if not _NAME.fullmatch(file):
                continue
            if self._content(file) is None or (file not in own and misfits(self.folder, [file])):
                with contextlib.suppress(OSError):
                    (self.folder / file).unlink(missing_ok=True)


def keys_of(
    cranes: Sequence[Crane], cases: Sequence[bytes], names: Sequence[tuple[str, ...]], n_sub: int
) -> list[bytes]:
    """What each summary follows from, as a hash: everything but names, titles and sources, which change no number; also
    how the certificate of a crane stands, which is in no file.

    Parameters: cases as bytes; names of the numbers of each; n_sub steps per PLC cycle.
    """
    start = f"{results_hash()} {n_sub} ".encode()
    machines = {id(c): c for c in cranes}
    prints = {
        key: "\0".join((c.model_dump_json(exclude={"sources", "title", "name"}), *objections(c))).encode()
        for key, c in machines.items()
    }
    columns = {each: " ".join(each).encode() for each in set(names)}
    return [
        hashlib.sha256(b"\0".join((start + columns[each], prints[id(crane)], case))).digest()
        for crane, case, each in zip(cranes, cases, names, strict=True)
    ]


NAMES = ("name", "source", "report")
"""What a scenario, and the record of a motion in it, are called and where they are from."""


def bare(data: Any) -> Any:
    """Plain data without names, at every depth."""
    if isinstance(data, dict):
        return {key: bare(x) for key, x in data.items() if key not in NAMES}
    return [bare(x) for x in data] if isinstance(data, list) else data
