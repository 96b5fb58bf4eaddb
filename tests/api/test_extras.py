"""A core installation: without the libraries of the extras every command answers, and one line says what is left out
and how to get it."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest
from tests.commands import case_file

from stillhook.base.extras import EXTRAS

REPORT = 'Install what makes them: pip install "stillhook[report]".'
PICTURES = f"Pictures are left out. {REPORT}"
PICTURES_AND_PDF = f"Pictures and the PDF are left out. {REPORT}"
FILM = '--film: matplotlib is not installed. Get it with: pip install "stillhook[report]".'
NO_FIGURES = '--figures: matplotlib is not installed. Get it with: pip install "stillhook[report]".'
PARQUET = 'is Parquet, which takes the reader duckdb: pip install "stillhook[logs]".'
EXCEL = 'is Excel, which takes the reader openpyxl: pip install "stillhook[logs]".'
ANSWERED = {  # command -> its line, and what it writes
    "compare case.toml --controllers ssc": (PICTURES, {"runs.nc", "summary.json"}),
    'sea "jonswap Hs=2 m Tp=9 s"': (PICTURES, {"sea.json"}),
    'map case.toml --loads "50 t" --speeds "20 m/min"': (PICTURES, {"map.nc", "map.json"}),
    "friction compare crane-1": (PICTURES, {"friction-sets.json"}),
    "identify motor map.csv": (PICTURES, {"report.html", "models.json", "motor.toml"}),
    "plan template-to-1500m --tier closed-form": (PICTURES_AND_PDF, {"plan.nc", "plan.json", "report.html"}),
}
REFUSED = {  # before anything is computed
    "lower anchor-to-3000m --out no --film ssc": FILM,
    "report plan --figures": NO_FIGURES,
    "identify curve log.parquet": f"log.parquet: {PARQUET}",
    "identify motor map.parquet": f"map.parquet: {PARQUET} Or save it as CSV.",
    "identify motor map.xlsx": f"map.xlsx: {EXCEL} Or save it as CSV.",
}
CODE = f"""
import contextlib, importlib, io, json, pkgutil, shlex, sys
sys.modules.update(dict.fromkeys({tuple(EXTRAS)!r}))  # an import of None fails as that of what is not installed
import stillhook
from stillhook.analysis import linearise, operating_point
from stillhook.cli import run

answers = {{}}
for command in json.loads(sys.argv[1]):
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()) as err:
        code = run(shlex.split(command))
    answers[command] = code, out.getvalue(), err.getvalue()
point = operating_point(stillhook.load_crane("nov-250t"), "60 m/min", 1.0, load="0 t", s_w="100 m")
try:
    linearise(point).system()
except stillhook.StillhookError as problem:
    answers["python-control"] = 2, "", f"error: {{problem}}"
others = ("stillhook.__main__", "stillhook.kernels.")  # the program, and templates of kernels
for module in pkgutil.walk_packages(stillhook.__path__, "stillhook."):
    if not module.name.startswith(others):
        importlib.import_module(module.name)
print(json.dumps(answers))
"""


class Answer(NamedTuple):
    code: int
    out: str
    err: str

    @property
    def lines(self) -> list[str]:
        """Lines on standard error without those that a progress bar has written over."""
        return [line for part in self.err.splitlines() if (line := part.rpartition("\r")[2].strip())]


def folder_of(command: str) -> str:
    """Where a command writes: a folder called as its first word, or its second."""
    return command.split()[1 if command.startswith("identify") else 0]


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Answer]]:
    """All commands in one process in which no extra can be imported, and every module loaded there."""
    folder = tmp_path_factory.mktemp("core")
    case_file(folder, duration="20 s", warm_up="5 s")
    for name in ("log.parquet", "map.parquet", "map.xlsx"):
        (folder / name).write_bytes(b"PAR1" + bytes(64) + b"PAR1")
    commands = ["example motor-map map.csv", *(f"{each} --out {folder_of(each)}" for each in ANSWERED)]
    commands += ["report plan", *REFUSED, 'stability nov-250t --load "0 t" --s-w "100 m"']
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(
        [sys.executable, "-c", CODE, json.dumps(commands)], capture_output=True, text=True, cwd=folder, env=environment
    )
    assert done.returncode == 0, done.stderr
    return folder, {name: Answer(*answer) for name, answer in json.loads(done.stdout).items()}


@pytest.mark.long
@pytest.mark.parametrize("command", ANSWERED)
def test_a_command_leaves_its_pictures_out_with_one_line(core: tuple[Path, dict[str, Answer]], command: str) -> None:
    folder, answers = core
    line, files = ANSWERED[command]
    answer = answers[f"{command} --out {folder_of(command)}"]
    assert answer.code == 0, answer.err
    assert answer.lines.count(line) == 1
    written = {path.name for path in (folder / folder_of(command)).iterdir()}
    assert written >= files
    assert not any(name.endswith((".png", ".gif", ".pdf")) for name in written)
    assert all(name not in answer.out for name in (".png", "Traceback"))


@pytest.mark.long
def test_pages_have_their_tables_and_are_made_again_without_a_pdf(core: tuple[Path, dict[str, Answer]]) -> None:
    folder, answers = core
    page = (folder / "motor" / "report.html").read_text(encoding="utf-8")
    assert "<table" in page
    assert "<img" not in page
    assert answers["report plan"].code == 0
    assert answers["report plan"].lines.count(PICTURES_AND_PDF) == 1


@pytest.mark.long
def test_what_needs_an_extra_is_refused_in_one_line(core: tuple[Path, dict[str, Answer]]) -> None:
    folder, answers = core
    for command, line in REFUSED.items():
        assert (answers[command].code, answers[command].lines) == (2, [f"error: {line}"])
    assert not (folder / "no").exists()
    control = 'error: system(): control is not installed. Get it with: pip install "stillhook[stability]".'
    assert answers["python-control"].err == control
    assert answers['stability nov-250t --load "0 t" --s-w "100 m"'].code == 0
