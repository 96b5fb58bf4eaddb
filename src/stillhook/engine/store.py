"""Summaries of runs, and a folder that keeps them under what they follow from: crane, case, step and code.

Every file is whole or not there; one file a task, so that an interrupted batch continues where it stopped.
"""

from __future__ import annotations

import functools
import hashlib
import json
from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import atomic_file, cannot_write, check_folder
from stillhook.engine.certificate import objections
from stillhook.errors import SimulationError
from stillhook.kernels.build import results_hash
from stillhook.spec.crane import Crane

SUFFIX = ".cases.npz"
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


class _Index(NamedTuple):
    """files that have been read; places: key -> file and row in it."""

    files: set[str]
    places: dict[bytes, tuple[str, int]]


_INDICES: dict[Path, _Index] = {}


class Store:
    """A folder of result files, each with the keys of its cases."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as e:
            raise cannot_write(folder, e) from None

    def check_room(self) -> None:
        """Refuse a folder that nothing can be kept in, before the work is done. Errors: SimulationError."""
        check_folder(self.folder, ())

    def find(self, keys: Sequence[bytes], names: Callable[[int], tuple[str, ...]]) -> dict[int, Summary]:
        """Place in `keys` -> summary, for what is present; names of the numbers by place. Errors: SimulationError
        naming a file that cannot be read."""
        index = self._index()
        hits: dict[str, list[tuple[int, int]]] = {}
        for i, key in enumerate(keys):
            if key in index.places:
                file, row = index.places[key]
                hits.setdefault(file, []).append((row, i))
        results: dict[int, Summary] = {}
        for file, rows in hits.items():
            with self._opened(file) as data:
                status, numbers, notes = data["status"], data["numbers"], data["notes"]
                for row, i in rows:
                    results[i] = Summary(names(i), str(status[row]), numbers[row].tolist(), json.loads(str(notes[row])))
        return results

    def _index(self) -> _Index:
        """Location of every key. Files never change, so each is read once in the life of this process."""
        present = {path.name for path in self.folder.glob(f"*{SUFFIX}")}
        index = _INDICES.get(self.folder.resolve())
        if index is None or not index.files <= present:
            index = _INDICES[self.folder.resolve()] = _Index(set(), {})
        for file in sorted(present - index.files):
            with self._opened(file) as data:
                index.places.update({key.tobytes(): (file, row) for row, key in enumerate(data["keys"])})
            index.files.add(file)
        return index

    @contextmanager
    def _opened(self, file: str) -> Iterator[Mapping[str, Any]]:
        path = self.folder / file
        try:
            with np.load(path, allow_pickle=False) as data:
                yield data
        except Exception as e:  # of a damaged file many kinds come
            raise SimulationError(
                f"{path}: not a result file of Stillhook ({' '.join(str(e).split())[:120]}). Remove it, and run again."
            ) from None

    def put(self, keys: Sequence[bytes], summaries: Sequence[Summary]) -> None:
        """Keep the results of one task, which have the same names. The file appears under its name only when it is
        complete."""
        name = hashlib.sha256(b"".join(keys)).hexdigest()[:KEY]
        with atomic_file(self.folder / f"{name}{SUFFIX}") as part, open(part, "wb") as file:
            np.savez_compressed(
                file,
                keys=np.frombuffer(b"".join(keys), dtype=f"V{KEY}"),
                status=np.array([s.status for s in summaries]),
                numbers=np.array([s.numbers for s in summaries], dtype=np.float64),
                notes=np.array([json.dumps(s.notes) for s in summaries]),
            )


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
