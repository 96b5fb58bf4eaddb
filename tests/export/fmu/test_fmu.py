"""FMUs in two hosts that are not ours: FMPy, and a small one in C; under wine, the Windows library."""

import ctypes
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.ssp.ssd import read_ssd
from fmpy.validation import validate_fmu
from tests.export.fmu.slave import CLOSE, OWN, RELATIVE, TIP, Slave, given, same

import stillhook
from stillhook.cli import run as command
from stillhook.control.registry import code_of
from stillhook.engine.inputs import CycleInputs
from stillhook.export.fmu import package, write_fmu, write_reference, write_ssp
from stillhook.export.fmu.description import exponents
from stillhook.export.fmu.package import source_of
from stillhook.export.twin import CONTENTS, PLATFORMS, Export, ExportError, compile_library, export
from stillhook.library import crane_from_toml, cranes
from stillhook.trust.comparison import compare
from stillhook.trust.trust_list import users_trust

SIGNALS = ("e_c", "s_w", "v_w", "F_w", "u_p", "p_a", "p_b", "omega_m", "alpha_m", "p_hp", "V_acc", "T_f")
HOST = Path(__file__).with_name("host.c")

pytestmark = pytest.mark.skipif(OWN is None, reason="an FMU has no library for this system")


@pytest.fixture(scope="module")
def case() -> stillhook.Scenario:
    return stillhook.Scenario(
        load="100 t", s_w="100 m", tip="sine 1 m 12 s", mode="ssc", duration="20 s", ramp="4 s", warm_up="0 s"
    )


@pytest.fixture(scope="module")
def made(nov: stillhook.Crane, case: stillhook.Scenario) -> Export:
    return export(nov, case)


@pytest.fixture(scope="module")
def tip(nov: stillhook.Crane, case: stillhook.Scenario) -> np.ndarray:
    drive = CycleInputs(nov, case)
    return np.array([drive.full_row(k)[:3] for k in range(drive.n_ticks + 1)])


@pytest.fixture(scope="module")
def run(nov: stillhook.Crane, case: stillhook.Scenario):
    return stillhook.simulate(nov, case, every="10 ms", series=True)


