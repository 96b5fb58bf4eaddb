"""The libraries for OrcaFlex and SIMO in small hosts in C, here and, as Windows libraries, under wine."""

import ctypes
import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.export.hosts.mock_orcaflex import Load, Tip

import stillhook
from stillhook.cli import run as command
from stillhook.export.hosts import Exchange, Sample, host_source, write_host
from stillhook.export.twin import Export, ExportError, compile_library, export, own_platform
from stillhook.physics.scalar import G

HERE = Path(__file__).parent
OWN = own_platform()
STRICT = ("-Wall", "-Wextra", "-pedantic", "-Werror")
SAME = 1e-12
"""The C core and the session have the same kernels by two compilers [m/s]."""
SIMO_OFF = 1.5e-3
"""Height of the load beside `simulate` with steps of 50 ms [m], of 1 m of tip motion: 0.9 mm is seen."""
SIMO_ORDER = 1.3
"""Least order in the host's step; seen 1.7: rates of tip and wire are those of the last three steps, of second
order."""
WINE = shutil.which("wine64") or next((w for w in ("/usr/lib/wine/wine64",) if Path(w).exists()), None)

pytestmark = pytest.mark.skipif(OWN is None, reason="no library for this system")


@pytest.fixture(scope="module")
def case() -> stillhook.Scenario:
    return stillhook.Scenario(
        load="100 t", s_w="100 m", tip="sine 1 m 12 s", mode="ssc", duration="10 s", ramp="2 s", warm_up="0 s"
    )


@pytest.fixture(scope="module")
def made(nov, case) -> Export:
    return export(nov, case, coupling="wire")


def host_of(name: str, folder: Path, *, windows: bool = False) -> Path:
    """A host in C, compiled."""
    file = folder / f"{name}.exe"
    zig = [sys.executable, "-m", "ziglang", "cc"]
    if windows:
        how = [*zig, "-target", "x86_64-windows-gnu"]
    else:
        how = [shutil.which("cc") or "cc"] if shutil.which("cc") else zig
    flags = ["-std=c99", "-O1", "-D_GNU_SOURCE", str(HERE / f"{name}.c"), "-o", str(file)]
    flags += [] if windows else ["-ldl", "-lm", "-rdynamic"]
    subprocess.run([*how, *flags], check=True, capture_output=True)
    return file


