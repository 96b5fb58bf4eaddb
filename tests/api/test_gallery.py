"""Every notebook of the gallery is short, asks a question, answers it, and runs as plain Python without Jupyter."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from tests.scripts import DOCS

GALLERY = DOCS / "gallery"
NOTEBOOKS = sorted(path for path in GALLERY.glob("*.md") if path.name != "index.md")
CELL = re.compile(r"^```\{code-cell\}\n(?P<options>(?::[^\n]*\n)*)\n?(?P<code>.*?)^```$", re.MULTILINE | re.DOTALL)
LONGEST = 60
"""Lines of code that a reader sees: not those of cells that are removed, or folded (hide-input)."""

NAMES = [path.stem for path in NOTEBOOKS]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=NAMES)
def test_notebook_asks_a_question_and_answers_it_in_few_lines(path: Path):
    text = path.read_text(encoding="utf-8")
    cells = list(CELL.finditer(text))
    assert text.count("```{code-cell}") == len(cells)
    assert re.search(r"^# .+\?$", text, re.MULTILINE)
    assert "**Answer.**" in text
    shown = [cell["code"] for cell in cells if not re.search("remove-cell|hide-input", cell["options"])]
    assert 0 < len("".join(shown).splitlines()) <= LONGEST
    assert "assert " in "".join(cell["code"] for cell in cells if "remove-cell" in cell["options"])


def test_every_notebook_is_named_in_the_index():
    index = (GALLERY / "index.md").read_text(encoding="utf-8")
    assert [name for name in NAMES if f"({name}.md)" not in index] == []


@pytest.mark.thorough
@pytest.mark.parametrize("path", NOTEBOOKS, ids=NAMES)
def test_notebook_runs_and_its_answer_holds(path: Path, tmp_path: Path):
    code = "\n".join(cell["code"] for cell in CELL.finditer(path.read_text(encoding="utf-8")))
    environment = os.environ | {"MPLBACKEND": "Agg", "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    ran = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