@pytest.fixture(scope="module")
def fmus(made: Export, shipped_fmus, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("fmus")
    with shipped_fmus():
        return {v: write_fmu(made, folder / f"nov{v}.fmu", fmi=v, platforms=[str(OWN)])[0] for v in ("2", "3")}


@pytest.fixture(params=["2", "3"])
def slave(request: pytest.FixtureRequest, fmus: dict[str, Path], tmp_path: Path) -> Slave:
    return Slave(fmus[request.param], tmp_path)


@pytest.mark.long
@pytest.mark.parametrize("fmi", ["2", "3"])
def test_fmpy_finds_nothing_wrong(fmi: str, fmus: dict[str, Path]):
    assert validate_fmu(str(fmus[fmi])) == []


@pytest.mark.thorough
@pytest.mark.parametrize("name", cranes())
@pytest.mark.parametrize("contents", CONTENTS)
@pytest.mark.parametrize("coupling", ["tip", "wire"])
def test_fmpy_finds_nothing_wrong_with_any_crane(name: str, contents: str, coupling: str, tmp_path: Path):
    if (contents, coupling) == ("controller", "wire"):
        pytest.skip("a controller alone has no wire")
    crane = stillhook.load_crane(name)
    mode = crane.plant.type.default_mode
    case = stillhook.Scenario(load=f"{0.4 * crane.SWL} kg", s_w="50 m", tip="still", mode=mode)
    for fmi in ("2", "3"):
        assert (
            validate_fmu(str(write_fmu(export(crane, case, contents, coupling), tmp_path / "x.fmu", fmi=fmi)[0])) == []
        )


@pytest.mark.long
def test_a_host_has_the_signals_of_simulate(slave: Slave, tip: np.ndarray, run):
    slave.begin(given(tip[0]), {"input_time": 0})
    out = [slave.get(*SIGNALS)]
    for k, row in enumerate(tip[1:]):
        slave.set(**given(row))
        slave.step(k * 0.01, 0.01)
        out.append(slave.get(*SIGNALS))
    for name, values in zip(SIGNALS, np.array(out).T, strict=True):
        true = run[name].values
        bound = CLOSE if name == "e_c" else RELATIVE * np.abs(true).max()
        assert np.abs(values - true).max() <= bound, name
    assert slave.text("causes") == str(run["status"].item())
    assert slave.text("outside") == "not validated"


def test_a_host_with_its_own_loop_gives_inputs_at_the_start_of_steps(fmus: dict[str, Path], tip: np.ndarray, run):
    """FMPy's own loop, as a user calls it; the acceleration of the tip is held over each step."""
    t = np.arange(len(tip)) * 0.01
    columns = [("time", float), *((name, float) for name in TIP)]
    table = np.array([(a, *b) for a, b in zip(t, tip, strict=True)], dtype=columns)
    for file in fmus.values():
        out = fmpy.simulate_fmu(
            str(file), input=table, output=["e_c"], stop_time=t[-1], step_size=0.01, output_interval=0.01
        )
        assert np.abs(np.interp(t, out["time"], out["e_c"]) - run["e_c"].values).max() < 2e-6


def test_load_wire_out_mode_and_gains_are_set_before_the_start(slave: Slave, nov: stillhook.Crane, tip: np.ndarray):
    other = nov.model_copy(update={"control": nov.control.model_copy(update={"K_p": 0.3})})
    case = stillhook.Scenario(
        load="180 t", s_w="1500 m", tip="sine 1 m 12 s", mode="ns", duration="5 s", ramp="4 s", warm_up="0 s"
    )
    reals = {**given(tip[0]), "load": 180e3, "s_w_start": 1500.0, "K_p": 0.3}
    slave.begin(reals, {"input_time": 0, "mode": round(code_of("ns"))})
    for k in range(500):
        slave.set(**given(tip[k + 1]))
        slave.step(k * 0.01, 0.01)
    run = stillhook.simulate(other, case, every="10 ms", series=True)
    assert abs(slave.get("e_c")[0] - float(run["e_c"][500])) <= CLOSE
    with pytest.raises(Exception, match=r"(?i)set"):
        slave.set(load=100e3)


def test_a_saved_state_goes_on_bit_for_bit(slave: Slave, tip: np.ndarray):
    slave.begin(given(tip[0]), {"input_time": 0})
    for k in range(300):
        slave.set(**given(tip[k + 1]))
        slave.step(k * 0.01, 0.01)
    kept, kept_bytes = slave.state(), slave.saved()

    def later() -> bytes:
        for k in range(300, 400):
            slave.set(**given(tip[k + 1]))
            slave.step(k * 0.01, 0.01)
        slave.get("e_c")
        return slave.saved()

    first = later()
    (slave.fmu.setFMUstate if slave.two else slave.fmu.setFMUState)(kept)
    assert later() == first
    slave.restore(kept_bytes)
    assert later() == first
    with pytest.raises(Exception, match=r"(?i)serialize"):
        slave.restore(b"\0" * len(kept_bytes))


@pytest.mark.parametrize("step", [(0.0, 0.015), (0.0, 0.0), (0.01, 0.01), (0.0, -0.01)])
def test_a_wrong_step_is_refused_and_changes_nothing(step: tuple[float, float], slave: Slave, tip: np.ndarray):
    slave.begin(given(tip[0]), {})
    before = slave.saved()
    with pytest.raises(Exception, match=r"(?i)step"):
        slave.step(*step)
    assert slave.saved() == before
    slave.step(0.0, 0.03)


def test_a_number_that_is_none_is_an_error(slave: Slave, tip: np.ndarray):
    slave.begin(given(tip[0]), {})
    for value in (float("nan"), float("inf")):
        with pytest.raises(Exception, match=r"(?i)set"):
            slave.set(s_tip=value)
    assert np.isfinite(slave.get("e_c", "F_w")).all()


def test_a_reset_instance_begins_as_a_new_one(slave: Slave, tip: np.ndarray):
    slave.begin(given(tip[0]), {"input_time": 0})
    first = slave.saved()
    slave.step(0.0, 0.01)
    slave.fmu.reset()
    slave.begin(given(tip[0]), {"input_time": 0})
    assert slave.saved() == first


def host(folder: Path, platform: str) -> list[str]:
    """The C host, compiled for a platform."""
    target = folder / ("host.exe" if platform == "win64" else "host")
    libraries = [] if platform == "win64" else ["-ldl"]
    zig = [sys.executable, "-m", "ziglang", "cc", "-target", PLATFORMS[platform].target]
    subprocess.run(
        [*zig, "-std=c99", "-O1", "-w", "-o", str(target), str(HOST), *libraries], check=True, capture_output=True
    )
    return [str(target)]


def hosted(made: Export, file: str, program: list[str], tip: np.ndarray, folder: Path, names: tuple[str, ...]):
    """Signals that a host printed, into a file: what wine leaves running would hold a pipe open."""
    (folder / "motion.txt").write_text("\n".join(" ".join(repr(float(x)) for x in row) for row in tip) + "\n")
    numbers = [str(made.number(name)) for name in (*TIP, "input_time", *names)]
    own = {"WINEPREFIX": str(folder / "wine"), "WINEDEBUG": "-all", "DISPLAY": ""}
    with (folder / "out.txt").open("w") as out, (folder / "told.txt").open("w") as told:
        done = subprocess.run(
            [*program, file, made.identity, "motion.txt", repr(made.t_cycle), *numbers],
            cwd=folder,
            stdout=out,
            stderr=told,
            env=os.environ | own,
            timeout=300,
            check=False,
        )
    assert done.returncode == 0, (folder / "told.txt").read_text()
    return np.array([line.split() for line in (folder / "out.txt").read_text().splitlines()], float).T


def library(fmu: Path, folder: Path) -> Path:
    """The library in an FMU."""
    with zipfile.ZipFile(fmu) as archive:
        (name,) = [n for n in archive.namelist() if n.startswith("binaries/")]
        (folder / Path(name).name).write_bytes(archive.read(name))
    return folder / Path(name).name


def test_a_host_in_c_has_the_signals_of_simulate(
    made: Export, fmus: dict[str, Path], tip: np.ndarray, run, tmp_path: Path
):
    file = library(fmus["2"], tmp_path)
    values = hosted(made, f"./{file.name}", host(tmp_path, str(OWN)), tip, tmp_path, SIGNALS)
    same(values, run, SIGNALS)


WINE = (
    shutil.which("wine64")
    or shutil.which("wine")
    or next((str(p) for p in (Path("/usr/lib/wine/wine64"),) if p.exists()), None)
)


@pytest.mark.thorough
@pytest.mark.skipif(WINE is None, reason="wine is not installed")
def test_the_windows_library_has_the_signals_of_simulate(made: Export, tip: np.ndarray, run, tmp_path: Path):
    fmu, _ = write_fmu(made, tmp_path / "w.fmu", platforms=["win64"])
    file = library(fmu, tmp_path)
    values = hosted(made, file.name, [str(WINE), *host(tmp_path, "win64")], tip, tmp_path, SIGNALS)
    same(values, run, SIGNALS)


@pytest.mark.long
@pytest.mark.parametrize(("compiler", "fmi"), [("gcc", "3"), pytest.param("clang", "2", marks=pytest.mark.thorough)])
def test_the_source_compiles_without_warnings_and_has_every_function(
    compiler: str, fmi: str, made: Export, tmp_path: Path
):
    if shutil.which(compiler) is None:
        pytest.skip(f"{compiler} is not installed")
    (tmp_path / "model.c").write_text(source_of(made, fmi))
    command = [compiler, "-std=c99", "-O0", "-Wall", "-Wextra", "-pedantic", "-Werror", "-shared", "-fPIC"]
    done = subprocess.run([*command, "-o", "m.so", "model.c", "-lm"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = ctypes.CDLL(str(tmp_path / "m.so"))
    for name in functions_of(fmi):
        assert hasattr(found, name), name


def functions_of(fmi: str) -> list[str]:
    """Functions of the standard for co-simulation, as the headers that come with FMPy name them."""
    text = (Path(fmpy.__file__).parent / "c-code" / f"fmi{fmi}Functions.h").read_text(
        encoding="utf-8", errors="replace"
    )
    names = re.findall(rf"^\s*FMI{fmi}_Export\s+fmi{fmi}\w+TYPE\s+(fmi{fmi}\w+)", text, re.MULTILINE)
    me_only = "EventMode|NewDiscreteStates|ContinuousTimeMode|IntegratorStep|SetTime|ContinuousStates|Derivatives$|EventIndicators"
    wanted = [n for n in names if fmi == "3" or not re.search(me_only, n) or "Real" in n]
    assert len(wanted) > 25
    return wanted


@pytest.mark.parametrize("fmi", ["2", "3"])
def test_an_fmu_says_what_it_was_made_of(fmi: str, fmus: dict[str, Path], nov: stillhook.Crane):
    with zipfile.ZipFile(fmus[fmi]) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    parts = json.loads(members.pop("resources/stillhook-manifest.json"))["sets"][0]["parts"]
    assert parts == {
        name: {"size": len(data), "sha256": hashlib.sha256(data).hexdigest()} for name, data in members.items()
    }
    assert compare(fmus[fmi], users_trust()).complete
    assert "not validated" in json.loads(members["resources/envelope.json"])["twin"]
    assert json.loads(members["resources/case.json"])["load"] == 100e3
    assert crane_from_toml(members["resources/crane.toml"].decode(), "stored") == nov


@pytest.mark.long
def test_the_same_export_is_the_same_file(made: Export, fmus: dict[str, Path], tmp_path: Path, monkeypatch):
    monkeypatch.setattr(package, "compile_library", compile_library)  # anew, whatever the worker shares
    again, _ = write_fmu(made, tmp_path / "a.fmu", platforms=[str(OWN)])
    assert again.read_bytes() == fmus["2"].read_bytes()


@pytest.mark.long
def test_units_have_the_dimensions_that_pint_finds():
    import pint

    registry = pint.UnitRegistry()
    names = {"[length]": "m", "[mass]": "kg", "[time]": "s", "[current]": "A", "[temperature]": "K"}
    seen = set()
    for name in cranes():
        crane = stillhook.load_crane(name)
        case = stillhook.Scenario(load="5 t", s_w="50 m", tip="still", mode=crane.plant.type.default_mode)
        seen |= {p.unit for p in export(crane, case, "plant").ports if p.unit}
    assert len(seen) > 12
    for unit in seen:
        text = " ".join(unit.replace("/", " / ").split())
        quantity = registry.Quantity(1.0, text.replace(" m", " * m") if text.startswith("N m") else text)
        expected = {names[d]: round(p) for d, p in quantity.dimensionality.items()}
        found = {base: power for base, power in exponents(unit).items() if base != "rad"}
        assert found == expected, unit


def test_a_reference_is_the_run_in_the_style_of_the_cross_check(made: Export, run, tip: np.ndarray, tmp_path: Path):
    inputs, results, options = write_reference(made, tmp_path)
    assert inputs.read_text().splitlines()[0].replace('"', "").split(",") == ["time", *TIP]
    assert np.array_equal(np.loadtxt(inputs, delimiter=",", skiprows=1)[:, 1:], tip)
    head = results.read_text().splitlines()[0].replace('"', "").split(",")
    table = np.loadtxt(results, delimiter=",", skiprows=1)
    assert np.array_equal(table[:, head.index("e_c")], run["e_c"].values)
    assert "StopTime, 20.0" in options.read_text()


@pytest.fixture(scope="module")
def system(nov: stillhook.Crane, case: stillhook.Scenario, quick_fmus, tmp_path_factory) -> Path:
    """Folder of a system of winch and PLC, and of the FMUs in it."""
    folder = tmp_path_factory.mktemp("system")
    pair = export(nov, case, "plant"), export(nov, case, "controller")
    with zipfile.ZipFile(write_ssp(*pair, folder / "s.ssp", platforms=[str(OWN)])) as archive:
        for part in ("plant", "controller"):
            (folder / f"{part}.fmu").write_bytes(archive.read(f"resources/{part}.fmu"))
    return folder


@pytest.mark.long
def test_a_system_of_winch_and_plc_is_a_valid_ssp(nov: stillhook.Crane, case: stillhook.Scenario, system: Path):
    described = read_ssd(str(system / "s.ssp"), validate=True)
    names = {p.name for p in export(nov, case, "controller").ports if p.name.startswith("sensed_")}
    wires = [(c.startElement, c.startConnector, c.endElement, c.endConnector) for c in described.system.connections]
    assert {n for a, n, b, m in wires if (a, b) == ("plant", "controller") and n == m} == names
    assert {n for a, n, b, _ in wires if (a, b) == ("controller", "plant")} == {"u_p", "u_m", "brake"}
    assert [validate_fmu(str(system / f"{part}.fmu")) for part in ("plant", "controller")] == [[], []]


def test_two_fmus_in_the_systems_order_are_the_winch_with_its_plc(system: Path, tip: np.ndarray, run, tmp_path: Path):
    plant, plc = (Slave(system / f"{part}.fmu", tmp_path / part) for part in ("plant", "controller"))
    sensed = [n for n in plc.numbers if n.startswith("sensed_") and n != "sensed_mode"]

    def connect() -> None:
        plc.set(**dict(zip(sensed, plant.get(*sensed), strict=True)))
        plant.set(**dict(zip(("u_p", "u_m", "brake"), plc.get("u_p", "u_m", "brake"), strict=True)))

    plant.begin(given(tip[0]), {"input_time": 0})
    plc.begin(dict(zip(sensed, plant.get(*sensed), strict=True)), {})
    connect()
    e_c = [plant.get("e_c")[0]]
    for k, row in enumerate(tip[1:]):
        plant.set(**given(row))
        plc.step(k * 0.01, 0.01)
        plant.step(k * 0.01, 0.01)
        connect()
        e_c.append(plant.get("e_c")[0])
    assert np.abs(np.array(e_c) - run["e_c"].values).max() <= CLOSE


def test_terminals_of_winch_and_plc_match(nov: stillhook.Crane, case: stillhook.Scenario, tmp_path: Path):
    members = []
    for contents in ("plant", "controller"):
        fmu, _ = write_fmu(export(nov, case, contents), tmp_path / "t.fmu", fmi="3")
        with zipfile.ZipFile(fmu) as archive:
            root = ElementTree.fromstring(archive.read("terminalsAndIcons/terminalsAndIcons.xml"))
        members.append({t.get("name"): [m.get("memberName") for m in t] for t in root.iter("Terminal")})
    for name in ("sensed", "commands"):
        assert members[0][name] == members[1][name]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--coupling", "rope"], "coupling"),
        (["--contents", "motor"], "contents"),
        (["--fmi", "1"], "choose 2 or 3"),
        (["--platforms", "amiga"], "amiga"),
        (["--platforms", ","], "--platforms"),
        (["--out", "x.zip"], "ends in .fmu"),
        (["--contents", "controller", "--coupling", "wire"], "no wire"),
        (["--contents", "ssp", "--reference", "x"], "--reference"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(options, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert command(["fmu", "nov-250t", *options]) == 2
    error = capsys.readouterr().err.strip()
    assert words in error
    assert "\n" not in error
    assert list(tmp_path.iterdir()) == []


def test_a_platform_without_a_compiler_is_refused(made: Export, tmp_path: Path, monkeypatch):
    from stillhook.export.twin import compile as compiling

    monkeypatch.setattr(compiling.importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(compiling.shutil, "which", lambda name: None)
    with pytest.raises(ExportError, match="no compiler"):
        write_fmu(made, tmp_path / "x.fmu", platforms=["win64"])
    assert list(tmp_path.iterdir()) == []
    write_fmu(made, tmp_path / "x.fmu", platforms=["source"])


def test_the_command_says_what_it_wrote(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert command(["fmu", "nov-250t", "--platforms", "source", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["t_cycle"] == 0.01
    assert said["files"] == ["nov-250t.fmu", "nov-250t_OspModelDescription.xml"]
    assert {"load", "s_w_start", "e_c"} <= {v["name"] for v in said["variables"]}


def test_inputs_that_contradict_each_other_are_told_once(slave: Slave, capfd: pytest.CaptureFixture[str]):
    """A host that gives the position alone: the winch would follow a tip that stands."""
    slave.begin({"s_tip": 0.0, "v_tip": 0.0, "a_tip": 0.0}, {"input_time": 0})
    for k in range(250):
        slave.set(s_tip=float(np.sin(2.0 * np.pi * 0.1 * (k + 1) / 8.0)))
        slave.step(0.1 * k, 0.1)
    (told,) = [line for line in "".join(capfd.readouterr()).splitlines() if "are not one motion" in line]
    assert "position and speed of the tip" in told
    assert "Give s_tip, v_tip and a_tip of one motion" in told
    assert slave.text("contradiction") == "position and speed of the tip are not one motion"
