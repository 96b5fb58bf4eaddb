"""What a command imports: libraries that take a tenth of a second and more come only with what uses them."""

import inspect
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest
import typer
from tests.commands import case_file

from stillhook.cli import COMMANDS, app, run
from stillhook.kernels.c99.library import compiler

ALWAYS_HEAVY = {
    "dask",
    "distributed",
    "pandas",
    "pint",
    "matplotlib",
    "numba",
    "control",
    "typst",
    "CoolProp",
    "openpyxl",
}
"""Libraries that none of these commands needs."""
PARTS_OF_SCIPY = ("scipy.optimize", "scipy.integrate", "scipy.linalg", "scipy.signal", "scipy.stats", "scipy.special")
NOT_CHECKED = (
    "stillhook.analysis.loop_stability",
    "stillhook.analysis.steady",
    "stillhook.plan.answer",
    "stillhook.plan.planning",
    "stillhook.plan.report.document",
    "stillhook.plan.tiers.closed_form",
    "stillhook.plan.tiers.frequency",
    "stillhook.plan.tiers.time_domain",
    "stillhook.plan.tiers.winch_residual",
    "stillhook.response.winch.identify",
)
"""Rooms of what a plan computes and reports, of which its check shows nothing."""
SMALL_MAP = ["--loads", "50 t", "--speeds", "20 m/min"]


def imported(*arguments: str, environment: Mapping[str, str] | None = None) -> set[str]:
    """Modules that are loaded after a command has run in a process of its own."""
    code = "import sys; from stillhook.cli import run; run(sys.argv[1:]); print(*sys.modules, file=sys.stderr)"
    paths = {"PYTHONPATH": os.pathsep.join(sys.path), **(environment or {})}
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True, env=os.environ | paths
    )
    return set(done.stderr.splitlines()[-1].split())


@pytest.mark.slow
def test_help_of_the_program_needs_no_numbers_and_no_command() -> None:
    modules = imported("--help")
    heavy = {*ALWAYS_HEAVY, "numpy", "scipy", "xarray", "duckdb", "pydantic", "rich.markdown", "rich.traceback"}
    assert heavy & modules == set()
    assert {name for name in modules if name.startswith("stillhook.cli.")} == {
        "stillhook.cli.groups",
        "stillhook.cli.names",
    }


@pytest.mark.long
@pytest.mark.parametrize(("name", "options"), [("compare", []), ("map", SMALL_MAP)])
def test_runs_need_no_tables_and_no_search(name: str, options: list[str], tmp_path: Path) -> None:
    """Kernels that are compiled already do not ask for their compiler."""
    command = [name, case_file(tmp_path, duration="10 s", warm_up="2 s"), *options]
    run(command)
    heavy = {*ALWAYS_HEAVY, *PARTS_OF_SCIPY, "xarray", "duckdb"}
    if compiler() is None:
        heavy.remove("numba")
    assert heavy & imported(*command) == set()


@pytest.mark.long
def test_the_check_of_a_plan_needs_no_search_the_second_time() -> None:
    command = ["plan", "template-to-1500m", "--check"]
    run(command)
    modules = imported(*command)
    assert {*ALWAYS_HEAVY, *PARTS_OF_SCIPY, "xarray"} & modules == set()
    assert {name for name in modules if name.startswith(NOT_CHECKED)} == set()


@pytest.mark.parametrize("name", COMMANDS)
def test_the_program_shows_the_help_that_the_command_has(name: str) -> None:
    program = typer.main.get_command(app)
    outline, command = program.get_command(None, name), program.commands[name]
    assert outline.name == command.name == name
    assert outline.help
    assert outline.help == inspect.cleandoc(command.help).split("\n\n")[0]
