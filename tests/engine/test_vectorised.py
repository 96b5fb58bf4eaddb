"""Sixteen lanes are vector code, and give every case the bits that it has alone; machine code never outlives its source."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from tests.engine.runs import run_one

from stillhook import Scenario, load_crane
from stillhook.base.kept.sources import PACKAGE, Sources
from stillhook.engine.scenario.run import Ready, ScenarioBlock
from stillhook.engine.scenario.summary import ScenarioRun
from stillhook.kernels import build
from stillhook.kernels.build import KERNEL_FOLDERS, driver, kernel_hash
from stillhook.kernels.lanes import VL
from stillhook.physics.scalar import STRICT
from stillhook.spec.crane import Crane

VECTOR_SHARE = 10
"""Vector operations for each scalar one: what is left as scalar is the fallback for arrays that overlap, and it never runs."""
INTERPRETED = 1.0e-9
"""Relative: `exp` of the library against our polynomial, 1e-14 a call, over two seconds with feedback."""

FOLDER = PACKAGE.folder
MODES = ("ns", "hs", "ssc", "ssc-cubic", "manual", "level-1", "level-2")
FAMILIES = {
    "active-passive": ("nov-250t", "nov-150t"),
    "pure-active": ("nov-100t-pure-active",),
}
plants = pytest.mark.parametrize("plant", sorted(FAMILIES))


@pytest.fixture(scope="module", params=sorted(FAMILIES))
def listing(request: pytest.FixtureRequest, numba: ModuleType) -> SimpleNamespace:
    """LLVM and machine code of `run` on sixteen lanes, compiled here: what comes from a cache cannot be looked into."""
    array, whole = numba.float64[::1], numba.int64
    run = numba.njit(nogil=True, **STRICT)(driver(request.param, VL).run.py_func)
    run.compile((array, array, whole, array, array, array, *[whole] * 7, numba.float64))
    return SimpleNamespace(llvm=run.inspect_llvm(run.signatures[0]), asm=run.inspect_asm(run.signatures[0]))


@pytest.mark.thorough
def test_sixteen_lanes_are_vector_code(listing):
    operations = re.findall(r"= f(?:add|sub|mul|div) [^\n]*?(<\d+ x double>|double)", listing.llvm)
    scalars = operations.count("double")
    vectors = len(operations) - scalars
    assert vectors > 500
    assert vectors >= VECTOR_SHARE * scalars


@pytest.mark.thorough
def test_lanes_call_no_mathematics_of_the_library(listing):
    called = set(re.findall(r"call [^\n]*?@([\w.]+)\(", listing.llvm))
    assert {f for f in called if re.search(r"exp|log|pow|tanh|sin|cos", f)} == set()


@pytest.mark.thorough
def test_lanes_are_read_without_gathers_and_kept_on_whole_cache_lines(listing):
    if "zmm" not in listing.asm and "ymm" not in listing.asm:
        pytest.skip("not an x86 processor with wide vectors")
    assert re.findall(r"\bv(?:p?gather|p?scatter)\w*pd", listing.asm) == []
    assert re.search(r"andq\s+\$-64, %rsp", listing.asm)


# The same bits


def bits(result: ScenarioRun) -> tuple:
    return result.stats, result.span, result.state, result.memory


def family(plant: str) -> list[tuple[Crane, Scenario]]:
    """Sixteen cases that share a block and nothing else: cranes with their own friction, loads, modes, motions, friction models."""
    out = []
    for i in range(VL):
        crane = load_crane(FAMILIES[plant][i % len(FAMILIES[plant])])
        case = Scenario(
            load=f"{2 * i} t",
            s_w=f"{30 + 25 * i} m",
            tip=f"sine {0.3 + 0.1 * i:.1f} m {8 + i % 7} s",
            mode=MODES[i % len(MODES)],
            friction="regularised" if i == 5 else "lugre",
            duration="45 s",
            warm_up="10 s",
        )
        out.append((crane, case))
    return out


@pytest.mark.thorough
@plants
@pytest.mark.parametrize("n_sub", [2, 5])
def test_unlike_cranes_and_cases_side_by_side_have_the_bits_that_they_have_alone(plant, n_sub):
    cases = family(plant)
    block = ScenarioBlock([Ready.of(c, s) for c, s in cases], lanes=VL, n_sub=n_sub, every=0)
    for _ in block.steps():
        pass
    together = [bits(r) for r in block.results()]
    alone = [bits(run_one(c, s, n_sub=n_sub, every=0)) for c, s in cases]
    assert together == alone
    assert len(set(together)) == VL


# Machine code and source


@pytest.mark.slow
def test_no_edit_of_a_kernel_is_overlooked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    for folder in KERNEL_FOLDERS:
        shutil.copytree(FOLDER / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__"))

    def hash_now() -> str:
        monkeypatch.setattr(build, "PACKAGE", Sources(tmp_path))
        return kernel_hash.__wrapped__()

    true = kernel_hash.__wrapped__()
    assert hash_now() == true
    for source in sorted(tmp_path.rglob("*.py")):
        text = source.read_bytes()
        source.write_bytes(text + b"\n")
        assert hash_now() != true, f"{source.name} can change without a new compilation"
        source.write_bytes(text)
    assert hash_now() == true


def test_the_engine_holds_no_kernels():
    makes = re.compile(r"^@scalar|\bnjit\(|= access\(|= replace\(|\bkept\(", re.M)
    assert [
        path.name for path in (FOLDER / "engine").rglob("*.py") if makes.search(path.read_text(encoding="utf-8"))
    ] == []


TWO_SECONDS = """
import json, sys
from stillhook import Scenario, load_crane
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.kernels.lanes import flatten
for name in ("nov-250t", "nov-100t-pure-active"):
    case = Scenario(load="30 t", s_w="100 m", tip="sine 1 m 10 s", duration="2 s", ramp="0.5 s", warm_up="0 s")
    r = run_cases(load_crane(name), [case], step=2, lanes=1, every=10, keep=unchanged)[0]
    print(json.dumps([*flatten(r.state), *flatten(r.stats), *r.series.ravel().tolist()]))
"""


@pytest.mark.thorough
def test_without_compiling_the_same_run_gives_the_same_numbers():
    found = {}
    for jit in ("0", "1"):
        env = {**os.environ, "NUMBA_DISABLE_JIT": jit, "PYTHONPATH": str(FOLDER.parent)}
        done = subprocess.run([sys.executable, "-c", TWO_SECONDS], env=env, capture_output=True, text=True, check=True)
        found[jit] = [np.array(json.loads(line)) for line in done.stdout.splitlines()]
    for compiled, interpreted in zip(found["0"], found["1"], strict=True):
        np.testing.assert_allclose(interpreted, compiled, rtol=INTERPRETED, atol=1e-12)
