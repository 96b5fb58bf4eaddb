"""A controller and a winch type of a user: the examples of the how-to pages run as they are printed, and a module that
cannot be one is refused in one line."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from tests.commands import case_file
from tests.contract.commands import (
    BOTH,
    CASE,
    OF_CLOSED_CIRCUITS,
    OF_CONTROLLER,
    OF_NUMBERS,
    Answer,
    printed_files,
)
from tests.scripts import DOCS

ROOT = DOCS.parent
LIFTS = ROOT / "src" / "stillhook" / "library" / "data" / "lifts"
MEANINGLESS = OF_CLOSED_CIRCUITS | {command: f"has no {number}" for command, number in OF_NUMBERS.items()}
"""Commands that have no meaning for the example's winch -> what their one line says."""


@pytest.fixture
def example(tmp_path: Path) -> Path:
    """Folder with the files of both pages."""
    for name, text in printed_files().items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def python(*arguments: str, extensions: list[Path], folder: Path) -> subprocess.CompletedProcess[str]:
    """A process that knows the user's modules."""
    paths = os.pathsep.join([str(ROOT / "src"), str(ROOT)])
    environment = os.environ | {"STILLHOOK_EXTENSIONS": os.pathsep.join(map(str, extensions)), "PYTHONPATH": paths}
    command = [sys.executable, *arguments]
    return subprocess.run(command, env=environment, cwd=folder, capture_output=True, text=True)


def found(crane: str, *commands: str, folder: Path, mode: str = "ssc-pi") -> dict[str, Answer]:
    """Answers of some commands on a crane under a controller, that of the example unless another is named."""
    place = folder / "answers"
    place.mkdir()
    modules = [folder / "torque_drive.py", folder / "ssc_pi.py"]
    words = ("-m", "tests.contract.commands", crane, mode, str(place), *commands)
    run = python(*words, extensions=modules, folder=folder)
    assert run.returncode == 0, run.stderr
    return {command: Answer(*answer) for command, answer in json.loads(run.stdout).items()}


def test_the_pages_print_modules_a_crane_and_their_tests(example: Path) -> None:
    names = {path.name for path in example.iterdir()}
    assert names == {"ssc_pi.py", "test_ssc_pi.py", "torque_drive.py", "my-winch.toml", "test_torque_drive.py"} | {
        "shock_absorber.py",
        "test_shock_absorber.py",
        "upper_load.py",
        "test_upper_load.py",
        "measuring_wheel.py",
        "our-crane.toml",
        "ssc_leak.py",
        "test_ssc_leak.py",
        "test_measuring_wheel.py",
    }


@pytest.mark.long
def test_both_modules_are_known_by_their_names(example: Path) -> None:
    modules = [example / "torque_drive.py", example / "ssc_pi.py"]
    shown = python("-m", "stillhook", "crane", "my-winch.toml", "--json", extensions=modules, folder=example)
    assert shown.returncode == 0, shown.stderr
    assert '"torque-drive"' in shown.stdout
    helped = python("-m", "stillhook", "compare", "--help", extensions=modules, folder=example)
    assert "ssc-pi" in helped.stdout


@pytest.mark.thorough
def test_every_command_runs_with_the_example_controller(example: Path) -> None:
    for command, answer in found("nov-100t-pure-active", *OF_CONTROLLER, folder=example).items():
        assert answer.given, f"{command}: {answer.error}"


@pytest.mark.thorough
def test_every_command_runs_on_the_example_winch_or_says_why_not(example: Path) -> None:
    crane = str(example / "my-winch.toml")
    for command, answer in found(crane, *BOTH, folder=example, mode="position").items():
        reason = MEANINGLESS.get(command)
        if reason is None:
            assert answer.given, f"{command}: {answer.error}"
        else:
            assert answer.refused, f"{command}: {answer.error}"
            assert reason in answer.error


@pytest.mark.thorough
@pytest.mark.parametrize(
    "name", ["ssc_pi", "ssc_leak", "torque_drive", "shock_absorber", "upper_load", "measuring_wheel"]
)
def test_the_tests_of_the_examples_pass(name: str, example: Path) -> None:
    run = python("-m", "pytest", "-q", f"test_{name}.py", extensions=[example / f"{name}.py"], folder=example)
    assert run.returncode == 0, run.stdout


