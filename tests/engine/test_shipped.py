"""Kernels that a wheel holds compiled: taken where they are of the installed sources, and no compiler is needed then."""

import ctypes
import os
import struct
import subprocess
import sys
import zipfile
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from tests.scripts import script

from stillhook import Scenario, load_crane, simulate
from stillhook.base.kept import checked
from stillhook.control.registry import CONTROLLERS
from stillhook.engine.scenario.run import ScenarioType
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.errors import SimulationError
from stillhook.kernels import build
from stillhook.kernels.c99 import library as native
from stillhook.kernels.c99.library import INDEX, SYSTEMS, Entry, Index, Library, code_hash, level, shipped_library
from stillhook.kernels.lanes import VL, Array
from stillhook.library import cranes
from stillhook.report.terminal import say_if_compiling

ROOT = Path(__file__).resolve().parents[2]
needs_zig = pytest.mark.skipif(native.compiler() is None, reason="Zig is not installed (extra native), or left out")
PLATFORM = f"{SYSTEMS.get(sys.platform)}-{level()}"
LEVELS_AGREE = 1e-10
"""Of the largest value of a signal: the exponential fuses multiplications and additions where the processor can, and
minutes of feedback carry that on; 1.2e-11 was found."""
EVERYWHERE = {name for name, law in CONTROLLERS.items() if law.in_every_kernel}
CODE = "void twice(double *A) {}"


def twice(A: Array, n: int, x: float):
    for i in range(n):
        A[i] = x * A[i]


def recipe() -> ModuleType:
    """hatch_build.py as a module."""
    pytest.importorskip("hatchling", reason="hatchling is not installed: nothing builds a wheel")
    return script(ROOT / "hatch_build.py")


def folder_with(folder: Path, platform: str = PLATFORM) -> Path:
    """A folder as a wheel has one, with one kernel."""
    index = Index("sources of today", {"twice": code_hash(CODE)}, {platform: "library"})
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "library").write_bytes(b"code")
    index.write(folder)
    return folder


def test_a_library_of_other_sources_is_refused(tmp_path):
    folder = folder_with(tmp_path)
    assert shipped_library(["twice"], sources="sources of today", folder=folder) == folder / "library"
    assert shipped_library(["twice"], sources="sources of tomorrow", folder=folder) is None
    assert shipped_library(["twice", "thrice"], sources="sources of today", folder=folder) is None


def test_a_kernel_that_an_edit_leaves_as_it_was_is_still_taken(tmp_path):
    folder = folder_with(tmp_path)
    edited = {"sources": "sources of tomorrow", "folder": folder}
    assert shipped_library(["twice"], code=code_hash(CODE), **edited) == folder / "library"
    assert shipped_library(["twice"], code=code_hash(CODE + "\n"), **edited) is None


def test_a_library_of_another_platform_or_a_damaged_index_is_none(tmp_path, caplog):
    checked._NOTED.discard(checked.Kept.WHEEL)
    assert shipped_library(["twice"], sources="sources of today", folder=folder_with(tmp_path / "a", "vms-vax")) is None
    assert shipped_library(["twice"], sources="sources of today", folder=tmp_path / "none") is None
    assert caplog.records == []
    index = folder_with(tmp_path / "b") / INDEX
    index.write_bytes(index.read_bytes().replace(b"today", b"times"))
    assert shipped_library(["twice"], sources="sources of times", folder=tmp_path / "b") is None
    (note,) = caplog.records
    assert note.getMessage() == (
        f"{index}: damaged (its checksum does not fit)."
        " The compiled kernels of this installation are not used: install Stillhook again."
    )


@pytest.mark.parametrize(("features", "expected"), [((True, True), "x86_64_v3"), ((True, False), "x86_64_v2")])
def test_the_best_level_that_the_processor_has_is_chosen(monkeypatch, features, expected):
    core = sys.modules["numpy._core._multiarray_umath" if hasattr(np, "_core") else "numpy.core._multiarray_umath"]
    monkeypatch.setattr(native.platform, "machine", lambda: "AMD64")
    monkeypatch.setattr(core, "__cpu_features__", dict(zip(("AVX2", "FMA3"), features, strict=True)))
    assert level.__wrapped__() == expected


def test_arm_is_called_the_same_on_every_system(monkeypatch):
    for machine in ("arm64", "aarch64"):
        monkeypatch.setattr(native.platform, "machine", lambda name=machine: name)
        assert level.__wrapped__() == "aarch64"


def test_a_checkout_holds_no_compiled_kernels():
    assert not native.SHIPPED.exists()