@pytest.fixture(scope="module")
def built(made: Export, compiled, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("hosts")
    for host in ("orcaflex", "simo"):
        shutil.copy(compiled(host_source(made, host), STRICT), folder / f"{host}.lib")
        host_of(f"host_{host}", folder)
    return folder


def samples() -> list[tuple[Sample, bool]]:
    """Steps shorter than a cycle, equal to one, longer, no part of one; each asked three times; one dropped."""
    found, t, w = [], 0.0, 2.0 * math.pi / 12.0
    for i in range(60):
        for j in range(3):
            F_w = 1.01e6 * (1.0 + 0.05 * math.sin(3.0 * t) + 0.01 * (2 - j))
            tip = (20.0 + 1.0 - math.cos(w * t), w * math.sin(w * t), w * w * math.cos(w * t))
            found.append((Sample(t, F_w, *tip), j == 0))
        t += (0.003, 0.01, 0.017, 0.05, -0.02)[i % 5]
    return found


def run_orcaflex(host: list[str], library: str, rows: Path, **more: object) -> list[str]:
    """Lines that the host prints."""
    choice = {"parameters": "TipObject=Vessel", "at": -1, "data": "WholeSimulationPayoutRate", "units": "SI"} | more
    arguments = [str(choice[name]) for name in ("at", "data", "units")]
    done = subprocess.run(
        [*host, library, str(choice["parameters"]), str(rows), *arguments],
        capture_output=True,
        text=True,
        timeout=120,
        env=os.environ | {"WINEDEBUG": "-all"},
        check=False,
    )
    assert done.returncode in (0, 3), done.stderr
    return done.stdout.split("\n")[:-1]


@pytest.fixture(scope="module")
def rows(tmp_path_factory) -> Path:
    file = tmp_path_factory.mktemp("rows") / "rows.txt"
    file.write_text("".join(f"{' '.join(map(repr, s))} {int(new)}\n" for s, new in samples()))
    return file


@pytest.fixture(scope="module")
def expected(nov, case) -> np.ndarray:
    exchange = Exchange(nov, case)
    return np.array([exchange.at(s, new_step=new).payout for s, new in samples()])


@pytest.mark.long
@pytest.mark.parametrize("more", [{}, {"at": 57}, {"units": "US"}])
def test_the_native_function_gives_what_the_python_one_gives(built: Path, rows: Path, expected, more):
    head, *lines = run_orcaflex([str(built / "host_orcaflex.exe")], str(built / "orcaflex.lib"), rows, **more)
    assert head == "capabilities 3"
    found = np.array([float(line) for line in lines])
    assert np.abs(found - expected).max() < (SAME if "units" not in more else 1e-9)


@pytest.mark.parametrize(
    ("more", "line"),
    [
        ({"parameters": ""}, "TipObject is missing"),
        ({"parameters": "TipObject=Tug"}, "TipObject: no object Tug is in the model"),
        ({"parameters": "tipobject = Vessel ;TipPosition=1 2 x"}, "TipPosition 1 2 x: give three numbers"),
        ({"parameters": "TipObject=Vessel;Mode=fast"}, "the crane has no mode fast"),
        ({"parameters": "TipObject=Vessel;WireOut=1e9"}, "outside the range of the crane"),
        ({"parameters": "TipObject=Vessel;SpeedResult=Heave"}, "no result Heave. Name it in the parameters"),
        ({"data": "WholeSimulationTension"}, "OrcaFlex requested WholeSimulationTension"),
    ],
)
def test_what_is_wrong_in_the_model_is_recorded_as_one_line(built: Path, rows: Path, more, line):
    last = run_orcaflex([str(built / "host_orcaflex.exe")], str(built / "orcaflex.lib"), rows, **more)[-1]
    assert last.startswith("error Stillhook: ")
    assert line in last


def run_simo(host: list[str], library: str, folder: Path, nov, case, h: float) -> np.ndarray:
    """Rows of time, height of the load above its start, tension."""
    tip, load = Tip(nov, case), Load(nov, case)
    heights = folder / f"tip-{h}.txt"
    heights.write_text("".join(f"{tip(i * h)[0]!r}\n" for i in range(int(8.0 / h) + 1)))
    numbers = [repr(x) for x in (h, load.m, load.W, 100.0)]
    done = subprocess.run(
        [*host, library, str(heights), *numbers, "6"],
        capture_output=True,
        text=True,
        timeout=120,
        env=os.environ | {"WINEDEBUG": "-all"},
        check=False,
    )
    assert done.returncode == 0, done.stdout[-200:]
    return np.array([[float(x) for x in line.split()] for line in done.stdout.splitlines()])


@pytest.mark.thorough
def test_a_load_that_hangs_on_forces_of_the_library_moves_as_in_simulate(built: Path, nov, case, tmp_path: Path):
    run = stillhook.simulate(nov, case, every="10 ms", series=True)
    height = run["s_load"].values - run["s_load"].values[0]
    found = []
    for h in (0.05, 0.025):
        out = run_simo([str(built / "host_simo.exe")], str(built / "simo.lib"), tmp_path, nov, case, h)
        found.append(np.abs(out[:, 1] - np.interp(out[:, 0], run.time.values, height)).max())
    assert found[0] < SIMO_OFF
    assert math.log2(found[0] / found[1]) > SIMO_ORDER


@pytest.mark.thorough
@pytest.mark.skipif(WINE is None, reason="wine is not installed")
def test_the_windows_libraries_give_the_same_under_wine(made: Export, rows: Path, expected, nov, case, tmp_path: Path):
    for host in ("orcaflex", "simo"):
        compile_library(host_source(made, host), "win64", tmp_path / f"{host}.dll")
        host_of(f"host_{host}", tmp_path, windows=True)
    wine = [str(WINE)]
    _, *lines = run_orcaflex([*wine, str(tmp_path / "host_orcaflex.exe")], str(tmp_path / "orcaflex.dll"), rows, at=57)
    assert np.abs(np.array([float(line) for line in lines]) - expected).max() < 1e-9
    out = run_simo([*wine, str(tmp_path / "host_simo.exe")], str(tmp_path / "simo.dll"), tmp_path, nov, case, 0.05)
    assert np.abs(out[:, 1]).max() < 1.0


@pytest.mark.thorough
def test_the_command_writes_a_folder_whose_python_function_runs(tmp_path: Path, capsys):
    out = tmp_path / "winch"
    assert command(["external", "orcaflex", "nov-250t", "--out", str(out), "--platforms", str(OWN), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert {Path(f).name for f in data["files"]} == {p.name for p in out.iterdir()} - {"stillhook-manifest.json"}
    names = {"README.txt", "parameters.txt", "winch.yml", "stillhook_winch.py", "stillhook_winch.c", "crane.toml"}
    assert names <= {p.name for p in out.iterdir()}
    space: dict[str, object] = {"__file__": str(out / "stillhook_winch.py")}
    exec((out / "stillhook_winch.py").read_text(), space)
    function = space["StillhookWinch"]
    assert stillhook.load_crane(function.crane).name == "nov-250t"  # type: ignore[attr-defined]
    assert stillhook.Scenario(**function.case).s_w == 100.0  # type: ignore[attr-defined]


@pytest.mark.long
def test_a_gas_charge_for_another_load_is_refused(compiled):
    crane = stillhook.load_crane("nov-100t-cylinder")
    case = stillhook.Scenario(load="50 t", s_w="100 m", mode="position")
    library = compiled(host_source(export(crane, case, coupling="wire"), "orcaflex"))
    lib, real = ctypes.CDLL(str(library)), ctypes.c_double
    lib.stillhook_new.restype, lib.stillhook_new.argtypes = ctypes.c_void_p, [real] * 3
    out = ctypes.POINTER(real)
    lib.stillhook_exchange.argtypes = [ctypes.c_void_p, *[real] * 5, ctypes.c_int, out, out]
    lib.stillhook_words.restype = ctypes.c_char_p
    winch, rate, s_w = lib.stillhook_new(math.nan, 0.0, math.nan), real(), real()
    weight = (50e3 + crane.hook_mass) * G
    answers = [
        lib.stillhook_exchange(winch, 0.0, part * weight, 0.0, 0.0, 0.0, 1, ctypes.byref(rate), ctypes.byref(s_w))
        for part in (1.01, 1.03)
    ]
    assert answers[0] == 0
    assert b"within 2 %" in lib.stillhook_words(answers[1])


def test_wrong_choices_leave_nothing_behind(tmp_path: Path, capsys, nov, case):
    for arguments, line in (
        (["foo", "nov-250t"], 'host = "foo": choose orcaflex or simo.'),
        (["simo", "nov-250t", "--platforms", "vax"], 'platform "vax" is not one of'),
    ):
        assert command(["external", *arguments, "--out", str(tmp_path / "none")]) == 2
        assert line in capsys.readouterr().err
    assert not (tmp_path / "none").exists()
    with pytest.raises(ExportError, match='coupling = tip: a host with a wire of its own needs "wire"'):
        host_source(export(nov, case), "simo")
    assert write_host("simo", nov, case, tmp_path / "source", platforms=())[0].name == "README.txt"
