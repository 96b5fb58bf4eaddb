"""A validation that is written where an earlier one is: what it does not write itself is taken away, and nothing else."""

import json

import pytest

from stillhook.validate.certificate.certificate import NUMBERS, SOMETIMES, _clear

PICTURE, OWN = "step-3-controller.png", "notes.txt"


@pytest.fixture
def folder(tmp_path):
    for name in (*SOMETIMES, PICTURE, OWN):
        (tmp_path / name).write_text("earlier", encoding="utf-8")
    return tmp_path


def names(folder):
    return {path.name for path in folder.iterdir()}


def test_files_of_the_earlier_one_go_and_those_of_this_one_and_of_the_user_stay(folder):
    (folder / NUMBERS).write_text(json.dumps({"criteria": [], "complete": True, "verdict": ""}), encoding="utf-8")
    _clear(folder, (NUMBERS, SOMETIMES[0]))
    assert names(folder) == {NUMBERS, SOMETIMES[0], OWN}


@pytest.mark.parametrize("numbers", ["{}", "[]", "no numbers"])
def test_a_folder_of_something_else_is_left_as_it_is(folder, numbers):
    (folder / NUMBERS).write_text(numbers, encoding="utf-8")
    before = names(folder)
    _clear(folder, (NUMBERS,))
    assert names(folder) == before
