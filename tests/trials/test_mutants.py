"""The mutation runner: what is changed and what is not, the draw, and a small repository in which one mutant is killed, one
hangs and one survives."""

import ast
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from trials.mutants.choice import Choice
from trials.mutants.run import Outcome, failed, read, verdict
from trials.mutants.sites import Mutant, draw, every, numbers, sites
from trials.mutants.table import survivors, table
from trials.mutants.tree import OVER, STOPPED, Ended

ROOT = Path(__file__).resolve().parents[2]
SOURCE = '''"""Text with 1 < 2."""
LIMIT: Literal[3] = 0.5  # µ = 7
@lru_cache(maxsize=8)
def inside(x: Annotated[float, 9], most=1e-9):
    """Between 0 and 1."""
    if µ == 0 and not x is None: return f"{x:.3g} of {100 * x}"
    return 0.0 <= x < (
        LIMIT)
class A:
    def __repr__(self):
        return "A" * 2
'''


def written(source: str) -> list[tuple[int, str, tuple[str, ...]]]:
    return [(site.line, site.before, site.after) for site in sites(source.encode())]


def test_numbers_and_comparisons_are_changed_and_texts_annotations_and_decorators_are_not():
    assert written(SOURCE) == [
        (2, "0.5", ("1.0", "0.25")),
        (4, "1e-9", ("1.0",)),
        (6, "==", ("!=",)),
        (6, "0", ("1",)),
        (6, "is", ("is not",)),
        (7, "0.0", ("1.0",)),
        (7, "<=", ("<", ">")),
        (7, "<", ("<=", ">=")),
    ]


def test_integers_become_their_neighbours_and_roundings_one():
    assert (numbers(3), numbers(0), numbers(2.5)) == (("4", "2"), ("1",), ("5.0", "1.25"))
    assert numbers(1e-6) == ("1.0",)
    assert numbers(2e-6) == ("4e-06", "1e-06")


def test_a_mutant_is_the_source_with_one_change_in_its_line(tmp_path):
    file = tmp_path / "a.py"
    file.write_text(SOURCE, encoding="utf-8")
    mutants = every(tmp_path, "a.py", range(1, 99))
    assert len(mutants) == 11
    for mutant in mutants:
        changed = mutant.apply(SOURCE.encode()).decode()
        ast.parse(changed)
        differ = [
            i for i, (a, b) in enumerate(zip(SOURCE.splitlines(), changed.splitlines(), strict=True), 1) if a != b
        ]
        assert differ == [mutant.line]


@pytest.mark.long
def test_a_seed_draws_the_same_places_again_and_another_seed_others():
    first, again, other = draw(ROOT, 1, 20), draw(ROOT, 1, 20), draw(ROOT, 2, 20)
    assert first == again
    assert len({(m.file, m.begin) for m in first}) == 20
    assert not set(first) & set(other)
    assert draw(ROOT, 1, 30)[:20] == first  # a larger sample begins with the smaller one


@pytest.mark.long
def test_the_tests_of_a_module_come_first():
    choice = Choice(ROOT)
    assert "tests/identify/test_pairs.py" in choice.tests("src/stillhook/identify/steady_state/pairs.py")[:2]
    assert "tests/conservation/test_lines.py" in choice.tests("src/stillhook/physics/hydraulics/lines.py")[:2]
    assert "tests/plan/test_closed_form.py" in choice.tests("src/stillhook/plan/tiers/closed_form.py")[:2]
    assert "tests/analysis/test_metrics.py" in choice.tests("src/stillhook/metrics.py")[:2]


