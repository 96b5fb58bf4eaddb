"""Contracts of winch types, controllers and load paths: the shipped modules keep them, and a module that breaks one is
refused in a line that names file and attribute."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest
from tests.contract.commands import printed_files
from tests.scripts import DOCS

from stillhook import Scenario, load_crane
from stillhook.base.extensions import load, modules_in
from stillhook.control import controllers
from stillhook.control import registry as of_controllers
from stillhook.control import sensors as of_sensors
from stillhook.engine.pack.winch import pack
from stillhook.errors import StillhookError
from stillhook.library import cranes
from stillhook.winches import checks as of_winches
from stillhook.winches import types
from stillhook.winches.load_path import host
from stillhook.winches.load_path import load as load_on_wire
from stillhook.winches.load_path.registry import check_path

TEXTS = printed_files()
NAMES = {"controller": "ssc_pi.py", "winch": "torque_drive.py", "sensor": "measuring_wheel.py"}
CHECKS = {"cycle": of_controllers, "rates": of_winches, "reading": of_sensors}
"""What checks a module, by the function by which it is known."""


def checked(text: str, folder: Path) -> ModuleType:
    """A module of this text, loaded and checked as one of the user."""
    file = folder / "mine.py"
    file.write_text(text, encoding="utf-8")
    try:
        module = load(str(file))
        next(each for name, each in CHECKS.items() if hasattr(module, name)).check_module(module)
        return module
    finally:
        sys.modules.pop("stillhook_extension_mine", None)


def refusal(kind: str, before: str, after: str, folder: Path) -> str:
    """The line in which the how-to's example is refused with one of its lines broken."""
    text = TEXTS[NAMES[kind]]
    assert before in text
    with pytest.raises(StillhookError) as problem:
        checked(text.replace(before, after, 1), folder)
    assert str(problem.value).startswith("mine.py")
    assert "\n" not in str(problem.value)
    return str(problem.value)


SHIPPED = [m for m in (*modules_in(types), *modules_in(controllers)) if m.NAME != "manual"]
"""All but manual mode, which alone may have its name and place."""


@pytest.mark.parametrize("module", SHIPPED, ids=lambda module: module.NAME)
def test_shipped_modules_keep_the_contract(module: ModuleType) -> None:
    (of_controllers if hasattr(module, "cycle") else of_winches).check_module(module)


@pytest.mark.parametrize("crane", cranes())
def test_shipped_winches_give_what_the_contract_says_at_rest(crane: str) -> None:
    machine = load_crane(crane)
    case = Scenario(load="10 t", s_w="100 m", mode=machine.plant.type.default_mode)
    of_winches.check_params(machine.plant.type.module, pack(machine, case).params)


@pytest.mark.parametrize("path", [load_on_wire, host], ids=["load", "host"])
def test_shipped_load_paths_keep_the_contract(path: ModuleType) -> None:
    check_path(path)


@pytest.mark.thorough
def test_a_type_checker_checks_a_module_against_its_contract(tmp_path: Path) -> None:
    """Every shipped winch type is assigned to the protocol; one whose arguments are in another order is not one."""
    lines = [
        "from stillhook.winches.interface import Winch",
        "from stillhook.winches.load_path import load",
        "from stillhook.winches.load_path.interface import LoadPath",
    ]
    for module in modules_in(types):
        name = module.__name__.rpartition(".")[2]
        lines += [f"from stillhook.winches.types import {name}", f"winch_{name}: Winch = {name}"]
    lines += ["path: LoadPath = load", "from stillhook.control import interface"]
    for module in modules_in(controllers):
        name, kind = module.__name__.rpartition(".")[2], of_controllers.contract_of(module).needed_by.__name__
        lines += [f"from stillhook.control.controllers import {name}", f"law_{name}: interface.{kind} = {name}"]
    wrong = "from stillhook.winches.load_path.interface import LoadPath\nfrom stillhook.physics import scalar\nx: LoadPath = scalar\n"
    for text, errors in (("\n".join(lines) + "\n", 0), (wrong, 1)):
        (tmp_path / "assigned.py").write_text(text, encoding="utf-8")
        config = ("--config-file", str(DOCS.parent / "pyproject.toml"), "--cache-dir", str(DOCS.parent / ".mypy_cache"))
        command = [sys.executable, "-m", "mypy", *config, "assigned.py"]
        run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
        assert run.stdout.count("error:") == errors, run.stdout


