"""Results kept on disk under what they follow from: crane, scenario, step and code. Every file is whole or not
there."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from stillhook.base.atomic import atomic_file, cannot_write, check_folder
from stillhook.errors import SimulationError
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario

Case = TypeVar("Case")
SUFFIX = ".cases.npz"
KEY = 32
"""Length of a key [bytes]."""


class _Index(NamedTuple):
    """files that have been read; places: key -> file and row in it."""

    files: set[str]
    places: dict[bytes, tuple[str, int]]


_INDICES: dict[Path, _Index] = {}


class Store:
    """A folder of result files; one file a task, each with the keys of its cases. `names` are the columns of the
    numbers."""

    def __init__(self, folder: Path, names: Sequence[str]) -> None:
        self.folder, self.names = folder, tuple(names)
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as e:
            raise cannot_write(folder, e) from None

    def keys(
        self,
        cranes: Sequence[Crane],
        cases: Sequence[Case],
        n_sub: int,
        code: str,
        to_bytes: Callable[[Case], bytes],
    ) -> list[bytes]:
        """What each result follows from, as a hash: everything but names, titles and sources, which change no number.
        to_bytes: a case as bytes."""
        prints: dict[int, bytes] = {}
        start = f"{code} {n_sub} {' '.join(self.names)}".encode()
        out = []
        for crane, case in zip(cranes, cases, strict=True):
            if id(crane) not in prints:
                prints[id(crane)] = crane.model_dump_json(exclude={"sources", "title", "name"}).encode()
            out.append(hashlib.sha256(b"\0".join((start, prints[id(crane)], to_bytes(case)))).digest())
        return out

    def check_room(self) -> None:
        """Refuse a folder that nothing can be kept in, before the work is done. Errors: SimulationError."""
        check_folder(self.folder, ())

    def find(self, keys: Sequence[bytes]) -> dict[int, dict[str, Any]]:
        """Place in `keys` -> summary, for what is present. Errors: SimulationError naming a file that cannot be
        read."""
        index = self._index()
        hits: dict[str, list[tuple[int, int]]] = {}
        for i, key in enumerate(keys):
            if key in index.places:
                file, row = index.places[key]
                hits.setdefault(file, []).append((row, i))
        results: dict[int, dict[str, Any]] = {}
        for file, rows in hits.items():
            with self._opened(file) as data:
                self._take(data, rows, results)
        return results

    def _index(self) -> _Index:
        """Where every key lies. Files never change, so each is read once in the life of this process."""
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

    def _take(
        self, data: Mapping[str, Any], hits: Sequence[tuple[int, int]], results: dict[int, dict[str, Any]]
    ) -> None:
        status, numbers, notes = data["status"], data["numbers"], data["notes"]
        for row, i in hits:
            columns = dict(zip(self.names, numbers[row].tolist(), strict=True))
            results[i] = {"status": str(status[row]), **columns, "notes": json.loads(str(notes[row]))}

    def put(
        self, keys: Sequence[bytes], status: Sequence[str], numbers: NDArray[np.float64], notes: Sequence[Sequence[str]]
    ) -> None:
        """Keep the results of one task. The file appears under its name only when it is complete."""
        name = hashlib.sha256(b"".join(keys)).hexdigest()[:KEY]
        with atomic_file(self.folder / f"{name}{SUFFIX}") as part, open(part, "wb") as file:
            np.savez_compressed(
                file,
                keys=np.frombuffer(b"".join(keys), dtype=f"V{KEY}"),
                status=np.array(list(status)),
                numbers=numbers,
                notes=np.array([json.dumps(list(n)) for n in notes]),
            )


NAMES = ("name", "source", "report")
"""What a scenario, and the record of a motion in it, are called and where they are from."""


def scenario_as_bytes(case: Scenario) -> bytes:
    return json.dumps(bare(case.to_dict()), sort_keys=True).encode()


def bare(data: Any) -> Any:
    """Plain data without names, at every depth."""
    if isinstance(data, dict):
        return {key: bare(x) for key, x in data.items() if key not in NAMES}
    return [bare(x) for x in data] if isinstance(data, list) else data
