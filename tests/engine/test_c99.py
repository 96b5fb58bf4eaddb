"""The kernels as C: translated, never copied; the same numbers; and what is not understood is refused by file and line."""

import ctypes
import math
import re
import shutil
import subprocess
import textwrap
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from numpy.ctypeslib import ndpointer

from stillhook import Scenario, load_crane
from stillhook.engine.scenario.run import Ready, ScenarioBlock
from stillhook.kernels.build import c_source, driver
from stillhook.kernels.c99.source import SubsetError, Translator
from stillhook.kernels.lanes import VL, Array, flatten
from stillhook.physics.records import define
from stillhook.physics.scalar import scalar, sqrt

SAME = 1.0e-9
"""Relative: the compilers fuse different operations; a minute of feedback keeps the difference near 1e-11."""

CRANES = {"active-passive": "nov-250t", "pure-active": "nov-100t-pure-active"}
FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-shared", "-fPIC", "-Wall", "-Wextra", "-Werror")
QUIET = ("-Wno-unknown-pragmas", "-Wno-unused", "-Wno-unused-parameter")
plants = pytest.mark.parametrize("plant", sorted(CRANES))


def compile_c(source: str, folder: Path) -> ctypes.CDLL:
    gcc = shutil.which("gcc")
    if gcc is None:
        pytest.skip("gcc is not installed: the C source is not compiled")
    file, library = folder / "kernel.c", folder / "kernel.so"
    file.write_text(source)
    subprocess.run([gcc, *FLAGS, *QUIET, str(file), "-o", str(library), "-lm"], check=True)
    return ctypes.CDLL(str(library))