@pytest.mark.long
@pytest.mark.parametrize("name", cranes())
@pytest.mark.parametrize("lanes", [1, VL])
def test_a_wheel_holds_the_kernels_of_every_winch_under_every_mode_of_its_type(name, lanes):
    """Without settings or memory of a controller's own: such a one, and sensors, are compiled where a case has them."""
    crane = load_crane(name)
    shipped = {symbol for each in recipe().libraries() for symbol in each.entries}
    for mode in crane.plant.type.modes:
        if mode not in {crane.plant.type.default_mode, *EVERYWHERE}:
            continue
        case = Scenario(load="10 t", s_w="80 m", mode=mode, tip="sine 1 m 9 s")
        setup, extra = ScenarioType().kernel(crane, case)
        assert build.driver(crane.plant.value, lanes, setup, extra).run.name in shipped, mode


@pytest.mark.parametrize("name", ["nov-250t", "nov-100t-electric"])
def test_no_compilation_is_announced_where_a_run_needs_none(name, capsys):
    crane = load_crane(name)
    simulate(crane, Scenario(load="10 t", s_w="80 m", duration="2 s", warm_up="0 s"), series=True)
    say_if_compiling(crane, series=True)
    assert capsys.readouterr().err == ""


def test_without_a_compiler_one_line_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "numba", None)
    monkeypatch.setattr(native, "compiler", lambda: None)
    library = Library({"twice": twice}, tmp_path / "state", tmp_path / "native")
    with pytest.raises(SimulationError, match=r'pip install "stillhook\[compiler\]"\.$') as caught:
        Entry(library, "twice", lambda: build._by_numba(twice, tmp_path))(np.ones(2), 2, 2.0)
    assert "\n" not in str(caught.value)


def test_controllers_of_a_user_that_move_codes_make_other_kernels(monkeypatch):
    codes = dict(build.CONTROLLERS)
    before = build.kernel_hash.__wrapped__()
    ssc = codes["ssc"]
    codes["ssc"] = type(ssc)(**{**vars(ssc), "code": ssc.code + 1.0})
    monkeypatch.setattr(build, "CONTROLLERS", codes)
    assert build.kernel_hash.__wrapped__() != before


# What the recipe makes


@needs_zig
@pytest.mark.thorough
def test_every_kernel_is_in_the_index(tmp_path):
    made = recipe()
    made.compile_all(tmp_path, {PLATFORM: made.TARGETS[PLATFORM]})
    index = native.index(tmp_path)
    assert index is not None
    assert set(index.kernels) == {symbol for each in made.libraries() for symbol in each.entries}
    library = ctypes.CDLL(str(tmp_path / index.libraries[PLATFORM]))
    assert all(hasattr(library, symbol) for symbol in index.kernels)


@needs_zig
@pytest.mark.thorough
@pytest.mark.skipif(level() != "x86_64_v3", reason="this processor runs no two of the levels")
@pytest.mark.parametrize("crane", ["nov-250t", "nov-100t-pure-active"])
def test_levels_of_a_processor_agree(crane, tmp_path, monkeypatch):
    made, platforms = recipe(), (PLATFORM, PLATFORM.replace("v3", "v2"))
    made.compile_all(tmp_path, {name: made.TARGETS[name] for name in platforms})
    index, winch = native.index(tmp_path), load_crane(crane)
    assert index is not None
    cases = [Scenario(load=f"{10 + 3 * i} t", s_w="80 m", tip="sine 2 m 9 s", mode="hs") for i in range(VL)]
    d = build.driver(winch.plant.value, VL)
    series = []
    for platform in platforms:
        library = Library(d.run.library.entries, tmp_path, tmp_path)
        library.loaded = ctypes.CDLL(str(tmp_path / index.libraries[platform]))
        with monkeypatch.context() as here:
            for name in ("run", "at_rest"):
                here.setattr(d, name, Entry(library, getattr(d, name).name, dict))
            runs = run_cases([winch] * VL, cases, step=2, lanes=VL, every=10, threads=1, keep=unchanged)
        series.append(np.array([run.series for run in runs]))
    largest = np.maximum(np.abs(series[0]).max(axis=(0, 1)), 1e-9)
    assert np.max(np.abs(series[1] - series[0]) / largest) < LEVELS_AGREE


@needs_zig
@pytest.mark.thorough
def test_a_library_for_windows_exports_its_kernels_and_needs_no_other(tmp_path):
    made = recipe()
    name = "windows-x86_64_v3"
    made.compile_all(tmp_path, {name: made.TARGETS[name]})
    index = native.index(tmp_path)
    assert index is not None
    exported, imported = tables_of((tmp_path / index.libraries[name]).read_bytes())
    assert exported == set(index.kernels)
    assert imported == set()


