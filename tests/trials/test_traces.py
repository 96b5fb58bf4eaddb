"""Which tests run a place: functions of a line, traces of tests, and the order in which they are taken."""

import os
import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest
from trials.mutants.traces import Traces, functions_of
from trials.mutants.tree import Only

ROOT = Path(__file__).resolve().parents[2]
A = """LIMIT = 3
def f(x, most=1):
    return x < LIMIT
class A:
    size = 4
    def g(self):
        def inside():
            return f(self.size)
        return inside()
"""
B = """from stillhook.a import LIMIT, f
def h(x):
    return [y for y in x if y > LIMIT]
def unseen():
    return f(1)
"""
TESTS = """import pytest
from stillhook.a import A, f
from stillhook.b import h
@pytest.mark.parametrize("x", [1, 2])
def test_f(x): assert f(x)
def test_all(): assert f(2) and not A().g() and h([4])
@pytest.mark.slow
def test_slow(): assert f(1)
"""


@pytest.fixture
def root(tmp_path: Path) -> Path:
    for file, text in {"src/stillhook/a.py": A, "src/stillhook/b.py": B, "tests/test_a.py": TESTS}.items():
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_text(text, encoding="utf-8")
    (tmp_path / "src/stillhook/__init__.py").touch()
    return tmp_path


@pytest.mark.parametrize(
    ("file", "line", "functions"),
    [
        ("a", 1, ["a.py:f", "b.py:h"]),  # a constant: who names it, and imports it
        ("a", 2, ["a.py:f"]),  # a default in a signature
        ("a", 5, ["a.py:A.g.<locals>.inside", "a.py:A.g"]),
        ("a", 8, ["a.py:A.g.<locals>.inside"]),
        ("b", 3, ["b.py:h"]),
    ],
)
def test_a_line_belongs_to_a_function_and_a_constant_to_those_that_name_it(root, file, line, functions):
    found = functions_of(root, f"src/stillhook/{file}.py", line)
    assert sorted(found) == sorted(f"src/stillhook/{name}" for name in functions)


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="a timer of the processor")
def test_quick_tests_that_run_little_else_come_first_and_one_case_of_each_before_the_next(root):
    shutil.copytree(ROOT / "trials" / "mutants", root / "trials" / "mutants")
    (root / "trials" / "__init__.py").touch()
    said: list[str] = []
    for _ in range(2):  # the second time from the kept file
        traces = Traces(root, root)
        traces.update(said.append, 1)
        tests = traces.tests("src/stillhook/a.py", 3, 9.0)
        assert [test.split("[")[0] for test in tests] == [
            f"tests/test_a.py::{n}" for n in ("test_f", "test_all", "test_f")
        ]
        assert len({*tests}) == 3
        assert traces.tests("src/stillhook/a.py", 9, 9.0) == ["tests/test_a.py::test_all"]
        assert len(traces.tests("src/stillhook/a.py", 3, 0.0)) == 0
        assert traces.tests("src/stillhook/b.py", 5, 9.0) == []
    assert said == ["tests are traced: 1 of 1 files"]


def test_chosen_tests_alone_are_run_in_their_order_those_of_a_file_together():
    items = [SimpleNamespace(nodeid=name) for name in ("a::1", "a::2", "a::3", "b::1", "b::2")]
    Only(["b::2", "a::3", "b::1", "a::1"]).pytest_collection_modifyitems(items)
    assert [item.nodeid for item in items] == ["b::2", "b::1", "a::3", "a::1"]
