"""A core installation: without the libraries of the extras every command answers, and one line says what is left out
and how to get it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from tests.commands import case_file

from stillhook.base.extras import EXTRAS

REPORT = 'Install what makes them: pip install "stillhook[report]".'
PICTURES = f"Pictures are left out. {REPORT}"
PICTURES_AND_PDF = f"Pictures and the PDF are left out. {REPORT}"
CORE = f"""
import sys
sys.modules.update(dict.fromkeys({tuple(EXTRAS)!r}))
"""
"""An import of a name whose place among the modules holds None fails as that of a library that is not installed."""
CASE = "case.toml"
MAP = [CASE, "--loads", "50 t", "--speeds", "20 m/min"]


def core(code: str, *arguments: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Code in a process of its own, in which no extra can be imported."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    return subprocess.run(
        [sys.executable, "-c", CORE + code, *arguments], capture_output=True, text=True, cwd=folder, env=environment
    )


def command(*arguments: str, folder: Path) -> subprocess.CompletedProcess[str]:
    return core("from stillhook.cli import run; sys.exit(run(sys.argv[1:]))", *arguments, folder=folder)


def lines(text: str) -> list[str]:
    """Lines without those that a progress bar has written over."""
    return [line for part in text.splitlines() if (line := part.rpartition("\r")[2].strip())]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "files"),
    [
        (["compare", CASE, "--controllers", "ssc"], {"runs.nc", "summary.json"}),
        (["sea", "jonswap Hs=2 m Tp=9 s"], {"sea.json"}),
        (["map", *MAP], {"map.nc", "map.json"}),
        (["friction", "compare", "crane-1"], {"friction-sets.json"}),
        (["stability", "nov-250t"], {"stability.json", "slow.nc"}),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else "",
)
def test_a_command_leaves_its_pictures_out_with_one_line(tmp_path: Path, arguments: list[str], files: set[str]) -> None:
    case_file(tmp_path, duration="20 s", warm_up="5 s")
    done = command(*arguments, "--out", "out", folder=tmp_path)
    assert done.returncode == (1 if arguments[0] == "stability" else 0), done.stderr  # it oscillates slowly under load
    assert lines(done.stderr).count(PICTURES) == 1
    written = {path.name for path in (tmp_path / "out").iterdir()}
    assert written >= files
    assert not any(name.endswith((".png", ".gif")) for name in written)
    assert all(name not in done.stdout for name in (".png", "Traceback"))


@pytest.mark.slow
def test_a_map_is_identified_and_its_page_has_no_picture(tmp_path: Path) -> None:
    assert command("example", "motor-map", "map.csv", folder=tmp_path).returncode == 0
    done = command("identify", "motor", "map.csv", "--out", "out", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert lines(done.stderr).count(PICTURES) == 1
    (page,) = (tmp_path / "out").glob("*.html")
    assert "<table" in page.read_text(encoding="utf-8")
    assert "<img" not in page.read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_plan_is_answered_with_a_page_in_place_of_a_pdf(tmp_path: Path) -> None:
    done = command("plan", "template-to-1500m", "--tier", "closed-form", "--out", "out", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert lines(done.stderr).count(PICTURES_AND_PDF) == 1
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"plan.nc", "plan.json", "report.html"}
    again = command("report", "out", folder=tmp_path)
    assert again.returncode == 0, again.stderr
    assert lines(again.stderr).count(PICTURES_AND_PDF) == 1
    asked = command("report", "out", "--figures", folder=tmp_path)
    assert asked.returncode == 2
    assert lines(asked.stderr) == [
        'error: --figures: matplotlib is not installed. Get it with: pip install "stillhook[report]".'
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (
            ["lower", "anchor-to-3000m", "--out", "out", "--animation"],
            '--animation: matplotlib is not installed. Get it with: pip install "stillhook[report]".',
        ),
        (
            ["identify", "curve", "log.parquet"],
            'log.parquet: is Parquet, which takes the reader polars: pip install "stillhook[logs]".',
        ),
        (
            ["identify", "motor", "map.parquet"],
            'map.parquet: is Parquet, which takes the reader polars: pip install "stillhook[logs]". Or save it as CSV.',
        ),
        (
            ["identify", "motor", "map.xlsx"],
            'map.xlsx: is Excel, which takes the reader openpyxl: pip install "stillhook[logs]". Or save it as CSV.',
        ),
    ],
    ids=lambda value: value[1] if isinstance(value, list) else "",
)
def test_what_needs_an_extra_is_refused_before_anything_is_computed(
    tmp_path: Path, arguments: list[str], says: str
) -> None:
    for name in ("log.parquet", "map.parquet", "map.xlsx"):
        (tmp_path / name).write_bytes(b"PAR1" + bytes(64) + b"PAR1")
    done = command(*arguments, folder=tmp_path)
    assert done.returncode == 2
    assert lines(done.stderr) == [f"error: {says}"]
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_every_module_of_the_package_loads_without_the_extras(tmp_path: Path) -> None:
    code = """
import pkgutil, importlib, stillhook
others = ("stillhook.__main__", "stillhook.kernels.")  # the program, and templates of kernels
for found in pkgutil.walk_packages(stillhook.__path__, "stillhook."):
    if not found.name.startswith(others):
        importlib.import_module(found.name)
"""
    done = core(code, folder=tmp_path)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_a_system_of_python_control_is_refused_in_one_line(tmp_path: Path) -> None:
    code = """
import stillhook
from stillhook.analysis import linearise, operating_point
point = operating_point(stillhook.load_crane("nov-250t"), "60 m/min", 1.0, load="0 t", s_w="100 m")
try:
    linearise(point).system()
except stillhook.StillhookError as problem:
    print(problem)
"""
    done = core(code, folder=tmp_path)
    assert done.stdout.strip() == (
        'system(): control is not installed. Get it with: pip install "stillhook[stability]".'
    )