UNIT = """
[compensator]
type = "shock-absorber"
stroke = "1.2 m"
preload = "850 kN"
spring = "160 kN/m"
height = "2 m"
weight = "1.5 t"
"""


def with_unit(folder: Path, unit: str = UNIT) -> Path:
    """A lift of the library with a unit between hook and slings."""
    lift = (LIFTS / "template-through-the-surface.toml").read_text(encoding="utf-8")
    (folder / "lift.toml").write_text(lift + unit, encoding="utf-8")
    return folder / "lift.toml"


@pytest.mark.long
def test_a_lift_has_a_unit_of_the_user_and_reports_its_numbers(example: Path) -> None:
    words = ("-m", "stillhook", "lower", str(with_unit(example)), "--duration", "60 s", "--json")
    run = python(*words, extensions=[example / "shock_absorber.py"], folder=example)
    assert run.returncode in (0, 1), run.stderr
    answer = json.loads(run.stdout)
    assert 0.0 <= answer["s_a_max"] <= 1.2
    assert abs(answer["energy_unaccounted"]) < 1e-2


@pytest.mark.long
@pytest.mark.parametrize(
    ("command", "unit", "line"),
    [
        ("response", UNIT, "of type shock-absorber: it has no linear form, which the frequency-domain method needs."),
        ("lower", UNIT.replace("shock-absorber", "spring"), 'type = "spring": choose gas-spring, shock-absorber.'),
        ("lower", UNIT.replace("160 kN/m", "160 kN"), 'compensator.spring = "160 kN": unit "kN" is not one of'),
        ("lower", UNIT.replace("stroke", "stroek"), "compensator.stroek"),
    ],
)
def test_a_unit_of_the_user_is_refused_in_one_line(command: str, unit: str, line: str, example: Path) -> None:
    lift = with_unit(example, unit)
    run = python("-m", "stillhook", command, str(lift), extensions=[example / "shock_absorber.py"], folder=example)
    assert Answer(run.returncode, run.stderr).refused, run.stderr
    assert line in run.stderr


# Modules that cannot be one: the whole table is in test_contracts.py, here that a command says so in one line


@pytest.mark.long
@pytest.mark.parametrize(
    ("file", "before", "after", "command", "line"),
    [
        ("torque_drive", "drive.brake), hold(m, 1.0), drive", "drive.brake), drive", "run case.toml", "actuate gave"),
        (
            "torque_drive",
            "return State(T=(c",
            "return Circuit(T, T, T, T) or State(T=(c",
            "run case.toml",
            "rates gave",
        ),
        (
            "torque_drive",
            "    brake: float  # how",
            "    lock: float  # how",
            "crane my-winch.toml",
            "Command.brake is missing",
        ),
        (
            "torque_drive",
            "return float(crane.torque_drive.n_max)",
            "return None",
            "crane my-winch.toml",
            "full_speed gave",
        ),
        ("torque_drive", "Stiffness(rates,", "Stiffness({},", "run case.toml", "stiffness gave Stiffness(rates={}"),
        (
            "torque_drive",
            '"torque-drive"',
            '"pure-active"',
            "list cranes",
            'winch type "pure-active" is that of pure_active.py',
        ),
        (
            "torque_drive",
            "    P_el: Annotated",
            "    p_a: Annotated",
            "run case.toml",
            "p_a is a 'power', elsewhere another kind",
        ),
        (
            "torque_drive",
            '{"torque_drive": T',
            '{"drum": T',
            "list cranes",
            'TABLES: "drum" is a table of crane files already',
        ),
        ("ssc_pi", '"ssc-pi"', '"ssc"', "run case.toml", 'the controller "ssc" is that of ssc.py. Change NAME.'),
        ("ssc_pi", '"ssc-pi"', '"alpha-ns"', "list cranes", "is a setting of [control] already"),
        ("ssc_pi", "NAME =", "NAME ==", "list cranes", "line 9: NameError: name 'NAME' is not defined"),
    ],
)
def test_a_command_with_a_module_that_cannot_be_one_is_refused_in_one_line(
    file: str, before: str, after: str, command: str, line: str, example: Path
) -> None:
    text = (example / f"{file}.py").read_text(encoding="utf-8")
    assert before in text
    (example / "mine.py").write_text(text.replace(before, after, 1), encoding="utf-8")
    case = CASE.replace("CRANE", "my-winch.toml").replace("MODE", "position")
    (example / "case.toml").write_text(case, encoding="utf-8")
    run = python("-m", "stillhook", *command.split(), extensions=[example / "mine.py"], folder=example)
    assert Answer(run.returncode, run.stderr).refused, run.stderr
    assert "mine.py" in run.stderr
    assert line in run.stderr