OWN = """
from stillhook.physics.friction import bristle_update
from stillhook.physics.scalar import fmax
from stillhook.winches.load_path.load import drum_geometry

BLANK = Extremes(0.0, 0.0)


@scalar
def fold_extremes(a, y):
    return Extremes(fmax(a.omega_m_max, abs(y.omega_m)), fmax(a.T_m_max, abs(y.T_m)))


@scalar
def geometry(s_w, p):
    return drum_geometry(s_w, p.hoist)


@scalar
def wire_speed(x, geo):
    return x.omega_m * geo.r_eff


@scalar
def bristle_after(c, x, p, tau):
    return bristle_update(x.omega_m, x.z, c.g, c.held, tau, p.hoist.bristle)
"""


def test_a_winch_may_declare_itself_what_it_can_take_over(tmp_path: Path) -> None:
    text = TEXTS[NAMES["winch"]]
    for taken in ("BLANK, fold_extremes = folded(Extremes)\n", "import bristle_after, geometry, sense, wire_speed"):
        assert taken in text
    text = text.replace("BLANK, fold_extremes = folded(Extremes)\n", OWN)
    module = checked(text.replace("import bristle_after, geometry, sense, wire_speed", "import sense"), tmp_path)
    assert module.fold_extremes(module.BLANK, module.Signals(-2.0, 1.0, 0.0)) == module.Extremes(2.0, 1.0)


