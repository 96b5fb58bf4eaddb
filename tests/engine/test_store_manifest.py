"""The manifest of a store: written once after the work, and it finds what a checksum inside a file cannot."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from stillhook.base.kept.checked import Kept, read_checked, write_checked
from stillhook.engine import store as stores
from stillhook.engine.store import SUFFIX, Store, Summary, one_manifest
from stillhook.errors import SimulationError
from stillhook.trust import results
from stillhook.trust.comparison import compare
from stillhook.trust.manifest import NAME, Part
from stillhook.trust.trust_list import TrustList

NOBODY = TrustList(Path("none"))
KEYS = [bytes([i]) * stores.KEY for i in range(6)]


def put(folder: Path, keys: list[bytes], value: float = 1.0) -> None:
    Store(folder).put(keys, [Summary(("F_w",), "ok", [value], [])])


def found(folder: Path, keys: list[bytes]) -> list[float]:
    return [of["F_w"] for _, of in sorted(Store(folder).find(keys, lambda i: ("F_w",)).items())]


@pytest.fixture
def store(tmp_path: Path) -> Path:
    """Three results; then as another process would find them."""
    with one_manifest(tmp_path / "s"):
        for key in KEYS[:3]:
            put(tmp_path / "s", [key])
    forget()
    return tmp_path / "s"


def forget() -> None:
    stores._INDICES.clear()
    stores._WRITTEN.clear()


def test_a_store_is_complete_after_work_in_several_steps(store: Path):
    with patch.object(results, "added_to", wraps=results.added_to) as written, one_manifest(store):
        for key in KEYS[3:]:
            with one_manifest(store):
                put(store, [key])
    assert written.call_count == 1
    result = compare(store, NOBODY)
    assert result.complete
    assert len(result.manifest.parts) == 6


def test_numbers_that_were_edited_with_their_checksum_are_not_believed(store: Path):
    file = sorted(store.glob(f"*{SUFFIX}"))[0]
    write_checked(file, (read_checked(file, Kept.CASES) or b"") + b"more")
    assert compare(store, NOBODY).changed == (file.name,)
    assert len(found(store, KEYS)) == 2
    with one_manifest(store):
        put(store, [KEYS[5]])  # something is kept: what is not believed goes
    assert not file.exists()
    assert compare(store, NOBODY).complete


def test_a_result_that_is_computed_again_takes_its_place(store: Path):
    with one_manifest(store):
        put(store, [KEYS[0]], 2.0)
    assert compare(store, NOBODY).complete
    forget()
    assert found(store, KEYS) == [2.0, 1.0, 1.0]


def test_work_that_fails_enters_what_it_has_kept(tmp_path: Path):
    def fail() -> None:
        with one_manifest(tmp_path / "s"):
            put(tmp_path / "s", [KEYS[0]])
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert compare(tmp_path / "s", NOBODY).complete


def test_two_processes_enter_both_of_their_results(store: Path):
    first, second = Part.of(b"1"), Part.of(b"2")
    for name, part in (("a", first), ("b", second)):
        (store / name).write_bytes(b"1" if name == "a" else b"2")
        results.add_parts(store, "store", {name: part})
    assert {"a", "b"} <= compare(store, NOBODY).manifest.parts.keys()
    assert compare(store, NOBODY).complete


def test_a_store_without_a_manifest_is_read(store: Path):
    (store / NAME).unlink()
    assert np.all(np.array(found(store, KEYS)) == 1.0)


def test_a_folder_in_place_of_a_file_is_refused_before_the_work_and_stays(tmp_path: Path):
    folder = tmp_path / f"{'0' * stores.KEY}{SUFFIX}"
    (folder / "somebody's").mkdir(parents=True)
    with pytest.raises(SimulationError, match=r"in the way.*[^\n]+$"):
        Store(tmp_path).check_room()
    assert (folder / "somebody's").is_dir()
    folder.rename(tmp_path / f"notes{SUFFIX}")
    Store(tmp_path).check_room()