@pytest.mark.long
@pytest.mark.parametrize(
    ("names", "line"),
    [
        (["gone.py"], "no file gone.py"),
        (["gone_module"], "ModuleNotFoundError"),
        (["ssc_pi.py", "ssc_pi.py"], "two files are called ssc_pi.py"),
        (["ssc_pi.py", "same.py"], 'same.py: the controller "ssc-pi" is that of ssc_pi.py'),
    ],
)
def test_modules_that_cannot_be_loaded_together_are_refused(names: list[str], line: str, example: Path) -> None:
    (example / "same.py").write_bytes((example / "ssc_pi.py").read_bytes())
    run = python("-m", "stillhook", "list", "cranes", extensions=[Path(name) for name in names], folder=example)
    assert Answer(run.returncode, run.stderr).refused, run.stderr
    assert line in run.stderr


@pytest.mark.thorough
def test_a_file_may_hold_a_module_and_its_tests(example: Path) -> None:
    module = example / "ssc_pi.py"
    module.write_text("\n".join((example / f"{name}.py").read_text() for name in ("ssc_pi", "test_ssc_pi")))
    run = python("-m", "pytest", "-q", "ssc_pi.py", extensions=[module], folder=example)
    assert run.returncode == 0, run.stdout


@pytest.mark.long
def test_an_exception_in_a_module_names_its_file_and_line(example: Path) -> None:
    module = example / "torque_drive.py"
    text = module.read_text(encoding="utf-8")
    module.write_text(text.replace("e = crane.torque_drive\n", "e = crane.torqe_drive\n"), encoding="utf-8")
    line = text.splitlines().index("    e = crane.torque_drive") + 1
    command = ("-m", "stillhook", "compare", "my-winch.toml", "--load", "30 t", "--controllers", "position")
    run = python(*command, extensions=[module], folder=example)
    assert Answer(run.returncode, run.stderr).refused, run.stderr
    assert f"error: torque_drive.py, line {line}: AttributeError:" in run.stderr


@pytest.mark.long
def test_machine_code_of_a_winch_of_the_user_is_not_used_after_an_edit(example: Path) -> None:
    module = example / "torque_drive.py"
    say = "from stillhook.kernels import build; print(build._folder('torque-drive', build.LOAD_ON_WIRE, ()))"
    before = python("-c", say, extensions=[module], folder=example).stdout
    module.write_text(module.read_text(encoding="utf-8") + "# edited\n", encoding="utf-8")
    after = python("-c", say, extensions=[module], folder=example).stdout
    assert before.startswith("torque-drive-")
    assert after.startswith("torque-drive-")
    assert before != after


# What commands say of a module of the user


def said(example: Path, module: str, *arguments: str) -> str:
    """Output and errors of a command that knows a module of the example."""
    run = python("-m", "stillhook", *arguments, extensions=[example / module], folder=example)
    return run.stdout + run.stderr


LIFTED = {"load": "50 t", "duration": "40 s", "warm_up": "20 s"}


@pytest.mark.long
def test_an_offset_is_foreseen_by_the_law_of_the_controller(example: Path) -> None:
    """The integral part works it off, as far as its largest command goes; a proportional law leaves all of it."""
    (example / "short.toml").write_text(
        'base = "nov-100t-pure-active"\nname = "short"\n[control.ssc_pi]\nu_i_max = 0.005\n', encoding="utf-8"
    )
    found = {
        crane: re.findall(
            r"(\S+): the load is held .* under (.+) expect a standing offset of about ([\d.]+) m",
            said(
                example,
                "ssc_pi.py",
                "compare",
                case_file(example, crane, **LIFTED),
                "--controllers",
                "ssc,ssc-pi",
                "--verbose",
            ),
        )
        for crane in ("nov-100t-pure-active", "short.toml")
    }
    assert [(mode, law) for mode, law, _ in found["nov-100t-pure-active"]] == [("ssc", "P control")]
    (_, _, of_p), (mode, law, left) = found["short.toml"]
    assert (mode, law) == ("ssc-pi", "ssc-pi")
    K_p, u_i_max = 0.16, 0.005
    assert float(of_p) - float(left) == pytest.approx(u_i_max / K_p, abs=1e-3)  # what the integral part takes over


