"""Compiles the kernels that many tests run, one process to a winch type, side by side: left to themselves the workers
would each compile them all. A process compiles the equations that its kernels share once.

python -m tests.kernels pure-active
"""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from stillhook import Scenario, load_crane, simulate
from stillhook.kernels.build import is_compiled
from stillhook.kernels.lanes import VL

ROOT = Path(__file__).resolve().parents[1]
CRANES = {"active-passive": "nov-250t", "pure-active": "nov-100t-pure-active"}
KERNELS = [(kind, lanes) for lanes in (VL, 1) for kind in ("driver", "lift_driver")]


def compile_all() -> None:
    """Compile what is not in the cache. A kernel that does not compile says so in the tests that need it."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(_in_a_process, CRANES))


def _in_a_process(plant: str) -> None:
    if not all(is_compiled(plant, lanes, kind) for kind, lanes in KERNELS):
        subprocess.run([sys.executable, "-m", "tests.kernels", plant], cwd=ROOT, capture_output=True, check=False)


def compile_one(kind: str, plant: str, lanes: int) -> None:
    """By the shortest of runs, a batch for kernels of several lanes."""
    from tests.engine.test_lowering import whole_lift

    crane, several = load_crane(CRANES[plant]), lanes > 1
    if kind == "driver":
        run = Scenario(load="10 t", s_w="50 m", duration="1 s", warm_up="0 s")
        simulate(crane, [run, run] if several else run)
    else:
        lift = whole_lift(duration="1 s")
        simulate(crane, [lift, lift] if several else lift, on_failure="mark")


if __name__ == "__main__":
    for kind, lanes in KERNELS:
        compile_one(kind, sys.argv[1], lanes)
