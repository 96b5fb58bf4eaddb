"""Compiles the kernels that many tests run, and the test modules with pytest's assertions, in two processes that take
about as long: left to themselves the workers would each compile them all. A process compiles the equations that its
kernels share once.

The second process begins with test modules: two that start with kernels in a new cache would both build Zig's runtime.

python -m tests.kernels 0
"""

import gc
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import pytest
from trials.reference_plant.pack import simulate_reference
from trials.reference_plant.parameters import ReferenceCrane

from stillhook import Scenario, load_crane, simulate
from stillhook.kernels.build import LOAD_ON_WIRE, Setup, is_compiled
from stillhook.kernels.lanes import VL

TESTS = Path(__file__).resolve().parent
ROOT = TESTS.parent
CRANES = {
    "active-passive": "nov-250t",
    "cylinder": "nov-100t-cylinder",
    "electric": "nov-100t-electric",
    "open-circuit": "utility-20t-open-circuit",
    "pure-active": "nov-100t-pure-active",
    "secondary": "nov-250t-secondary",
    "reference": "nov-250t",
}


class Kernel(NamedTuple):
    plant: str
    lanes: int
    setup: Setup = LOAD_ON_WIRE


PROCESSES = (
    (
        Kernel("active-passive", VL),
        Kernel("active-passive", VL, Setup(("wire", "slings", "payload"))),
        Kernel("reference", 1),
        Kernel("electric", VL),
        Kernel("electric", 1),
        Kernel("cylinder", VL),
    ),
    (
        Kernel("pure-active", VL),
        Kernel("pure-active", 1),
        Kernel("active-passive", 1),
        Kernel("active-passive", 1, Setup(("wire", "slings", "payload"))),
        Kernel("secondary", VL),
        Kernel("secondary", 1),
        Kernel("open-circuit", VL),
        Kernel("open-circuit", 1),
        Kernel("cylinder", 1),
    ),
)


def compile_all() -> None:
    """Compile what is not in the cache. A kernel that does not compile says so in the tests that need it."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(_in_a_process, range(len(PROCESSES))))


def _in_a_process(number: int) -> None:
    if not (all(is_compiled(*kernel) for kernel in PROCESSES[number]) and has_bytecode(folders(number))):
        subprocess.run([sys.executable, "-m", "tests.kernels", str(number)], cwd=ROOT, capture_output=True, check=False)


def folders(number: int) -> list[Path]:
    """Those of the tests whose modules a process compiles."""
    every = sorted(path for path in TESTS.iterdir() if path.is_dir() and path.name != "__pycache__")
    return every[number :: len(PROCESSES)]


def has_bytecode(of: list[Path]) -> bool:
    """Whether every module of tests was compiled once, where Python keeps what it compiles, beside the module."""
    if sys.dont_write_bytecode or sys.pycache_prefix:
        return True
    modules = (path for folder in of for path in folder.rglob("test_*.py"))
    return all(any(path.parent.glob(f"__pycache__/{path.stem}.*-pytest-*.pyc")) for path in modules)


def compile_tests(of: list[Path]) -> None:
    """Pytest rewrites the assertions of what it collects, and keeps the bytecode."""
    if not has_bytecode(of):
        pytest.main(["--collect-only", "-qq", "-p", "no:cacheprovider", *map(str, of)])


def compile_one(kernel: Kernel) -> None:
    """By the shortest of runs, a batch for kernels of several lanes."""
    from tests.engine.test_lowering import whole_lift

    crane, several = load_crane(CRANES[kernel.plant]), kernel.lanes > 1
    run = Scenario(load="10 t", s_w="50 m", duration="1 s", warm_up="0 s")
    if kernel.plant == "reference":
        simulate_reference(crane, run, ReferenceCrane())
    elif kernel.setup == LOAD_ON_WIRE:
        simulate(crane, [run, run] if several else run)
    else:
        lift = whole_lift(duration="1 s")
        simulate(crane, [lift, lift] if several else lift, on_failure="mark")


if __name__ == "__main__":
    gc.set_threshold(100_000, 20, 50)  # a compiler makes millions of small objects
    mine = int(sys.argv[1])
    if mine:
        compile_tests(folders(mine))
    for each in PROCESSES[mine]:
        compile_one(each)
    compile_tests(folders(mine))