@pytest.mark.long
def test_stability_is_that_of_a_controller_of_the_user(example: Path) -> None:
    """The integral part takes phase at the slow crossover and no gain where the winch would oscillate."""
    place = ("--load", "50 t", "--s-w", "100 m", "--v-tip", "20 m/min", "--json")
    ssc, pi = (
        json.loads(said(example, "ssc_pi.py", "stability", "nov-100t-pure-active", "--controller", name, *place))
        for name in ("ssc", "ssc-pi")
    )
    assert (pi["controller"], pi["stable"], ssc["stable"]) == ("ssc-pi", True, True)
    assert pi["phase_margin_plc"] < ssc["phase_margin_plc"] - 0.5
    assert pi["K_p_ms_plc"] == pytest.approx(ssc["K_p_ms_plc"], rel=0.02)
    t_cycle, T_i = 0.01, 8.0
    at_once = 1.0 + t_cycle / T_i  # what the integral part adds in the same cycle is proportional
    assert pi["K_p_strong"] == pytest.approx(ssc["K_p_strong"] / at_once, rel=1e-6)


@pytest.mark.long
@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("u_m=u_m", "u_m=u_m - 0.1 * m.u_i", "depends on what it remembers"),
        ("r.u_ff + r.u_fb + u_i", "r.u_ff", "feeds no small position error back"),
    ],
)
def test_stability_refuses_a_law_that_it_has_no_model_for(before: str, after: str, words: str, example: Path) -> None:
    module = example / "ssc_pi.py"
    text = module.read_text(encoding="utf-8").replace(before, after)
    if "u_fb" in before:
        text = text.replace("m.u_i + r.u_fb", "m.u_i + 0.0 * r.u_fb")
    else:
        text = text.replace("m.u_i + r.u_fb * plc.t_cycle", "m.u_i + r.u_ff * plc.t_cycle")
    module.write_text(text, encoding="utf-8")
    place = ("--load", "50 t", "--s-w", "100 m", "--v-tip", "20 m/min")
    answer = said(example, "ssc_pi.py", "stability", "nov-100t-pure-active", "--controller", "ssc-pi", *place)
    assert answer.startswith("error: ")
    assert words in answer


FRICTION = (
    (", z=0.0)", ")"),
    ("State(0.0, 0.0, 0.0)", "State(0.0, 0.0)"),
    ("State(q.F_w * geo.r_eff, 0.0, 0.0)", "State(q.F_w * geo.r_eff, 0.0)"),
    (" - shaft.friction(c, x, p)\n", "\n"),
    ("    friction: float\n", ""),
    (", friction=shaft.friction(c, x, p) * x.omega_m", ""),
    ("    z: float  # bristle, half a step ahead [rad]\n", ""),
    ("import bristle_after, geometry", "import geometry"),
)
"""The lines of the example's winch that give it friction -> the same without."""


@pytest.mark.long
def test_a_winch_is_asked_about_nothing_that_it_does_not_have(example: Path) -> None:
    """Without friction no factor or variation of it; without pumps and pressure no column of theirs."""
    module = example / "torque_drive.py"
    text = module.read_text(encoding="utf-8")
    for before, after in FRICTION:
        assert before in text
        text = text.replace(before, after)
    module.write_text(text, encoding="utf-8")
    grid = ("--loads", "30 t", "--speeds", "20 m/min", "--periods", "10 s", "--free", "K_p")
    case = case_file(example, "my-winch.toml", settings="budget = 20", **LIFTED)
    tuned = said(example, module.name, "tune", case, *grid, "--verbose")
    bands = said(example, module.name, "uncertainty", case, "--draws", "4", "--verbose")
    assert "motion signal 0.1 s later" in tuned
    assert "inertia" in bands
    for word in ("friction", "pump", "pressure"):
        assert word not in tuned
        assert word not in bands.replace("friction, gears", "")
