"""What is said of a result: every code has one template, is used, and gets the values that its template takes."""

import ast
import string
from pathlib import Path

import pytest

import stillhook.validate
from stillhook.validate.criteria.results import NOTES, Measure, Note

SOURCES = sorted(Path(stillhook.validate.__file__).parent.rglob("*.py"))
TEXT = "".join(path.read_text(encoding="utf-8") for path in SOURCES)
CALLS = [
    node
    for path in SOURCES
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Note" and isinstance(node.args[0], ast.Constant)
]
FAMILIES = ("ends-", "lacks-", "outside-", "wire-by-", "map-", "by-", "line-")
"""Codes of which a name is a part."""


def fields(code: str) -> set[str]:
    parsed = [x for x in string.Formatter().parse(NOTES[code]) if x[1]]
    inner = {f for *_, spec, _ in parsed for _, f, *_ in string.Formatter().parse(spec or "") if f}
    return {field for _, field, *_ in parsed} | inner


def test_every_code_has_a_template_and_every_template_is_used():
    assert {call.args[0].value for call in CALLS} <= NOTES.keys()
    unused = {code for code in NOTES if f'"{code}"' not in TEXT and not code.startswith(FAMILIES)}
    assert not unused


@pytest.mark.parametrize("call", [c for c in CALLS if all(k.arg for k in c.keywords)], ids=lambda c: c.args[0].value)
def test_a_template_takes_the_values_of_its_code(call):
    assert fields(call.args[0].value) <= {k.arg for k in call.keywords}


def test_values_are_shown_in_their_units_and_signs_choose_words():
    note = Note("reference", lag=-0.0153)
    assert note == "the PLC's tip is 15 ms earlier than the logged one"
    assert (note.code, note.values) == ("reference", {"lag": -0.0153})
    assert Note("speed-of-flow", error=0.0123).startswith("with full pumps the winch is 1.23 % faster")
    assert Note("lengths-apart", layers=1.0).endswith("1 layer of the drum apart")
    assert Note("by-test", each={"a": 1e5, "b": 3e5}, form="pressure 2") == "1 bar (a) to 3 bar (b) by test"
    assert Note("clock-by", rates=["v_w", "v_tip"]) == "v_w and v_tip agree on it"


def test_a_measure_has_the_codes_of_its_causes_next_to_the_text():
    m = Measure.of("lever_error", 0.01, Note("gear", log=28.0, file=27.0), "", Note("any-of-these"))
    assert m.note == "the gear ratio is 28, not 27; any of these"
    assert m.to_dict()["causes"] == ["gear", "any-of-these"]
    assert Measure.of("lever_error", None).note  # what to log, by the table of measures