SUPPLIED = 'SUPPLIED = ("motor",)\n'
T_M = '    T_m: Annotated[float, Row("N m", "torque", "hoisting positive", "torque of all motors")]'
OF_A_WINCH = [
    ("def settle(", "def settled(", "settle is missing. A winch type needs settle(x, q, u, tick, geo, p)"),
    (
        "    brake: float  # how far",
        "    lock: float  # how far",
        "Command.brake is missing. Command needs brake, a float",
    ),
    ("    hoist: Hoist\n", "", "Params.hoist is missing"),
    ("    hoist: Hoist\n", "    hoist: float\n", "Params.hoist is annotated as float. Annotate it as Hoist"),
    ("    K: float", "    K: int", "Params.K is annotated as int. Annotate it as float"),
    ("    K: float", "    K: list[float]", "Params.K is annotated as list[float]"),
    ("    K: float", "    K = 3.0", "Params.K = 3.0 has no annotation"),
    ("    K: float", '    K: "Nonsense"', "Params: name 'Nonsense' is not defined"),
    ("class State(NamedTuple)", "class State", "State is not a NamedTuple"),
    ("    T: float  #", "    T: str  #", "State.T is annotated as str"),
    ("    T: float  #", '    T: "State"  #', "State.T.T is annotated as State"),
    ("    T_ref: float", "    T_ref: bool", "Circuit.T_ref is annotated as bool"),
    (
        '("motor",)',
        '("sorce",)',
        "SUPPLIED = ('sorce',). It must be a tuple of at least one of the fields of Powers: motor",
    ),
    ('("motor",)', '"motor"', 'SUPPLIED = "motor"'),
    ('("motor",)', "()", "SUPPLIED = ()"),
    (SUPPLIED, SUPPLIED + 'WITHIN = ("shaft",)\n', "WITHIN = ('shaft',)"),
    (SUPPLIED, SUPPLIED + 'WITHIN = ("motor", "friction")\n', "SUPPLIED has something from outside besides"),
    ("def pack(", "def note(crane):\n    return []\n\n\ndef pack(", "note is not read. Call it notes, or _note"),
    ("def lag(", "def lags(", "lags is not read. Call it lag"),
    (SUPPLIED, SUPPLIED + "TUNE = {}\n", "TUNE is not read. Call it TUNED"),
    ("@scalar\ndef circuit", "def circuit", "circuit is not decorated with @scalar"),
    (
        "circuit(x, q, u, geo, p)",
        "circuit(x, u, q, geo, p)",
        "circuit(x, u, q, geo, p). It must be circuit(x, q, u, geo, p)",
    ),
    ("circuit(x, q, u, geo, p)", "circuit(*every)", "circuit(every). It must be"),
    ("lag(crane: Any)", "lag(machine: Any)", "lag(machine). It must be lag(crane)"),
    ("PATH = load", 'PATH = "load_path"', 'PATH = "load_path". It must be a module'),
    ("PATH = load", "import math\nPATH = math", "PATH: math"),
    ('{"torque_drive": TorqueDrive}', '"active"', 'TABLES = "active"'),
    ('{"torque_drive": TorqueDrive}', '{"torque_drive": dict}', "each a stillhook.tables.table.Spec"),
    ("folded(Extremes)\n", "(0.0, 0.0), folded(Extremes)[1]\n", "BLANK = (0.0, 0.0)"),
    (', largest("T_m")', "", "Extremes.T_m_max: note highest, lowest or largest of a signal next to its Row"),
    ('"T_m_max": "peak', '"T_max": "peak', "of omega_m_max, T_m_max, torque_time"),
    ('CONTROL = "speed"', 'CONTROL = "torque"', 'It must be "displacement" or "speed"'),
    (SUPPLIED, SUPPLIED + 'TUNED = {"torque_drive.K": (1.0, 2.0)}\n', "TUNED"),
    (SUPPLIED, SUPPLIED + 'TUNED = {"torque_drive.tau": (2.0, 1.0)}\n', "pairs of numbers that rise"),
    (SUPPLIED, SUPPLIED + 'PER_MOTOR = "torque_drive"\n', "PER_MOTOR"),
    (SUPPLIED, SUPPLIED + 'SERVOS = {"u_x": ("torque_drive.servo", "plc")}\n', "SERVOS"),
    (SUPPLIED, SUPPLIED + 'SERVOS = {"brake": ("torque_drive", "plc")}\n', "pairs of a path of a table in TABLES"),
    (T_M, "    T_m: float", "Signals.T_m: annotate it as Annotated[float, Row(...)]"),
    ('Row("N m", "torque"', 'Row("Nm", "torque"', "Signals.T_m: unit 'Nm'. A torque is in \"N m\""),
    ('Row("N m", "torque"', 'Row("N m", "torqe"', "Signals.T_m: unknown kind 'torqe'"),
    ("    T_m: Annotated", "    v_w: Annotated", "Signals.v_w is there already"),
    ("    friction: float\n", "    drag: float\n", "Powers.drag is there already"),
    ("    T_m_max: Annotated", "    torque_time: Annotated", "Extremes.torque_time is also the time of Limits.torque"),
    ('Cause("torque"', 'Cause("ok"', "Limits.torque: status 'ok'"),
    ("import bristle_after, geometry", "import geometry", "State.z without bristle_after"),
    ("    z: float  # bristle, half a step ahead [rad]\n", "", "bristle_after without State.z"),
    ('"torque-drive"', '"truth"', "and not truth"),
    ("def pack(", "@scalar\ndef cycle(r, plc):\n    return 0\n\n\ndef pack(", "both cycle and rates"),
    ("NAME = ", "raise SystemExit(3)\nNAME = ", "line 19: SystemExit: 3"),
]
NAME = 'NAME = "ssc-pi"\n'
OF_A_CONTROLLER = [
    ("TITLE =", "HEAD =", "TITLE is missing. A controller needs TITLE"),
    ('"ssc-pi"', '"SSC PI"', 'NAME = "SSC PI". It must be lower-case letters'),
    ('"ssc-pi"', '"none"', "and not none, cap-80"),
    ("(r, plc, s, m)", "(r, plc, m, s)", "cycle(r, plc, m, s). It must be cycle(r, plc, s, m)"),
    ("@scalar\n", "", "cycle is not decorated with @scalar"),
    ("def cycle(", "def law(", "no cycle, rates, pull or reading"),
    (
        "u_i_max: Annotated",
        "T_j: float\n    u_i_max: Annotated",
        "Settings.T_j: annotate it as Annotated[float, Setting(...)]",
    ),
    ('"time", "8 s"', '"era", "8 s"', "Settings.T_i: unknown kind 'era'"),
    ('"8 s"', '"8 kg"', 'Settings.T_i: default = "8 kg": unit "kg" is not one of'),
    ('"8 s"', '"0.01 s"', "default = '0.01 s'. It must be a number from 0.1"),
    ('"8 s"', "None", "default = None"),
    ("search=(2.0, 60.0)", "search=(60.0, 2.0)", "search = (60.0, 2.0). It must be a pair of numbers that rises"),
    ("search=(2.0, 60.0)", "search=(0.0, 60.0)", "from 0.1 to 1e+06"),
    ("least=0.1", "least=1e9", "least 1000000000.0, most 1000000.0"),
    ('"integral time of the position loop"', '""', "meaning = ''"),
    ("u_i: float = 0.0", "u_i: float", "Memory.u_i = nothing. Give it the number that it starts from"),
    ("u_i: float = 0.0", "u_i: int = 0", "Memory.u_i is annotated as int"),
    ("class Memory(NamedTuple)", "class Memory", "Memory is not a NamedTuple"),
    ("class Settings", "class Setings", "Setings is not read. Call it Settings"),
    (NAME, NAME + "ORDER = 0\n", "ORDER = 0. It must be a number above 0"),
    (NAME, NAME + 'DRIVES = "speed"\n', 'DRIVES = "speed"'),
    (NAME, NAME + 'DRIVES = ("speed",)\n', "USES names settings of motors"),
    (NAME, NAME + 'FAMILY = "modern"\n', '"classic" or "other"'),
    (NAME, NAME + 'USUAL = "yes"\n', "True or False"),
    (NAME, NAME + "SWL_SHARE = 1.2\n", "above 0, at most 1"),
    (NAME, NAME + 'DRIVE = ("speed",)\n', "DRIVE is not read. Call it DRIVES"),
    ('USES = ("u_thr",)', 'USES = ("K_p",)', "USES = ('K_p',)"),
    ("NAME =", "NAME ==", "line 9: NameError: name 'NAME' is not defined"),
    ("NAME =", "NAME NAME =", "line 9: SyntaxError"),
]
QUANTITY, OF_S_W = 'QUANTITY = "s_w"\n', 'QUANTITY = "s_w"'
MEASURED = "return s.count * ceil(s_f / s.count - 0.5), Memory(m.s_0, s_f)"
OF_A_SENSOR = [
    ("TITLE =", "HEAD =", "TITLE is missing. A sensor needs TITLE"),
    (QUANTITY, "", "QUANTITY is missing. A sensor needs QUANTITY: field of Sensed that it reads"),
    (OF_S_W, 'QUANTITY = "s_v"', 'QUANTITY = "s_v". It must be one of s_tip, v_tip, a_tip, s_w, F'),
    (OF_S_W, 'QUANTITY = ("s_w", "s_w")', "QUANTITY = ('s_w', 's_w')"),
    (OF_S_W, "QUANTITY = ()", "QUANTITY = ()"),
    (OF_S_W, 'QUANTITY = "mode"', 'QUANTITY = "mode"'),
    ('"measuring-wheel"', '"ssc"', 'NAME = "ssc" is that of a controller. Change NAME'),
    ("(true, h, s, m)", "(true, s, m)", "reading(true, s, m). It must be reading(true, h, s, m)"),
    ("@scalar\ndef reading", "def reading", "reading is not decorated with @scalar"),
    ("def begin(", "def start(", "begin is missing. A sensor needs begin(true, s)"),
    ("class Memory(", "class Memry(", "Memory is missing. A sensor needs Memory"),
    ("class Settings(NamedTuple)", "class Settings", "Settings is not a NamedTuple"),
    ("    s_f: float", "    s_f: int", "Memory.s_f is annotated as int"),
    ("most=10.0)]", "most=10.0, search=(0.0, 1.0))]", "search = (0.0, 1.0). Leave it out: sensors are not tuned"),
    ('"0.5 mm"', '"0.5 kg"', 'Settings.count: default = "0.5 kg": unit "kg" is not one of'),
    (MEASURED, "return s_f", "reading gave 1.0. It must give a number and a Memory of numbers"),
    (MEASURED, "return s_f, s_f", "It must give a number and a Memory of numbers"),
    ("Memory(true, true)", "(true, true)", "begin gave (1.0, 1.0). It must give a Memory of numbers"),
    ("s.slip)", "s.slipp)", "reading at 1, with the settings by default: AttributeError"),
]
CASES = [
    (kind, *each)
    for kind, table in (("winch", OF_A_WINCH), ("controller", OF_A_CONTROLLER), ("sensor", OF_A_SENSOR))
    for each in table
]


@pytest.mark.long
@pytest.mark.parametrize(("kind", "before", "after", "words"), CASES)
def test_a_broken_line_is_named(kind: str, before: str, after: str, words: str, tmp_path: Path) -> None:
    assert words in refusal(kind, before, after, tmp_path)


@pytest.mark.parametrize("kind", NAMES)
def test_a_module_with_its_tests_in_its_file_is_accepted_without_them(kind: str, tmp_path: Path) -> None:
    tests = """
import pytest
from hypothesis import given
from stillhook import Scenario, load_crane, simulate

CASE = Scenario(load="50 t")


@pytest.fixture
def crane():
    return load_crane("nov-250t")


def ran(case: Scenario):
    return simulate(load_crane("nov-250t"), case)


@pytest.mark.parametrize("u_i", [1.0])
def test_it(u_i, crane):
    assert u_i
"""
    module = checked(TEXTS[NAMES[kind]] + tests, tmp_path)
    assert hasattr(module, "ran")
    assert not {"pytest", "CASE", "crane", "test_it"} & vars(module).keys()
