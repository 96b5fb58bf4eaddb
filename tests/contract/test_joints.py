"""A unit between hook and slings of a user is checked when it is loaded: a broken line, and the words that name it."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest
from tests.contract.commands import printed_files

from stillhook.errors import SpecError
from stillhook.winches.load_path.registry import UNITS, check_module

TEXT, WITH_BODY = (printed_files()[name] for name in ("shock_absorber.py", "upper_load.py"))


def module_of(text: str, folder: Path) -> ModuleType:
    file = folder / "mine.py"
    file.write_text(text, encoding="utf-8")
    spec = importlib.util.spec_from_file_location("mine", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", UNITS)
def test_the_units_of_the_package_keep_the_contract(name: str) -> None:
    check_module(UNITS[name])


@pytest.mark.parametrize("text", [TEXT, WITH_BODY], ids=["unit", "body"])
def test_the_units_of_the_how_to_keep_it(text: str, tmp_path: Path) -> None:
    check_module(module_of(text, tmp_path))


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("TITLE = ", "HEAD = ", "TITLE is missing"),
        ('NAME = "shock-absorber"', 'NAME = "Shock"', "Unit.type is not"),
        (
            "def energy(x, sling, link)",
            "def energy(x, link, sling)",
            "energy(x, link, sling). It must be energy(x, sling",
        ),
        ("@scalar\ndef pull(", "def pull(", "pull is not decorated with @scalar"),
        ("def blank():", "def blank(a):", "blank(a). It must be blank()"),
        ("    e: float\n", "    e: int\n", "Link.e is annotated as int"),
        (
            's_a: Annotated[float, Row("m", "length", "shortest 0", "stroke of the shock absorber")]',
            "s_a: float",
            "Signals.s_a",
        ),
        ("class Unit(JointUnit):", "class Unit:", "Unit is not a JointUnit"),
        ('    type: Literal["shock-absorber"] = "shock-absorber"\n', '    type: str = "other"\n', "Unit.type is not"),
        ("    def travel(self):", "    def reach(self):", "Unit.travel is missing"),
        ('"s_a_max": Row("m", "length", "", "largest stroke of the shock absorber"),', "", "differ in s_a_max"),
        ('EXTENSION, STOPS, LIMIT = "s_a"', 'EXTENSION, STOPS, LIMIT = "s_b"', 'EXTENSION = "s_b"'),
        ('("s_a_stop_time",), "shock', '("stop_time",), "shock', "STOPS"),
        ('SUMMED, LOWEST = ("at_stop",)', 'SUMMED, LOWEST = ("at_stops",)', "SUMMED"),
        (
            "def moved(",
            "def goes_on(",
            "heights and foresee and work alone. A unit with a body of its own needs heights, ",
        ),
        ("def work(w, x,", "def work(x, w,", "work(x, w, v_up, v_down, h, sling, before, link). It must be work(w, x,"),
        ("@scalar\ndef foresee(", "def foresee(", "foresee is not decorated with @scalar"),
        ("def numbers(stats):\n", "def numbers(a):\n    stats = a\n", "numbers(a). It must be numbers(stats)"),
    ],
)
def test_each_fault_is_one_line_with_file_and_attribute(before: str, after: str, words: str, tmp_path: Path) -> None:
    text = TEXT if before in TEXT else WITH_BODY
    assert before in text
    with pytest.raises(SpecError) as problem:
        check_module(module_of(text.replace(before, after, 1), tmp_path))
    assert str(problem.value).startswith("mine.py: ")
    assert words in str(problem.value)
    assert "\n" not in str(problem.value)
