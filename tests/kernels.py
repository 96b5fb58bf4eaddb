"""Compiles the kernels that many tests run, one to a process, side by side: left to themselves the workers would each compile them all.

python -m tests.kernels lift_driver pure-active 16
"""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from stillhook import Scenario, load_crane, simulate
from stillhook.kernels.build import is_compiled

ROOT = Path(__file__).resolve().parents[1]
CRANES = {"active-passive": "nov-250t", "pure-active": "nov-100t-pure-active"}
KERNELS = [(kind, plant, lanes) for kind in ("lift_driver", "driver") for lanes in (16, 1) for plant in CRANES]
"""Those that take longest first."""


def compile_all() -> None:
    """Compile what is not in the cache. A kernel that does not compile says so in the tests that need it."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(_in_a_process, KERNELS))


def _in_a_process(kernel: tuple[str, str, int]) -> None:
    kind, plant, lanes = kernel
    if not is_compiled(plant, lanes, kind):  # a lowering compiles the driver that it stands on as well
        subprocess.run(
            [sys.executable, "-m", "tests.kernels", kind, plant, str(lanes)], cwd=ROOT, capture_output=True, check=False
        )


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
    compile_one(sys.argv[1], sys.argv[2], int(sys.argv[3]))