def test_a_failed_test_kills_and_the_end_of_the_time_that_tests_are_given_does_not():
    text = "...F\nFAILED tests/a/test_b.py::test_c[x of y - 2] - assert 1 == 2\n1 failed, 3 passed\n"
    assert failed(text) == ["tests/a/test_b.py::test_c[x of y - 2]"]
    assert verdict(Ended(1, 2.0, text), ["t"]) == ("killed", "tests/a/test_b.py::test_c[x of y - 2]")
    assert verdict(Ended(0, 2.0, ""), ["t", "u"]) == ("survived", "t, u")
    assert verdict(Ended(OVER, 2.0, ""), ["t"]) == ("survived", "t (as many as there was time for)")
    assert verdict(Ended(STOPPED, 2.0, "..\nSIGXCPU"), ["t"]) == ("stopped", "SIGXCPU")
    assert verdict(Ended(2, 2.0, "ERROR tests/a/test_b.py - NameError"), ["t"]) == ("killed", "tests/a/test_b.py")


def test_rooms_and_survivors_are_told(tmp_path):
    one = Outcome(Mutant("src/stillhook/sea/a.py", 0, 1, 7, "<", "<="), "killed", "tests/x.py::y", 1.0, "if a < b:")
    two = Outcome(Mutant("src/stillhook/plan/b.py", 5, 8, 9, "0.5", "1.0"), "survived", "tests/z.py", 1.0, "x = 0.5")
    assert "| plan | 1 | 0 |  |\n| sea | 1 | 1 |  |\n| numbers | 1 | 0 |" in table([one, two])
    assert table([one, two]).endswith("| all | 2 | 1 |  |\n")
    assert survivors([one, two]) == "src/stillhook/plan/b.py:9: 0.5 -> 1.0\n    x = 0.5\n    tests/z.py\n"
    kept = tmp_path / "kept.jsonl"
    kept.write_text(f"{json.dumps(one)}\n{json.dumps(two)}\n{json.dumps(two)[:40]}")
    assert read(kept) == {one.mutant: one, two.mutant: two}


@pytest.mark.long
@pytest.mark.skipif(os.name == "nt" or not shutil.which("git"), reason="processes are forked, files listed by git")
def test_in_a_small_repository_one_is_killed_one_hangs_and_one_survives(tmp_path):
    package = tmp_path / "src" / "stillhook" / "room"
    package.mkdir(parents=True)
    (package.parent / "__init__.py").write_text("")
    (package / "__init__.py").write_text("")
    (package / "count.py").write_text(
        "def count(n):\n    while n > 3:\n        n -= 1\n    return n\n\n\ndef unseen():\n    return 4\n"
    )
    tests = tmp_path / "tests" / "room"
    tests.mkdir(parents=True)
    (tests / "test_count.py").write_text(
        "from stillhook.room.count import count\n\n\ndef test_it_ends():\n    assert count(6) == 3\n"
    )
    shutil.copytree(ROOT / "trials" / "mutants", tmp_path / "trials" / "mutants")
    (tmp_path / "trials" / "__init__.py").write_text("")
    tree = tmp_path / "trials" / "mutants" / "tree.py"
    tree.write_text(tree.read_text().replace("HANGS = 60.0", "HANGS = 3.0"))
    run = tmp_path / "trials" / "mutants" / "run.py"
    run.write_text(run.read_text().replace("BUDGET, COMPILING = 45.0", "BUDGET, COMPILING = 1.0"))
    subprocess.run(["git", "init", "-q"], cwd=tmp_path, check=True)

    def mutants() -> list[str]:
        command = [sys.executable, "-m", "trials.mutants", "--file", "src/stillhook/room/count.py", "--workers", "2"]
        environment = os.environ | {"PYTHONPATH": str(tmp_path)}
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
        return done.stdout.splitlines()

    lines = mutants()
    assert (
        sorted(line.split()[1] for line in lines if line[:1].isdigit())
        == ["killed"] * 5 + ["stopped"] + ["survived"] * 2
    )
    assert "| all | 8 | 6 | 1 |" in lines
    assert [line for line in lines if line.startswith("src/")] == [
        "src/stillhook/room/count.py:8: 4 -> 5",
        "src/stillhook/room/count.py:8: 4 -> 3",
    ]
    assert lines[0] == "tests are traced: 1 of 1 files"
    assert mutants()[-len(lines) + 9 :] == lines[9:]  # what is kept is neither traced nor run again
    assert (package / "count.py").read_text().startswith("def count(n):\n    while n > 3:")