@pytest.fixture(scope="module", params=sorted(CRANES))
def translated(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> SimpleNamespace:
    library = compile_c(c_source(request.param), tmp_path_factory.mktemp(request.param))
    return SimpleNamespace(plant=request.param, library=library)


def blocks(translated: SimpleNamespace, lanes: int) -> tuple[ScenarioBlock, ScenarioBlock]:
    """The same cases through our kernel and through C's, a series row every cycle."""
    crane = load_crane(CRANES[translated.plant])
    cases = [
        Scenario(
            load=f"{5 + 2 * i} t",
            s_w=f"{50 + 30 * i} m",
            tip=f"sine {0.5 + 0.05 * i:.2f} m {8 + i % 5} s",
            mode=("ssc", "hs", "ns", "ssc-cubic")[i % 4],
            friction="regularised" if i == 3 else "lugre",
            duration="60 s",
            warm_up="20 s",
        )
        for i in range(lanes)
    ]
    out = []
    for c in (False, True):
        block = ScenarioBlock([Ready.of(crane, s) for s in cases], lanes=lanes, n_sub=2, every=1)
        if c:
            array, n = ndpointer(np.float64, flags="C_CONTIGUOUS"), ctypes.c_int64
            run = getattr(translated.library, f"run_{lanes}")
            run.argtypes, run.restype = [array, array, n, array, array, array, *[n] * 7, ctypes.c_double], None
            d = driver(translated.plant, lanes)
            block.d = replace(d, run=run)
        for _ in block.steps():
            pass
        out.append(block)
    return out[0], out[1]


@pytest.mark.thorough
@pytest.mark.parametrize("lanes", [1, VL])
def test_c_runs_the_same_physics(translated, lanes):
    ours, theirs = blocks(translated, lanes)
    scale = np.maximum(np.max(np.abs(ours.out), axis=0), 1e-9)
    assert np.max(np.abs(theirs.out - ours.out) / scale) < SAME
    for a, b in zip(ours.results(), theirs.results(), strict=True):
        np.testing.assert_allclose(flatten(b.stats), flatten(a.stats), rtol=SAME, atol=SAME)
        np.testing.assert_allclose(b.span, a.span, rtol=SAME)


@pytest.mark.thorough
def test_c_lays_a_load_to_rest_alike(translated):
    block, _ = blocks(translated, 1)
    d = driver(translated.plant, 1)
    ours, theirs = block.A.reshape(-1).copy(), block.A.reshape(-1).copy()
    d.at_rest(ours)
    translated.library.at_rest_1(theirs.ctypes.data_as(ctypes.POINTER(ctypes.c_double)))
    np.testing.assert_allclose(theirs, ours, rtol=SAME, atol=SAME)


@pytest.mark.slow
@plants
def test_c_holds_every_function_of_the_circuit_and_no_library_exponential(plant):
    source = c_source(plant)
    for name in ("circuit", "rates", "sense", "actuate", "signals", "powers", "stored_energy", "limits"):
        assert f"{plant.replace('-', '_')}_{name}(" in source
    assert {*re.findall(r"\brun_(\d+)\(", source)} == {"1", "16"}  # one trajectory, and a block of lanes
    assert "scalar_exp(double x)" in source
    assert not re.search(r"(?<![\w])(exp|log|pow|tanh)\(", source)


@pytest.mark.slow
@plants
def test_the_same_source_gives_the_same_c(plant):
    assert c_source(plant) == c_source(plant)


# The subset


class Pair(NamedTuple):
    a: float
    b: float


def translate(text: str, *types: object, **names: object) -> str:
    """C of the function `f` in this source."""
    space: dict = {"scalar": scalar, "sqrt": sqrt, "Pair": Pair, "math": math, **names}
    text = textwrap.dedent(text).lstrip()
    define(text, space, f"<{hash((text, types))}>")
    t = Translator()
    t.function(space["f"], types, export="f")
    return t.source()


def value(text: str, folder: Path, *arguments: float) -> float:
    """Result of `f` in C."""
    f = compile_c(translate(text, *map(type, arguments)), folder).f
    f.restype = ctypes.c_double
    f.argtypes = [ctypes.c_double if isinstance(a, float) else ctypes.c_int64 for a in arguments]
    return float(f(*arguments))


def python(text: str, *arguments: float) -> float:
    space: dict = {"sqrt": math.sqrt, "Pair": Pair, "math": math, "scalar": lambda f: f}
    exec(textwrap.dedent(text), space)
    return float(space["f"](*arguments))


ACCEPTED = [
    ("def f(x, y):\n    x, y = y, x\n    return x - 2.0 * y", (3.0, 5.0)),
    ("def f(x, y):\n    return 1.0 if x < y < 9.0 and not x == y else -1.0", (3.0, 5.0)),
    ("def f(n, m):\n    return n // m + 0.001 * (n % m)", (-7, 3)),
    ("def f(n, m):\n    return n / m", (7, 2)),
    (
        "def f(x, y):\n    if x > y:\n        return x\n    elif x == y:\n        return 0.0\n    else:\n        return x**y",
        (3.0, 5.0),
    ),
    (
        "def f(n, m):\n    s = 0.0\n    for i in range(n, m, -2):\n        if i == 3:\n            break\n        s = s + i\n    return s",
        (9, 0),
    ),
    (
        "def f(x, y):\n    p = Pair(b=x, a=y)\n    q = Pair(p.b, p.a)\n    return q.a - 10.0 * q.b + sqrt(p.a) + abs(-x)",
        (3.0, 5.0),
    ),
    (
        "@scalar\ndef g(a, b):\n    return a - b, a * b\n\n\ndef f(x, y):\n    u, v = g(y, x)\n    return u / v",
        (3.0, 5.0),
    ),
    ("def f(x, int):\n    return x - int * math.pi + math.copysign(x, -int) + math.ceil(0.1 * x)", (3.0, 5.0)),
    ("def f(n, m):\n    return 1.0 * (n << m)", (3, 5)),
    ("def f(x, y):\n    while x < y:\n        x += 1.5\n    return x", (3.0, 5.0)),
    ("def f(x, y):\n    return max(x, y) - 3.0 * min(x, 9.0) + min(int(y), 4) + math.floor(-0.5 * x)", (3.0, 5.5)),
    (
        "def f(n, m):\n    s = 0.0\n    for i in range(n):\n        if i % m == 1:\n            continue\n        s += i\n    return s",
        (9, 3),
    ),
    ("def f(x, y):\n    ok = True\n    if x > y:\n        ok = False\n    return 1.0 if ok else 0.0", (3.0, 5.0)),
]


@pytest.mark.slow
@pytest.mark.parametrize(("text", "arguments"), ACCEPTED)
def test_c_means_what_python_means(tmp_path, text, arguments):
    assert value(text, tmp_path, *arguments) == pytest.approx(python(text, *arguments), rel=1e-15)


REFUSED = [
    ("def f(x):\n    y = 1\n    y = x\n    return y", "y, which changes its type,", 3),
    ("def f(x):\n    return max(x, 1)", "the call of max", 2),
    ("def f(x):\n    return math.exp(x)", "the call of math.exp", 2),
    ("def f(x):\n    return [x][0]", "the expression List", 2),
    ("def f(x):\n    return 1.0 if x else 0.0", "a condition that is a number", 2),
    ("def f(x):\n    return Pair(x)", "Pair without all of its fields", 2),
    ("def f(x):\n    return unknown * x", "the name unknown", 2),
    ("def f(x):\n    for i in (1, 2):\n        x = x + i\n    return x", "a loop over anything but range", 2),
    ("def f(x):\n    if x > 0.0:\n        return x", "an end without a result", 1),
    ("def f(x):\n    if x > 0.0:\n        return x\n    return x, x", "a second type of result", 4),
    ("def f(x, y=1.0):\n    return x", "parameters other than plain positional ones", 1),
    ("def f(x):\n    return x % 2.0", "the operator Mod on these numbers", 2),
    ("def f(x):\n    del x\n    return 1.0", "the statement Delete", 2),
    ("def f(x):\n    a, b = x\n    return a", "unpacking of anything but a tuple", 2),
    ("def f(x):\n    return x.real", "the attribute real", 2),
]


@pytest.mark.parametrize(("text", "what", "line"), REFUSED, ids=[r[1] for r in REFUSED])
def test_what_lies_outside_the_subset_is_refused_by_line(text, what, line):
    with pytest.raises(SubsetError) as caught:
        translate(text, float)
    message = str(caught.value)
    assert f">:{line}: {what}" in message
    assert "\n" not in message
    assert "stillhook.kernels.c99.source" in message


def test_a_refusal_names_the_file():
    def f(x):
        raise ValueError(x)

    with pytest.raises(SubsetError, match=r"test_c99\.py:\d+: the statement Raise in f cannot be translated"):
        Translator().function(f, (float,))


def test_a_loop_over_lanes_is_marked_for_vectors():
    text = (
        "def f(A):\n    for l in range(LANES):\n        A[l] = 2.0 * A[l]\n    for l in range(3):\n        A[l] = 0.0"
    )
    source = translate(text, Array, LANES=16)
    assert source.count("#pragma omp simd\n    for (int64_t l = 0; l < 16; l += 1)") == 1
    assert source.count("#pragma") == 1
