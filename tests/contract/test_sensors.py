"""A sensor of a user: commands run through it, and a crane file that cannot have it is refused in one line."""

from __future__ import annotations

import json
import shlex
import subprocess
from pathlib import Path

import pytest
from tests.contract.commands import OF_CONTROLLER, Answer, printed_files
from tests.contract.test_extensions import ROOT, python

FACTOR = '''"""Every quantity that a sensor may read, times k."""
from typing import Annotated, NamedTuple

from stillhook.control.interface import Setting
from stillhook.control.interface import QUANTITIES
from stillhook.physics.scalar import scalar

NAME, TITLE, QUANTITY = "factor", "all quantities by a factor", QUANTITIES


class Settings(NamedTuple):
    k: Annotated[float, Setting("", 1.0, "factor", most=10.0)]


@scalar
def reading(true, h, s):
    return s.k * true
'''


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Folder with the files of the page, and two sensors that read alike but for their quantities."""
    for name, text in printed_files().items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "factor.py").write_text(FACTOR, encoding="utf-8")
    cell = FACTOR.replace('"factor", "all', '"cell", "all').replace('by a factor", QUANTITIES', 'by a factor", "F"')
    (tmp_path / "cell.py").write_text(cell, encoding="utf-8")
    for name, quantity in (("gauge", "p_a"), ("difference", "dp")):
        (tmp_path / f"{name}.py").write_text(cell.replace('"cell"', f'"{name}"').replace('"F"', f'"{quantity}"'))
    return tmp_path


def ran(folder: Path, *arguments: str, known: bool = True) -> subprocess.CompletedProcess[str]:
    """A process that knows the sensors, or none."""
    modules = (
        [folder / f"{name}.py" for name in ("measuring_wheel", "factor", "cell", "gauge", "difference")]
        if known
        else []
    )
    return python(*arguments, extensions=modules, folder=folder)


@pytest.mark.long
def test_every_way_to_run_a_winch_reads_through_its_sensors(folder: Path) -> None:
    run = ran(
        folder, "-m", "pytest", "-q", "-n", "0", "-m", "not thorough", str(ROOT / "tests/contract/sensor_runs.py")
    )
    assert run.returncode == 0, run.stdout


@pytest.mark.thorough
def test_every_winch_type_has_sensors(folder: Path) -> None:
    run = ran(folder, "-m", "pytest", "-q", "-n", "0", "-m", "thorough", str(ROOT / "tests/contract/sensor_runs.py"))
    assert run.returncode == 0, run.stdout


@pytest.mark.thorough
def test_every_command_runs_on_a_crane_with_a_sensor(folder: Path) -> None:
    words = ("-m", "tests.contract.commands", "our-crane.toml", "ssc", str(folder), *OF_CONTROLLER)
    run = ran(folder, *words)
    assert run.returncode == 0, run.stderr
    for command, answer in json.loads(run.stdout).items():
        assert Answer(*answer).given, f"{command}: {answer}"


TABLE = "[sensors.measuring_wheel]"


@pytest.mark.long
@pytest.mark.parametrize(
    ("before", "after", "line"),
    [
        ("measuring_wheel]", "measuring_weel]", "sensors: measuring_weel is not a sensor that is loaded. Choose"),
        ("slip = 0.01", "slip = 0.6", "sensors.measuring_wheel.slip = 0.6: it must be less than or equal to 0.5"),
        ("slip =", "slipp =", 'sensors.measuring_wheel.slipp: unknown field; did you mean "slip"?'),
        ('"20 ms"', "0.02", "sensors.measuring_wheel.tau = 0.02: a bare number"),
        (TABLE, "[sensors.factor]\n" + TABLE, "sensors: measuring-wheel and factor both read s_w. Remove one"),
    ],
)
def test_a_crane_file_is_refused_in_one_line(before: str, after: str, line: str, folder: Path) -> None:
    crane = folder / "our-crane.toml"
    crane.write_text(crane.read_text(encoding="utf-8").replace(before, after), encoding="utf-8")
    run = ran(folder, "-m", "stillhook", "crane", "our-crane.toml")
    assert Answer(run.returncode, run.stderr).refused, run.stderr
    assert line in run.stderr


@pytest.mark.long
def test_a_crane_whose_sensor_is_not_loaded_is_refused(folder: Path) -> None:
    run = ran(folder, "-m", "stillhook", "crane", "our-crane.toml", known=False)
    assert Answer(run.returncode, run.stderr).refused, run.stderr
    assert (
        "measuring_wheel is not a sensor that is loaded. Name the file of its module in STILLHOOK_EXTENSIONS"
        in run.stderr
    )


@pytest.mark.long
@pytest.mark.parametrize(
    "command",
    [
        "stability our-crane.toml --alpha-m 1 --full --load '50 t' --v-tip '10 m/min'",
        "envelope our-crane.toml --controllers ssc --loads '30 t'",
    ],
)
def test_a_method_whose_plc_reads_true_values_says_so(command: str, folder: Path) -> None:
    for kind in ([], ["--json"]):
        run = ran(folder, "-m", "stillhook", *shlex.split(command), *kind)
        assert run.returncode in (0, 1), run.stderr
        assert "without measuring-wheel: this method's PLC reads true values" in run.stdout


@pytest.mark.long
def test_machine_code_of_a_sensor_is_not_used_after_an_edit(folder: Path) -> None:
    say = (
        "from stillhook.kernels.build import Setup, _folder;"
        "print(*(_folder('pure-active', Setup(sensors=s), ()) for s in ((), ('cell',))))"
    )
    before = ran(folder, "-c", say).stdout.split()
    with (folder / "cell.py").open("a", encoding="utf-8") as module:
        module.write("# edited\n")
    after = ran(folder, "-c", say).stdout.split()
    assert before[0] == after[0] == "pure-active"
    assert before[1].startswith("pure-active-cell-")
    assert before[1] != after[1]
