"""Files and folders appear complete or not at all, and what cannot be written is said before the work."""

import os

import pytest

from stillhook.base.atomic import atomic_file, atomic_folder, check_folder
from stillhook.errors import SimulationError

ADVICE = "Choose another folder."


def fails(writing: atomic_file | atomic_folder) -> None:
    """A block that ends with an error after it has begun to write."""
    with writing as part:
        (part / "half.txt" if part.is_dir() else part).write_text("half")
        raise ZeroDivisionError


def test_a_folder_in_place_of_a_file_is_in_the_way_and_a_file_of_that_name_is_replaced(tmp_path):
    (tmp_path / "report.html").write_text("old")
    check_folder(tmp_path, ("report.html", "new.html"))
    (tmp_path / "plan.csv").mkdir()
    with pytest.raises(SimulationError) as caught:
        check_folder(tmp_path, ("report.html", "plan.csv"))
    says = f"cannot be written (a folder of that name is in the way). {ADVICE}"
    assert str(caught.value) == f"{tmp_path / 'plan.csv'}: {says}"


def test_a_folder_that_is_not_made_yet_is_judged_by_the_one_above_it(tmp_path):
    check_folder(tmp_path / "a" / "b", ("x",))
    assert not (tmp_path / "a").exists()
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(
            SimulationError, match=r"cannot be written \(file is not a folder\)\. Choose another folder\.$"
        ):
            check_folder(folder, ())


def test_a_folder_without_the_right_to_write_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode: mode != os.W_OK)
    with pytest.raises(SimulationError, match=r"cannot be written \(no right to write there\)\."):
        check_folder(tmp_path, ())


def test_what_fails_leaves_the_old_file_and_nothing_beside_it(tmp_path):
    target = tmp_path / "new" / "numbers.csv"
    with atomic_file(target) as part:
        part.write_text("old")
        assert part.parent == target.parent
    with pytest.raises(ZeroDivisionError):
        fails(atomic_file(target))
    assert target.read_text() == "old"
    assert [path.name for path in target.parent.iterdir()] == ["numbers.csv"]
    if os.name != "nt":
        assert target.stat().st_mode & 0o777 == 0o644  # others read it, and only the user writes


def test_a_folder_that_was_made_for_what_fails_is_gone_and_one_that_was_there_stays(tmp_path):
    old = tmp_path / "old"
    old.mkdir()
    (old / "kept.txt").write_text("kept")
    for target in (old, tmp_path / "new"):
        with pytest.raises(ZeroDivisionError):
            fails(atomic_folder(target))
    assert [path.name for path in tmp_path.iterdir()] == ["old"]
    assert [path.name for path in old.iterdir()] == ["kept.txt"]
    with atomic_folder(tmp_path / "new") as part:
        (part / "a.txt").write_text("a")
        assert not (tmp_path / "new" / "a.txt").exists()
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["a.txt"]
