"""Compiles the kernels that the tests run, different ones side by side: without it every worker compiles all of them, at the same time.

    python tests/warm.py PART PARTS
"""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from stillhook import Scenario, load_crane, load_lift, lower, read_payload, simulate
from stillhook.engine.build import is_compiled

CASE = Scenario(load="20 t", s_w="50 m", duration="1 s", warm_up="0 s")
CRANES = {"active-passive": "deep-250t", "pure-active": "nov-100t-pure-active"}


def _winch(plant: str, lanes: int) -> None:
    simulate(load_crane(CRANES[plant]), CASE if lanes == 1 else [CASE])


def _lift(plant: str, lanes: int) -> None:
    lift = load_lift("template-through-the-surface", duration="60 s").lift
    light = lift.model_copy(update={"payload": read_payload("mud-mat-25t")})
    lower(load_crane(CRANES[plant]), light if lanes == 1 else [light])


JOBS: tuple[tuple[str, int, Callable[[str, int], None]], ...] = tuple(
    (plant, lanes, job) for job in (_lift, _winch) for plant in CRANES for lanes in (16, 1)
)
"""Longest first, so that every second one makes even parts."""


def cold() -> bool:
    """Whether any of these kernels is missing on disk."""
    return not all(is_compiled(plant, lanes, "driver" if job is _winch else "lift_driver") for plant, lanes, job in JOBS)


def warm(parts: int) -> None:
    """Compile in so many processes; what fails here fails again in a test, which says why."""
    file = str(Path(__file__).resolve())
    running = [subprocess.Popen([sys.executable, file, str(i), str(parts)], stderr=subprocess.DEVNULL) for i in range(parts)]
    for process in running:
        process.wait()


if __name__ == "__main__":
    for plant, lanes, job in JOBS[int(sys.argv[1]) :: int(sys.argv[2])]:
        job(plant, lanes)
