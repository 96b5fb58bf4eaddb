"""A winch type that there is not is refused in one line, and what a known type means is said everywhere."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path
from typing import Any

import pytest
from tests.commands import case_file

from stillhook import library, load_crane
from stillhook.cli import run
from stillhook.errors import SpecError
from stillhook.library import changed
from stillhook.spec.crane import Plant
from stillhook.winches.registry import WINCH_TYPES


def test_a_crane_file_with_a_winch_type_that_there_is_not_is_refused_in_one_line():
    with pytest.raises(SpecError) as refused:
        changed(load_crane("nov-250t"), {"plant": "steam"})
    assert str(refused.value).count("\n") == 0
    assert "plant" in str(refused.value)
    assert all(name in str(refused.value) for name in WINCH_TYPES)


def test_every_winch_type_has_a_name_in_crane_files_and_rows_for_its_numbers():
    assert set(Plant) == set(WINCH_TYPES)
    for each in WINCH_TYPES.values():
        assert {row.name for row in each.rows} == set(each.module.Signals._fields)
        assert all(row.meaning for row in (*each.rows, *each.numbers))


def test_a_question_about_a_circuit_that_a_winch_does_not_have_is_one_line():
    crane = load_crane("nov-250t")
    bare = crane.model_copy()
    bare.__dict__.pop("active")
    with pytest.raises(SpecError, match="has no closed circuit, on which this question rests"):
        bare.active.motor  # noqa: B018


PURE, SINKS, OFFSET = (
    "nov-100t-pure-active",
    "nothing compensates leakage in manual mode",
    "the load is held by the pumps against leakage",
)


def found(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[str, dict[str, Any]]:
    """What a command prints for people, and as JSON."""
    run([*words, "--verbose"])
    text = capsys.readouterr().out
    run([*words, "--json"])
    return " ".join(text.split()), json.loads(capsys.readouterr().out)


@pytest.mark.thorough
@pytest.mark.parametrize(
    "words",
    [
        f"envelope {PURE} --loads '60 t' --controllers ns,ssc",
        f"map {PURE} --controllers ns,ssc --loads '60 t' --speeds '10 m/min'",
        f"tune {PURE} --controllers ssc --loads '60 t' --speeds '10 m/min' --periods '10 s'",
        f"uncertainty {PURE} --load '60 t' --controllers ns,ssc --draws 16",
    ],
    ids=lambda words: words.split()[0],
)
def test_a_pure_active_winch_tells_of_its_offset_in_every_answer(words: str, capsys):
    text, data = found(capsys, *shlex.split(words))
    assert OFFSET in text
    assert any(OFFSET in note and "with 60 t" in note for note in data["notes"])


@pytest.mark.slow
def test_more_oil_than_the_accumulator_takes_is_said_of_a_map(tmp_path, capsys):
    case = case_file(tmp_path, tip="sine 1 m 30 s", duration="80 s", warm_up="10 s")
    words = ["map", case, "--controllers", "ns", "--loads", "250 t", "--speeds", "120 m/min"]
    text, data = found(capsys, *words)
    assert "the piston will run into its ends" in text
    assert any("accumulator's stroke" in note for note in data["notes"])


LIFT = """
crane = "nov-100t-pure-active"
start_depth = "-10 m"
duration = "40 s"
[payload]
name = "box"
mass = "60 t"
shape = "box"
length = "5 m"
width = "4 m"
height = "3 m"
[tip]
height = "30 m"
motion = "sine 0.3 m 9 s"
[water]
depth = "100 m"
[wire]
nodes = 3
[[phase]]
mode = "ahc"
time = "10 s"
"""
LOWERED = """
[[phase]]
mode = "manual"
speed = "6 m/min"
time = "10 s"
"""


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("stages", "brake", "sinks"),
    [("", False, False), (LOWERED, False, True), (LOWERED, True, False)],
    ids=["compensated", "then lowered manually", "with a brake that holds at rest"],
)
def test_a_lowering_with_a_pure_active_winch_tells_of_offset_and_sinking(
    stages: str, brake: bool, sinks: bool, tmp_path: Path, capsys
):
    written = (Path(library.__file__).parent / "data" / "cranes" / f"{PURE}.toml").read_text(encoding="utf-8")
    without = re.sub(r"(?ms)^\[brake\]\n.*?(?=^\[)", "", written)
    assert "[brake]" in written
    assert "[brake]" not in without
    (tmp_path / "pure.toml").write_text(written if brake else without, encoding="utf-8")
    (tmp_path / "box.toml").write_text(LIFT.replace(f'"{PURE}"', '"pure.toml"') + stages)
    text, data = found(capsys, "lower", str(tmp_path / "box.toml"))
    assert OFFSET in text
    assert any(OFFSET in note for note in data["notes"])
    assert any(SINKS in note for note in data["notes"]) is sinks