def tables_of(data: bytes) -> tuple[set[str], set[str]]:
    """Names that a PE32+ library exports, and the libraries that it imports from."""
    (pe,) = struct.unpack_from("<I", data, 0x3C)
    assert data[pe : pe + 4] == b"PE\0\0"
    sections, optional = struct.unpack_from("<H", data, pe + 6)[0], pe + 24
    assert struct.unpack_from("<H", data, optional) == (0x20B,)
    table = optional + struct.unpack_from("<H", data, pe + 20)[0]
    places = [struct.unpack_from("<IIII", data, table + 40 * i + 8) for i in range(sections)]

    def at(address: int) -> int:
        return next(address - start + raw for size, start, _, raw in places if start <= address < start + size)

    def text(address: int) -> str:
        return data[at(address) : data.index(b"\0", at(address))].decode()

    (exports, _), (imports, size) = (struct.unpack_from("<II", data, optional + 112 + 8 * i) for i in (0, 1))
    count, _, names = struct.unpack_from("<III", data, at(exports) + 24)
    exported = {text(struct.unpack_from("<I", data, at(names) + 4 * i)[0]) for i in range(count)}
    imported = set()
    for i in range(size // 20):
        (name,) = struct.unpack_from("<I", data, at(imports) + 20 * i + 12)
        imported |= {text(name)} if name else set()
    return exported, imported


RUNS = """
import sys
if sys.argv[2] == "no compiler":
    sys.modules.update(dict.fromkeys(("numba", "llvmlite", "ziglang", "filelock")))
import numpy as np
import stillhook
from pathlib import Path
series = []
for name, modes in (("nov-250t", ("ns", "hs", "ssc")), ("nov-100t-pure-active", ("ns", "hs"))):
    crane = stillhook.load_crane(name)
    cases = [stillhook.Scenario(load="40 t", s_w="100 m", tip="sine 2 m 9 s", mode=m, duration="60 s") for m in modes]
    series += [stillhook.simulate(crane, cases[0]), stillhook.simulate(crane, cases)]
file = stillhook.load_lift("template-through-the-surface", duration="60 s")
series += [stillhook.simulate(file.crane, file.lift), stillhook.simulate(file.crane, [file.lift] * 2)]
np.savez(sys.argv[1], *[v.values for run in series for v in run.data_vars.values() if v.dtype == float])
print(Path(stillhook.__file__).parent)
"""


def python(site: Path, cache: Path, *arguments: str) -> str:
    environment = {name: value for name, value in os.environ.items() if not name.startswith("STILLHOOK_")}
    environment |= {"PYTHONPATH": str(site), "STILLHOOK_CACHE": str(cache)}
    run = subprocess.run([sys.executable, *arguments], env=environment, cwd=cache, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return run.stdout


QUICK_PLAN = """
import sys
sys.modules.update(dict.fromkeys(("numba", "llvmlite", "ziglang", "filelock")))
from stillhook.plan.planning import plan
plan("template-to-1500m", tier="frequency")
"""


@needs_zig
@pytest.mark.thorough
def test_a_wheel_runs_without_a_compiler_and_gives_the_bits_of_the_checkout(tmp_path):
    recipe()
    site, cache, own = (tmp_path / name for name in ("site", "cache", "own"))
    for folder in (cache, own):
        folder.mkdir(mode=0o700)
    command = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(tmp_path)]
    subprocess.run(command, cwd=ROOT, env=os.environ | {"STILLHOOK_WHEEL": PLATFORM}, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    zipfile.ZipFile(wheel).extractall(site)

    assert python(site, cache, "-c", RUNS, str(tmp_path / "a.npz"), "no compiler").split() == [str(site / "stillhook")]
    python(ROOT / "src", own, "-c", RUNS, str(tmp_path / "b.npz"), "any")
    with np.load(tmp_path / "a.npz") as a, np.load(tmp_path / "b.npz") as b:
        assert len(a) == len(b) > 0
        for name in a:
            np.testing.assert_array_equal(a[name], b[name])
    python(site, cache, "-c", QUICK_PLAN)
    assert list(cache.iterdir()) == []  # nothing was compiled, and no winch identified

    for file in (site / "stillhook" / "shipped").rglob("*"):
        if file.is_file():
            data = bytearray(file.read_bytes())
            data[len(data) // 2] ^= 1
            file.write_bytes(bytes(data))
    python(site, cache, "-c", RUNS, str(tmp_path / "c.npz"), "any")
    with np.load(tmp_path / "b.npz") as b, np.load(tmp_path / "c.npz") as c:
        for name in b:
            np.testing.assert_array_equal(b[name], c[name])
